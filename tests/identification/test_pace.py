"""The step of a fit goes by the noise of what was measured, not by the scene: a gauge on a damped cantilever."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.optimize import brentq
from shoal.engines import get_engine
from shoal.identification import Problem, identify, measure
from shoal.identification.adapt import paced
from shoal.identification.forward import ForwardModel
from shoal.trajectory import Array

LENGTH, HEIGHT, WIDTH, DENSITY = 1.0, 0.01, 0.02, 2700.0
FORCE, PLACE, NOISE = 2.0, 0.1, 2e-6
MODULUS, RETARDATION = 7e10, 1.97e-4


def strain(times: Array) -> Array:
    """Bernoulli and Euler's beam with Kelvin and Voigt's law, let go from a force at its tip: eight modes."""
    area, inertia = WIDTH * HEIGHT, WIDTH * HEIGHT**3 / 12
    found = np.zeros_like(times)
    for n in range(8):
        k = brentq(lambda x: np.cos(x) + 1 / np.cosh(x), (n + 0.05) * np.pi, (n + 0.95) * np.pi)
        ratio = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))

        def mode(x: float, sign: float, k: float = k, ratio: float = ratio) -> float:
            """The shape, of mean square one, or (sign 1) its second derivative over the squared wave number."""
            across, turned = np.cosh(k * x) + sign * np.cos(k * x), np.sinh(k * x) + sign * np.sin(k * x)
            return float(across - ratio * turned)

        omega = (k / LENGTH) ** 2 * np.sqrt(MODULUS * inertia / (DENSITY * area))
        decay = RETARDATION * omega**2 / 2
        damped = np.sqrt(complex(omega**2 - decay**2))
        swing = np.exp(-decay * times) * (np.cos(damped * times) + decay / damped * np.sin(damped * times))
        amplitude = FORCE * mode(1.0, -1.0) / (DENSITY * area * LENGTH * omega**2)
        found += HEIGHT / 2 * amplitude * mode(PLACE / LENGTH, 1.0) * (k / LENGTH) ** 2 * swing.real
    return found


def let_go(folder: Path, noise: float | None) -> Problem:
    """The recording, its noise as stated, and what is sought."""
    rod = {"kind": "rod", "length": LENGTH, "height": HEIGHT, "width": WIDTH, "density": DENSITY}
    scene = {
        "name": "let-go",
        "gravity": [0.0, 0.0],
        "bodies": {"r": {**rod, "youngs_modulus": 6e10, "retardation": 1e-4, "element": "ancf-cable", "elements": 6}},
        "joints": {"w": {"kind": "weld", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "r"}}},
        "loads": {
            "f": {
                "kind": "force",
                "at": {"body": "r", "point": "end"},
                "force": [0, -FORCE],
                "scale": "1-step(t-1e-6)",
            }
        },
        "markers": {"gauge": {"body": "r", "point": [PLACE, 0]}},
        "initial": {"from": "statics"},
        "solver": {"duration": 0.5},
    }
    (folder / "scene.yaml").write_text(yaml.safe_dump(scene))
    times = np.linspace(0.0, 0.5, 501)
    values = strain(times) + NOISE * np.random.default_rng(1).standard_normal(len(times))
    np.savetxt(folder / "gauge.csv", np.column_stack([times, values]), delimiter=",", header="t,gauge", comments="")
    stated = {
        "name": "let-go",
        "scene": str(folder / "scene.yaml"),
        "parameters": {
            "E": {"path": "bodies.r.youngs_modulus", "lower": 2e10, "upper": 2e11},
            "ret": {"path": "bodies.r.retardation", "lower": 1e-6, "upper": 1e-2, "start": 1e-4},
        },
        "channels": [
            {"marker": "gauge", "quantity": "strain", "height": HEIGHT / 2, "column": "gauge", "noise": noise}
        ],
        "source": {"kind": "file", "path": str(folder / "gauge.csv")},
    }
    return Problem.parse(stated, "let-go")


@pytest.mark.parametrize(("noise", "step"), [(1e-3, 5e-4), (NOISE, 2.5e-4), (None, 2.5e-4)])
def test_the_step_of_a_fit_is_shortened_where_its_error_is_seen_beside_the_noise(
    tmp_path: Path, noise: float | None, step: float
) -> None:
    """At the start a step of 1e-3 s loses so much energy that the run is rejected, whatever the noise.

    Noise that is not stated is the one that the data show.
    """
    problem = let_go(tmp_path, noise)
    scene = problem.load_scene()
    model = ForwardModel(problem, scene, get_engine("gauss"), measure(problem, scene))
    assert paced(model, model.parameters.start).scene.solver.step == pytest.approx(step)
    named = ForwardModel(
        problem, scene.with_values({"solver.integrator": "generalized-alpha"}), model.engine, model.measurement
    )
    assert paced(named, model.parameters.start) is named


@pytest.mark.slow
def test_modulus_and_damping_of_a_cantilever_that_is_let_go_follow_from_its_strain(tmp_path: Path) -> None:
    """With the scene's step of a millisecond the higher modes run late, runs lose energy, and the fit is rejected."""
    found = identify(let_go(tmp_path, NOISE))
    assert found.verdict == "identified", found.message
    for name, truth in (("E", MODULUS), ("ret", RETARDATION)):
        value = found.parameters[name]
        assert abs(value.value - truth) < 3 * value.std
        assert value.lower - value.std < truth < value.upper + value.std
