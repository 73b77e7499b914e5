"""A place of rest within a tolerance: kept against the elastica as published, and said where it is not to be had."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
import shoal
from click.testing import CliRunner
from reissner import end_of_cantilever
from scipy.integrate import solve_bvp
from shoal.cli import main
from shoal.errors import InputError
from shoal.mechanics.analysis import settled as module
from shoal.mechanics.analysis.findings import EquilibriumStatus
from shoal.mechanics.analysis.settled import settled
from shoal.scene import Scene

MODULUS, SIDE, LENGTH = 2.07e11, 0.1, 2.0
PUBLISHED = [LENGTH - 0.508537304, -1.207239855]
"""End of the extensible elastica under 3 EI / L^2, +-1e-9 m."""


def cantilever(element: str, **more: Any) -> Scene:
    load = 3 * MODULUS * SIDE**4 / 12 / LENGTH**2
    end = {"body": "B", "point": "end"}
    rod = {"kind": "rod", "length": LENGTH, "height": SIDE, "width": SIDE, "density": 8000.0, "youngs_modulus": MODULUS,
           "element": element, "elements": 1}  # fmt: skip
    return Scene.parse({
        "name": "cantilever", "gravity": [0, 0], "bodies": {"B": rod},
        "joints": {"W": {"kind": "weld", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "B"}}},
        "loads": {"P": {"kind": "force", "at": end, "force": [0, -load]}}, "markers": {"e": end},
        "solver": {"theory": "slender"}, **more,
    })  # fmt: skip


@pytest.mark.parametrize(
    ("element", "more", "tolerance"),
    [
        ("ancf-cable", {}, 1e-2),
        ("ancf-cable", {}, 1e-5),
        ("ancf-quintic", {}, 1e-5),
        pytest.param("ancf-cable", {"dimensions": 3}, 1e-4, marks=pytest.mark.slow),
        pytest.param("director-rod", {"dimensions": 3}, 1e-3, marks=pytest.mark.slow),
    ],
)
@pytest.mark.by_day(1)
def test_the_tolerance_is_kept_against_the_elastica(element: str, more: dict[str, Any], tolerance: float) -> None:
    found = settled(cantilever(element, **more), tolerance)
    assert found.ok
    assert found.errors.estimates["mesh"] is not None
    assert found.errors.estimates["mesh"] <= tolerance
    assert np.linalg.norm(found.marker("e")[:2] - PUBLISHED) <= tolerance


@pytest.mark.parametrize("quadrature", ["full", "reduced"])
@pytest.mark.parametrize("elements", [2, 4, 8])
@pytest.mark.by_day(2)
def test_without_a_tolerance_the_error_against_the_elastica_is_told(quadrature: str, elements: int) -> None:
    """And by half too large at most: cables converge faster than the second order that is believed."""
    scene = cantilever("ancf-cable").with_values({"bodies.B.quadrature": quadrature, "bodies.B.elements": elements})
    found = shoal.statics(scene)
    assert found.errors.estimates["mesh"] is not None
    error = float(np.linalg.norm(found.marker("e") - PUBLISHED))
    assert error <= found.errors.estimates["mesh"] <= 1.5 * error


@pytest.mark.slow
def test_an_error_that_cancels_on_one_mesh_is_told_on_the_next() -> None:
    """A taper, bent far: r' = (1 + N / EA) t, E I(s) theta' = M, M' = -r' x F.

    Two parts of its error cancel near 16 elements: 16 and 32 differ by less than 32 are off.
    """
    length, modulus, width, thick, thin, load = 0.9034, 2.787e9, 0.005318, 0.002659, 0.001663, 0.279

    def slopes(s: Any, y: Any) -> Any:
        height = thick + (thin - thick) * s / length
        stretch = 1 + load * np.sin(y[2]) / (modulus * width * height)
        bending = modulus * width * height**3 / 12
        return np.array(
            [stretch * np.cos(y[2]), stretch * np.sin(y[2]), y[3] / bending, -stretch * np.cos(y[2]) * load]
        )

    nodes = np.linspace(0, length, 50)
    turn = 1.4 * nodes / length
    guess = np.array([nodes * np.cos(turn), nodes * np.sin(turn), turn, load * (length - nodes) / 2])
    ends = solve_bvp(slopes, lambda a, b: np.array([a[0], a[1], a[2], b[3]]), nodes, guess, tol=1e-8)
    assert ends.success
    rod = {"length": length, "height": thick, "end_height": thin, "width": width, "youngs_modulus": modulus}
    values = {f"bodies.B.{field}": value for field, value in rod.items()}
    found = settled(cantilever("ancf-cable").with_values(values | {"loads.P.force": [0.0, load]}), 2.5e-4)
    error = float(np.linalg.norm(found.marker("e") - ends.y[:2, -1]))
    assert found.ok
    assert found.errors.estimates["mesh"] is not None
    assert error <= found.errors.estimates["mesh"] <= 2 * error


@pytest.mark.slow
def test_shear_counts_where_it_moves_a_marker_by_more_than_the_tolerance() -> None:
    """The end by Reissner's equations of 1972."""
    scene = cantilever("ancf-cable", solver={"theory": "auto"})
    found = settled(scene, 1e-5)
    assert found.ok
    assert found.to_json()["models"] == {"B": "simo-reissner"}
    assert found.codes == ["with-shear"]
    exact = end_of_cantilever(scene.value("loads.P.force.1"), LENGTH, MODULUS, SIDE, SIDE, 0.3)
    assert np.linalg.norm(found.marker("e") - exact) < 1e-5
    assert np.linalg.norm(found.marker("e") - PUBLISHED) > 1e-3
    coarse = settled(scene, 1e-2)
    assert coarse.to_json()["models"] == {"B": "ancf-cable"}


def test_a_coarse_tolerance_takes_a_coarse_mesh() -> None:
    coarse, fine = (
        settled(cantilever("ancf-cable"), tolerance).to_json()["elements"]["B"] for tolerance in (1e-2, 1e-6)
    )
    assert coarse < fine


def test_what_no_mesh_settles_is_failed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "DOUBLINGS", 2)
    found = settled(cantilever("ancf-cable"), 1e-8)
    assert found.status is EquilibriumStatus.FAILED
    assert found.codes == ["no-mesh-within-tolerance"]


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan])
def test_a_tolerance_is_a_length_above_zero(tolerance: float) -> None:
    with pytest.raises(InputError, match="tolerance: needs a length above 0 m"):
        settled(cantilever("ancf-cable"), tolerance)


def test_the_command_tells_mesh_and_error() -> None:
    run = CliRunner().invoke(
        main, ["statics", "flexible-double-pendulum", "--tolerance", "1e-3", "--json"], standalone_mode=False
    )
    data = json.loads(run.stdout)
    assert data["mesh_error"] <= 1e-3
    assert data["elements"]["OA"] >= 2
