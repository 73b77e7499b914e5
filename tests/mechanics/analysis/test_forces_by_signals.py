"""Reactions, virtual sensors, steady motions and starts from the end of a run of machines with signals and states."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.analysis.felt import lanes_of
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.reactions_along import reactions_along
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Attachment, Scene

sys.path.insert(0, str(Path(__file__).parents[1]))
from controlled import in_space, pendulum, two_link

MASS, LENGTH, G = 2.0, 0.8, 9.81
INERTIA = MASS * LENGTH**2 / 3
TIMES = np.linspace(0.0, 1.0, 6)


def controlled() -> Scene:
    data = pendulum("60*(ref - phi) - 6*rate(hinge) + sum")
    return Scene.parse({**data, "states": {"sum": {"rate": "30*(ref - phi)"}}})


def hinge_force(phi: np.ndarray, rate: np.ndarray, change: np.ndarray) -> np.ndarray:
    """Of the ground on the pendulum, phi from hanging down: m (a - g)."""
    along, across = np.array([np.sin(phi), -np.cos(phi)]), np.array([np.cos(phi), np.sin(phi)])
    return MASS * (LENGTH / 2 * (change * across - rate**2 * along) + np.array([[0.0], [G]]))


def exact() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    from scipy.integrate import solve_ivp

    def change(_: float, y: np.ndarray) -> list[float]:
        torque = 60 * (1 - y[0]) - 6 * y[1] + y[2]
        return [y[1], (torque - MASS * G * LENGTH / 2 * math.sin(y[0])) / INERTIA, 30 * (1 - y[0])]

    y = solve_ivp(change, (0, 1), [0.2, 0.0, 0.0], method="DOP853", t_eval=TIMES, rtol=1e-13, atol=1e-13).y
    return y[0], y[1], np.array([change(0.0, one)[1] for one in y.T])


def test_reactions_and_an_accelerometer_of_a_controlled_pendulum() -> None:
    """Newton's law with the motion of scipy, by reactions at times and by sensors along the motion."""
    scene, (phi, rate, change) = controlled(), exact()
    wanted = hinge_force(phi, rate, change).T
    for one, force in zip(reactions(scene, TIMES[1:4].tolist()), wanted[1:4], strict=True):
        assert np.abs(np.array(one.joints["hinge"].force)) == pytest.approx(np.abs(force), rel=1e-8)
        assert one.ok
    run = simulate(scene, TIMES, whole=True)
    (felt,) = lanes_of(run.states, TIMES, [0])
    along = reactions_along(felt, ("hinge",))["hinge"]
    assert np.abs(along.force) == pytest.approx(np.abs(wanted), rel=1e-8)
    tip = felt.specific_force(Attachment(body="arm", point="end"))
    assert tip[:, 1] == pytest.approx(LENGTH * change + G * np.sin(phi), rel=1e-7, abs=1e-7)
    assert tip[:, 0] == pytest.approx(-LENGTH * rate**2 - G * np.cos(phi), rel=1e-7, abs=1e-7)


def test_reactions_at_rest_under_feedback() -> None:
    (joint,) = statics(controlled()).reactions.joints.values()
    assert np.abs(joint.force) == pytest.approx([0.0, MASS * G], abs=1e-8)


@pytest.mark.parametrize("make", [two_link, in_space])
def test_reactions_are_those_of_loads_of_the_same_strength(make: Any) -> None:
    """At a state, in the plane and in space: signals by their values there."""
    data = make()
    found = reactions(Scene.parse(data))[0]
    from shoal.mechanics.analysis.evaluate import Evaluator
    from shoal.mechanics.assembly.build import build

    model = build(Scene.parse(data), horizon=1.0)
    strengths = Evaluator(model).strengths(model.q0[:, 0], model.v0[:, 0])
    assert strengths
    for field, value in strengths.items():
        _, name, part = field.split(".")
        data["loads"][name][part] = value
    data["signals"] = {}
    stated = reactions(Scene.parse(data))[0]
    assert found.ok
    for name, joint in stated.joints.items():
        assert found.joints[name].force == pytest.approx(joint.force, rel=1e-9, abs=1e-9)
        assert found.joints[name].torque == pytest.approx(joint.torque, rel=1e-9, abs=1e-9)


def test_a_run_goes_on_from_the_end_of_another_with_states_and_turns() -> None:
    """Half and half are the whole; the angle of the hinge has counted more than a turn."""
    data = pendulum("60*(ref - phi) - 6*rate(hinge) + sum", ref="9*sin(t)")
    scene = Scene.parse({**data, "states": {"sum": {"rate": "30*(ref - phi)", "size": 3.0}}})
    whole = simulate(scene, np.array([1.5, 3.0]))
    end = json.loads(json.dumps(dict(simulate(scene, np.array([1.5])).end)))
    assert end["measures"]["angle(hinge)"] > 2 * math.pi
    later = scene.model_dump(mode="json", exclude_none=True)
    later["signals"]["ref"] = "9*sin(t + 1.5)"
    later["initial"] = {"from": end}
    rest = simulate(Scene.parse(later), np.array([1.5]))
    assert rest.points[-1, 0, :, 0] == pytest.approx(whole.points[-1, 0, :, 0], abs=1e-9)
    end["states"] = {}
    with pytest.raises(InputError, match=r"initial.from: states.sum: only the scene has such a state"):
        simulate(Scene.parse(later | {"initial": {"from": end}}), np.array([1.5]))


def test_modes_of_a_steady_motion_under_feedback() -> None:
    """A disc that a torque holds at a speed: its speed returns with exp(-k t / J)."""
    disc = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.2}
    pin = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "disc"}}
    data = {
        "name": "held-speed", "bodies": {"disc": disc}, "joints": {"axle": pin}, "markers": {"m": {"body": "disc"}},
        "loads": {"motor": {"kind": "torque", "at": {"body": "disc"}, "torque": "0.7*(5 - rate(axle))"}},
        "initial": {"disc": {"rate": 5.0}},
    }  # fmt: skip
    found = modes(Scene.parse(data))
    assert found.ok
    assert found.speed == pytest.approx(5.0)
    assert sorted(one.eigenvalue.real for one in found.modes) == pytest.approx([-3.5, 0.0], abs=1e-9)
    data["states"] = {"sum": {"rate": "5 - rate(axle)"}}
    data["loads"]["motor"]["torque"] = "0.7*(5 - rate(axle)) + sum"
    with pytest.raises(InputError, match=r"states.sum: modes about steady motions take signals, but no states yet"):
        modes(Scene.parse(data))


def test_held_values_are_refused_where_they_are_not_known() -> None:
    """A run tells its continuous states; what a sampled controller holds is none of them."""
    data = pendulum("u")
    pid = {"kind": "pid", "of": "0.5 - angle(hinge)", "kp": 40, "ki": 20, "kd": 5, "rate": "-rate(hinge)"}
    data |= {"signals": {}, "controllers": {"u": {**pid, "sampled": {"period": 0.01}}}}
    data["states"] = {"late": {"rate": "(angle(hinge) - late)/0.1"}}
    scene = Scene.parse(data)
    with pytest.raises(InputError, match="reactions and virtual sensors know no held values"):
        reactions(scene, [0.1])
    end = dict(simulate(scene, np.array([0.1])).end)
    assert list(end["states"]) == ["late"]
    with pytest.raises(InputError, match="what it holds at the end of a run is not kept"):
        simulate(scene.with_values({"initial.from": end}), np.array([0.1]))
