"""Quadratic drag of a joint: against its closed form, Lagrange's equation by scipy, and other engines."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

VISCOUS, DRAG, DRY, INERTIA, RATE = 0.3, 0.7, 0.2, 0.5, 8.0
PLACE = {"body": "ground", "point": [0.0, 0.0]}


def alone(kind: str, dimensions: int = 2, **joint: Any) -> Scene:
    """One body that turns or slides without gravity, of inertia or mass INERTIA, from a rate of RATE."""
    turning = kind == "revolute"
    body = {"kind": "rigid-body", "mass": INERTIA, "inertia": INERTIA, "named_points": {"tip": [1.0, 0.0]}}
    joints = {"O": {"kind": kind, "first": PLACE, "second": {"body": "b", "point": [0.0, 0.0]}, **joint}}
    return Scene.parse({
        "name": kind, "dimensions": dimensions, "gravity": [0.0, 0.0], "bodies": {"b": body}, "joints": joints,
        "markers": {"tip": {"body": "b", "point": "tip"}}, "solver": {"duration": 3.0, "step": 1e-3},
        "initial": {"b": {"angle": 0.0, "rate": RATE} if turning else {"velocity": [RATE, 0.0]}},
    })  # fmt: skip


def way(t: Any) -> Any:
    """Of I w' = -(c + c2 w) w: by separation, w = c w0 / ((c + c2 w0) exp(c t / I) - c2 w0), integrated once more."""
    grown = VISCOUS + DRAG * RATE * -np.expm1(-VISCOUS * t / INERTIA)
    return INERTIA / DRAG * np.log(grown / VISCOUS)


SLOW = pytest.mark.slow  # they compile time loops that no other test needs
WITHIN = {"dop853": 1e-7, "radau5": 1e-7, "leapfrog": 1e-4, "implicit-gauss": 1e-2}
"""[rad or m]; the last are of second and first order, with steps of 1 ms where rates fall at 11/s."""


@pytest.mark.parametrize(
    ("integrator", "dimensions"),
    [
        *[("dop853", 2), ("leapfrog", 2)],
        *[pytest.param(name, 3, marks=SLOW) for name in ("dop853", "radau5", "leapfrog", "implicit-gauss")],
    ],
)
@pytest.mark.parametrize("kind", ["revolute", "slider"])
def test_one_body_comes_to_rest_as_the_closed_form_says(kind: str, integrator: str, dimensions: int) -> None:
    locked = {"rotation": "locked"} if kind == "slider" else {}
    scene = alone(kind, dimensions, friction=VISCOUS, drag=DRAG, **locked)
    times = np.linspace(0.0, 3.0, 7)[1:]
    run = simulate(scene.with_values({"solver.integrator": integrator}), times)
    assert run.ok, run.message
    tip = run.marker("tip")
    wanted = way(times)
    if kind == "revolute":
        np.testing.assert_allclose(
            tip[:, :2], np.column_stack([np.cos(wanted), np.sin(wanted)]), atol=WITHIN[integrator]
        )
    else:
        np.testing.assert_allclose(tip[:, 0], 1.0 + wanted, atol=WITHIN[integrator])


def pendulums(**joint: Any) -> Scene:
    """Two rods from a pivot, all of whose joints resist."""

    def pin(first: Any, second: str) -> Any:
        return {"first": first, "second": {"body": second, "point": "start"}, **joint}

    rod = {"kind": "rod", "length": 0.6, "height": 0.02, "width": 0.04, "density": 1500.0}
    return Scene.parse({
        "name": "two", "bodies": {"a": rod, "b": rod},
        "joints": {"O": pin(PLACE, "a"), "A": pin({"body": "a", "point": "end"}, "b")},
        "markers": {"B": {"body": "b", "point": "end"}},
        "initial": {"a": {"angle": -0.3}, "b": {"angle": 0.9}}, "solver": {"duration": 1.5, "step": 5e-4},
    })  # fmt: skip


@pytest.mark.parametrize("engine", ["exudyn", "casadi"])
def test_other_engines_agree(engine: str) -> None:
    """With all kinds of friction at once, in joints between bodies that both turn."""
    scene = pendulums(friction=0.01, drag=0.02, coulomb=0.05, coulomb_speed=0.5)
    times = np.linspace(0.0, 1.5, 6)[1:]
    ours, theirs = simulate(scene, times), get_engine(engine).simulate(scene, times)
    assert ours.ok
    assert theirs.ok, theirs.message
    np.testing.assert_allclose(ours.marker("B"), theirs.marker("B"), atol=2e-5)
    without = simulate(scene.with_values({"joints.O.drag": 0.0, "joints.A.drag": 0.0}), times)
    assert np.max(np.abs(ours.marker("B") - without.marker("B"))) > 1e-2


def test_lanes_have_drags_of_their_own() -> None:
    scene, times = alone("revolute", friction=VISCOUS), np.array([1.0, 2.0])
    drags = np.array([0.0, DRAG, 3.0])
    runs = get_engine("gauss").simulate_many(scene, {"joints.O.drag": drags}, times)
    for lane, drag in enumerate(drags):
        wanted = solve_ivp(
            lambda _, y, c2=drag: [y[1], -(VISCOUS + c2 * abs(y[1])) * y[1] / INERTIA], (0, 2), [0, RATE], "DOP853",
            times, rtol=1e-11, atol=1e-11,
        )  # fmt: skip
        tip = np.column_stack([np.cos(wanted.y[0]), np.sin(wanted.y[0])])
        np.testing.assert_allclose(runs.marker("tip", lane), tip, atol=1e-6)


def test_the_joint_exerts_its_drag() -> None:
    (told,) = reactions(alone("revolute", friction=VISCOUS, drag=DRAG, coulomb=DRY))
    assert told.joints["O"].torque == pytest.approx(-(VISCOUS + DRAG * RATE) * RATE - DRY, rel=1e-9)


def test_bad_values_are_refused() -> None:
    with pytest.raises(InputError, match=r"joints.O.*drag"):
        alone("revolute", drag=-1.0)
