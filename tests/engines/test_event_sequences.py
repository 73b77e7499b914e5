"""Second runs compare events of contacts: equal words, near misses, the order of impacts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shoal
from scipy.integrate import quad, solve_ivp
from scipy.special import ellipj, ellipk
from shoal.engines.event_comparison import compare
from shoal.scene import Scene

DOWN, HIGH = -np.pi / 2, np.pi / 3
PULL = 1.5 * 9.81
"""Of a uniform rod of 1 m on a pin: its angle x from below obeys x'' = -PULL sin x [1/s^2]."""


def rod(stop: float, restitution: float = 1.0, **solver: Any) -> Scene:
    """Return the rod let go at HIGH, with a stop at an angle from below [rad]."""
    body = {"kind": "rigid-body", "mass": 1.0, "inertia": 1 / 12, "centre_of_mass": [0.5, 0.0],
            "named_points": {"end": [1.0, 0.0]}}  # fmt: skip
    pin = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "B"},
           "stops": {"min": DOWN + stop, "restitution": restitution}}  # fmt: skip
    return Scene.parse({"name": "rod", "gravity": [0.0, -9.81], "bodies": {"B": body}, "joints": {"O": pin},
                        "markers": {"P": {"body": "B", "point": "end"}},
                        "initial": {"B": {"angle": DOWN + HIGH, "rate": 0.0}},
                        "solver": {"duration": 1.5, **solver}})  # fmt: skip


@pytest.mark.compiles("kernels of contacts, which few machines need")
def test_times_of_equal_events_are_known_to_their_difference() -> None:
    run = shoal.simulate(rod(0.2, 0.8, duration=10.0))
    told = run.model["verification"]["events"]
    assert told["paired"] == len(run.model["events"])
    assert not told["differs"]
    assert 0.0 < told["time_error"] < 1e-8
    assert not run.findings
    *_, last, rests = run.model["events"]
    assert (rests["kind"], rests["joint"]) == ("rests", "O")
    assert rests["impacts"] == len(run.model["events"]) - 1
    # Where the impacts accumulate: elliptic integrals, see `test_stops`.
    assert rests["time"] == pytest.approx(6.456691947419185, abs=1e-9)
    assert last["time"] < rests["time"]


@pytest.mark.parametrize("short", [1e-6, 1e-10, 1e-12, 0.0, -1e-12, -1e-6])
def test_a_stop_that_is_just_met_or_missed_is_told_with_its_margin(short: float) -> None:
    """At (1 - short) of the amplitude. A perfect stop turns the motion round sooner, by a time in closed form."""
    run = shoal.simulate(rod(-HIGH * (1.0 - short)))
    assert run.ok, run.message
    open_ = run.model["verification"]["undecided"]
    assert bool(open_) == (abs(short) < 1e-11)
    assert [one.code for one in run.findings] == ["near-grazing"] * len(open_)
    for one in open_:
        assert 0.0 <= one["margin"] <= one["error"] < 1e-9
        assert abs(short) * HIGH <= one["margin"] + one["error"]
    # x(t) = x_free(t + 2 dt) after it, dt the time from the stop to the amplitude.
    shift = 2.0 * np.sqrt(2.0 * max(short, 0.0) * HIGH / (PULL * np.sin(HIGH)))
    way: Any = solve_ivp(lambda _, y: [y[1], -PULL * np.sin(y[0])], (0.0, 2.0), [HIGH, 0.0], "DOP853", rtol=1e-13,
                    atol=1e-14, dense_output=True)  # fmt: skip
    late = run.times > 0.9
    true = way.sol(run.times[late] + shift)[0] + DOWN
    away = np.max(np.hypot(*(run.points[late, 0, :, 0].T - np.array([np.cos(true), np.sin(true)]))))
    known = run.errors.total
    assert known is not None
    assert away <= known + 1e-11


@pytest.mark.slow
def test_no_near_miss_is_silently_wrong() -> None:
    """At random distances and tolerances; true motions by elliptic functions."""
    rng, k, rate = np.random.default_rng(0), np.sin(HIGH / 2), np.sqrt(PULL)
    quarter, told = ellipk(k**2) / rate, 0
    for _ in range(100):
        short = float(rng.choice([1.0, 1.0, -1.0]) * 10.0 ** rng.uniform(-13, -3))
        tolerance = float(10.0 ** rng.uniform(-12, -4))
        solver = {"relative_tolerance": tolerance, "absolute_tolerance": tolerance / 10}
        run = shoal.simulate(rod(-HIGH * (1.0 - short), 1.0, duration=float(rng.uniform(1.0, 4.0)), **solver))
        # cd(u) = 1 - c at the stop, whose time before the amplitude is an integral over a small angle.
        c = 2 * np.cos(HIGH / 2 - HIGH * short / 4) * np.sin(HIGH * max(short, 0.0) / 4) / np.sin(HIGH / 2)
        angle = 2 * np.arcsin(np.sqrt(c / 2))
        sooner = quad(lambda a: 1 / np.sqrt(1 - (k * np.cos(a)) ** 2), 0, angle, epsabs=0, epsrel=1e-12)[0] / rate
        hit = 2 * quarter - sooner
        phase = run.times % (2 * hit)
        time = np.where(phase <= hit, phase, 2 * hit - phase) if short > 0 else run.times
        _, cn, dn, _ = ellipj(rate * time, k**2)
        true = 2 * np.arcsin(k * cn / dn) + DOWN
        away = np.max(np.hypot(*(run.points[:, 0, :, 0].T - np.array([np.cos(true), np.sin(true)]))))
        assert run.errors.total is not None
        assert not run.ok or away <= run.errors.total + 1e-13, (short, tolerance, run.message)
        told += "near-grazing" in [one.code for one in run.findings]
    assert 20 < told < 80


def balls(late: float, kept: float = 0.5) -> Scene:
    """Return a ball at rest that two others reach from both sides, on springs, one of them from farther away [m]."""
    places = {"m": [0.0, 0.0], "a": [-0.5, 0.0], "b": [0.5 + late, 0.0]}
    rates = {"m": 0.0, "a": 1.0, "b": -1.0}
    between: dict[str, Any] = {"kind": "distance", "keeps": "at-least", "length": 0.1, "restitution": kept,
                               "first": {"body": "m"}}  # fmt: skip
    spring: dict[str, Any] = {"kind": "spring", "first": {"body": "ground", "point": [0.0, 0.0]}, "stiffness": 30.0,
                              "length": 0.05}  # fmt: skip
    return Scene.parse({
        "name": "balls", "gravity": [0.0, 0.0], "bodies": {key: {"kind": "point-mass", "mass": 1.0} for key in places},
        "joints": {name: between | {"second": {"body": name}} for name in "ab"},
        "loads": {f"spring-{name}": spring | {"second": {"body": name}} for name in "ab"},
        "markers": {name: {"body": name} for name in places},
        "initial": {name: {"position": places[name], "velocity": [rates[name], 0.0]} for name in places},
        "solver": {"duration": 0.5, "relative_tolerance": 1e-9},
    })  # fmt: skip


def test_impacts_whose_order_is_not_known_are_rejected_as_the_other_order_ends_elsewhere() -> None:
    run = shoal.simulate(balls(1e-11))
    assert str(run.status[0]) == "failed"
    assert [one.code for one in run.findings] == ["open-contacts", "order-of-impacts-not-resolved"]
    (first, *_) = run.model["verification"]["undecided"]
    assert first["joints"] == ["a", "b"]
    assert first["margin"] < first["error"] < 1e-8
    # The other order is the mirror image.
    m, a, b = (run.marker(name)[-1, 0] for name in "mab")
    assert first["distance"] == pytest.approx(max(abs(2 * m), abs(a + b)), rel=1e-3)


def test_an_order_that_is_known_or_does_not_matter_is_no_doubt() -> None:
    known = shoal.simulate(balls(1e-6))
    assert known.ok
    assert not known.findings
    # Of equal balls that lose nothing every order ends alike.
    equal = shoal.simulate(balls(1e-11, 1.0))
    assert equal.ok
    assert not equal.findings
    assert equal.model["verification"]["undecided"]
    tie = shoal.simulate(balls(0.0))
    assert tie.ok
    assert [one.code for one in tie.findings] == ["simultaneous-impact"]
    assert tie.model["verification"]["contacts_error"] is None


def row(gap: float) -> Scene:
    """Return three equal balls in a row without friction or loss, of which the first comes and the others stand."""
    places = {"a": -1.0, "b": 0.0, "c": 0.2 + gap}
    side = {name: {"body": name, "radius": 0.1} for name in places}
    contacts = {one + two: {"first": side[one], "second": side[two], "restitution": 1.0} for one, two in ("ab", "bc")}
    return Scene.parse({
        "name": "row", "gravity": [0.0, 0.0], "contacts": contacts,
        "markers": {name: {"body": name} for name in places},
        "bodies": {name: {"kind": "rigid-body", "mass": 2.0, "inertia": 0.01} for name in places},
        "initial": {name: {"position": [x, 0.0], "velocity": [1.0 if name == "a" else 0.0, 0.0]}
                    for name, x in places.items()},
        "solver": {"duration": 2.0},
    })  # fmt: skip


def test_an_impact_on_balls_that_touch_says_that_one_after_the_other_would_differ() -> None:
    touch, apart = shoal.simulate(row(0.0)), shoal.simulate(row(1e-3))
    # At once -1/3, 2/3, 2/3 (Moreau); one after the other 0, 0, 1. In the metric of the masses half of the impulses.
    since = 2.0 - 0.8
    assert touch.points[-1, :, 0, 0] == pytest.approx([-0.2 - since / 3, 2 / 3 * since, 0.2 + 2 / 3 * since], abs=1e-12)
    (finding,) = touch.findings
    assert finding.code == "simultaneous-impact"
    assert finding.numbers["difference"] == pytest.approx(0.5, rel=1e-9)
    assert apart.points[-1, :, 0, 0] == pytest.approx([-0.2, 1e-3, 0.201 + since - 1e-3], abs=1e-12)
    assert not apart.findings


def events(*letters: str) -> list[dict[str, Any]]:
    names = {"i": "impact", "o": "opens", "r": "rests"}
    return [{"time": 0.1 * k, "kind": names[one[0]], "joint": one[1]} for k, one in enumerate(letters)]


@pytest.mark.parametrize(
    ("one", "other", "paired", "parts"),
    [
        ("iA iB oA", "iA iB oA", 3, None),
        ("iA iA iA rA oA", "iA iA rA oA", 4, None),
        ("iA iA rA", "iA iA iA iA rA iB", 3, (None, "B")),
        ("iA iB", "iB iA", 0, ("A", "B")),
        ("iA iA iB rA", "iA rA", 1, ("A", "A")),
        ("", "iA", 0, (None, "A")),
    ],
)
def test_words_are_compared_from_the_beginning(one: str, other: str, paired: int, parts: Any) -> None:
    """A run that rests a few invisible hops later is no other one."""
    found = compare(events(*one.split()), events(*other.split()), 2.0)
    assert found.paired == paired
    assert (tuple(event and event["joint"] for event in found.differs) or None) == parts


def test_rates_between_two_times_of_an_impact_are_not_compared() -> None:
    found = compare([{"time": 1.0, "kind": "impact", "joint": "A"}], [{"time": 1.1, "kind": "impact", "joint": "A"}])
    assert found.time_error == pytest.approx(0.1)
    np.testing.assert_array_equal(found.beside(np.array([0.9, 1.05, 1.2])), [False, True, False])
