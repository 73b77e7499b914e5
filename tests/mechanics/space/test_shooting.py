"""Curved, twisted and loaded director rods drawn at random, against Kirchhoff's equations solved by shooting."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import root
from shoal.mechanics.analysis.mesh_error import of_equilibrium
from shoal.mechanics.analysis.settled import settled
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene
from shoal.scene.sections import Rectangle

E, NU, L = 7e10, 0.3, 1.0


def drawn(seed: int) -> tuple[dict[str, Any], Any]:
    """A rod with a shape of its own, and a force at its end that bends it by up to a radian or so."""
    rng = np.random.default_rng(seed)
    h, w = rng.uniform(0.006, 0.02, 2)
    bent = {"curvature": rng.uniform(-1.0, 1.0, 2), "side_curvature": rng.uniform(-1.0, 1.0, 2),
            "twist": rng.uniform(-1.5, 1.5, 2)}  # fmt: skip
    kept = {name: [float(k) for k in shape] for name, shape in bent.items() if rng.random() < 0.7}
    force = rng.normal(size=3)
    force *= rng.uniform(0.3, 1.5) * E * min(h * w**3, w * h**3) / 12 / L**2 / np.linalg.norm(force)
    made = {"length": L, "youngs_modulus": E, "poisson_ratio": NU, "height": float(h), "width": float(w)}
    return made | kept, force


def scene(rod: dict[str, Any], force: Any, elements: int) -> Scene:
    end = {"body": "B", "point": "end"}
    return Scene.parse({
        "name": "clamped", "dimensions": 3, "gravity": [0, 0, 0],
        "bodies": {"B": {"kind": "rod", "density": 1.0, "element": "director-rod", "elements": elements} | rod},
        "joints": {"W": {"kind": "weld", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "B"}}},
        "loads": {"P": {"kind": "force", "at": end, "force": force.tolist()}}, "markers": {"e": end},
    })  # fmt: skip


def by_finite_elements(rod: dict[str, Any], force: Any, elements: int) -> Any:
    found = statics(scene(rod, force, elements))
    assert found.ok, found.message
    return found.marker("e")


def by_shooting(rod: dict[str, Any], force: Any) -> Any:
    """r' = (1 + n/EA) d1, D' = D [u], m' = f x r', u = u0 + K^-1 D'm, from the clamp on so that no moment is left."""
    h, w, length, modulus = rod["height"], rod["width"], rod["length"], rod["youngs_modulus"]
    shear = modulus / (2 * (1 + rod["poisson_ratio"]))
    torsion = rod.get("torsion_constant", float(Rectangle(h, w).torsion))
    stiffness = np.array([shear * torsion, modulus * h * w**3 / 12, modulus * w * h**3 / 12])
    names = ("twist", "side_curvature", "curvature")
    shapes = [np.polynomial.Polynomial(rod.get(name, [0.0])) for name in names]

    def end(moment: Any, part: float) -> Any:
        def rate(s: float, y: Any) -> Any:
            d = y[3:12].reshape(3, 3)
            turn = np.array([shapes[0](s), -shapes[1](s), shapes[2](s)]) + d.T @ y[12:] / stiffness
            x, up, z = turn
            along = (1 + part * force @ d[:, 0] / (modulus * h * w)) * d[:, 0]
            spin = np.array([[0, -z, up], [z, 0, -x], [-up, x, 0]])
            return np.concatenate([along, (d @ spin).ravel(), np.cross(part * force, along)])

        start = np.concatenate([np.zeros(3), np.eye(3).ravel(), moment])
        return solve_ivp(rate, (0.0, length), start, "DOP853", rtol=1e-11, atol=1e-12).y[:, -1]

    moment, size = np.zeros(3), np.linalg.norm(force) * length
    for part in np.linspace(0.1, 1.0, 10):
        found = root(lambda m, part=part: end(m * size, part)[12:] / size, moment, tol=1e-11)
        assert found.success, found.message
        moment = found.x
    return end(moment * size, 1.0)[:3]


def check(seed: int, counts: tuple[int, int]) -> tuple[float, float]:
    """Errors on two meshes [m]."""
    rod, force = drawn(seed)
    exact = by_shooting(rod, force)
    coarse, fine = (float(np.linalg.norm(by_finite_elements(rod, force, n) - exact)) for n in counts)
    assert fine < 2e-3
    assert fine < 1e-6 or math.log(coarse / fine) / math.log(counts[1] / counts[0]) > 1.7
    return coarse, fine


@pytest.mark.slow
def test_a_random_rod_converges_to_kirchhoffs_and_its_mesh_error_is_told() -> None:
    """It is a third more than what twice as many elements change."""
    error, _ = check(0, (6, 12))
    one = scene(*drawn(0), 6)
    told = of_equilibrium(statics(one), one).errors.estimates["mesh"]
    assert told is not None
    assert error <= told <= 1.3 * error


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(1, 60))
def test_many_random_rods_converge_to_kirchhoffs(seed: int) -> None:
    check(seed, (16, 32))


@pytest.mark.slow
@pytest.mark.parametrize("load", [4.448, 8.896, 13.345])
@pytest.mark.parametrize("angle", range(0, 91, 15))
def test_the_princeton_beam_rests_within_the_tolerance(load: float, angle: int) -> None:
    """All its loads [N] and angles [degrees]; the torsion constant is 0.198 of the polar moment, as published."""
    h, w = 12.3777e-3, 3.2024e-3
    rod = {"length": 0.508, "height": h, "width": w, "youngs_modulus": 71.7e9, "poisson_ratio": 0.31,
           "torsion_constant": 0.198 * (h * w**3 + w * h**3) / 12}  # fmt: skip
    force = load * np.array([0.0, math.cos(math.radians(angle)), math.sin(math.radians(angle))])
    found = settled(scene(rod, force, 2), 1e-5)
    assert found.ok
    assert np.linalg.norm(found.marker("e") - by_shooting(rod, force)) < 1e-5
