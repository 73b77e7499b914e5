"""Further reference problems of contacts: a chain of springs, an elastic bar, Hertz's law in space."""

from __future__ import annotations

import numpy as np
import pytest
import shoal
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.trajectory import Trajectory

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
WALL = {"body": "ground", "point": [0.0, 0.0], "line": -np.pi / 2}


def events(found: Trajectory, kind: str) -> list[float]:
    return [event["time"] for event in found.model["events"] if event["kind"] == kind]


def test_a_row_of_masses_on_springs_flies_against_a_wall() -> None:
    """Values of the reference problem `spring-chain`, by matrix exponentials in 30 digits."""
    count, apart, gap = 6, 0.1, 1e-3
    names = [f"m{k}" for k in range(count)]
    scene = Scene.parse({
        "name": "chain", "gravity": [0.0, 0.0],
        "bodies": {name: {"kind": "point-mass", "mass": 0.1} for name in names},
        "loads": {f"s{k}": {"kind": "spring", "first": {"body": names[k]}, "second": {"body": names[k + 1]},
                            "stiffness": 1e4, "length": apart} for k in range(count - 1)},
        "contacts": {"wall": {"first": {"body": "m0"}, "second": WALL}},
        "initial": {name: {"position": [gap + k * apart, 0.0], "velocity": [-1.0, 0.0]}
                    for k, name in enumerate(names)},
        "markers": {name: {"body": name} for name in names},
        "solver": {"duration": 0.05, "relative_tolerance": 1e-12, "absolute_tolerance": 1e-14},
    })  # fmt: skip
    found = simulate(scene, np.array([0.005, 0.02, 0.05]))
    assert found.ok, found.message
    # The wall's force is zero at first, so that round-off may let the mass go for a moment.
    first, *others = [event for event in found.model["events"] if event["kind"] == "impact"]
    assert first["time"] == pytest.approx(0.001, abs=1e-15)
    assert all(event["time"] < 0.00101 and event["impulse"] < 1e-6 for event in others)
    assert events(found, "opens") == pytest.approx([0.036996301893066366], abs=1e-9)
    moved = found.points[:, :, 0, 0] - apart * np.arange(count)
    expected = [
        [0.0, -0.0030887146458080422, -0.003926707187605438, -0.00399715542596588, -0.003999935708616296,
         -0.003999999042002931],
        [0.0, -0.0031532901637557234, -0.0063969532472629995, -0.009230968518006396, -0.012712366515435346,
         -0.015533244953447631],
        [0.011175724646450112, 0.009921122294979656, 0.009645317183226584, 0.01124220893293851, 0.012490272870174766,
         0.013451538656891637],
    ]  # fmt: skip
    np.testing.assert_allclose(moved, expected, atol=1e-11)
    assert found.velocities is not None
    assert np.mean(found.velocities[2, :, 0, 0]) == pytest.approx(0.811395691937887, abs=1e-9)


def bar(elements: int) -> Scene:
    """An elastic bar that flies end-on against a rigid wall, `elastic-bar`; steps resolve its fastest waves."""
    rod = {"kind": "rod", "element": "ancf-cable", "elements": elements, "length": 1.0, "youngs_modulus": 2.1e11,
           "density": 7800.0, "height": 0.02, "width": 0.0157}  # fmt: skip
    return Scene.parse({
        "name": "bar", "gravity": [0.0, 0.0], "bodies": {"R": rod},
        "contacts": {"wall": {"first": {"body": "R", "point": "start"}, "second": WALL}},
        "initial": {"R": {"position": [5e-5, 0.0], "velocity": [-0.1, 0.0]}},
        "markers": {"E": {"body": "R", "point": "end"}},
        "solver": {"duration": 1.5e-3, "integrator": "leapfrog", "step": 1e-5 / elements},
    })  # fmt: skip


MIDDLE, FREE_END = 5e-4 + 0.0003854496446637726 / 2, 1.0 - 1.927248223318863e-05
"""The middle of the contact [s], and where the free end is then [m]: d'Alembert's solution of the wave equation."""


def test_an_elastic_bar_rebounds_as_waves_run_through_it() -> None:
    """A node that stops loses its energy, in proportion to the size of an element: an error of first order."""
    runs = [simulate(bar(elements), np.array([MIDDLE, 1.5e-3])) for elements in (10, 20)]
    assert all(found.ok for found in runs)
    for found in runs:
        assert events(found, "impact")[0] == pytest.approx(5e-4, abs=1e-9)
        contact = max(events(found, "opens")) - 5e-4
        assert contact == pytest.approx(0.0003854496446637726, rel=0.01)
    errors = [abs(found.points[0, 0, 0, 0] - FREE_END) for found in runs]
    assert errors[0] / errors[1] == pytest.approx(2.0, abs=0.25)


@pytest.mark.slow  # runs on finer meshes
@pytest.mark.parametrize("elements", [5, 10, 20])
def test_the_error_of_the_mesh_covers_what_nodes_lose(elements: int) -> None:
    found = shoal.simulate(bar(elements), [MIDDLE])
    assert found.ok, found.message
    error = abs(found.points[0, 0, 0, 0] - FREE_END)
    assert found.errors is not None
    told = found.errors.estimates["mesh"]
    assert error <= told <= 4.0 * error


@pytest.mark.parametrize("tilt", [0.0, 0.7])
def test_a_ball_rebounds_from_a_plane_by_hertz_law_in_space(tilt: float) -> None:
    """Values of the reference problem `hertz`; the plane may be oblique, along which the ball flies on."""
    normal = np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    along = np.array([np.cos(tilt), 0.0, -np.sin(tilt)])
    for damping, kept in ((0.0, 1.0), (0.5, 0.7484349315974341)):
        law = {"stiffness": 1e8, "exponent": 1.5, "damping": damping}
        plane = {"body": "ground", "point": [0.0, 0.0, 0.0], "plane": normal.tolist()}
        scene = Scene.parse({
            "name": "hertz", "dimensions": 3, "gravity": [0.0, 0.0, 0.0],
            "bodies": {"B": {"kind": "rigid-body", "mass": 0.1, "inertia": [1e-5, 1e-5, 1e-5]}},
            "contacts": {"plane": {"first": {"body": "B", "radius": 0.02}, "second": plane, "law": law}},
            "initial": {"B": {"position": (0.0201 * normal).tolist(), "velocity": (2.0 * along - normal).tolist()}},
            "markers": {"B": {"body": "B"}}, "solver": {"duration": 2e-3},
        })  # fmt: skip
        found = simulate(scene, np.array([1e-4 + 0.5 * 0.0008083414963977903, 2e-3]))
        assert found.ok, found.message
        assert found.velocities is not None
        np.testing.assert_allclose(found.velocities[1, 0, :, 0], 2.0 * along + kept * normal, atol=1e-8)
        if not damping:
            deep = 0.02 - found.points[0, 0, :, 0] @ normal
            assert deep == pytest.approx(0.0002746401358265294, abs=1e-11)
            (touches,), (opens,) = events(found, "touches"), events(found, "opens")
            assert opens - touches == pytest.approx(0.0008083414963977903, abs=1e-11)
