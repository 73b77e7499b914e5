"""`python -m shoal_validation.coverage.impacts [--seeds A:B] [--only CASE] [--record FOLDER]`.

Identifies restitution, friction and gap from recordings through impacts, whose data are closed forms with noise: a rod
that swings against a stop (elliptic functions), and a disc with spin that bounces and slips on the ground. Each seed
(0:100) has its own noise and its own wrong start. Counts how often the 95 % interval of what is called right contains
the truth, with the binomial interval of that rate (Clopper and Pearson), and what was called right and is wrong. The
table goes to standard output and into docs/contact-checks.md.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from scipy.stats import beta
from shoal.errors import ShoalError
from shoal.home import prepare_kernel_cache
from shoal.json_values import plain
from shoal.trajectory import Array

from shoal_validation.contacts.cases import pendulum, struck
from shoal_validation.coverage.sensors import WRONG, over_interval
from shoal_validation.document import publish, table
from shoal_validation.resumed import resumed

DOWN = -np.pi / 2


@dataclass(frozen=True)
class Case:
    """A recording. sought: paths, bounds; truth, far: of parameters, and how far from it a start may be, as a part

    data: of the truth at times [s], one column a channel; noise: its standard deviation by channel
    """

    name: str
    scene: Mapping[str, Any]
    sought: Mapping[str, Mapping[str, Any]]
    truth: Mapping[str, float]
    far: Mapping[str, float]
    channels: tuple[tuple[str, str], ...]
    times: Array
    data: Callable[[Array], Array]
    noise: float


def rod() -> Case:
    """A rod and a stop: five impacts of its angle, seen to 2 mrad."""
    kept, stop, times = 0.8, -0.2, np.linspace(0.0, 4.0, 161)[1:]
    scene = pendulum(stop, kept, np.pi / 3, 4.0).data
    sought = {"restitution": {"path": "joints.pin.stops.restitution", "lower": 0.1, "upper": 0.98},
              "gap": {"path": "joints.pin.stops.min", "lower": DOWN - 0.6, "upper": DOWN + 0.3}}  # fmt: skip
    return Case("rod against a stop", scene, sought, {"restitution": kept, "gap": DOWN + stop},
                {"restitution": 0.3, "gap": 0.08}, (("rod", "angle"),), times,
                lambda at: DOWN + np.array([[struck(stop, kept, np.pi / 3, float(t))] for t in at]), 2e-3)  # fmt: skip


def disc(mu: float = 0.15, name: str = "disc that slips") -> Case:
    """A disc with backspin that is thrown on the ground: three impacts of its centre, seen to 2 mm.

    It slips through the first impact and rolls after the second; with more friction it sticks at once.
    """
    from shoal_validation.stability.contacts import RADIUS, bounced
    from shoal_validation.stability.contacts import disc as thrown

    kept, spin, times = 0.7, 15.0, np.linspace(0.0, 1.6, 81)[1:]
    scene = thrown(mu, kept, spin).scene.model_dump(mode="json", exclude_unset=True)
    sought = {"restitution": {"path": "contacts.floor.restitution", "lower": 0.1, "upper": 0.98},
              "friction": {"path": "contacts.floor.mu", "lower": 0.01, "upper": 1.0},
              "gap": {"path": "contacts.floor.first.radius", "lower": 0.05, "upper": 0.2}}  # fmt: skip
    return Case(name, scene, sought, {"restitution": kept, "friction": mu, "gap": RADIUS},
                {"restitution": 0.3, "friction": 0.5, "gap": 0.2}, (("disc", "x"), ("disc", "y")), times,
                lambda at: bounced(mu, kept, spin, np.ascontiguousarray(at).tobytes()), 2e-3)  # fmt: skip


def sticking() -> Case:
    """A disc that sticks at its first impact, so that its friction is known to be large enough, and no more."""
    return disc(0.6, "disc that sticks")


CASES: dict[str, Callable[[], Case]] = {"rod": rod, "disc": disc, "sticking": sticking}
STUDIED = ("rod", "disc")


@dataclass(frozen=True)
class Trial:
    """Result of a seed. errors: of each parameter that is called right, over the side of its interval."""

    verdict: str
    message: str
    errors: Mapping[str, float]


def trial(name: str, seed: int) -> Trial:
    """Identify a case with the noise and the start of a seed."""
    case = CASES[name]()
    from shoal.identification import Measurement, Problem, identify

    rng = np.random.default_rng(seed)
    parameters = {}
    for name, given in case.sought.items():
        start = case.truth[name] * (1.0 + case.far[name] * rng.uniform(-1.0, 1.0))
        parameters[name] = {**given, "start": float(np.clip(start, given["lower"], given["upper"]))}
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scene.yaml"
        path.write_text(yaml.safe_dump(plain(case.scene)), encoding="utf-8")
        channels = [{"marker": marker, "quantity": quantity, "column": quantity} for marker, quantity in case.channels]
        problem = Problem.parse({"name": "impacts", "scene": str(path), "parameters": parameters, "channels": channels,
                                 "source": {"kind": "file"}}, "impacts")  # fmt: skip
        data = case.data(case.times)
        data = data + case.noise * rng.standard_normal(data.shape)
        measured = Measurement.single(case.times, tuple(problem.channels), data, "closed form")
        try:
            found = identify(problem, measurement=measured, seed=seed)
        except ShoalError as error:
            return Trial(type(error).__name__, str(error), {})
    right = {name: value for name, value in found.parameters.items() if found.verdict.trusted and value.identifiable}
    errors = {name: over_interval(value, case.truth[name]) for name, value in right.items()}
    return Trial(str(found.verdict), found.message, errors)


def _trial(name: str, seed: str) -> dict[str, Any]:
    return asdict(trial(name, int(seed)))


def rate(held: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a rate by Clopper and Pearson (1934)."""
    low = 0.0 if held == 0 else float(beta.ppf(0.025, held, count - held + 1))
    high = 1.0 if held == count else float(beta.ppf(0.975, held + 1, count - held))
    return low, high


def rows(case: Case, trials: Mapping[int, Trial]) -> list[tuple[str, ...]]:
    """Return a row of the table for each parameter."""
    found: list[tuple[str, ...]] = []
    for name in case.truth:
        errors = {seed: one.errors[name] for seed, one in trials.items() if name in one.errors}
        held = sum(error <= 1.0 for error in errors.values())
        low, high = rate(held, max(len(errors), 1))
        wrong = sum(error > WRONG for error in errors.values())
        found.append((case.name, name, f"{len(errors)} of {len(trials)}", f"{held} of {len(errors)}",
                      f"{100 * low:.0f} to {100 * high:.0f} %", str(wrong)))  # fmt: skip
    return found


def main(arguments: list[str]) -> None:
    """Identify, count, write."""
    parser = argparse.ArgumentParser("python -m shoal_validation.coverage.impacts", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("--seeds", default="0:100", help="the first, and the one after the last")
    parser.add_argument("--record", type=Path, metavar="FOLDER", help="keeps trials, so that a stopped study goes on")
    parser.add_argument("--only", choices=STUDIED, help="one case; nothing is written")
    parser.add_argument("--page", type=Path, default=Path("docs/contact-checks.md"))
    chosen = parser.parse_args(arguments)
    prepare_kernel_cache()
    seeds = range(*map(int, chosen.seeds.split(":")))
    counted = []
    for name in STUDIED:
        if chosen.only in (None, name):
            record = None if chosen.record is None else chosen.record / f"{name}.jsonl"
            found = resumed([str(seed) for seed in seeds], partial(_trial, name), record)
            counted += rows(CASES[name](), {int(seed): Trial(**one) for seed, one in found})
    head = ("recording", "parameter", "called right", "interval holds the truth", "95 % of that rate", "wrong")
    text = table(head, counted)
    publish(Path("/nowhere") if chosen.only else chosen.page, {"impacts": text})


if __name__ == "__main__":
    main(sys.argv[1:])
