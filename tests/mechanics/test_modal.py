"""Bodies in floating frames: a published figure, Lagrange's equations by scipy, closed forms, Exudyn's."""

from __future__ import annotations

from typing import Any, NamedTuple

import exudyn_frames
import floating_frame as judge
import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.verification import Verification, verified
from shoal.error_budget import ErrorBudget
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.modal.beams import wave_numbers
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

GROUND = {"body": "ground", "point": [0.0, 0.0]}
ROD = {
    **{"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.02, "density": 7800.0, "youngs_modulus": 2e11},
    "element": "modal",
}
CLOSE = {"relative_tolerance": 1e-11, "absolute_tolerance": 1e-13}


def _rod(joints: dict[str, Any], rod: dict[str, Any] | None = None, **more: Any) -> Scene:
    return Scene.parse(
        {
            "name": "rod",
            "bodies": {"A": ROD | (rod or {})},
            "joints": joints,
            "markers": {"end": {"body": "A", "point": "end"}},
        }
        | more
    )


def _held(kind: str, **more: Any) -> dict[str, Any]:
    return {"O": {"kind": kind, "first": GROUND, "second": {"body": "A"}, **more}}


def test_the_flexible_slider_crank_ends_where_it_is_published() -> None:
    """IVP test set (Mazzia and Magherini 2008), crank: phi2 and x3 at 0.1 s."""
    run = get_engine("gauss").simulate(load_scene("flexible-slider-crank"), [0.1])
    assert run.ok, run.message
    assert run.angle("rod")[-1] == pytest.approx(-0.331173498825626, abs=1e-8)
    assert run.marker("slider")[-1, 0] == pytest.approx(0.169737332842786, abs=1e-8)


class Chain(NamedTuple):
    """Rods hung on the origin and on each other, for us and for a judge."""

    scene: Scene
    bars: list[judge.Bar]
    start: Array
    rates: Array


TIMES = np.linspace(0.05, 0.15, 3)


def _chain(seed: int) -> Chain:
    """At random."""
    rng = np.random.default_rng(seed)
    bars, bodies, joints, initial, start, rates = [], {}, {}, {}, list[float](), list[float]()
    count = int(rng.integers(1, 3))
    for k in range(count):
        length, height, width = rng.uniform(0.5, 1.5), rng.uniform(0.01, 0.03), 0.04
        density, young = rng.uniform(2000, 8000), 10 ** rng.uniform(8.5, 9.5)
        across = int(rng.integers(1, 4))
        along = int(rng.integers(0, across + 2))
        retardation, rotary = float(rng.choice([0.0, 1e-4])), bool(rng.integers(2))
        area, moment = height * width, width * height**3 / 12
        shapes = judge.hinged_free if k == count - 1 else judge.sines
        bars.append(
            judge.Bar(
                length, density * area, young * area, young * moment, density * moment * rotary, retardation, across,
                along, shapes,
            )
        )  # fmt: skip
        name, before = f"B{k}", {"body": f"B{k - 1}", "point": "end"} if k else GROUND
        bodies[name] = {
            **{"kind": "rod", "length": length, "height": height, "width": width, "density": density},
            **{"youngs_modulus": young, "element": "modal", "modes": across, "axial_modes": along},
            **{"retardation": retardation, "rotary_inertia": rotary},
        }
        joints[f"J{k}"] = {"kind": "revolute", "first": before, "second": {"body": name}}
        angle, rate = rng.uniform(-1.5, 1.5), rng.uniform(-2, 2)
        q = [*rng.normal(size=across) * 5e-3, *rng.normal(size=along) * 1e-5]
        v = [*rng.normal(size=across) * 0.1, *rng.normal(size=along) * 1e-3]
        initial[name] = {"angle": angle, "rate": rate, "modes": q, "mode_rates": v}
        start, rates = [*start, angle, *q], [*rates, rate, *v]
    scene = Scene.parse(
        {
            "name": "chain",
            "bodies": bodies,
            "joints": joints,
            "markers": {name: {"body": name, "point": "end"} for name in bodies},
            "initial": initial,
            "solver": {"integrator": "dop853", "duration": 0.15, **CLOSE},
        }
    )
    return Chain(scene, bars, np.array(start), np.array(rates))


def _ends(scene: Scene) -> Array:
    """Of a chain as it moves, (times, rods) complex."""
    run = get_engine("gauss").simulate(scene, TIMES)
    assert run.ok, run.message
    return np.asarray(run.points[:, :, 0, 0] + 1j * run.points[:, :, 1, 0])


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.by_day(1)
def test_chains_move_as_lagrange_says(seed: int) -> None:
    scene, *chain = _chain(seed)
    assert np.max(np.abs(_ends(scene) - judge.motion(*chain, TIMES, 9.81))) < 1e-8


@pytest.mark.parametrize(
    ("seed", "step"), [(2, 1e-4), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((0, 5e-5), (1, 2.5e-5)))]
)
def test_chains_move_as_exudyns_floating_frames_do(seed: int, step: float) -> None:
    """Its step has the second order, which two of them take away."""
    pytest.importorskip("exudyn")
    scene, *chain = _chain(seed)
    found = _ends(scene)
    coarse, fine = (exudyn_frames.motion(*chain, TIMES, 9.81, h) for h in (step, step / 2))
    assert np.max(np.abs(found - (4 * fine - coarse) / 3)) < 1e-8
    assert np.max(np.abs(found - coarse)) > 3 * np.max(np.abs(found - fine))


@pytest.mark.parametrize(
    ("joints", "ends"),
    [
        (_held("revolute"), ("pinned", "free")),
        (_held("weld"), ("clamped", "free")),
        (
            _held("revolute") | {"S": {"kind": "slider", "first": GROUND, "second": {"body": "A", "point": "end"}}},
            ("pinned", "pinned"),
        ),
    ],
    ids=["hinged", "clamped", "between hinges"],
)
def test_rods_vibrate_as_bernoulli_and_euler_say(joints: dict[str, Any], ends: Any) -> None:
    closed = {
        ("pinned", "free"): [3.926602312047919, 7.068582745628732, 10.210176122813031],
        ("clamped", "free"): [1.8751040687119611, 4.694091132974175, 7.854757438237613],
        ("pinned", "pinned"): [np.pi, 2 * np.pi, 3 * np.pi],
    }[ends]
    np.testing.assert_allclose(wave_numbers(ends, 3), closed, rtol=1e-13)
    found = [2 * np.pi * one.frequency for one in modes(_rod(joints, gravity=[0.0, 0.0]), about="start").modes]
    slowness = np.sqrt(2e11 / 7800) * 0.01 / np.sqrt(12)
    bending = [one for one in found if one > 1.0][:3]
    np.testing.assert_allclose(bending, slowness * np.array(closed) ** 2, rtol=1e-8)


def test_a_cantilever_sags_and_holds_as_the_series_of_its_modes_says() -> None:
    """Tip deflection F L^3/EI times the sum of 4/b^4 (whole: 1/3); the clamp carries the force and its moment."""
    load = {"F": {"kind": "force", "at": {"body": "A", "point": "end"}, "force": [0.0, -1.0]}}
    found = statics(_rod(_held("weld"), {"modes": 3}, gravity=[0.0, 0.0], loads=load))
    assert found.ok, found.message
    series = sum(4 / b**4 for b in (1.8751040687119611, 4.694091132974175, 7.854757438237613))
    stiffness = 2e11 * 0.02 * 0.01**3 / 12
    np.testing.assert_allclose(found.marker("end"), [1.0, -series / stiffness], atol=1e-12)
    assert found.reactions is not None
    joint = found.reactions.joints["O"]
    np.testing.assert_allclose(joint.force, [0.0, 1.0], atol=1e-9)
    assert joint.torque == pytest.approx(1.0, abs=1e-9)


def test_a_swinging_rod_hangs_on_the_force_that_its_momentum_needs() -> None:
    """The rate of the momentum, by the velocities of the centre of mass from finite differences of the motion."""
    scene = _rod(
        _held("revolute"),
        {"youngs_modulus": 2e9, "axial_modes": 2},
        initial={"A": {"angle": 0.3, "rate": 2.0, "modes": [0.01, 0.0, 0.001, 0.0, 1e-5, 0.0]}},
        solver={"duration": 0.1, **CLOSE},
    )
    x, weight = np.polynomial.legendre.leggauss(12)
    markers = {f"p{k}": {"body": "A", "point": [(1 + s) / 2, 0.0]} for k, s in enumerate(x)}
    traced = Scene.parse(scene.model_dump(mode="json") | {"markers": markers})
    h = 1e-4
    run = get_engine("gauss").simulate(traced, [0.05 - h, 0.05, 0.05 + h])
    assert run.ok, run.message
    centre = np.tensordot(weight / 2, run.points[..., 0], axes=(0, 1))
    mass = 7800 * 0.01 * 0.02
    needed = mass * (centre[0] - 2 * centre[1] + centre[2]) / h**2 + [0.0, 9.81 * mass]
    (found,) = reactions(scene, [0.05])
    np.testing.assert_allclose(found.joints["O"].force, needed, rtol=2e-3)
    assert found.unbalanced < 1e-8


PENDULUM = {
    "name": "pendulum",
    "bodies": {"A": ROD | {"height": 0.02, "width": 0.04}, "B": ROD | {"height": 0.02, "width": 0.04, "length": 1.5}},
    "joints": _held("revolute") | {"J": {"first": {"body": "A", "point": "end"}, "second": {"body": "B"}}},
    "markers": {"tip": {"body": "B", "point": "end"}},
    "initial": {"A": {"angle": 0.5}, "B": {"angle": -0.3}},
    "solver": {"duration": 0.3, "relative_tolerance": 1e-9, "absolute_tolerance": 1e-11},
}


@pytest.mark.slow
def test_stiff_rods_swing_like_exudyns_cables() -> None:
    """Rigid rods come out 2e-4 m away, modes within what small bending and Exudyn's step leave out."""
    pytest.importorskip("exudyn")
    scene = Scene.parse(PENDULUM)
    times = np.linspace(0.05, 0.3, 6)

    def as_rods(**fields: Any) -> Scene:
        return scene.with_values({f"bodies.{name}.{field}": value for name in "AB" for field, value in fields.items()})

    cables = as_rods(element="ancf-cable", elements=8).with_values({"solver.step": 2.5e-4})
    other = get_engine("exudyn").simulate(cables, times)
    assert other.ok, other.message
    runs = [get_engine("gauss").simulate(as_rods(modes=count, axial_modes=2), times) for count in (1, 2, 4)]
    assert all(run.ok for run in runs)
    first, second, third = (run.distance(other) for run in runs)
    assert third < second < first < 1e-5
    assert third < 4e-6
    assert get_engine("gauss").simulate(as_rods(element="rigid"), times).distance(other) > 1e-4


@pytest.mark.slow
def test_rods_that_bend_far_are_not_believed() -> None:
    """Cables are the judge: the error is small and stated for steel, and grows to a warning, then to a rejection."""
    stiff = verified(get_engine("gauss"), Scene.parse(PENDULUM))
    assert stiff.ok, stiff.message
    assert not stiff.message
    assert 1e-7 < stiff.model["verification"]["bending_error"] < 1e-5
    soft = {f"bodies.{name}.youngs_modulus": 2e7 for name in "AB"}
    found = verified(get_engine("gauss"), Scene.parse(PENDULUM).with_values({**soft, "solver.duration": 0.5}))
    error = found.model["verification"]["bending_error"]
    assert error > 0.05
    assert found.codes == ["bends-far"]
    (finding,) = Verification(ErrorBudget({"bending": error}), 5.0 * error).findings
    assert (finding.code, finding.numbers["error"]) == ("bends-too-far", error)


def test_a_rod_that_turns_faster_than_it_vibrates_flies_apart_and_is_told_why() -> None:
    """Kane, Ryan and Banerjee 1987: without the stiffness of tension; 3.516 sqrt(EI/m L^4) is the limit."""
    first = 3.516 * np.sqrt(2e11 * 0.01**2 / 12 / 7800.0)
    spin = {"kind": "driven-angle", "first": GROUND, "second": {"body": "hub"}, "angle": f"{2 * first}*ramp(t)*t"}
    hub = {"hub": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.01}}
    joints = {
        "m": {"first": GROUND, "second": {"body": "hub"}},
        "w": {"kind": "weld", "first": {"body": "hub"}, "second": {"body": "A"}},
        "d": spin,
    }
    more = {"gravity": [0.0, 0.0], "solver": {"duration": 0.3, "samples": 4}}
    found = get_engine("gauss").simulate(_rod(joints, bodies=hub | {"A": ROD}, **more))
    assert not found.ok
    assert "modal rods are right for small bending: use element: ancf-cable for more" in found.advice


BODY = load_scene("flexible-slider-crank").model_dump(mode="json")["bodies"]["rod"]


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda rod: rod | {"elements": 2},
            "bodies.A.rod.elements: a modal rod is one element, found 2; set elements to 1 as well",
        ),
        (lambda rod: rod | {"curvature": [0.1]}, "curvature: a modal rod is straight"),
        (lambda rod: rod | {"axial_modes": 6}, "axial_modes: 6 is more than 5"),
        (lambda rod: rod | {"ends": ["clamped", "pinned"]}, "ends: clamped, pinned keep a rod"),
        (lambda rod: rod | {"element": "ancf-cable", "modes": 3}, "modes: ancf-cable has elements instead"),
        (lambda rod: BODY | {"modal_mass": [1.0, 2.0]}, "modal_mass: needs 4 rows of 4 numbers"),
        (lambda rod: BODY | {"modal_stiffness": [1.0, 1.0, 1.0, -1.0]}, "modal_stiffness: has a negative eigenvalue"),
        (lambda rod: BODY | {"modal_coupling": [1.0, 1.0, 1.0, 1.0]}, "modal_coupling: is not antisymmetric"),
        (lambda rod: BODY | {"modal_mass": [1e-3] * 4}, "modal_mass: with translation"),
        (lambda rod: BODY | {"named_points": {}}, "modes.3.points: no named point 'end'"),
    ],
)
def test_what_is_wrong_is_said_in_one_line(change: Any, words: str) -> None:
    data = {"name": "rod", "bodies": {"A": change(ROD)}, "joints": _held("revolute"), "markers": {"m": {"body": "A"}}}
    with pytest.raises(InputError) as refusal:
        Scene.parse(data)
    assert words.removeprefix("bodies.A.rod.") in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"initial.rod.modes": [0.0]}, "initial.rod.modes: 1 numbers, but rod has 4 modes"),
        ({"initial.crank.modes": [0.0]}, "initial.crank.modes: 1 numbers, but crank has no modes"),
        ({"markers.rod.point": [0.1, 0.0]}, "markers.rod.point: the modes of rod are known at its named points"),
        ({"dimensions": 3}, "say dimensions: 2"),
    ],
)
def test_what_modes_cannot_do_is_said(values: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError) as refusal:
        load_scene("flexible-slider-crank").with_values(values)
    assert words in str(refusal.value)


@pytest.mark.parametrize("engine", ["exudyn", "casadi", "tree", "mujoco"])
def test_other_engines_refuse_modes_by_name(engine: str) -> None:
    pytest.importorskip({"tree": "numpy"}.get(engine, engine))
    with pytest.raises(InputError, match="modal; use gauss"):
        get_engine(engine).simulate(_rod(_held("revolute")), [0.1])
