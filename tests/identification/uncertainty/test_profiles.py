"""Profiles and the bootstrap against what linear theory and known answers say."""

import numpy as np
import pytest
from scipy.optimize import brentq, least_squares
from shoal.engines import get_engine
from shoal.identification import Problem, identify
from shoal.identification.conclude import Options
from shoal.identification.forward import ForwardModel
from shoal.identification.methods.least_squares import descend
from shoal.identification.recording.measurement import Measurement
from shoal.identification.uncertainty.bootstrap import block_length, bootstrap
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import linearise, spread
from shoal.identification.uncertainty.profiles import profile
from shoal.scene import Scene
from shoal.trajectory import Array
from shoal_validation.coverage.cases import Case, cases

CASES = {case.name: case for case in cases()}


def fitted(case: Case) -> tuple:  # type: ignore[type-arg]
    model = case.model(seed=5)
    truth = model.parameters.to_vector(np.array([case.truth[name] for name in model.names]))
    end = descend(model, truth, lambda *_: None)
    at = linearise(end.jacobian, end.residual, model.sizes(end.point), blocks_of(model, len(end.residual)))
    return model, end, at


@pytest.mark.parametrize("name", ["angles; white", "angles; AR(1) 0.9"])
def test_a_well_known_parameter_has_the_interval_of_linear_theory(name: str) -> None:
    """Where the misfit is a parabola, profile and covariance agree, correlated noise included."""
    model, end, at = fitted(CASES[name])
    for k in range(2):
        half = spread(lambda p, k=k: float(p[k]), end.point, at).half  # type: ignore[misc]
        found = profile(model, end.point, at, k)
        assert not found.open
        assert not found.better
        assert found.upper - end.point[k] == pytest.approx(half, rel=0.05)
        assert end.point[k] - found.lower == pytest.approx(half, rel=0.05)
        assert np.all(np.diff(found.values) > 0)


TIMES = np.linspace(0.0, 1.2, 120)
TURN, TORQUE, NOISE = 0.3, 0.1, 0.03


def swing(spring: float, inertia: float, friction: float) -> Array:
    """The angle of a disc on a torsion spring with a damper, let go from TURN under a constant torque."""
    rest, decay = TORQUE / spring, friction / (2 * inertia)
    rate = np.sqrt(complex(spring / inertia - decay**2))
    return np.real(
        rest + (TURN - rest) * np.exp(-decay * TIMES) * (np.cos(rate * TIMES) + decay / rate * np.sin(rate * TIMES))
    )


def test_the_profile_along_a_curved_valley_is_that_of_the_closed_form() -> None:
    """Spring, inertia and damper scale together but for a weak torque: a fit that stalls on the way bounds nothing."""
    ground, disc = {"body": "ground", "point": [0, 0]}, {"body": "disc"}
    scene = {
        "name": "torsion",
        "gravity": [0, 0],
        "bodies": {"disc": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.03}},
        "joints": {"axle": {"kind": "revolute", "first": ground, "second": disc, "friction": 0.06}},
        "loads": {
            "spring": {"kind": "torsion-spring", "first": ground, "second": disc, "stiffness": 10.0, "angle": 0},
            "motor": {"kind": "torque", "at": disc, "torque": TORQUE},
        },
        "markers": {"disc": disc},
        "initial": {"disc": {"angle": TURN}},
    }
    truth = {"spring": 10.0, "inertia": 0.03, "friction": 0.06}
    paths = "loads.spring.stiffness", "bodies.disc.inertia", "joints.axle.friction"
    bounds = {name: (true / 30, 30 * true) for name, true in truth.items()}
    sought = {
        name: {"path": path, "lower": bounds[name][0], "upper": bounds[name][1], "scale": "log"}
        for name, path in zip(truth, paths, strict=True)
    }
    channels = [{"marker": "disc", "quantity": "angle", "column": "a"}]
    stated = {"name": "t", "scene": "t", "parameters": sought, "channels": channels, "noise": NOISE}
    problem = Problem.parse({**stated, "source": {"kind": "file"}}, "t")
    seen = swing(**truth) + NOISE * np.random.default_rng(2).standard_normal(len(TIMES))
    measurement = Measurement.single(TIMES, tuple(problem.channels), seen[:, None], "closed form", noise=NOISE)
    model = ForwardModel(problem, Scene.parse(scene, "t"), get_engine("gauss"), measurement)
    end = descend(model, np.log(list(truth.values())), lambda *_: None)
    at = linearise(end.jacobian, end.residual, model.sizes(end.point), blocks_of(model, len(end.residual)))
    found = profile(model, end.point, at, 0)

    def misfit(spring: float) -> float:
        """Least sum of squares over inertia and friction, which scale with the spring to begin with."""
        rows = least_squares(
            lambda p: swing(spring, *np.exp(p)) - seen,
            end.point[1:] + np.log(spring) - end.point[0],
            bounds=np.log([bounds["inertia"], bounds["friction"]]).T,
            xtol=1e-12,
        )
        return 2 * float(rows.cost)

    least = misfit(float(np.exp(end.point[0])))
    half = float(spread(lambda p: float(p[0]), end.point, at).half)
    threshold = half**2 / float(np.sum(at.pseudo_inverse[0] ** 2))
    middle = float(np.exp(end.point[0]))
    lower = brentq(lambda spring: misfit(spring) - least - threshold, 0.3 * middle, middle)
    upper = brentq(lambda spring: misfit(spring) - least - threshold, middle, 20 * middle)
    assert upper / middle > 1.2 * middle / lower
    assert not found.open
    assert found.lower == pytest.approx(lower, rel=0.03)
    assert found.upper == pytest.approx(upper, rel=0.03)


def test_a_parameter_without_effect_is_open_on_both_sides() -> None:
    """The first rod's density multiplies nothing when both densities and the friction may change with it."""
    case = CASES["angles, mass, friction; white"]
    both = case.problem.model_dump()
    both["parameters"]["first"] = {"path": "bodies.OA.density", "lower": 500.0, "upper": 2000.0, "scale": "log"}
    both["parameters"]["density"]["upper"] = 1e5
    wide = Case(case.name, Problem.parse(both, "wide"), {**case.truth}, 0.0)
    model = wide.model(seed=5)
    truth = model.parameters.to_vector(np.array([{**case.truth, "first": 1000.0}[name] for name in model.names]))
    end = descend(model, truth, lambda *_: None)
    at = linearise(end.jacobian, end.residual, model.sizes(end.point), blocks_of(model, len(end.residual)))
    found = profile(model, end.point, at, model.names.index("first"))
    assert found.lower_open
    assert found.upper_open
    assert found.lower == pytest.approx(500.0)
    assert found.upper == pytest.approx(2000.0)


def test_blocks_are_as_long_as_the_noise_remembers() -> None:
    assert block_length(200, 0.0) == 1
    assert 20 <= block_length(200, 0.9) <= 66


@pytest.mark.parametrize("name", ["angles; white", "angles; AR(1) 0.9"])
def test_the_bootstrap_scatters_as_the_covariance_says(name: str) -> None:
    """Refits of redrawn residuals; for correlated noise the plain deviation would be a third of it."""
    model, end, at = fitted(CASES[name])
    predicted = {key: model.observe(end.point[None], key)[0] for key in model.measurement.recordings}
    found = bootstrap(model, end.point, predicted, at.noise[0].rho, 60, np.random.default_rng(0))
    assert found.failed == 0
    for k, key in enumerate(model.names):
        std = float(np.std(found.draws[:, k], ddof=1))
        assert std == pytest.approx(np.sqrt(at.covariance[k, k]), rel=0.5)
        low, high = found.interval(key)
        assert low < end.point[k] < high


def test_wishes_are_part_of_the_estimate() -> None:
    case = CASES["angles; white"]
    model = case.model(seed=1)
    options = Options(profiles=True, bootstrap=5)
    estimate = identify(case.problem, method="least-squares", measurement=model.measurement, options=options)
    answer = estimate.to_json()
    assert set(answer["profiles"]) == {"theta1", "theta2"}
    assert answer["bootstrap"]["draws"] == 5
    again = identify(case.problem, method="least-squares", measurement=model.measurement, options=options)
    assert again.to_json()["bootstrap"] == answer["bootstrap"]
