"""`python -m shoal_validation.coverage.sensors [--seeds N] [--record FILE] [--page FILE]`.

Draws N (200) rigid machines in the plane at random, records each by an IMU of Exudyn's, with noise, and has `identify`
find mass, inertia and friction from 2 s of it, beginning up to 40 % beside them. Counts how often the 95 % intervals of
what is called right contain the truth, and names the machines of which something wrong was called right. --record keeps
every machine in a file, so that the study goes on where it was stopped. The table goes to standard output and into
docs/verdict-charts.md. Takes an hour.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from shoal.errors import ShoalError
from shoal.identification import Measurement, Problem, identify
from shoal.identification.estimate import Estimate
from shoal.identification.uncertainty.intervals import Value

from shoal_validation.coverage.exudyn_imu import imu
from shoal_validation.coverage.sensed_machines import Machine, machine
from shoal_validation.document import publish, table
from shoal_validation.resumed import resumed

NOISE = {"ax": 0.05, "ay": 0.05, "rate": 0.005}
"""Standard deviations [m/s^2], [rad/s], of sensors as they are in telephones."""
TIMES = np.arange(1, 201) / 100
WRONG = 2.0
"""An error beyond so many half intervals is wrong, which chance alone makes one in ten thousand."""


@dataclass(frozen=True)
class Trial:
    """Result for a machine. verdict, message: as reported, or the kind of error and its text.

    errors: of each parameter that is called right, over the side of its interval where the truth is
    """

    seed: int
    machine: str
    verdict: str
    message: str
    errors: dict[str, float]


def problem(drawn: Machine, scene: Path, rng: np.random.Generator, stated: bool) -> Problem:
    """Mass, inertia and friction of a machine by its IMU; scene: its file; stated: whether the noise is."""
    channels = [
        {"marker": "imu", "quantity": quantity, "column": quantity}
        | ({"tilt": drawn.tilt} if quantity != "rate" else {})
        | ({"noise": noise} if stated else {})
        for quantity, noise in NOISE.items()
    ]
    parameters = {
        name: {
            "path": drawn.sought[name],
            "lower": truth / 10,
            "upper": truth * 10,
            "start": truth * float(rng.uniform(0.6, 1.4)),
        }
        for name, truth in drawn.truth.items()
    }
    data = {
        "name": "imu",
        "scene": str(scene),
        "parameters": parameters,
        "channels": channels,
        "source": {"kind": "file"},
    }
    return Problem.parse(data, "imu")


def answer(drawn: Machine, seed: int) -> Estimate:
    """Identify a machine from Exudyn's IMU with the noise of a seed; every second seed states its size."""
    rng = np.random.default_rng((seed, 1))
    shown = imu(drawn.scene, "imu", drawn.tilt, TIMES)
    shown += rng.standard_normal(shown.shape) * np.array([*NOISE.values()])
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "machine.yaml"
        file.write_text(yaml.safe_dump(drawn.scene.model_dump(mode="json", exclude_none=True)), encoding="utf-8")
        sought = problem(drawn, file, rng, stated=seed % 2 == 0)
        data = Measurement.single(TIMES, tuple(sought.channels), shown, "exudyn", drawn.truth)
        if seed % 2 == 0:
            noise = np.array([*NOISE.values()])
            data = Measurement({name: replace(one, noise=noise) for name, one in data.recordings.items()}, data.truth)
        return identify(sought, measurement=data, seed=seed)


def trial(seed: int) -> Trial:
    """Draw, record, identify and compare."""
    drawn = machine(np.random.default_rng(seed))
    try:
        found = answer(drawn, seed)
    except ShoalError as error:
        return Trial(seed, drawn.scene.name, type(error).__name__, str(error), {})
    right = {name: value for name, value in found.parameters.items() if found.verdict.trusted and value.identifiable}
    errors = {name: over_interval(value, drawn.truth[name]) for name, value in right.items()}
    return Trial(seed, drawn.scene.name, str(found.verdict), found.message, errors)


def over_interval(found: Value, truth: float) -> float:
    """Return an error over the side of the interval where the truth is; infinite where that side has no width."""
    side = found.upper - found.value if truth > found.value else found.value - found.lower
    return abs(truth - found.value) / side if side > 0 else np.inf


def main(arguments: list[str]) -> None:
    """Measure and write."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.coverage.sensors", description=__doc__)
    parser.add_argument("--seeds", type=int, default=200)
    parser.add_argument("--record", type=Path, help="file of the machines that are done")
    parser.add_argument("--page", type=Path, default=Path("docs/verdict-charts.md"))
    chosen = parser.parse_args(arguments)
    seeds = [str(seed) for seed in range(chosen.seeds)]
    found = [Trial(**one) for _, one in resumed(seeds, lambda seed: asdict(trial(int(seed))), chosen.record)]
    publish(chosen.page, {"sensors": f"{_intervals(found)}\n\n{_verdicts(found)}"})


def _intervals(found: list[Trial]) -> str:
    rows = []
    for name in ("mass", "inertia", "friction"):
        ratios = np.array([one.errors[name] for one in found if name in one.errors])
        wrong = [f"{one.machine} (seed {one.seed})" for one in found if one.errors.get(name, 0.0) > WRONG]
        held = f"{100 * np.mean(ratios <= 1.0):.1f} %" if ratios.size else ""
        rows.append((name, str(ratios.size), held, ", ".join(wrong) or "none"))
    return table(("sought", "called right", "95 % interval covers", f"off by more than {WRONG:g} half intervals"), rows)


def _verdicts(found: list[Trial]) -> str:
    kinds = dict.fromkeys(one.machine for one in found)
    counts = Counter((one.machine, one.verdict) for one in found)
    rows = [(kind, ", ".join(f"{verdict} {n}" for (of, verdict), n in counts.items() if of == kind)) for kind in kinds]
    return table(("machine", "verdicts"), rows)


if __name__ == "__main__":
    main(sys.argv[1:])
