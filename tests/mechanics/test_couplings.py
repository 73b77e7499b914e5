"""Couplings of angles, slides, distances and places: closed forms, scipy and MuJoCo."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.notebook import sweep
from shoal.scene import Scene

FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}
GROUND: dict[str, Any] = {"body": "ground", "point": [0.0, 0.0]}


def body(mass: float, inertia: Any, centre: Any = (0.0, 0.0)) -> dict[str, Any]:
    return {"kind": "rigid-body", "mass": mass, "inertia": inertia, "centre_of_mass": list(centre)}


def yo_yo(radius: float = 0.01) -> Scene:
    return Scene.parse({
        "name": "yo-yo", "bodies": {"disc": body(0.2, 8e-5)},
        "joints": {"guide": {"kind": "slider", "first": GROUND, "second": {"body": "disc", "point": [0.0, 0.0]},
                             "direction": np.pi / 2},
                   "string": {"kind": "coupling", "terms": [{"of": "position(disc, y)"},
                                                            {"of": "angle(disc)", "factor": radius}]}},
        "markers": {"disc": {"body": "disc"}, "edge": {"body": "disc", "point": [1.0, 0.0]}},
        "solver": {"duration": 1.0},
    })  # fmt: skip


@pytest.mark.parametrize(("integrator", "more", "bound"), [
    ("dop853", {"solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}, 1e-8),
    ("radau5", {"solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}, 1e-6),
    ("rk4", {"solver.step": 2e-4}, 1e-5),
    ("leapfrog", {"solver.step": 5e-5}, 1e-1),
    ("generalized-alpha", {"solver.step": 5e-5}, 1e-1),
])  # fmt: skip
def test_a_yo_yo_unwinds_by_fifteen_turns(integrator: str, more: dict[str, Any], bound: float) -> None:
    found = simulate(yo_yo().with_values({"solver.integrator": integrator, **more}), np.array([1.0]))
    assert found.ok, found.message
    place, edge = found.marker("disc")[0], found.marker("edge")[0]
    assert place[1] == pytest.approx(-0.981, abs=bound)
    assert edge - place == pytest.approx([np.cos(98.1), np.sin(98.1)], abs=bound)


def test_the_force_of_a_coupling_is_the_tension() -> None:
    assert reactions(yo_yo(), [0.1])[0].joints["string"].components["coupled"] == pytest.approx(1.5696, abs=1e-9)


def test_a_rope_over_a_pulley_with_inertia_has_two_tensions() -> None:
    """Atwood's machine; the references are closed forms."""
    masses = {"a": (3.0, 0.1), "b": (2.0, -0.1)}
    scene = Scene.parse({
        "name": "atwood",
        "bodies": {"wheel": body(1.0, 0.02), **{n: {"kind": "point-mass", "mass": m} for n, (m, _) in masses.items()}},
        "joints": {"axle": {"first": GROUND, "second": {"body": "wheel", "point": [0.0, 0.0]}},
                   **{f"guide-{n}": {"kind": "slider", "first": {"body": "ground", "point": [x, -1.0]},
                                     "second": {"body": n}, "direction": np.pi / 2} for n, (_, x) in masses.items()},
                   "left": {"kind": "coupling", "terms": [{"of": "position(a, y)"},
                                                          {"of": "angle(axle)", "factor": 0.1}]},
                   "right": {"kind": "coupling", "terms": [{"of": "slide(guide-b)"},
                                                           {"of": "angle(wheel)", "factor": -0.1}]}},
        "markers": {n: {"body": n} for n in masses},
        "initial": {n: {"position": [x, -1.0]} for n, (_, x) in masses.items()},
        "solver": {"duration": 0.8},
    })  # fmt: skip
    found = simulate(scene.with_values(FINE), np.array([0.8]))
    assert found.marker("a")[0][1] == pytest.approx(-1.4484571428571429, abs=1e-9)
    joints = reactions(scene, [0.1])[0].joints
    for name, tension in (("left", 25.22571428571429), ("right", 22.422857142857143)):
        assert joints[name].components["coupled"] == pytest.approx(tension, rel=1e-9)


def test_a_screw_lifts_its_nut() -> None:
    origin = {"body": "ground", "point": [0.0, 0.0, 0.0]}
    scene = Scene.parse({
        "name": "screw", "dimensions": 3, "gravity": [0.0, 0.0, -9.81],
        "bodies": {"nut": body(5.0, 0.01, [0.0] * 3), "screw": body(1.0, 1e-3, [0.0] * 3)},
        "joints": {"bar": {"kind": "slider", "axis": [0.0, 0.0, 1.0], "rotation": "locked", "first": origin,
                           "second": {"body": "nut", "point": [0.0] * 3}},
                   "pin": {"first": origin, "second": {"body": "screw", "point": [0.0] * 3}},
                   "thread": {"kind": "coupling", "terms": [{"of": "slide(bar)"},
                                                            {"of": "angle(pin)", "factor": -0.01 / (2 * np.pi)}]}},
        "loads": {"motor": {"kind": "torque", "at": {"body": "screw"}, "torque": 0.3}},
        "markers": {"nut": {"body": "nut"}}, "solver": {"duration": 1.0},
    })  # fmt: skip
    found = simulate(scene.with_values(FINE), np.array([1.0]))
    assert found.marker("nut")[0][2] == pytest.approx(0.3488020976602856 / 2, abs=1e-9)
    held = reactions(scene, [0.1])[0].joints["thread"].components["coupled"]
    assert held == pytest.approx(50.79401048830143, rel=1e-9)


def eyes(dimensions: int) -> Scene:
    """Two weights on a rope that slips through two eyes."""
    z = [0.0] * (dimensions - 2)
    return Scene.parse({
        "name": "eyes", "dimensions": dimensions, "gravity": [0.0, -9.81, *z],
        "bodies": {"a": {"kind": "point-mass", "mass": 1.0}, "b": {"kind": "point-mass", "mass": 1.7}},
        "joints": {"rope": {"kind": "coupling", "terms": [{"of": "distance(a, P)"}, {"of": "distance(b, Q)"}]}},
        "ground_points": {"P": {"x": 0.0, "y": 0.0}, "Q": {"x": 0.5, "y": 0.0}},
        "markers": {"a": {"body": "a"}, "b": {"body": "b"}},
        "initial": {"a": {"position": [0.3, -1.0, *z], "velocity": [1.0, 0.3, *z]}, "b": {"position": [0.9, -0.6, *z]}},
        "solver": {"duration": 0.6},
    })  # fmt: skip


@pytest.mark.parametrize("dimensions", [2, 3])
def test_a_sum_of_distances_is_that_of_scipy(dimensions: int) -> None:
    masses, eye = np.array([1.0, 1.7]), np.array([[0.0, 0.0], [0.5, 0.0]])

    def moves(_: float, x: Any) -> Any:
        place, rate = x[:4].reshape(2, 2), x[4:].reshape(2, 2)
        way = place - eye
        length = np.linalg.norm(way, axis=1)
        along = way / length[:, None]
        bias = np.sum((np.sum(rate**2, axis=1) - np.sum(along * rate, axis=1) ** 2) / length)
        weight = np.array([0.0, -9.81])
        tension = (np.sum(along @ weight) + bias) / np.sum(1.0 / masses)
        return np.concatenate([x[4:], (weight - tension * along / masses[:, None]).ravel()])

    ours = simulate(eyes(dimensions).with_values(FINE), np.array([0.0, 1e-6, 0.6]))
    assert ours.ok, ours.message
    begin = np.concatenate([ours.marker(name)[0][:2] for name in "ab"])
    rates = np.concatenate([(ours.marker(name)[1] - ours.marker(name)[0])[:2] for name in "ab"]) / 1e-6
    along = (begin.reshape(2, 2) - eye) / np.linalg.norm(begin.reshape(2, 2) - eye, axis=1)[:, None]
    assert np.sum(along * rates.reshape(2, 2)) == pytest.approx(0.0, abs=1e-4)
    # The start meets the rope: of the stated rate what does is kept, by least kinetic energy of the change.
    there = solve_ivp(moves, (0.0, 0.6), [*begin, *_began(dimensions)], rtol=1e-11, atol=1e-12).y[:4, -1]
    assert np.concatenate([ours.marker(name)[-1][:2] for name in "ab"]) == pytest.approx(there, abs=1e-8)


def _began(dimensions: int) -> Any:
    from shoal.mechanics.assembly.build import build

    model = build(eyes(dimensions))
    return np.concatenate([model.frames[name].origin.rate(model.v0[:, 0])[:2] for name in "ab"])


def pair(ratio: float, **more: Any) -> Scene:
    """Two arms on pins: the angle of the first and `ratio` times that of the second add up to those of the start."""
    arms = {name: body(1.0, 0.05, [0.4, 0.0]) for name in ("a", "b")}
    pins = {f"pin-{n}": {"first": {"body": "ground", "point": [x, 0.0]}, "second": {"body": n, "point": [0.0, 0.0]}}
            for n, x in (("a", 0.0), ("b", 2.0))}  # fmt: skip
    terms = [{"of": "angle(pin-a)"}, {"of": "angle('pin-b')", "factor": ratio}]
    return Scene.parse({
        "name": "pair", "bodies": arms, "joints": {**pins, "K": {"kind": "coupling", "terms": terms}},
        "markers": {n: {"body": n, "point": [1.0, 0.0]} for n in arms},
        "initial": {"a": {"angle": 0.3}, "b": {"angle": -0.4}}, "solver": {"duration": 3.0},
    } | more)  # fmt: skip


def ends_of(ratio: float, rate: float, time: float) -> tuple[float, float]:
    """Angles of both arms by scipy, from a rate of the first."""
    inertia, weight = 0.05 + 0.4**2, 9.81 * 0.4

    def moves(_: float, x: Any) -> Any:
        other = -0.4 - (x[0] - 0.3) / ratio
        return [x[1], -weight * (np.cos(x[0]) - np.cos(other) / ratio) / (inertia * (1.0 + 1.0 / ratio**2))]

    angle = float(solve_ivp(moves, (0.0, time), [0.3, rate], rtol=1e-12, atol=1e-12).y[0, -1])
    return angle, -0.4 - (angle - 0.3) / ratio


@pytest.mark.parametrize("ratio", [0.5, 2.0**0.5])
def test_two_angles_of_any_ratio_over_whole_turns(ratio: float) -> None:
    found = simulate(pair(ratio, initial={"a": {"angle": 0.3, "rate": 9.0}, "b": {"angle": -0.4}}).with_values(FINE),
                     np.array([3.0]))  # fmt: skip
    assert found.ok, found.message
    angle, other = ends_of(ratio, 9.0, 3.0)
    assert abs(angle) > 2 * np.pi
    assert found.marker("a")[0] == pytest.approx([np.cos(angle), np.sin(angle)], abs=1e-7)
    assert found.marker("b")[0] == pytest.approx([2.0 + np.cos(other), np.sin(other)], abs=1e-7)


@pytest.mark.parametrize("integrator", ["rk4", "leapfrog", "semi-implicit-euler", "generalized-alpha", "radau5",
                                        "implicit-gauss", "energy-momentum"])  # fmt: skip
def test_every_integrator_counts_turns(integrator: str) -> None:
    scene = pair(2.0**0.5).with_values({"solver.integrator": integrator, "solver.step": 2e-4})
    found = simulate(scene, np.array([1.0]))
    assert found.ok, found.message
    angle, _ = ends_of(2.0**0.5, 0.0, 1.0)
    bound = {"semi-implicit-euler": 2e-2, "implicit-gauss": 2e-2, "generalized-alpha": 1e-4, "energy-momentum": 1e-4}
    assert found.marker("a")[0] == pytest.approx([np.cos(angle), np.sin(angle)], abs=bound.get(integrator, 1e-5))


def test_factors_vary_from_lane_to_lane() -> None:
    """Each as alone: a ratio of whole teeth among others as well."""
    ratios = [0.5, 0.7, 2.0**0.5]
    found = sweep(pair(0.5).with_values(FINE), {"joints.K.terms.1.factor": ratios}, 1.0).positions
    for k, ratio in enumerate(ratios):
        angle, other = ends_of(ratio, 0.0, 1.0)
        assert found["a"][k] == pytest.approx([np.cos(angle), np.sin(angle)], abs=1e-7)
        assert found["b"][k] == pytest.approx([2.0 + np.cos(other), np.sin(other)], abs=1e-7)


@pytest.mark.parametrize("ratio", [0.5, 2.0**0.5])
def test_rest_modes_and_forces_of_coupled_arms(ratio: float) -> None:
    """Where both weights balance, the stiffness of the one angle that is left, and the torque of the coupling."""
    rest = statics(pair(ratio, initial={"a": {"angle": -1.3}, "b": {"angle": -1.0}}))
    assert rest.ok, rest.message
    (x, y), (u, v) = (rest.marker(name) for name in "ab")
    weight, inertia = 9.81 * 0.4, 0.05 + 0.4**2
    assert x - (u - 2.0) / ratio == pytest.approx(0.0, abs=1e-9)
    found = modes(pair(ratio, initial={"a": {"angle": -1.3}, "b": {"angle": -1.0}}))
    stiffness = -weight * (y + v / ratio**2) / (inertia * (1 + ratio**-2))
    assert abs(found.modes[0].eigenvalue) == pytest.approx(np.sqrt(stiffness), rel=1e-7)


def test_a_coupling_may_be_driven() -> None:
    """A way of a slider less a part of an angle follows a function; both are measured as signals measure them."""
    scene = Scene.parse({
        "name": "driven", "gravity": [0.0, 0.0], "bodies": {"bar": body(1.0, 0.1), "wheel": body(2.0, 0.03)},
        "joints": {"guide": {"kind": "slider", "first": GROUND, "second": {"body": "bar", "point": [0.0, 0.0]},
                             "rotation": "locked"},
                   "axle": {"first": GROUND, "second": {"body": "wheel", "point": [0.0, 0.0]}},
                   "rack": {"kind": "coupling", "terms": [{"of": "slide(guide)"}, {"of": "angle(axle)", "factor": 0.2}],
                            "value": "0.5 + 3*t**2"}},
        "markers": {"bar": {"body": "bar"}}, "solver": {"duration": 1.0}, "initial": {"wheel": {"angle": 0.5}},
    })  # fmt: skip
    found = simulate(scene.with_values(FINE), np.array([0.0, 1.0]))
    assert found.ok, found.message
    # The force f moves the bar by f/m and the wheel by r f/J; the sum by f (1/m + r^2/J) = 6 m/s^2.
    force = 6.0 / (1.0 + 0.2**2 / 0.03)
    assert found.marker("bar")[:, 0] == pytest.approx([0.4, 0.4 + force / 2], abs=1e-9)


def test_backlash_of_a_sum_with_angles() -> None:
    """A rack that hits the teeth of its pinion: the play of the rack, then momentum along the coupling."""
    scene = Scene.parse({
        "name": "rattle", "gravity": [0.0, 0.0], "bodies": {"bar": body(1.0, 0.1), "wheel": body(2.0, 0.03)},
        "joints": {"guide": {"kind": "slider", "first": GROUND, "second": {"body": "bar", "point": [0.0, 0.0]},
                             "rotation": "locked"},
                   "axle": {"first": GROUND, "second": {"body": "wheel", "point": [0.0, 0.0]}},
                   "rack": {"kind": "coupling", "backlash": 0.02, "restitution": 0.5,
                            "terms": [{"of": "slide(guide)"}, {"of": "angle(axle)", "factor": -0.2}]}},
        "markers": {"bar": {"body": "bar"}}, "solver": {"duration": 0.2},
        "initial": {"bar": {"velocity": [0.1, 0.0]}, "wheel": {"rate": 0.0}},
    })  # fmt: skip
    found = simulate(scene, np.array([0.2]))
    assert found.ok, found.message
    # It meets the teeth after 0.01 m at 0.1 s; the impulse of (1 + e) v/(1/m + r^2/J) leaves the bar this rate.
    rate = 0.1 - 1.5 * 0.1 / (1.0 + 0.2**2 / 0.03)
    assert found.marker("bar")[0][0] == pytest.approx(0.01 + 0.1 * rate, abs=1e-9)


@pytest.mark.parametrize(("terms", "message"), [
    ([{"of": "angle(x)"}], "joints.K.terms.0.of: angle(x): no joint or body 'x'; of this kind there are pin-a, pin-b"),
    ([{"of": "slide(pin-a)"}], "joints.K.terms.0.of: slide(pin-a): joint 'pin-a' is revolute"),
    ([{"of": "rate(pin-a)"}], "of: one of angle, slide, distance and position of a machine, found 'rate(pin-a)'"),
    ([{"of": "2*angle(pin-a)"}], "found '2*angle(pin-a)'"),
    ([{"of": "distance(a, a)"}], "joints.K.terms.0.of: distance(a, a)"),
    ([{"factor": 2.0}], "a term is `of` a measure, or `at` a place along an `axis`"),
    ([{"of": "angle(pin-a)", "axis": "x"}], "a term is `of` a measure"),
])  # fmt: skip
def test_what_cannot_be_coupled_is_refused_by_its_field(terms: list[dict[str, Any]], message: str) -> None:
    data = pair(1.0).model_dump(mode="json", exclude_unset=True)
    data["joints"]["K"]["terms"] = terms
    with pytest.raises(InputError) as refused:
        Scene.parse(data)
    assert message in str(refused.value)


def test_a_distance_without_a_direction_is_refused() -> None:
    data = eyes(2).model_dump(mode="json", exclude_unset=True)
    data["initial"]["a"] = {"position": [0.0, 0.0]}
    with pytest.raises(InputError, match=r"joints.rope: two places that follow each other are 0 m apart at the start"):
        simulate(Scene.parse(data), np.array([0.0]))


def test_a_driven_angle_in_space_is_refused_in_a_coupling() -> None:
    data = pair(1.0).model_dump(mode="json", exclude_unset=True)
    data |= {"dimensions": 3}
    data["joints"]["K"]["value"] = "t"
    with pytest.raises(
        InputError, match=r"joints.K.value: in space a sum with an angle \(terms.0\) is that of the start"
    ):
        Scene.parse(data)
