"""Starts from statics: a machine that starts where its forces balance stays there, and swings when it is let go."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shoal
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.mechanics.analysis.course import Course, machine, machines
from shoal.mechanics.analysis.felt import lane_of, lanes_of
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import states
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

HEIGHT, YOUNG, DENSITY, LENGTH, FORCE = 0.02, 2e9, 1000.0, 1.0, 1e-3


def blade(scale: Any = 1.0, elements: int = 8, force: float = FORCE, **fields: Any) -> Scene:
    """A cantilever under a force across its tip."""
    rod = {"kind": "rod", "length": LENGTH, "height": HEIGHT, "width": HEIGHT, "density": DENSITY,
           "youngs_modulus": YOUNG, "element": "ancf-cable", "elements": elements}  # fmt: skip
    return Scene.parse(
        {
            "name": "blade",
            "gravity": [0.0, 0.0],
            "bodies": {"blade": rod},
            "joints": {"clamp": {"kind": "weld", "first": {"body": "ground", "point": [0.0, 0.0]},
                                 "second": {"body": "blade"}}},
            "loads": {"tip": {"kind": "force", "at": {"body": "blade", "point": "end"}, "force": [0.0, force],
                              "scale": scale}},
            "markers": {"tip": {"body": "blade", "point": "end"}},
            "initial": {"from": "statics"},
            "solver": {"duration": 0.2, "samples": 20},
        }
        | fields
    )  # fmt: skip


def let_go(t: Any) -> Any:
    """Deflection of the tip [m] at the time after which the force is gone: 4 F/(m L) sum of cos(w_i t)/w_i^2."""
    roots = [1.8751040687119611, 4.694091132974175, 7.854757438237613, 10.995540734875467, 14.13716839104647]
    roots += [np.pi * (k - 0.5) for k in range(6, 40)]
    line, stiffness = DENSITY * HEIGHT**2, YOUNG * HEIGHT**4 / 12
    w = np.array(roots) ** 2 * np.sqrt(stiffness / line) / LENGTH**2
    return 4 * FORCE / (line * LENGTH) * np.sum(np.cos(np.multiply.outer(t, w)) / w**2, axis=-1)


def test_who_starts_in_balance_stays_there() -> None:
    scene = blade(force=5.0)
    run = verified(get_engine("gauss"), scene)
    assert run.ok, run.message
    bent = statics(scene).marker("tip")
    assert bent[1] > 0.05
    assert run.marker("tip") == pytest.approx(np.tile(bent, (len(run.times), 1)), abs=1e-9)


def test_a_bent_blade_swings_as_its_modes_when_it_is_let_go() -> None:
    gone = 1e-3
    solver = {"duration": 0.2, "samples": 20, "integrator": "generalized-alpha", "step": 5e-5}
    run = verified(get_engine("gauss"), blade(f"1 - step(t - {gone})", elements=12, solver=solver))
    assert run.ok, run.message
    known = let_go(np.maximum(run.times - gone, 0.0))
    assert run.marker("tip")[:, 1] == pytest.approx(known, abs=5e-4 * FORCE * LENGTH**3 * 4 / (YOUNG * HEIGHT**4))


def between_pins(apart: float, initial: Any = "statics", **fields: Any) -> Scene:
    """A round wire of one metre between two pins that are so far apart."""
    ends = {"a": ([0.0, 0.0], "start"), "b": ([apart, 0.0], "end")}
    joints = {
        name: {"first": {"body": "ground", "point": place}, "second": {"body": "wire", "point": end}}
        for name, (place, end) in ends.items()
    }
    wire = {"kind": "rod", "section": "round", "length": 1.0, "height": 1e-3, "density": 7800.0,
            "youngs_modulus": 2e11, "element": "ancf-cable", "elements": 16}  # fmt: skip
    data = {"name": "wire", "gravity": [0.0, 0.0], "bodies": {"wire": wire}, "joints": joints}
    data |= {"markers": {"middle": {"body": "wire", "point": [0.5, 0.0]}}, "initial": {"from": initial}}
    return Scene.parse(data | {"solver": {"duration": 2e-3, "samples": 4}} | fields)


def test_a_wire_that_two_pins_stretch_is_a_string() -> None:
    """T = EA e, and the frequencies of a string that bends a little: n/2l sqrt(T/m) sqrt(1 + n^2 pi^2 EI/T l^2)."""
    area, bending, apart = np.pi * 1e-6 / 4, 2e11 * np.pi * 1e-12 / 64, 1.002
    tension, line = 2e11 * area * (apart - 1.0), 7800.0 * area / apart
    scene = between_pins(apart)
    assert statics(scene).reactions.joints["b"].force[0] == pytest.approx(tension, rel=1e-6)
    n = np.arange(1, 4)
    wanted = n / (2 * apart) * np.sqrt(tension / line * (1 + (n * np.pi / apart) ** 2 * bending / tension))
    assert [mode.frequency for mode in modes(scene).modes[:3]] == pytest.approx(wanted, rel=1e-3)
    run = verified(get_engine("gauss"), scene)
    assert run.ok, run.message
    assert run.marker("middle") == pytest.approx(np.tile([apart / 2, 0.0], (len(run.times), 1)), abs=1e-9)


def test_a_wire_that_two_pins_press_is_an_elastica() -> None:
    """With k = sin(a/2) of the angle a at its ends: chord 2 E/K - 1, height k/K of its length."""
    chord = 0.98
    k = brentq(lambda k: 2 * ellipe(k * k) / ellipk(k * k) - 1 - chord, 1e-3, 0.9)
    assert abs(statics(between_pins(chord)).marker("middle")[1]) == pytest.approx(k / ellipk(k * k), rel=1e-3)


def test_a_weld_that_takes_its_angle_from_a_start_that_does_not_fit_is_refused() -> None:
    ends = {"a": ([0.0, 0.0], "start"), "b": ([0.98, 0.0], "end")}
    joints = {
        name: {"kind": "weld", "first": {"body": "ground", "point": place}, "second": {"body": "wire", "point": end}}
        for name, (place, end) in ends.items()
    }
    with pytest.raises(InputError, match=r"joints\.a: takes a number from the start.*joints; state its `angle`"):
        statics(between_pins(0.98, joints=joints))
    held = {name: joint | {"angle": 0.0} for name, joint in joints.items()}
    chord = statics(between_pins(0.98, joints=held))
    k = brentq(lambda k: 2 * ellipe(k * k) / ellipk(k * k) - 1 - 0.98, 1e-3, 0.9)
    assert abs(chord.marker("middle")[1]) == pytest.approx(k / ellipk(k * k), rel=1e-3)


def test_a_stretched_wire_goes_on_where_a_run_has_stretched_it() -> None:
    """A pin that moves stretches it; the pin that stands where that one ended holds the same force."""
    moving = {"x": "1 + 2e-3*ramp(t/0.02)"}
    held = {"b": {"first": {"body": "ground", "point": "P"}, "second": {"body": "wire", "point": "end"}}}
    scene = between_pins(1.0, None, ground_points={"P": moving}, solver={"duration": 0.05})
    scene = scene.with_values({"joints": {**scene.model_dump(mode="json")["joints"], **held}})
    end = dict(shoal.simulate(scene, verify=False).end)
    later = scene.with_values({"ground_points.P.x": 1.002, "initial.from": end, "solver.duration": 1e-3})
    run = get_engine("gauss").simulate(later)
    assert run.ok, run.message
    assert run.marker("middle")[:, 0] == pytest.approx(0.501, abs=1e-4)


def test_a_mass_hangs_from_its_spring() -> None:
    spring = {"kind": "spring", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "mass"},
              "stiffness": 100.0, "length": 1.0}  # fmt: skip
    scene = Scene.parse(
        {
            "name": "hanging",
            "bodies": {"mass": {"kind": "point-mass", "mass": 2.0}},
            "loads": {"spring": spring},
            "markers": {"mass": {"body": "mass"}},
            "initial": {"from": "statics", "mass": {"position": [0.0, -1.0]}},
            "solver": {"duration": 1.0},
        }
    )
    run = get_engine("gauss").simulate(scene)
    assert run.marker("mass") == pytest.approx(np.tile([0.0, -1.0 - 2.0 * 9.81 / 100.0], (len(run.times), 1)), abs=1e-9)


@pytest.mark.slow
def test_what_is_stated_beside_is_near_the_place_of_rest_only() -> None:
    """A weight on a rope from the tip: it hangs straight below, wherever it was said to be."""
    found = {}
    for near in ([1.2, -0.3], [0.8, -1.0]):
        scene = blade(
            gravity=[0.0, -9.81],
            bodies={**blade().model_dump(mode="json")["bodies"], "load": {"kind": "point-mass", "mass": 0.05}},
            joints={**blade().model_dump(mode="json")["joints"],
                    "rope": {"kind": "distance", "first": {"body": "blade", "point": "end"},
                             "second": {"body": "load"}, "length": 0.5}},
            markers={"tip": {"body": "blade", "point": "end"}, "load": {"body": "load"}},
            initial={"from": "statics", "load": {"position": near}},
        )  # fmt: skip
        run = verified(get_engine("gauss"), scene)
        assert run.ok, run.message
        found[tuple(near)] = run.marker("load")[0]
        assert run.marker("load")[-1] == pytest.approx(run.marker("tip")[0] - [0.0, 0.5], abs=1e-7)
    first, second = found.values()
    assert first == pytest.approx(second, abs=1e-8)


def test_every_lane_has_its_own_place_of_rest() -> None:
    scene = blade(force=5.0)
    moduli = np.array([1e9, 2e9, 4e9])
    run = get_engine("gauss").simulate_many(scene, {"bodies.blade.youngs_modulus": moduli}, [0.0, 0.1])
    for lane, modulus in enumerate(moduli):
        bent = statics(scene.with_values({"bodies.blade.youngs_modulus": modulus})).marker("tip")
        assert run.marker("tip", lane) == pytest.approx(np.tile(bent, (2, 1)), abs=1e-9)


def test_lanes_without_friction_stay_at_rest_beside_those_with_it() -> None:
    """A lane that has no friction has fewer force elements: the turns of its spring are those of the spring."""
    hinge = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "arm"}, "friction": 0.1}
    coil = {"kind": "torsion-spring", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "arm"},
            "stiffness": 5.0, "angle": 7.0}  # fmt: skip
    scene = Scene.parse(
        {
            "name": "wound",
            "bodies": {"arm": {"kind": "rod", "length": 0.5, "height": 0.01, "width": 0.01, "density": 2700.0}},
            "joints": {"hinge": hinge},
            "loads": {"coil": coil},
            "markers": {"tip": {"body": "arm", "point": "end"}},
            "initial": {"from": "statics", "arm": {"angle": 6.0}},
            "solver": {"duration": 0.2},
        }
    )
    weight, length = 9.81 * 2700.0 * 0.01**2 * 0.5, 0.5
    angle = brentq(lambda a: 5.0 * (7.0 - a) - weight * length / 2 * np.cos(a), 6.0, 7.5)
    run = get_engine("gauss").simulate_many(scene, {"joints.hinge.friction": np.array([0.0, 0.1])}, [0.0, 0.2])
    assert run.ok, run.message
    for lane in range(2):
        known = length * np.array([np.cos(angle), np.sin(angle)])
        assert run.marker("tip", lane) == pytest.approx(np.tile(known, (2, 1)), abs=1e-8)


def test_states_along_the_motion_begin_there_too() -> None:
    scene = blade(force=5.0)
    (state,) = states(scene, [0.05])[1]
    assert state.q == pytest.approx(statics(scene).q, abs=1e-9)


def test_what_is_written_of_a_scene_can_be_read_and_set() -> None:
    scene = blade()
    again = Scene.parse(scene.model_dump(mode="json"))
    assert again == scene
    assert again.starts_at_rest
    assert not scene.with_values({"initial.from": None}).starts_at_rest
    assert blade(initial={}).with_values({"initial.from": "statics"}).starts_at_rest


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"initial": {"from": "rest"}}, "initial.from: .statics. or the .end. of a run's JSON, found 'rest'"),
        ({"initial": {"from": "statics", "blade": {"rate": 1.0}}}, "initial.blade.rate: a start from statics is at"),
    ],
)
def test_what_cannot_start_at_rest_is_one_line(fields: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        blade(**fields)


def test_nothing_starts_where_nothing_holds_it() -> None:
    scene = Scene.parse(
        {
            "name": "falling",
            "bodies": {"mass": {"kind": "point-mass", "mass": 2.0}},
            "markers": {"mass": {"body": "mass"}},
            "initial": {"from": "statics", "mass": {"position": [0.0, 0.0]}},
        }
    )
    with pytest.raises(InputError, match=r"initial.from: statics finds no stable place of rest: .*falls without end"):
        get_engine("gauss").simulate(scene)


def test_engines_that_know_no_statics_refuse_it() -> None:
    with pytest.raises(InputError, match=r"^initial.from: engine casadi cannot do starts at rest; use gauss$"):
        get_engine("casadi").simulate(blade())


STIFFNESS, INERTIA, WOUND, TORQUE, PACE, RIM = 8.0, 0.5, 5.0, 0.7, 3.0, 0.3


def wheel(angle: float = 0.0) -> Scene:
    """A wheel at rest where its spring has wound it, most of a turn from where it is stated; a torque drives it."""
    ground, at = {"body": "ground", "point": [0.0, 0.0]}, {"body": "wheel"}
    spring = {"kind": "torsion-spring", "first": ground, "second": at, "stiffness": STIFFNESS, "angle": WOUND}
    torque = {"kind": "torque", "at": at, "torque": f"{TORQUE}*sin({PACE}*t)"}
    body = {"kind": "rigid-body", "mass": 2.0, "inertia": INERTIA, "centre_of_mass": [0.0, 0.0]}
    return Scene.parse(
        {
            "name": "wheel",
            "bodies": {"wheel": body},
            "joints": {"O": {"first": ground, "second": at}},
            "loads": {"spring": spring, "torque": torque},
            "markers": {"rim": {"body": "wheel", "point": [RIM, 0.0]}, "hub": at},
            "initial": {"from": "statics", "wheel": {"angle": angle}},
            "gravity": [0.0, 0.0],
            "solver": {"duration": 2.0, "samples": 40},
        }
    )


def swing(t: Any) -> tuple[Any, Any, Any]:
    """Angle from rest [rad], rate and acceleration of J x'' + k x = T sin(w t)."""
    own = np.sqrt(STIFFNESS / INERTIA)
    size = TORQUE / (STIFFNESS - INERTIA * PACE**2)
    x = size * (np.sin(PACE * t) - PACE / own * np.sin(own * t))
    rate = size * PACE * (np.cos(PACE * t) - np.cos(own * t))
    return x, rate, size * PACE * (own * np.sin(own * t) - PACE * np.sin(PACE * t))


@pytest.mark.parametrize(
    "how", ["lanes", "courses", *(pytest.param(how, marks=pytest.mark.slow) for how in ("states", "course"))]
)
@pytest.mark.slow
def test_turns_are_counted_from_where_statics_puts_the_machine(how: str) -> None:
    """They were counted from the stated angles: a spring wound by 5 rad was felt as one wound by 5 - 2 pi."""
    scene, values = wheel(), {"bodies.wheel.mass": np.full(2, 2.0)}
    times = np.linspace(0.0, 2.0, 41)
    run = simulate(scene, times, values, whole=True)
    assert run.ok, run.message
    x, rate, change = swing(times)
    assert run.angles[:, 0, 1] == pytest.approx(WOUND + x, abs=1e-8)
    parts = run.points, run.velocities, run.angles, run.rates
    course = Course(times, *(part[:, 1:] for part in parts if part is not None))
    felt = {
        "states": lambda: lane_of(run.states, times, scene, values, 1),
        "lanes": lambda: list(lanes_of(run.states, times, [0, 1]))[1],
        "course": lambda: machine(scene, values, course, 1),
        "courses": lambda: list(machines(scene, values, course, [0, 1]))[1],
    }[how]()
    expected = np.stack([-RIM * rate**2, RIM * change], axis=1)
    assert felt.specific_force(scene.markers["rim"]) == pytest.approx(expected, abs=1e-7)
    assert felt.turns[:, 0] == pytest.approx(WOUND + x, abs=1e-8)
