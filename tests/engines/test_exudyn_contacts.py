"""Exudyn's contacts give way: their distance from rigid ones falls as stiffness^-1/2, or it is disagreement."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines import get_engine
from shoal.engines.compare import Comparison, compare
from shoal.engines.exudyn.contacts import LEAST, coefficient, model_2
from shoal.engines.exudyn.script import script
from shoal.errors import InputError
from shoal.scene import Scene
from shoal.scene.contact_law import loss_of

pytest.importorskip("exudyn")
pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")

BALL = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.004}
MASS = {"kind": "point-mass", "mass": 2.0}
GROUND = {"body": "ground", "point": [0.0, 0.0]}


def machine(body: dict[str, Any], start: dict[str, Any], duration: float = 0.8, **more: Any) -> Scene:
    return Scene.parse({
        "name": "touching", "bodies": {"A": body}, "initial": {"A": start}, "markers": {"A": {"body": "A"}},
        "solver": {"duration": duration, "samples": 100}, **more,
    })  # fmt: skip


def touching(first: dict[str, Any], second: dict[str, Any], **law: Any) -> dict[str, Any]:
    return {"c": {"first": {"body": "A", **first}, "second": GROUND | second, **law}}


def held(kind: str, **more: Any) -> dict[str, Any]:
    return {"J": {"kind": kind, "first": GROUND, "second": {"body": "A"}, **more}}


THROWN = {"position": [0.0, 0.6], "velocity": [1.0, 0.0], "rate": 5.0}
SOLID = {"kind": "rigid-body", "mass": 1.0, "inertia": [0.004, 0.004, 0.004]}
MACHINES = {
    "hinge": machine(BALL, {"angle": -0.5},
                     joints={"J": {"first": GROUND, "second": {"body": "A", "point": [-0.5, 0.0]},
                                   "stops": {"min": -1.8, "max": 0.0, "restitution": 0.8}}}),
    "slider": machine(BALL, {}, joints=held("slider", direction=-0.5, stops={"max": 0.4, "restitution": 0.6})),
    "rope": machine(MASS, {"position": [0.3, -0.4], "velocity": [0.5, 0.0]},
                    joints=held("distance", keeps="at-most", length=0.8, restitution=0.5)),
    "strut": machine(MASS, {"position": [0.1, 0.9]}, 0.5,
                     joints=held("distance", keeps="at-least", length=0.7, restitution=0.5)),
    "circle-on-line": machine(BALL, THROWN, contacts=touching({"radius": 0.1}, {"line": 0.1}, restitution=0.7, mu=0.2)),
    "plastic": machine(BALL, THROWN, contacts=touching({"radius": 0.1}, {"line": 0.1}, mu=0.1)),
    "point-on-circle": machine(BALL, THROWN | {"velocity": [0.2, 0.0], "rate": 0.0}, 0.4,
                               contacts=touching({}, {"radius": 0.3}, restitution=0.4, mu=0.2)),
    "hole": machine(BALL, {"position": [0.1, 0.1], "velocity": [0.5, 0.0]},
                    contacts=touching({"radius": 0.1}, {"hole": 0.4}, restitution=0.4, mu=0.2)),
    "sphere-on-plane": machine(
        SOLID, {"position": [0.0, 0.0, 0.6], "velocity": [1.0, 0.3, 0.0]}, dimensions=3, gravity=[0.0, 0.0, -9.81],
        contacts={"c": {"first": {"body": "A", "radius": 0.1}, "second": {"body": "ground", "plane": [0.0, 0.1, 1.0]},
                        "restitution": 0.7, "mu": 0.2}}),
    "slider-in-space": machine(
        SOLID, {}, dimensions=3, gravity=[0.0, 0.0, -9.81],
        joints={"J": {"kind": "slider", "axis": [1.0, 0.0, -0.5], "first": {"body": "ground", "point": [0, 0, 0]},
                      "second": {"body": "A"}, "stops": {"max": 0.4, "restitution": 0.6}}}),
}  # fmt: skip
MACHINES["pin-with-play"] = machine(
    BALL, {"angle": -0.5, "position": [0.5 * np.cos(0.5) + 0.01, -0.5 * np.sin(0.5)]}, 0.3,
    joints={"J": {"first": GROUND, "second": {"body": "A", "point": [-0.5, 0.0]}, "play": 0.03, "radius": 0.02,
                  "restitution": 0.5}},
)  # fmt: skip
MACHINES["block-on-line"] = machine(
    BALL, {"position": [0.0, 0.6], "angle": 0.5, "velocity": [0.5, 0.0]}, 0.36,
    contacts=touching({"polygon": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]}, {"line": 0.1},
                      restitution=0.5),
)  # fmt: skip
DAILY = ("hinge", "circle-on-line")


def compared(scene: Scene) -> Comparison:
    return compare(scene, ["gauss", "exudyn"], scene.solver.duration * np.arange(1, 101) / 100)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name not in DAILY)) for name in MACHINES]
)
def test_the_distance_from_rigid_contacts_is_halved_by_four_times_the_stiffness(name: str) -> None:
    found = compared(MACHINES[name])
    assert found.ok, found.complaint
    assert found.trajectories["gauss"].model["events"]
    row = found.compliance()["exudyn"]
    first, second, third = row["distances"]
    assert 1.5 < first / second < 3.0
    assert 1.3 < second / third < 4.0
    assert row["rigid"] < row["penalty"]
    assert not row["disagrees"]


def test_a_law_that_differs_is_disagreement_and_no_penalty_error() -> None:
    """Balls that touch: Moreau's law gives (-1/3, 2/3, 2/3), springs hand the motion on from ball to ball."""
    balls = dict.fromkeys("ABC", BALL)
    contacts = {pair: {"first": {"body": pair[0], "radius": 0.1}, "second": {"body": pair[1], "radius": 0.1},
                       "restitution": 1.0} for pair in ("AB", "BC")}  # fmt: skip
    start = {"A": {"position": [-0.5, 0.0], "velocity": [1.0, 0.0]}, "B": {"position": [0.0, 0.0]},
             "C": {"position": [0.2, 0.0]}}  # fmt: skip
    scene = Scene.parse({
        "name": "cradle", "gravity": [0.0, 0.0], "bodies": balls, "contacts": contacts, "initial": start,
        "markers": {"A": {"body": "A"}}, "solver": {"duration": 1.0},
    })  # fmt: skip
    row = compared(scene).compliance()["exudyn"]
    assert row["disagrees"]
    assert row["rigid"] > 10.0 * (row["penalty"] + row["uncertainty"])


@pytest.mark.parametrize(
    ("law", "field"),
    [
        ({"rolling": True}, "rolling"),
        ({"mu": 0.2, "mu_static": 0.3}, "mu_static"),
        ({"tangential_restitution": 0.5, "mu": 0.2}, "tangential_restitution"),
        ({"law": {"stiffness": 1e5, "damping": 0.1}}, "law.damping"),
    ],
)
def test_what_exudyn_has_not_is_refused_by_name(law: dict[str, Any], field: str) -> None:
    scene = machine(BALL, THROWN, contacts=touching({"radius": 0.1}, {"line": 0.0}, **law))
    with pytest.raises(InputError, match=rf"^contacts\.c\.{field}: contacts of engine exudyn have no counterpart"):
        get_engine("exudyn").simulate(scene)


def test_a_stated_law_is_the_same_in_both() -> None:
    """No penalty: Hertz's law with the damping of a restitution."""
    law = {"stiffness": 1e6, "restitution": 0.6}
    scene = machine(BALL, {"position": [0.0, 0.3]}, contacts=touching({"radius": 0.1}, {"line": 0.0}, law=law))
    ours = get_engine("gauss").simulate(scene)
    away = [ours.distance(get_engine("exudyn").simulate(scene.with_values({"solver.step": step})))
            for step in (1e-3, 1e-4)]  # fmt: skip
    assert away[1] < 0.1 * away[0]
    assert away[1] < 1e-4


def test_a_body_that_falls_through_a_surface_is_a_failure() -> None:
    scene = machine(BALL, {"position": [0.0, 5.0]}, 2.0,
                    contacts=touching({"radius": 0.01}, {"line": 0.0}, restitution=0.5))  # fmt: skip
    run = get_engine("exudyn").simulate(scene)
    assert not run.ok
    assert run.message.startswith("contacts.c: a body fell through the surface")


@pytest.mark.parametrize("restitution", [0.95, 0.5, 0.2, LEAST])
def test_the_damping_gives_back_what_is_asked_for(restitution: float) -> None:
    """Exudyn's law of the depth d, d'' = -d (1 + c d'/v), integrated by scipy from the impact to its end."""
    damping = model_2(coefficient(restitution))
    assert damping == pytest.approx(loss_of(restitution), rel=1e-9)
    way = solve_ivp(lambda _, y: [y[1], -y[0] * (1.0 + damping * y[1])], (0.0, 1e3), [0.0, 1.0], rtol=1e-11, atol=1e-13,
                    events=_out)  # fmt: skip
    assert -way.y[1, -1] == pytest.approx(restitution, rel=1e-6)


def _out(_: float, y: Any) -> float:
    return float(y[0])


_out.terminal, _out.direction = True, -1.0  # type: ignore[attr-defined]


def test_a_script_for_exudyn_has_the_same_contacts(tmp_path: Path) -> None:
    scene = MACHINES["circle-on-line"]
    path = tmp_path / "touching.py"
    path.write_text(script(scene), encoding="utf-8")
    subprocess.run([sys.executable, str(path)], check=True, capture_output=True)
    table = np.genfromtxt(path.with_suffix(".csv"), delimiter=",", names=True)
    ours = get_engine("exudyn").simulate(scene, table["t"])
    np.testing.assert_allclose(table["Ax"], ours.marker("A")[:, 0], atol=1e-9)
