"""Derivatives against two independent ways: CasADi's exact ones, and variational equations by short segments."""

from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.engines import get_engine
from shoal.engines.casadi.shooting import shot
from shoal.findings import message
from shoal.identification import Measurement, Problem, Verdict, identify
from shoal.identification.conclude import conclude
from shoal.identification.diagnostics.judgement import judge
from shoal.identification.evidence import evidence
from shoal.identification.forward import ForwardModel
from shoal.identification.lengthening import lengthened
from shoal.identification.methods.auto import auto
from shoal.identification.methods.least_squares import differentiate as naive
from shoal.identification.methods.outcome import Outcome
from shoal.identification.uncertainty import intervals
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import linearise
from shoal.identification.uncertainty.sensitivity import believed, sensitivity
from shoal.mechanics.numerics.tile import WIDE
from shoal.scene import Scene
from shoal_validation.coverage.cases import tip
from shoal_validation.inverse_precision.cases import rigid_problem, textbook

PATHS = ("initial.OA.angle", "initial.AB.angle")
STATE = (*PATHS, "initial.OA.rate", "initial.AB.rate")
CHAOTIC = np.array([3 * np.pi / 4, 2.6]) - np.pi / 2
"""From the downward vertical 3 pi/4 and 2.6 rad."""
FINE = {"solver.relative_tolerance": 1e-11, "solver.absolute_tolerance": 1e-11}


def model_of(start: np.ndarray, horizon: float, noise: float = 1e-3) -> ForwardModel:
    """Both angles from the tip at 100 Hz, data by scipy."""
    data = {
        "name": "sensitivity",
        "scene": "rigid-double-pendulum",
        "parameters": {
            name: {"path": path, "lower": -4.8, "upper": 4.8} for name, path in zip("ab", PATHS, strict=True)
        },
        "channels": [{"marker": "B", "quantity": q, "column": q} for q in ("x", "y")],
        "noise": noise,
        "source": {"kind": "file"},
    }
    problem = Problem.parse(data, "sensitivity")
    times = np.arange(1, round(100 * horizon) + 1) / 100
    points = tip(times, *start) + noise * np.random.default_rng(0).standard_normal((len(times), 2))
    measurement = Measurement.single(times, tuple(problem.channels), points, "scipy DOP853", noise=noise)
    return ForwardModel(problem, problem.load_scene(FINE), get_engine("gauss"), measurement)


def by_segments(model: ForwardModel, start: np.ndarray, samples: int = 25, step: float = 1e-6) -> np.ndarray:
    """Derivatives of the tip in the initial angles, (rows, 2), by the variational equations of short segments.

    Angles and rates at the starts of segments come from one run. In a segment of so many samples nothing grows much, so
    that central differences in its first state are exact to ten digits; the chain rule joins the segments.
    """
    times, scene = model.measurement.first.times, model.scene
    whole = model.engine.simulate(scene.with_values(dict(zip(PATHS, start.tolist(), strict=True))), times)
    assert whole.rates is not None
    states = np.column_stack([whole.angles[:, :, 0], whole.rates[:, :, 0]])
    first = np.concatenate([[*start, 0.0, 0.0], states[samples - 1 : -1 : samples].ravel()]).reshape(-1, 4)
    moved = first[:, None] + step * np.concatenate([np.eye(4), -np.eye(4)])
    values = dict(zip(STATE, moved.reshape(-1, 4).T, strict=True))
    runs = model.engine.simulate_many(scene, values, times[:samples])
    assert runs.rates is not None
    seen = runs.points[:, runs.markers.index("B")].reshape(samples, 2, -1, 2, 4)
    last = np.concatenate([runs.angles[-1], runs.rates[-1]]).reshape(4, -1, 2, 4)
    slopes = (seen[:, :, :, 0] - seen[:, :, :, 1]) / (2 * step)
    transition = (last[:, :, 0] - last[:, :, 1]) / (2 * step)
    carried, rows = np.eye(4)[:, :2], []
    for k in range(len(first)):
        rows.append(slopes[:, :, k] @ carried)
        carried = transition[:, k] @ carried
    return np.concatenate(rows).reshape(-1, 2)


@pytest.mark.parametrize("horizon", [0.5, 2.0])
def test_differences_are_the_exact_derivatives_of_casadi(horizon: float) -> None:
    model, start = model_of(np.array([np.pi / 4, np.pi / 6]), horizon), np.array([np.pi / 4, np.pi / 6])
    motion = shot(model.scene, PATHS, model.measurement.first.times, "B", 1e-3, 2)
    exact = np.array(motion(start))[2:].reshape(2, 2, -1)
    seen = sensitivity(model, start)
    assert seen.reliable
    assert np.allclose(seen.jacobian.reshape(-1, 2, 2), np.moveaxis(exact, -1, 0).swapaxes(1, 2), atol=1e-6)


def test_segments_agree_with_casadi() -> None:
    """The second way is itself checked."""
    model, start = model_of(np.array([np.pi / 4, np.pi / 6]), 2.0), np.array([np.pi / 4, np.pi / 6])
    exact = np.array(shot(model.scene, PATHS, model.measurement.first.times, "B", 1e-3, 2)(start))[2:].reshape(2, 2, -1)
    assert np.allclose(by_segments(model, start).reshape(-1, 2, 2), np.moveaxis(exact, -1, 0).swapaxes(1, 2), atol=1e-6)


def test_the_weak_direction_of_a_chaotic_motion() -> None:
    """1 mm of noise over 10 s leaves 2.6e-5 rad in the weak direction; differences of one step say a fraction of it."""
    model = model_of(CHAOTIC, 10.0)

    def weak(jacobian: np.ndarray) -> float:
        return 1e-3 / float(np.linalg.svd(jacobian, compute_uv=False)[-1])

    second = weak(by_segments(model, CHAOTIC))
    first = sensitivity(model, CHAOTIC)
    assert 1e-5 < second < 1e-4
    assert weak(first.jacobian) == pytest.approx(second, rel=0.1)
    assert first.reliable
    assert weak(naive(model, CHAOTIC)[1]) < 0.1 * second
    at = linearise(first.jacobian, first.residual, model.sizes(CHAOTIC), blocks_of(model, len(first.residual)))
    assert at.unknown.size == 0
    assert np.sqrt(np.linalg.eigvalsh(at.covariance)[-1]) == pytest.approx(second, rel=0.3)


def test_steps_that_never_agree_are_not_reliable() -> None:
    """At solver tolerances of 1e-5 the neighbourhood of a chaotic motion is noise, and the derivatives say so."""
    model = model_of(CHAOTIC, 10.0)
    model.scene = model.scene.with_values({"solver.relative_tolerance": 1e-5, "solver.absolute_tolerance": 1e-5})
    seen = sensitivity(model, CHAOTIC)
    assert not seen.reliable
    assert seen.doubt > 1e-2


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_intervals_of_a_chaotic_record_rest_on_its_beginning_and_hold(seed: int) -> None:
    """Data by scipy's integrator; derivatives of 10 s, and intervals with them, are off by orders of magnitude."""
    problem = rigid_problem()
    found = identify(problem, measurement=textbook(problem, 10.0, 0.01, seed=seed))
    assert "unreliable-derivatives" in found.codes
    for name, true in found.truth.items():
        value = found.parameters[name]
        assert abs(value.value - true) < 4 * value.std
        assert value.std < 1e-2


def test_a_lengthening_record_leads_to_the_minimum_of_a_chaotic_motion() -> None:
    """Data by scipy. 4e-5 rad beside the truth the motion is off by a metre, and a descent from there ends in that."""
    model = model_of(CHAOTIC, 8.0)
    truth, beside = CHAOTIC, CHAOTIC + np.array([3e-5, -2e-5])
    found = lengthened(model, beside)
    best, before = model.fitness(np.array([truth, beside]))
    assert found is not None
    assert found.fitness <= best < 1e-3 * before
    assert found.point == pytest.approx(truth, abs=1e-5)


@pytest.mark.slow
def test_intervals_at_the_minimum_of_a_long_chaotic_record_hold_the_truth() -> None:
    """Two encoders, 1 mrad, 12 s; data by scipy. The valley of the misfit is 1e-11 rad wide across, 1e-5 along."""
    first, second = 0.6, 1.0
    rod = {"kind": "rod", "height": 0.02, "width": 0.02, "density": 2500.0}
    hinge = {"second": {"body": "A", "point": "start"}, "first": {"body": "ground", "point": [0.0, 0.0]}}
    scene = {
        "name": "two rods",
        "bodies": {"A": {**rod, "length": 1.0}, "B": {**rod, "length": 0.8}},
        "joints": {
            "O": hinge,
            "Q": {"first": {"body": "A", "point": "end"}, "second": {"body": "B", "point": "start"}},
        },
        "markers": {name: {"body": name, "point": "end"} for name in "AB"},
        "initial": {"A": {"angle": first}, "B": {"angle": second}},
        "solver": {"duration": 12.0},
    }
    stated = {
        "name": "two rods",
        "scene": "two rods",
        "parameters": {
            "a": {"path": "initial.A.angle", "lower": -1.0, "upper": 2.0},
            "b": {"path": "initial.B.angle", "lower": -1.0, "upper": 2.0},
            "l": {"path": "bodies.B.length", "lower": 0.5, "upper": 1.2},
        },
        "channels": [{"marker": name, "quantity": "angle", "column": name} for name in "AB"],
        "noise": 1e-3,
        "source": {"kind": "file"},
    }

    def rates(_: float, y: np.ndarray) -> list[float]:
        a, b, u, v = y
        whole, part, mixed, pull = 1.0 / 3 + 0.8, 0.8**3 / 3, 0.32 * np.cos(a - b), 0.32 * np.sin(a - b)
        one = -pull * v * v - 1.3 * 9.81 * np.cos(a)
        two = pull * u * u - 0.32 * 9.81 * np.cos(b)
        return [u, v, *np.linalg.solve([[whole, mixed], [mixed, part]], [one, two])]

    times = np.linspace(0.0, 12.0, 480)
    motion = solve_ivp(rates, (0.0, 12.0), [first, second, 0, 0], method="DOP853", rtol=1e-12, atol=1e-12, t_eval=times)
    noise = np.random.default_rng(1000).standard_normal((2, 480)).T
    problem = Problem.parse(stated, "two rods")
    measurement = Measurement.single(
        times, tuple(problem.channels), motion.y[:2].T + 1e-3 * noise, "scipy DOP853", noise=1e-3
    )
    model = ForwardModel(problem, Scene.parse(scene, "two rods"), get_engine("gauss"), measurement)
    search = auto(model, np.random.default_rng(0), lambda *_: None)
    found = conclude(model, search, "auto", 0)
    assert found.verdict is Verdict.IDENTIFIED, found.message
    for name, true in {"a": first, "b": second, "l": 0.8}.items():
        assert abs(found.parameters[name].value - true) < 3 * found.parameters[name].std < 3e-5


@pytest.mark.parametrize(("tolerance", "verdict"), [(1e-8, Verdict.UNFINISHED), (1e-6, Verdict.IDENTIFIED)])
@pytest.mark.slow
def test_a_misfit_only_where_no_derivatives_hold_is_not_held_against_the_model(
    tolerance: float, verdict: Verdict
) -> None:
    """At the truth of data by scipy: late in a chaotic motion the errors of the solver are the misfit.

    Where the tolerance is loose a run with a tighter one shows that, and the misfit is in the intervals.
    """
    model = model_of(CHAOTIC, 10.0)
    loose = {"solver.relative_tolerance": tolerance, "solver.absolute_tolerance": tolerance}
    model.scene = model.scene.with_values(loose)
    near = evidence(model, CHAOTIC)
    outcome = Outcome(CHAOTIC, float(model.cost(near.residual[None])[0]), [], "")
    values = intervals.parameters(model, CHAOTIC, near.at, near.correction)
    found = judge(model, outcome, near.seen, near.at, near.tests, near.score_test(model), values, [])
    assert found.verdict is verdict
    if verdict is Verdict.UNFINISHED:
        assert near.tests.wrong_model
        assert found.findings[0].code == "fits-the-beginning-only"
        assert found.findings[0].numbers["end"] == near.seen.end
        return
    assert not near.tests.wrong_model
    for value, true in zip(values.values(), CHAOTIC, strict=True):
        assert value.lower + 0.001 < true < value.upper - 0.001


@pytest.mark.parametrize(("magnified", "cause"), [(1e3, "the motion is chaotic"), (2.0, "the solver's steps are too")])
def test_the_cause_of_derivatives_that_do_not_hold_is_told(magnified: float, cause: str) -> None:
    """Only a motion that magnifies deviations is chaotic; else it is the solver that makes derivatives rough."""
    model = model_of(np.array([0.5, 0.2]), 1.0)
    seen = sensitivity(model, np.array([0.5, 0.2]))
    share = np.linspace(0.0, 1.0, len(seen.residual))[:, None]
    rough = replace(seen, jacobian=np.ones_like(seen.jacobian) * magnified**share, doubt=0.5)
    near = evidence(model, np.array([0.5, 0.2]))
    outcome = Outcome(near.point, float(model.cost(near.residual[None])[0]), [], "")
    values = intervals.parameters(model, near.point, near.at, near.correction)
    judged = judge(model, outcome, rough, near.at, near.tests, near.score_test(model), values, [])
    assert cause in message(judged.findings)


def test_derivatives_that_hold_are_those_of_the_whole_record() -> None:
    model = model_of(np.array([0.5, 0.2]), 1.0)
    point = np.array([0.5, 0.2])
    one, other = sensitivity(model, point), believed(model, point)
    assert other.end is None
    assert np.array_equal(one.jacobian, other.jacobian)


@pytest.mark.parametrize("seed", range(4))
def test_the_jacobian_of_a_linear_model_with_equal_singular_values_is_its_matrix(seed: int) -> None:
    """Within such a pair any direction is singular, so that the directions never settle."""
    rng = np.random.default_rng(seed)
    left, right = np.linalg.qr(rng.standard_normal((30, 4)))[0], np.linalg.qr(rng.standard_normal((4, 4)))[0]
    matrix = left * [1.0, 1.0, 1e-4, 1e-4] @ right.T
    linear = SimpleNamespace(
        sizes=np.ones_like,
        lower=-np.ones(4),
        upper=np.ones(4),
        box_at=lambda point: (point - 1.0, point + 1.0),
        uncounted=lambda points: points @ matrix.T,
        rows=SimpleNamespace(signal=1.0),
    )
    seen = sensitivity(cast(ForwardModel, linear), np.zeros(4))
    assert seen.reliable
    assert seen.jacobian == pytest.approx(matrix, abs=1e-9)


def test_an_error_that_lanes_of_a_tile_share_is_none_of_the_derivatives() -> None:
    """Lanes that share iterations share what these leave, here 1e-10 of the motion; the weakest direction has 1e-5.

    Judged by the matrix of the linear model itself.
    """
    rng = np.random.default_rng(0)
    left, right = np.linalg.qr(rng.standard_normal((30, 4)))[0], np.linalg.qr(rng.standard_normal((4, 4)))[0]
    matrix = left * [1.0, 0.2, 0.03, 1e-5] @ right.T

    def motion(points: np.ndarray) -> np.ndarray:
        tiles = -(-len(points) // len(WIDE))
        left_over = np.repeat(1e-10 * rng.standard_normal((tiles, 30)), len(WIDE), axis=0)
        return points @ matrix.T + left_over[: len(points)]

    linear = SimpleNamespace(
        sizes=np.ones_like,
        lower=-np.ones(4),
        upper=np.ones(4),
        box_at=lambda point: (point - 1.0, point + 1.0),
        uncounted=motion,
        rows=SimpleNamespace(signal=1.0, time=np.arange(30.0), recording=np.zeros(30, dtype=int)),
        parameters=SimpleNamespace(initial=np.zeros(4, dtype=bool)),
        measurement=SimpleNamespace(recordings={"one": SimpleNamespace(times=np.arange(30.0))}),
    )
    seen = sensitivity(cast(ForwardModel, linear), np.zeros(4))
    assert seen.doubt < 1e-4
    assert seen.jacobian == pytest.approx(matrix, abs=1e-9)


@pytest.mark.parametrize("upper", [1.0, 0.0])
def test_a_parameter_at_its_bound_does_not_cast_doubt_on_the_others(upper: float) -> None:
    """Both act all but alike, the second at its lower bound, the first inside or at its upper one.

    Where they differ is bent and little above round-off: one-sided differences of that direction never agree, and the
    other one leads out of the box either way where both stand at bounds.
    """
    rng = np.random.default_rng(0)
    alike, apart = np.linalg.qr(rng.standard_normal((30, 2)))[0].T

    def motion(points: np.ndarray) -> np.ndarray:
        one, two = points.T[:, :, None]
        return (one + two) * alike + 1e-4 * (two + 400 * two**2) * apart + 1e-10 * rng.standard_normal(30)

    model = SimpleNamespace(
        sizes=np.ones_like,
        lower=np.array([-1.0, 0.0]),
        upper=np.array([upper, 1.0]),
        box_at=lambda _: (np.array([-1.0, 0.0]), np.array([upper, 1.0])),
        uncounted=motion,
        rows=SimpleNamespace(signal=1.0),
    )
    seen = sensitivity(cast(ForwardModel, model), np.zeros(2))
    assert seen.reliable
    assert seen.jacobian == pytest.approx(np.column_stack([alike, alike + 1e-4 * apart]), abs=1e-4)


def falling(speed: float, reach: float) -> ForwardModel:
    """A point mass thrown at 45 degrees, so fast [m/s] and from so near the origin [m], seen by three cameras."""
    first = {"position": [0.0, 0.0], "velocity": [speed, speed]}
    ball = {"name": "ball", "bodies": {"b": {"kind": "point-mass", "mass": 0.5}}, "initial": {"b": first}}
    scene = Scene.parse(ball | {"markers": {"b": {"body": "b"}}, "solver": {"duration": 1.0}}, "ball")
    sought = {"vx": "velocity.0", "vy": "velocity.1", "px": "position.0", "py": "position.1"}
    bounds = {name: 10 * speed if name.startswith("v") else reach for name in sought}
    starts = {name: speed if name.startswith("v") else 0.0 for name in sought}
    stated = {
        "name": "ball",
        "scene": "ball",
        "parameters": {
            name: {"path": f"initial.b.{path}", "lower": -bounds[name], "upper": bounds[name], "start": starts[name]}
            for name, path in sought.items()
        },
        "channels": [{"marker": "b", "quantity": q, "column": q} for q in ("x", "y")],
        "noise": 1e-3,
        "source": {"kind": "file"},
    }
    problem = Problem.parse(stated, "ball")
    times = np.linspace(0.0, 1.0, 41)
    points = np.column_stack([speed * times, speed * times - 0.5 * 9.81 * times**2])
    measurement = Measurement.single(times, tuple(problem.channels), points, "parabola", noise=1e-3)
    return ForwardModel(problem, scene, get_engine("gauss"), measurement)


@pytest.mark.parametrize(("speed", "reach"), [(1.0, 1.0), (40.0, 0.01), (1000.0, 1e-3)])
def test_a_linear_problem_is_known_exactly_however_its_sizes_differ(speed: float, reach: float) -> None:
    """Positions shift the data one to one, be they ever so small beside the speeds. Judged by the normal equations."""
    model = falling(speed, reach)
    point = model.parameters.start
    seen = sensitivity(model, point)
    at = linearise(seen.jacobian, seen.residual, model.sizes(point), blocks_of(model, len(seen.residual)), seen.error)
    lines = np.column_stack([model.measurement.first.times, np.ones(41)])
    exact = np.sqrt(np.diag(np.linalg.inv(lines.T @ lines)))
    assert at.unknown.size == 0
    assert np.linalg.norm(at.pseudo_inverse, axis=1) == pytest.approx(np.repeat(exact, 2), rel=1e-2)
