"""The start of a closed loop, sought by any of its bodies: what is not sought follows. Data by Exudyn."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem, Verdict, identify
from shoal.scene import Scene
from shoal_validation.suspects.machines import four_bar

RATE = {"path": "initial.crank.rate", "lower": -6.0, "upper": 6.0}


def linkage(folder: Path, seed: int, sought: str) -> tuple[Problem, dict[str, float]]:
    """A linkage whose crank turns, the angle of a body and the rate of the crank being sought; and the true values."""
    rng = np.random.default_rng(seed)
    data, _, seen = four_bar(rng)
    data["initial"]["crank"]["rate"] = float(rng.uniform(-2.0, 2.0))
    path = folder / "four-bar.yaml"
    path.write_text(yaml.safe_dump(data))
    stop, noise = data["solver"]["duration"], 1e-3
    stated: dict[str, Any] = {
        "name": "four-bar",
        "scene": str(path),
        "parameters": {"angle": {"path": f"initial.{sought}.angle", "lower": -3.2, "upper": 3.2}, "rate": RATE},
        "channels": [{"marker": marker, "quantity": quantity} for marker, quantity in seen],
        "noise": noise,
        "source": {"kind": "engine", "engine": "exudyn", "stop": stop, "count": 100, "noise": noise, "seed": seed},
    }
    truth = {"angle": data["initial"][sought]["angle"], "rate": data["initial"]["crank"]["rate"]}
    return Problem.parse(stated, "four-bar"), truth


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "sought"),
    [(0, "crank"), *(pytest.param(s, b, marks=pytest.mark.slow) for s in range(3) for b in ("coupler", "rocker"))],
)
def test_the_start_of_a_linkage_is_found_by_any_body(seed: int, sought: str, tmp_path: Path) -> None:
    """Most angles of the box cannot be assembled; the poses that can are found all the same."""
    problem, truth = linkage(tmp_path, seed, sought)
    found = identify(problem)
    assert found.verdict is Verdict.IDENTIFIED, found.message
    for name, true in truth.items():
        known = found.parameters[name]
        assert known.value == pytest.approx(true, abs=5 * known.std)


def closable(most: float) -> tuple[Problem, Scene, Measurement]:
    """A four-bar whose coupler is sought, up to so many times its length, and what its far end does in round numbers.

    A crank with the angle of the machine, and a loop that the others close.
    """
    data, _, seen = four_bar(np.random.default_rng(0))
    for name in ("coupler", "rocker"):
        data["initial"][name]["guess"] = ["angle"]
    length = data["bodies"]["coupler"]["length"]
    stated: dict[str, Any] = {
        "name": "four-bar",
        "scene": "four-bar",
        "parameters": {"l": {"path": "bodies.coupler.length", "lower": 0.9 * length, "upper": most * length}},
        "channels": [{"marker": marker, "quantity": quantity, "column": quantity} for marker, quantity in seen],
        "noise": 1e-4,
        "source": {"kind": "file"},
    }
    problem, scene = Problem.parse(stated, "four-bar"), Scene.parse(data, "four-bar")
    times = np.linspace(0.01, 0.4, 40)
    run = get_engine("gauss").simulate(scene, times)
    points = np.round(run.points[:, run.markers.index("B"), :2, 0], 4)
    return problem, scene, Measurement.single(times, tuple(problem.channels), points, "four-bar", noise=1e-4)


def test_a_search_begins_where_the_loop_closes(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the coupler of the middle of the bounds it cannot, and the message blamed the start of the crank."""
    problem, scene, measurement = closable(20.0)
    monkeypatch.setattr(Problem, "load_scene", lambda *_: scene)
    found = identify(problem, measurement=measurement, method="least-squares")
    assert found.verdict is Verdict.IDENTIFIED, found.message
    known = found.parameters["l"]
    assert known.value == pytest.approx(scene.value("bodies.coupler.length"), abs=5 * known.std)
    assert "the search starts from the scene's own l" in found.notes[0]
