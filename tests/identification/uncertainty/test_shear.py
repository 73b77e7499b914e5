"""Recordings of beams with shear, fitted by slender ones: the modulus comes out low, and its interval knows why.

Data by Exudyn's geometrically exact beams, on a finer mesh than the one that corrects the answer.
"""

from pathlib import Path

import pytest
import yaml
from shoal.identification import Problem, Verdict, identify
from shoal.identification.uncertainty import model_error

MODULUS = 5e7
CASES = [(height, seed) for height in (0.1, 0.06) for seed in range(5)]
SHORT = (0.1, 0)


def problem(folder: Path, height: float, seed: int) -> Problem:
    """A pendulum of 1 m and a height: its modulus and start by its middle and its tip, 0.2 mm of noise."""
    rod = {"kind": "rod", "length": 1.0, "height": height, "width": 0.04, "density": 5540.0}
    rod |= {"youngs_modulus": MODULUS, "element": "ancf-cable", "elements": 4}
    scene = {
        "name": "thick",
        "bodies": {"OA": rod},
        "joints": {"O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "OA", "point": "start"}}},
        "markers": {"M": {"body": "OA", "point": [0.5, 0.0]}, "A": {"body": "OA", "point": "end"}},
        "initial": {"OA": {"angle": 0.5}},
        "solver": {"duration": 1.0, "step": 1e-3, "samples": 100},
    }
    path = folder / "thick.yaml"
    path.write_text(yaml.safe_dump(scene))
    finer = {"bodies.OA.elements": 16, "solver.step": 2e-4, "solver.integrator": "generalized-alpha"}
    source = {"kind": "engine", "engine": "exudyn-ge", "stop": 1.0, "count": 100, "noise": 2e-4, "seed": seed}
    modulus = {"path": "bodies.OA.youngs_modulus", "lower": MODULUS / 5, "upper": 5 * MODULUS, "start": 0.97 * MODULUS}
    stated = {
        "name": "thick",
        "scene": str(path),
        "parameters": {"E": modulus, "angle": {"path": "initial.OA.angle", "lower": -3.0, "upper": 3.0}},
        "channels": [{"marker": m, "quantity": q, "noise": 2e-4} for m in ("M", "A") for q in ("x", "y")],
        "source": {**source, "values": finer},
    }
    return Problem.parse(stated, "thick")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("height", "seed"), [pytest.param(*case, marks=() if case == SHORT else pytest.mark.slow) for case in CASES]
)
def test_the_interval_holds_the_modulus_and_shear_is_named(height: float, seed: int, tmp_path: Path) -> None:
    found = identify(problem(tmp_path, height, seed), method="least-squares")
    modulus = found.parameters["E"]
    assert found.verdict is Verdict.IDENTIFIED, found.message
    assert modulus.lower <= MODULUS <= modulus.upper
    assert "theory-error" in found.codes
    assert modulus.value < MODULUS
    assert modulus.theory is not None
    assert modulus.theory > 0.5 * (MODULUS - modulus.value)


@pytest.mark.slow
def test_where_no_element_has_shear_an_order_of_magnitude_stands_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in space: within a factor of three of what rods with shear say."""
    stated = problem(tmp_path, *SHORT)
    computed = identify(stated, method="least-squares").parameters["E"].theory
    monkeypatch.setattr(model_error, "with_shear", lambda scene: None)
    estimated = identify(stated, method="least-squares").parameters["E"].theory
    assert computed is not None
    assert estimated is not None
    assert 0.1 * MODULUS > estimated > 0.01 * MODULUS
    assert 1.0 / 3.0 < estimated / computed < 3.0
