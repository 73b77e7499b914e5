"""MuJoCo as an engine: open chains in the plane and in space; loops are refused, as its own are soft."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines import get_engine
from shoal.engines.compare import compare
from shoal.engines.mujoco.limits import damping_ratio
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene

pytest.importorskip("mujoco")
TIMES = np.array([0.1, 0.3])
LINK = {"kind": "rigid-body", "mass": 1.5, "inertia": [[0.05, 0.01, 0], [0.01, 0.2, 0], [0, 0, 0.22]],
        "centre_of_mass": [0.4, 0.1, 0.05], "named_points": {"end": [0.8, 0.0, 0.1]}}  # fmt: skip


def chain() -> Scene:
    """Every kind of joint that it has, one stated from the child to its parent; at rates."""
    return Scene.parse({
        "name": "chain", "dimensions": 3, "gravity": [0.5, 0.0, -9.81],
        "bodies": dict.fromkeys("ABCD", LINK),
        "joints": {
            "S": {"kind": "spherical", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "A"}},
            "R": {"first": {"body": "B"}, "second": {"body": "A", "point": "end"}, "axis": [1, 2, 0], "friction": 0.1},
            "P": {"kind": "slider", "first": {"body": "B", "point": "end"}, "second": {"body": "C"}, "axis": [1, 0, 1],
                  "rotation": "locked", "friction": 0.3},
            "W": {"kind": "weld", "first": {"body": "C", "point": "end"}, "second": {"body": "D"}},
        },
        "markers": {name: {"body": name, "point": "end"} for name in "ABCD"},
        "initial": {"A": {"rotation": [0.3, 0.2, 0.5], "spin": [1, -2, 3]}, "B": {"rotation": [-1.0, 0.4, 0.1]}},
        "solver": {"integrator": "dop853"},
    })  # fmt: skip


def test_a_chain_of_every_joint_moves_as_in_the_native_solver() -> None:
    found = compare(chain(), ["gauss", "tree", "mujoco"], TIMES)
    assert found.ok
    assert max(row["largest"] for row in found.differences()) < 1e-9
    ours, _, theirs = found.trajectories.values()
    assert np.max(np.abs(ours.angles - theirs.angles)) < 1e-9


def test_a_step_that_is_too_long_is_not_believed() -> None:
    rough = get_engine("mujoco").simulate(chain().with_values({"solver.step": 0.1, "solver.energy_tolerance": 1e-6}))
    assert not rough.ok


def test_the_planar_double_pendulum_is_the_native_one() -> None:
    pendulum = load_scene("rigid-double-pendulum")
    theirs = get_engine("mujoco").simulate(pendulum, TIMES)
    assert theirs.ok
    assert simulate(pendulum.with_values({"solver.integrator": "dop853"}), TIMES).distance(theirs) < 1e-10


def test_loops_are_refused_with_the_reason() -> None:
    with pytest.raises(InputError, match=r"cannot do closed loops; use gauss .*MuJoCo's are soft and open"):
        get_engine("mujoco").simulate(load_scene("n-four-bar-2"), TIMES)


def stopped(dimensions: int, *, swapped: bool, step: float, restitution: float = 0.7) -> Scene:
    """Return a body on a hinge between two stops, with the ground as the second side where it is swapped."""
    flat = dimensions == 2
    middle, end = ([x, 0.0, 0.0][:dimensions] for x in (0.5, 1.0))
    body = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1 if flat else [0.1, 0.1, 0.1], "centre_of_mass": middle,
            "named_points": {"end": end}}  # fmt: skip
    sides: list[dict[str, Any]] = [{"body": "ground", "point": [0.0] * dimensions}, {"body": "B"}]
    first, second = reversed(sides) if swapped else sides
    hinge: dict[str, Any] = {"kind": "revolute", "first": first, "second": second,
                             "stops": {"min": -0.8, "max": 0.4, "restitution": restitution}}  # fmt: skip
    hinge |= {} if flat else {"axis": [0.0, 0.0, 1.0]}
    return Scene.parse({"name": "stopped", "dimensions": dimensions, "gravity": [0.0, -9.81, 0.0][:dimensions],
                        "bodies": {"B": body}, "joints": {"H": hinge}, "markers": {"P": {"body": "B", "point": "end"}},
                        "solver": {"duration": 0.8, "step": step}})  # fmt: skip


@pytest.mark.parametrize(("dimensions", "swapped"), [(2, False), (2, True), (3, False), (3, True)])
def test_stops_are_limits_whose_error_falls_with_their_stiffness(dimensions: int, swapped: bool) -> None:
    times, apart, stiff = np.linspace(0.0, 0.8, 41), [], []
    for step in (1e-3, 5e-5):
        scene = stopped(dimensions, swapped=swapped, step=step)
        ours, theirs = (get_engine(name).simulate(scene, times) for name in ("gauss", "mujoco"))
        assert theirs.ok, theirs.message
        assert any(event["kind"] == "impact" for event in ours.model["events"])
        apart.append(ours.distance(theirs))
        stiff.append(theirs.model["contacts"]["joints.H.stops"]["stiffness"])
    assert stiff[1] == pytest.approx(400 * stiff[0])
    assert apart[1] < 0.2 * apart[0]
    assert apart[1] < 0.01


@pytest.mark.parametrize("restitution", [0.9, 0.5, 0.2, 0.05])
def test_a_limit_gives_back_what_the_stop_does(restitution: float) -> None:
    """Spring and damper that push only, by scipy: the rate at which their force vanishes."""
    ratio = damping_ratio(restitution)

    def released(_: float, y: Any) -> float:
        return float(-y[0] - 2.0 * ratio * y[1]) if y[1] > 0.0 else 1.0

    released.terminal = True  # type: ignore[attr-defined]
    way = solve_ivp(lambda _, y: [y[1], -y[0] - 2.0 * ratio * y[1]], (0.0, 50.0), [0.0, -1.0], events=released,
                    rtol=1e-10, atol=1e-12)  # fmt: skip
    assert way.y[1, -1] == pytest.approx(restitution, abs=1e-6)


BALL = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.004}
GROUND = {"body": "ground", "point": [0.0, 0.0]}


def touching(start: dict[str, Any], bodies: int = 1, **more: Any) -> Scene:
    """Return balls, the first of which starts somehow, beside one at rest."""
    names = "AB"[:bodies]
    return Scene.parse({
        "name": "touching", "bodies": dict.fromkeys(names, BALL), "markers": {"A": {"body": "A"}},
        "initial": {"A": start} | ({"B": {"position": [0.5, 0.05]}} if bodies > 1 else {}),
        "solver": {"duration": 0.8, "samples": 100}, **more,
    })  # fmt: skip


def contact(second: dict[str, Any], **law: Any) -> dict[str, Any]:
    return {"C": {"first": {"body": "A", "radius": 0.1}, "second": second, **law}}


FALLING = {"position": [0.0, 0.6], "velocity": [1.0, 0.0]}
TOUCHING = {
    "circle-on-line": touching(FALLING, contacts=contact(GROUND | {"line": 0.1}, restitution=0.7)),
    "two-circles": touching({"position": [0.0, 0.0], "velocity": [1.0, 0.0]}, 2,
                            contacts=contact({"body": "B", "radius": 0.1}, restitution=0.7)),
    "strut": touching({"position": [0.1, 0.9]}, solver={"duration": 0.5, "samples": 100},
                      joints={"J": {"kind": "distance", "keeps": "at-least", "length": 0.7, "restitution": 0.5,
                                    "first": GROUND, "second": {"body": "A"}}}),
}  # fmt: skip


@pytest.mark.compiles("kernels of contacts, which few machines need")
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name == "strut")) for name in TOUCHING]
)
def test_the_distance_from_rigid_contacts_falls_with_their_stiffness(name: str) -> None:
    found = compare(TOUCHING[name], ["gauss", "mujoco"])
    assert found.ok, found.complaint
    row = found.compliance()["mujoco"]
    assert row["distances"][2] < 0.5 * row["distances"][0]
    assert not row["disagrees"]


@pytest.mark.compiles("kernels of contacts, which few machines need")
def test_a_sliding_contact_separates_by_the_associated_law_of_friction() -> None:
    """MuJoCo's convex law, no error of its springs: what slides by v leaves the surface by mu v; ours does not."""
    start = {"position": [0.0, 0.6], "velocity": [2.0, 0.0], "rate": 10.0}
    scene = touching(start, contacts=contact(GROUND | {"line": 0.0}, restitution=0.7, mu=0.2))
    row = compare(scene, ["gauss", "mujoco"]).compliance()["mujoco"]
    assert row["disagrees"]
    assert row["rigid"] > 3.0 * (row["penalty"] + row["uncertainty"])


@pytest.mark.parametrize(
    ("second", "law", "field"),
    [
        (GROUND | {"hole": 0.8}, {}, "second.hole"),
        (GROUND | {"line": 0.0}, {"rolling": True}, "rolling"),
        (GROUND | {"line": 0.0}, {"law": {"stiffness": 1e5}}, "law"),
        ({"body": "B", "line": 0.0}, {}, "second.line"),
    ],
)
def test_contacts_that_mujoco_has_not_are_refused_by_name(second: Any, law: dict[str, Any], field: str) -> None:
    scene = touching(FALLING | {"position": [0.0, 0.3]}, 2, contacts=contact(second, **law))
    with pytest.raises(InputError, match=rf"^contacts\.C\.{field}: contacts of MuJoCo have no counterpart"):
        get_engine("mujoco").simulate(scene)
