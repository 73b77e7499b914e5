"""Gears, belts and planets against closed forms: the ratio of rates, reflected inertia, torques, and many turns."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.integrators import INTEGRATORS
from shoal.scene import Scene

ROOT: dict[str, Any] = {"body": "ground", "point": [0.0, 0.0]}
AWAY: dict[str, Any] = {"body": "ground", "point": [1.0, 0.0]}


def wheel(inertia: float) -> dict[str, Any]:
    return {"kind": "rigid-body", "mass": 1.0, "inertia": inertia, "named_points": {"rim": [0.1, 0.0]}}


def train(ratio: Any, **fields: Any) -> Scene:
    """Two wheels on the ground, a torque on the first."""
    return Scene.parse(
        {
            "name": "train",
            "gravity": [0.0, 0.0],
            "bodies": {"one": wheel(0.02), "two": wheel(0.5)},
            "joints": {
                "A": {"first": ROOT, "second": {"body": "one"}},
                "B": {"first": AWAY, "second": {"body": "two"}},
                "mesh": {"kind": "gear", "first": {"body": "one"}, "second": {"body": "two"}, "ratio": ratio},
            },
            "loads": {"motor": {"kind": "torque", "at": {"body": "one"}, "torque": 0.3}},
            "markers": {"one": {"body": "one", "point": "rim"}, "two": {"body": "two", "point": "rim"}},
            "solver": {"duration": 2.0, "samples": 20},
        }
        | fields
    )


@pytest.mark.parametrize("integrator", [name for name in INTEGRATORS if name != "auto"])
def test_wheels_turn_by_their_teeth_and_with_the_inertia_of_both(integrator: str) -> None:
    """phi_1 = t^2/2 T/(I_1 + r^2 I_2), phi_2 = r phi_1."""
    ratio, duration = -17 / 40, 0.5
    scene = train("-17/40", solver={"duration": duration, "samples": 5, "integrator": integrator, "step": 1e-3})
    run = get_engine("gauss").simulate(scene)
    assert run.ok, run.message
    turned = run.times**2 / 2 * 0.3 / (0.02 + ratio**2 * 0.5)
    slack = {"semi-implicit-euler": 1.5e-3, "implicit-gauss": 1.5e-3}.get(integrator, 1e-6)
    assert run.angle("one") == pytest.approx(turned, abs=slack)
    assert run.angle("two") == pytest.approx(ratio * turned, abs=slack)
    assert run.angle("two") == pytest.approx(ratio * run.angle("one"), abs=1e-9)


def test_a_run_of_many_turns_is_verified() -> None:
    run = verified(get_engine("gauss"), train(0.025, solver={"duration": 8.0, "samples": 8}))
    assert run.ok, run.message
    turned = run.times**2 / 2 * 0.3 / (0.02 + 0.025**2 * 0.5)
    assert turned[-1] > 70 * 2 * np.pi
    assert run.angle("one") == pytest.approx(turned, rel=1e-9)
    assert run.angle("two") == pytest.approx(0.025 * turned, rel=1e-9)


def test_a_planet_rolls_inside_its_ring() -> None:
    """A fixed ring of 60 teeth, a planet of 20 on an arm: it turns by -(60/20 - 1) of the arm's angle."""
    scene = Scene.parse(
        {
            "name": "planet",
            "gravity": [0.0, 0.0],
            "bodies": {
                "arm": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "centre_of_mass": [0.2, 0.0],
                        "named_points": {"pin": [0.4, 0.0]}},
                "planet": wheel(0.03),
            },
            "joints": {
                "A": {"first": ROOT, "second": {"body": "arm"}},
                "B": {"first": {"body": "arm", "point": "pin"}, "second": {"body": "planet"}},
                "teeth": {"kind": "gear", "first": ROOT, "second": {"body": "planet"}, "ratio": 3.0,
                          "carrier": {"body": "arm"}},
            },
            "loads": {"motor": {"kind": "torque", "at": {"body": "arm"}, "torque": 0.2}},
            "markers": {"arm": {"body": "arm", "point": "pin"}, "planet": {"body": "planet", "point": "rim"}},
            "initial": {"planet": {"angle": 0.7}},
            "solver": {"duration": 2.0, "samples": 10},
        }
    )  # fmt: skip
    run = verified(get_engine("gauss"), scene)
    assert run.ok, run.message
    inertia = 0.1 + 1.0 * 0.2**2 + 1.0 * 0.4**2 + 0.03 * 2.0**2
    turned = run.times**2 / 2 * 0.2 / inertia
    assert run.angle("arm") == pytest.approx(turned, abs=1e-9)
    assert run.angle("planet") == pytest.approx(0.7 - 2.0 * turned, abs=1e-9)


def test_torques_are_as_the_teeth() -> None:
    """A torque on the second wheel, held by a spring on the first: k phi_1 = T r."""
    spring = {"kind": "torsion-spring", "first": ROOT, "second": {"body": "one"}, "stiffness": 5.0}
    load = {"kind": "torque", "at": {"body": "two"}, "torque": 0.4}
    scene = train(-2.5, loads={"spring": spring, "load": load})
    found = statics(scene)
    assert found.ok, found.message
    assert found.angle("one") == pytest.approx(-2.5 * 0.4 / 5.0, abs=1e-9)
    assert found.angle("two") == pytest.approx(2.5**2 * 0.4 / 5.0, abs=1e-9)
    assert found.reactions is not None
    assert found.reactions.joints["mesh"].torque == pytest.approx(-0.4, abs=1e-9)
    (moving,) = reactions(train(-2.5), [0.1])
    assert moving.unbalanced < 1e-9


def test_a_stated_rate_turns_both() -> None:
    run = get_engine("gauss").simulate(train("-1/2", loads={}, initial={"one": {"rate": 3.0}}))
    assert run.angle("two") == pytest.approx(-1.5 * run.times, abs=1e-9)
    with pytest.raises(InputError, match=r"initial\.two\.rate: 1 rad/s contradicts initial\.one\.rate"):
        get_engine("gauss").simulate(train("-1/2", initial={"one": {"rate": 3.0}, "two": {"rate": 1.0}}))


@settings(max_examples=15, deadline=None)
@given(
    teeth=st.tuples(st.integers(1, 120), st.integers(1, 120), st.sampled_from([-1, 1])),
    angles=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
)
def test_any_teeth_mesh_as_they_stand_at_the_start(teeth: tuple[int, int, int], angles: tuple[float, float]) -> None:
    m, n, sign = teeth
    ratio = sign * m / n
    initial = {"one": {"angle": angles[0], "rate": 2.0 / max(1.0, abs(ratio))}, "two": {"angle": angles[1]}}
    run = get_engine("gauss").simulate(train(ratio, loads={}, initial=initial), [0.0, 1.0, 2.0])
    assert run.ok, run.message
    turned = [run.angle(name) - angle for name, angle in zip(("one", "two"), angles, strict=True)]
    assert turned[0] == pytest.approx(2.0 / max(1.0, abs(ratio)) * run.times, abs=1e-9)
    assert turned[1] == pytest.approx(ratio * turned[0], abs=1e-9)


@pytest.mark.parametrize("ratio", [0.0, np.pi, 1001.0, 0.33333, "1/0", "two"])
def test_a_ratio_is_of_whole_teeth(ratio: Any) -> None:
    with pytest.raises(InputError, match=r"joints\.mesh.*ratio") as error:
        train(ratio)
    assert "\n" not in str(error.value)


def test_wheels_of_the_plane_turn_alike_in_space() -> None:
    flat, run = (get_engine("gauss").simulate(train("-17/40", dimensions=d)) for d in (2, 3))
    assert run.ok, run.message
    assert run.points[:, :, :2] == pytest.approx(flat.points, abs=1e-9)


def test_what_has_no_teeth_is_refused_in_one_line() -> None:
    rod = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 1e3, "youngs_modulus": 1e9,
           "element": "ancf-cable"}  # fmt: skip
    with pytest.raises(InputError, match=r"^joints\.mesh: turns a flexible rod; weld a rigid body to it instead$"):
        get_engine("gauss").simulate(train(2.0).with_values({"bodies.two": rod, "markers": {"one": {"body": "one"}}}))
    with pytest.raises(InputError, match="ratio of a gear: is of whole teeth"):
        get_engine("gauss").simulate_many(train(2.0), {"joints.mesh.ratio": np.array([1.0, 2.0])}, [0.0, 0.1])
