"""Starts of random machines against closed forms of linkages: what is stated is kept, the rest follows."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.simulate import simulate
from shoal.mechanics.start.closure import Closure
from shoal.mechanics.start.start import complete, is_direct
from shoal.scene import Scene, load_scene


class State(NamedTuple):
    """Origin [m], angle [rad] and their rates of one body."""

    place: complex
    angle: float
    speed: complex
    rate: float


States = dict[str, State]


class Machine(NamedTuple):
    """A scene without a start, and all its states for one angle or coordinate of the first body and its rate."""

    scene: dict[str, Any]
    lead: Callable[[State], tuple[float, float]]
    states: Callable[[float, float], list[States]]
    range: tuple[float, float]


def circles(a: complex, r: float, b: complex, s: float) -> list[complex]:
    """Where two circles meet."""
    d = abs(b - a)
    if not abs(r - s) < d < r + s:
        return []
    x = (d * d + r * r - s * s) / (2 * d)
    h = math.sqrt(r * r - x * x)
    return [a + (b - a) / d * complex(x, side * h) for side in (1, -1)]


def solved(one: complex, other: complex, right: complex) -> tuple[float, float]:
    """Real x, y with x one + y other = right."""
    x, y = np.linalg.solve([[one.real, other.real], [one.imag, other.imag]], [right.real, right.imag])
    return float(x), float(y)


def bar(length: float, rng: np.random.Generator) -> dict[str, Any]:
    centre = [float(rng.uniform(0, length)), float(rng.uniform(-0.1, 0.1))]
    return {"kind": "rigid-body", "mass": float(rng.uniform(0.1, 5)), "inertia": float(rng.uniform(0.01, 1)),
            "centre_of_mass": centre, "named_points": {"end": [length, 0.0]}}  # fmt: skip


def rod(length: float, rng: np.random.Generator) -> dict[str, Any]:
    return {"kind": "rod", "length": length, "height": 0.01, "width": 0.02, "density": 2700.0, "element": "ancf-cable",
            "youngs_modulus": float(10 ** rng.uniform(8, 11)), "elements": int(rng.integers(1, 4))}  # fmt: skip


def pin(first: str, at: Any, second: str, point: str = "start") -> dict[str, Any]:
    return {"first": {"body": first, "point": at}, "second": {"body": second, "point": point}}


def scene(bodies: dict[str, Any], joints: dict[str, Any]) -> dict[str, Any]:
    return {"name": "drawn", "bodies": bodies, "joints": joints, "markers": {"m": {"body": next(iter(bodies))}}}


def crank(state: State) -> tuple[float, float]:
    return state.angle, state.rate


def dyad(lengths: tuple[float, float], a: complex, va: complex, p: complex, vp: complex) -> list[tuple[State, State]]:
    """Two bars from a and p that meet."""
    found = []
    for b in circles(a, lengths[0], p, lengths[1]):
        c, d = b - a, b - p
        w2, w3 = solved(1j * c, -1j * d, vp - va)
        found.append((State(a, cmath.phase(c), va, w2), State(p, cmath.phase(d), vp, w3)))
    return found


def four_bar(rng: np.random.Generator, equal: bool = False, joint: str = "bar", made: Any = (bar,)) -> Machine:
    """Crank a, coupler c, rocker b; equal: a parallelogram. joint: the coupler is a bar, or a distance."""
    l1, l2, l3 = rng.uniform(0.4, 2.0, 3)
    d = float(rng.uniform(0.5, 2.5))
    if equal:
        l2, l3 = d, l1
    bodies = {name: made[rng.integers(len(made))](float(length), rng)
              for name, length in (("a", l1), ("c", l2), ("b", l3))}  # fmt: skip
    joints: dict[str, Any] = {"O": pin("ground", [0.0, 0.0], "a"), "P": pin("ground", [d, 0.0], "b")}
    if joint == "bar":
        joints |= {"A": pin("a", "end", "c"), "B": pin("b", "end", "c", "end")}
    else:
        bodies.pop("c")
        joints["D"] = {"kind": "distance", "length": l2, **pin("a", "end", "b", "end")}

    def states(angle: float, rate: float) -> list[States]:
        a = l1 * cmath.exp(1j * angle)
        first = State(0j, angle, 0j, rate)
        pairs = dyad((l2, l3), a, 1j * rate * a, complex(d), 0j)
        found = [{"a": first, "c": c, "b": b} for c, b in pairs]
        return found if joint == "bar" else [{"a": s["a"], "b": s["b"]} for s in found]

    return Machine(scene(bodies, joints), crank, states, (-math.pi, math.pi))


def six_bar(rng: np.random.Generator) -> Machine:
    """A four-bar whose rocker drives a second loop."""
    first = four_bar(rng)
    q, e, f = complex(rng.uniform(2, 4), rng.uniform(-1, 1)), float(rng.uniform(0.5, 2.5)), float(rng.uniform(0.5, 2.5))
    bodies = first.scene["bodies"] | {"e": bar(e, rng), "f": bar(f, rng)}
    joints = first.scene["joints"] | {"B2": pin("b", "end", "e"), "Q": pin("ground", [q.real, q.imag], "f"),
                                      "C": pin("e", "end", "f", "end")}  # fmt: skip

    def states(angle: float, rate: float) -> list[States]:
        found = []
        for one in first.states(angle, rate):
            b, length = one["b"], first.scene["bodies"]["b"]["named_points"]["end"][0]
            arm = length * cmath.exp(1j * b.angle)
            pairs = dyad((e, f), b.place + arm, 1j * b.rate * arm, q, 0j)
            found += [one | {"e": x, "f": y} for x, y in pairs]
        return found

    return Machine(scene(bodies, joints), crank, states, first.range)


def slider_crank(rng: np.random.Generator) -> Machine:
    """Crank a, rod c, block s on an inclined line beside the crank's pivot."""
    l1, l2 = sorted(rng.uniform(0.4, 2.0, 2))
    base, along = 1j * rng.uniform(-0.2, 0.2), cmath.exp(1j * rng.uniform(-0.5, 0.5))
    bodies = {"a": bar(l1, rng), "c": bar(l2, rng), "s": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1}}
    line = {"kind": "slider", "direction": cmath.phase(along), "rotation": "locked"}
    joints = {"O": pin("ground", [0.0, 0.0], "a"), "A": pin("a", "end", "c"), "B": pin("s", "start", "c", "end"),
              "S": line | pin("ground", [base.real, base.imag], "s")}  # fmt: skip

    def states(angle: float, rate: float) -> list[States]:
        a = l1 * cmath.exp(1j * angle)
        off = (base - a) / along
        if not abs(off.imag) < l2:
            return []
        found = []
        for side in (1, -1):
            b = a + along * complex(side * math.sqrt(l2**2 - off.imag**2), off.imag)
            w2, speed = solved(1j * (b - a), -along, -1j * rate * a)
            found.append({"a": State(0j, angle, 0j, rate), "c": State(a, cmath.phase(b - a), 1j * rate * a, w2),
                          "s": State(b, 0.0, along * speed, 0.0)})  # fmt: skip
        return found

    return Machine(scene(bodies, joints), crank, states, (-math.pi, math.pi))


def trammel(rng: np.random.Generator) -> Machine:
    """A rod whose ends slide on two lines."""
    length, base = float(rng.uniform(0.4, 2)), complex(rng.uniform(-1, 1), rng.uniform(-1, 1))
    first = float(rng.uniform(-math.pi, math.pi))
    one, other = cmath.exp(1j * first), cmath.exp(1j * (first + rng.uniform(0.6, 2.5)))
    joints = {
        "X": {"kind": "slider", "direction": cmath.phase(one), **pin("ground", [0.0, 0.0], "r")},
        "Y": {"kind": "slider", "direction": cmath.phase(other), **pin("ground", [base.real, base.imag], "r", "end")},
    }

    def states(angle: float, rate: float) -> list[States]:
        arm = length * cmath.exp(1j * angle)
        s, _ = solved(one, -other, base - arm)
        speed, _ = solved(one, -other, -1j * rate * arm)
        return [{"r": State(s * one, angle, speed * one, rate)}]

    return Machine(scene({"r": bar(length, rng)}, joints), crank, states, (-math.pi, math.pi))


def coupled(rng: np.random.Generator) -> Machine:
    """Two blocks on lines whose coordinates are coupled."""
    angles = rng.uniform(0.3, 1.2, 2)
    one, other = (cmath.exp(1j * a) for a in angles)
    factor, total = float(rng.choice([-1, 1]) * rng.uniform(0.5, 3)), float(rng.uniform(-1, 1))
    block = {"kind": "point-mass", "mass": 1.0}
    joints = {
        "S": {"kind": "slider", "direction": float(angles[0]), **pin("ground", [0.0, 0.0], "p")},
        "T": {"kind": "slider", "direction": float(angles[1]), **pin("ground", [1.0, 0.0], "q")},
        "K": {"kind": "coupling", "value": total, "terms": [{"at": {"body": "p"}, "axis": "x"},
              {"at": {"body": "q"}, "axis": "y", "factor": factor}]},
    }  # fmt: skip

    def states(x: float, rate: float) -> list[States]:
        t, speed = (total - x) / factor / other.imag, -rate / factor / other.imag
        p = State(x / one.real * one, 0.0, rate / one.real * one, 0.0)
        return [{"p": p, "q": State(1 + t * other, 0.0, speed * other, 0.0)}]

    def lead(state: State) -> tuple[float, float]:
        return state.place.real, state.speed.real

    return Machine(scene({"p": block, "q": block}, joints), lead, states, (-1.0, 1.0))


KINDS: dict[str, Callable[[np.random.Generator], Machine]] = {
    "four-bar": four_bar,
    "parallelogram": lambda rng: four_bar(rng, equal=True),
    "flexible": lambda rng: four_bar(rng, made=(rod, rod, bar)),
    "distance": lambda rng: four_bar(rng, joint="distance"),
    "six-bar": six_bar,
    "slider-crank": slider_crank,
    "trammel": trammel,
    "coupled": coupled,
}


def drawn(kind: str, rng: np.random.Generator) -> tuple[Machine, States]:
    """A machine and one of its states."""
    while True:
        machine = KINDS[kind](rng)
        found = machine.states(float(rng.uniform(*machine.range)), float(rng.uniform(-3, 3)))
        if found and max(abs(state.rate) + abs(state.speed) for one in found for state in one.values()) < 15:
            return machine, found[rng.integers(len(found))]


def values(name: str, state: State) -> dict[str, Any]:
    """All that can be stated of a body."""
    moving = {"position": [state.place.real, state.place.imag], "velocity": [state.speed.real, state.speed.imag]}
    return moving if name in "pq" else {"angle": state.angle, "rate": state.rate, **moving}


def some(states: States, rng: np.random.Generator) -> dict[str, Any]:
    """A random choice of statements that holds at least one of a place and one of a motion."""
    every = [(name, key, value) for name, one in states.items() for key, value in values(name, one).items()]
    telling = [e for e in every if e[1] in ("angle", "position") and (e[0] not in "abf" or e[1] == "angle") and
               e[:2] != ("s", "angle") and not (e[:2] == ("c", "angle") and abs(e[2]) < 1e-9)]  # fmt: skip
    moving = [e for e in every if e[1] in ("rate", "velocity") and (e[0] not in "abf" or e[1] == "rate") and
              e[:2] != ("s", "rate") and not (e[:2] == ("c", "rate") and abs(e[2]) < 1e-9)]  # fmt: skip
    chosen = [telling[rng.integers(len(telling))], moving[rng.integers(len(moving))]]
    chosen += [e for e in every if rng.uniform() < 0.25]
    order = rng.permutation(len(chosen))
    start: dict[str, Any] = {}
    for name, key, value in (chosen[k] for k in order):
        start.setdefault(name, {})[key] = value
    return start


def apart(found: State, told: State) -> float:
    turn = abs(cmath.phase(cmath.exp(1j * (found.angle - told.angle))))
    return max(abs(found.place - told.place), turn, abs(found.speed - told.speed), abs(found.rate - told.rate))


def state_of(scene: Scene, name: str) -> State:
    one = scene.initial[name]
    assert one.position is not None
    assert one.velocity is not None
    return State(complex(*one.position), float(one.angle or 0.0), complex(*one.velocity), float(one.rate or 0.0))


def misses(kind: str, seed: int) -> float:
    """How far a start is from the closed form that agrees with all that was stated; nan where it was refused."""
    rng = np.random.default_rng([seed, *kind.encode()])
    machine, states = drawn(kind, rng)
    start = some(states, rng)
    try:
        done = complete(Scene.parse({**machine.scene, "initial": start})).scene
    except InputError:
        return math.nan
    found = {name: state_of(done, name) for name in states}
    first = next(iter(states))
    told = machine.states(*machine.lead(found[first]))
    closed = min((max(apart(found[n], one[n]) for n in states) for one in told), default=math.inf)
    kept = [np.max(np.abs(np.subtract(getattr(done.initial[name], key), value)))
            for name, one in start.items() for key, value in one.items()]  # fmt: skip
    return max(closed / (1 + max(abs(s.speed) + abs(s.rate) for s in found.values())), 1e6 * max(kept))


def refused(kind: str, seed: int) -> str:
    """What is said of a start whose last statement contradicts the first, by its angle or rate; empty if accepted."""
    rng = np.random.default_rng([seed, 7, *kind.encode()])
    while True:
        machine, states = drawn(kind, rng)
        first, *_, last = states
        lead, rate = machine.lead(states[first])
        others = machine.states(lead, rate)
        start = {first: {k: v for k, v in values(first, states[first]).items() if k in ("angle", "rate")}}
        if rng.uniform() < 0.5:
            wrong = float(states[last].angle + rng.choice([-1, 1]) * rng.uniform(0.02, 1.0))
            start[last] = {"angle": wrong}
            off = min(abs(cmath.phase(cmath.exp(1j * (one[last].angle - wrong)))) for one in others)
        else:
            wrong = float(
                states[last].rate + rng.choice([-1, 1]) * rng.uniform(0.02, 1.0) * (1 + abs(states[last].rate))
            )
            start = {name: {"angle": one.angle} for name, one in states.items()} | start
            start[last] = start.get(last, {}) | {"rate": wrong}
            off = abs(states[last].rate - wrong)
        if off > 0.02:
            break
    try:
        complete(Scene.parse({**machine.scene, "initial": start}))
    except InputError as error:
        return str(error)
    return ""


@pytest.mark.parametrize("kind", KINDS)
def test_a_start_keeps_what_is_stated_and_agrees_with_the_closed_form(kind: str) -> None:
    assert max(misses(kind, seed) for seed in range(6)) < 1e-9


@pytest.mark.parametrize("kind", ["four-bar", "distance"])
def test_a_contradiction_is_refused_by_name(kind: str) -> None:
    for seed in range(3):
        text = refused(kind, seed)
        assert text.startswith("initial.b.")
        assert "joint" in text
        assert "\n" not in text


@pytest.mark.parametrize("seed", range(4))
def test_flexible_rods_of_a_loop_start_straight_where_the_linkage_puts_them(seed: int) -> None:
    machine, states = drawn("flexible", np.random.default_rng(seed))
    markers = {name: {"body": name, "point": "end"} for name in states}
    start = {"a": {"angle": states["a"].angle, "rate": states["a"].rate}, "c": {"angle": states["c"].angle}}
    run = simulate(Scene.parse({**machine.scene, "markers": markers, "initial": start}), np.zeros(1))
    for number, name in enumerate(markers):
        body, told = machine.scene["bodies"][name], states[name]
        length = body["length"] if body["kind"] == "rod" else body["named_points"]["end"][0]
        end = told.place + length * cmath.exp(1j * told.angle)
        speed = told.speed + 1j * told.rate * length * cmath.exp(1j * told.angle)
        assert complex(*run.points[0, number, :, 0]) == pytest.approx(end, abs=1e-9)
        assert complex(*run.velocities[0, number, :, 0]) == pytest.approx(speed, abs=1e-8)
        assert run.rates[0, number, 0] == pytest.approx(told.rate, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_starts_of_many_machines(kind: str) -> None:
    assert max(misses(kind, seed) for seed in range(100, 250)) < 1e-9


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["four-bar", "parallelogram", "distance", "six-bar"])
def test_contradictions_of_many_machines(kind: str) -> None:
    for seed in range(100, 130):
        text = refused(kind, seed)
        assert text.startswith("initial.")
        assert "\n" not in text


RHOMBUS = four_bar(np.random.default_rng(3), equal=True).scene


def done(data: dict[str, Any], **start: Any) -> Scene:
    return complete(Scene.parse({**data, "initial": start})).scene


def test_a_rate_that_is_not_stated_follows_and_a_stated_zero_contradicts() -> None:
    """A parallelogram: both cranks turn alike, and the coupler does not turn."""
    angles = {name: {"angle": 1.2} for name in "ab"}
    found = done(RHOMBUS, **angles | {"b": {"angle": 1.2, "rate": 2.0}})
    assert found.initial["a"].rate == pytest.approx(2.0, abs=1e-12)
    assert found.initial["b"].rate == 2.0
    assert found.initial["c"].rate == pytest.approx(0.0, abs=1e-12)
    still = {"a": {"angle": 1.2, "rate": 0.0}, "b": {"angle": 1.2, "rate": 2.0}}
    with pytest.raises(InputError, match=r"initial\.b\.rate: 2 rad/s contradicts initial\.a\.rate = 0: joint B"):
        done(RHOMBUS, **still)


def test_digits_that_were_rounded_are_corrected_in_the_order_of_the_scene() -> None:
    rng = np.random.default_rng(0)
    machine, states = drawn("four-bar", rng)
    start = {name: {"angle": round(states[name].angle, 6)} for name in ("b", "a", "c")}
    found = done(machine.scene, **start)
    assert found.initial["b"].angle == start["b"]["angle"]
    for name in "ac":
        assert 0 < abs(found.initial[name].angle - start[name]["angle"]) < 1e-4


def test_a_pinned_body_keeps_no_other_place_or_velocity() -> None:
    with pytest.raises(InputError, match=r"initial\.a\.position: \[0\.5, 0\] m cannot be kept: joint O would"):
        done(RHOMBUS, a={"position": [0.5, 0.0]})
    with pytest.raises(InputError, match=r"initial\.a\.velocity: \[0, 3\] m/s cannot be kept: joint O asks"):
        done(RHOMBUS, a={"angle": 1.0, "velocity": [0.0, 3.0]})


def test_two_angles_that_a_joint_ties_are_kept_or_refused() -> None:
    bodies = {name: bar(1.0, np.random.default_rng(1)) for name in "ab"}
    joints = {"O": pin("ground", [0.0, 0.0], "a"), "A": {"kind": "weld", "angle": 0.5, **pin("a", "end", "b")}}
    assert done(scene(bodies, joints), b={"angle": 0.7}).initial["a"].angle == pytest.approx(0.2, abs=1e-12)
    with pytest.raises(InputError, match=r"initial\.b\.angle: 0\.7 rad contradicts initial\.a\.angle = 0\.3: joint A"):
        done(scene(bodies, joints), a={"angle": 0.3}, b={"angle": 0.7})


def test_what_is_set_moves_the_rest_of_a_loop_and_lanes_without_a_start_are_marked() -> None:
    rng = np.random.default_rng(0)
    machine, states = drawn("four-bar", rng)
    stated = Scene.parse({**machine.scene, "initial": {name: {"angle": one.angle} for name, one in states.items()}})
    near = states["a"].angle + 0.1
    found = {name: state_of(complete(stated.with_values({"initial.a.angle": near})).scene, name) for name in states}
    told = machine.states(near, 0.0)
    assert min(max(apart(found[n], one[n]) for n in states) for one in told) < 1e-9
    lanes = complete(stated.with_lanes({"initial.a.angle": np.array([states["a"].angle, near])}))
    assert not np.any(lanes.failed)
    assert lanes.scene.initial["b"].angle[1] == pytest.approx(found["b"].angle, abs=1e-9)
    lengths = np.array([stated.bodies["c"].points["end"][0], 50.0])
    assert list(complete(stated.with_lanes({"bodies.c.named_points.end.0": lengths})).failed) == [False, True]


def test_a_folded_parallelogram_moves_on_one_of_its_branches() -> None:
    """Bars in one line: rates that only the first derivative of the joints allows are no motion."""
    flat = {name: {"angle": 0.0} for name in "abc"}
    found = done(RHOMBUS, **flat | {"a": {"angle": 0.0, "rate": 1.0}, "c": {"angle": 0.0, "rate": 0.0}})
    assert found.initial["b"].rate == pytest.approx(1.0, abs=1e-9)
    free = done(RHOMBUS, **flat | {"a": {"angle": 0.0, "rate": 1.0}}).initial
    crank, rocker, rod = (free[name].rate for name in "abc")
    l1, l2 = (RHOMBUS["bodies"][name]["named_points"]["end"][0] for name in "ac")
    # The second derivative of the loop along its line: l1 a^2 + l2 c^2 = l1 b^2.
    assert l1 * crank**2 + l2 * rod**2 == pytest.approx(l1 * rocker**2, abs=1e-8)
    wrong = {"a": {"angle": 0.0, "rate": 1.0}, "b": {"angle": 0.0, "rate": 0.5}}
    wrong["c"] = {"angle": 0.0, "rate": l1 * (0.5 - 1.0) / l2}
    with pytest.raises(InputError, match="allow no"):
        done(RHOMBUS, **wrong)


def test_open_chains_take_the_direct_path() -> None:
    bodies = {name: bar(1.0, np.random.default_rng(1)) for name in "ab"}
    joints = {"O": pin("ground", [0.0, 0.0], "a"), "A": pin("a", "end", "b")}
    chain = scene(bodies, joints)
    assert is_direct(Scene.parse(chain))
    assert not is_direct(Scene.parse({**chain, "initial": {"b": {"position": [0.0, 1.0]}}}))
    found = done(chain, a={"rate": 1.0})
    assert found.initial["b"].rate == pytest.approx(0.0, abs=1e-15)
    assert done(chain, b={"position": [0.0, 1.0]}).initial["a"].angle == pytest.approx(np.pi / 2, abs=1e-9)


@pytest.mark.parametrize(("rate", "told"), [(3000.0, set()), (1.0, {"velocity"})])
def test_round_off_is_told_by_the_speed_of_the_machine(rate: float, told: set[str]) -> None:
    """A joint holds the body where a velocity is stated; one of 6e-10 m/s is round-off beside 30 m/s on 1 cm."""
    bodies = {"a": {"kind": "rigid-body", "mass": 1.0, "inertia": 1e-5}}
    data = scene(bodies, {"O": pin("ground", [0.0, 0.0], "a", [0.0, 0.0])})
    data["markers"] = {"m": {"body": "a", "point": [0.01, 0.0]}}
    data["initial"] = {"a": {"angle": 0.0, "rate": rate, "velocity": [6e-10, 0.0]}}
    run = simulate(Scene.parse(data), np.array([0.001]))
    assert run.ok, run.message
    assert set(run.model["initial_changes"].get("a", {})) == told


def test_a_weight_between_two_bars_in_one_line_stays() -> None:
    """A truss that only the second derivative of its joints holds."""
    sides = {"L": [-1.0, 0.0], "R": [1.0, 0.0]}
    joints = {name: {"kind": "distance", **pin("ground", place, "m")} for name, place in sides.items()}
    data = scene({"m": {"kind": "point-mass", "mass": 1.0}}, joints) | {"initial": {"m": {"position": [0.0, 0.0]}}}
    run = simulate(Scene.parse(data), np.array([0.5, 1.0]))
    assert run.ok, run.message
    assert np.max(np.abs(run.marker("m"))) < 1e-8
    assert run.model["initial_changes"] == {}
    assert run.model["redundant_joints"] == ["L", "R"]


def test_what_the_start_changes_is_reported_by_body() -> None:
    machine, states = drawn("four-bar", np.random.default_rng(0))
    stated = Scene.parse({**machine.scene, "initial": {name: {"angle": one.angle} for name, one in states.items()}})
    run = simulate(stated.with_values({"initial.a.angle": states["a"].angle + 0.1}), np.array([0.01]))
    assert set(run.model["initial_changes"]) == {"b", "c"}
    moved = run.model["initial_changes"]["b"]["angle"]
    assert moved["stated"] == states["b"].angle
    assert moved["used"] == run.model["initial"]["b"]["angle"]
    assert run.model["initial_correction"] > 0.01
    assert run.model["redundant_joints"] == []


@pytest.mark.parametrize("kind", ["parallel", "perpendicular"])
def test_a_point_mass_has_no_direction_to_hold(kind: str) -> None:
    joints = {"J": {"kind": kind, **pin("p", "start", "q")}}
    free = {"initial": {name: {"position": [0.0, 0.0]} for name in "pq"}}
    with pytest.raises(InputError, match=r"joints\.J.*: p is a point mass, which has no direction"):
        Scene.parse(scene({name: {"kind": "point-mass", "mass": 1.0} for name in "pq"}, joints) | free)


def test_a_long_chain_that_cannot_be_assembled_is_not_sought_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """A crank six times too long in the first of twelve loops: the gaps of the joints are looked at a few times."""
    looked = []
    rows = Closure.rows
    monkeypatch.setattr(Closure, "rows", lambda self, u: looked.append(len(u)) or rows(self, u))
    scene = load_scene("n-four-bar-12")
    path = "bodies.crank0.named_points.end.0"
    with pytest.raises(InputError, match=r"^joints\.C1: cannot be assembled; its places stay 5 m apart at best$"):
        complete(scene.with_values({path: 5 * scene.value(path) + 1.0}))
    assert sum(looked) < 3000


def looked(monkeypatch: pytest.MonkeyPatch, scene: Scene) -> tuple[str, int]:
    """How a scene is refused, and how often the gaps of its joints are looked at."""
    counted: list[int] = []
    rows = Closure.rows
    monkeypatch.setattr(Closure, "rows", lambda self, u: counted.append(len(u)) or rows(self, u))
    with pytest.raises(InputError) as refusal:
        complete(scene)
    return str(refusal.value), len(counted)


def test_a_contradiction_of_many_statements_is_not_narrowed_down_for_long(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a closed chain of thirty bars every angle is stated: the last contradicts others, which are not sought to the
    end.
    """
    rng = np.random.default_rng(1)
    bars = {f"r{k}": bar(0.4, rng) for k in range(30)}
    joints = {f"J{k}": pin(f"r{k}", "end", f"r{k + 1}") for k in range(29)}
    joints |= {"O": pin("ground", [0.0, 0.0], "r0"), "E": pin("r29", "end", "ground", [6.0, 0.0])}  # type: ignore[dict-item]
    start = {name: {"angle": float(rng.uniform(-0.3, 0.3))} for name in bars}
    text, count = looked(monkeypatch, Scene.parse(scene(bars, joints) | {"initial": start}))
    assert text.startswith("initial.r29.angle: ")
    assert "more: joint E would stay" in text
    assert "leave some of them out" in text
    assert count < 900


def test_a_contradiction_names_the_mechanism_that_gapes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seven four-bars in one scene: the crank of the sixth points where its coupler does not reach."""
    rng = np.random.default_rng(2)
    bodies, joints, start = {}, {}, {}
    for k in range(7):
        bodies |= {f"{name}{k}": bar(length, rng) for name, length in (("a", 1.0), ("b", 1.0), ("c", 1.2))}
        joints[f"O{k}"], joints[f"A{k}"] = pin("ground", [9.0 * k, 0.0], f"a{k}"), pin(f"a{k}", "end", f"b{k}")
        joints[f"B{k}"] = pin(f"b{k}", "end", f"c{k}", "end")
        joints[f"C{k}"] = pin("ground", [9.0 * k + 2.0, 0.0], f"c{k}")
        start[f"a{k}"] = {"angle": 3.0 if k == 5 else 0.7}
    text, count = looked(monkeypatch, Scene.parse(scene(bodies, joints) | {"initial": start}))
    assert text.startswith("initial.a5.angle: 3 rad cannot be kept: joint C5 would stay ")
    assert count < 900


@pytest.mark.parametrize("digits", [4, 6, 9])
def test_rounded_places_of_a_machine_that_holds_itself_twice_are_said_to_be_rounded(digits: int) -> None:
    """Three cranks in a row under one bar, which without its angle would turn over: none is told to be left out."""
    rng, lead = np.random.default_rng(3), np.round(np.exp(0.7j) * np.arange(3), digits)
    feet = {f"o{k}": pin("ground", [float(z.real), float(z.imag)], f"k{k}") for k, z in enumerate(lead)}
    heads = {f"p{k}": pin(f"k{k}", "end", "bar", [float(k), 0.0]) for k in range(3)}  # type: ignore[arg-type]
    bodies = {**{f"k{k}": bar(0.3, rng) for k in range(3)}, "bar": bar(2.0, rng)}
    start = {**{f"k{k}": {"angle": 0.2} for k in range(3)}, "bar": {"angle": 0.7}}
    with pytest.raises(
        InputError, match=r"p\d would stay .* m apart, as rounded places or lengths do; state them with"
    ):
        complete(Scene.parse(scene(bodies, {**feet, **heads}) | {"initial": start}))


@pytest.mark.parametrize("seed", range(8))
def test_places_that_differ_by_rounding_only_are_no_measure_of_a_machine(seed: int) -> None:
    """A point that a coupling sets to the sum of others, which are at one place up to the last digits."""
    random = np.random.default_rng(seed)
    count, place = int(random.integers(2, 9)), float(random.uniform(0.1, 100.0))
    places = place * (1.0 + 10.0 ** random.uniform(-16, -3) * random.normal(size=count))
    names = [f"p{k}" for k in range(count)]
    terms = [{"at": {"body": name}, "axis": "x", "factor": -1.0} for name in names]
    scene = Scene.parse({
        "name": "sum",
        "bodies": {name: {"kind": "point-mass", "mass": 1.0} for name in ("S", *names)},
        "joints": {"c": {"kind": "coupling", "terms": [{"at": {"body": "S"}, "axis": "x"}, *terms]}},
        "markers": {"S": {"body": "S"}},
        "initial": {name: {"position": [float(x), 0.0]} for name, x in zip(names, places, strict=True)},
    })  # fmt: skip
    begun = complete(scene).scene.initial
    assert begun["S"].position[0] == pytest.approx(places.sum(), rel=1e-9)
    assert [begun[name].position[0] for name in names] == pytest.approx(places, rel=1e-9)
