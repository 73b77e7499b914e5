"""Newton's iteration of implicit steps: kept factors change no answer, constraints stay sparse, guesses follow."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numba import njit
from shoal.compile.pointers import raw
from shoal.mechanics.assembly.build import build
from shoal.mechanics.integrators import guess
from shoal.mechanics.numerics.tile import SINGLE
from shoal.mechanics.simulate import simulate
from shoal.mechanics.tangent import tangent_tile
from shoal.mechanics.workspace import at_start
from shoal.scene import load_scene

ALL = slice(0, 1)


@njit(cache=True)
def _walk(tile, arrays, room, memory, path, step, missed):  # type: ignore[no-untyped-def]
    """Go along a path, (instants, unknowns), with a poor guess of its own; missed: distance of what was guessed."""
    m, w, g = raw(arrays), raw(room), raw(memory)
    for n in range(len(missed)):
        for i in range(m.unknowns):
            w.z[i] = path[n, i]
        guess.start(tile, m, g, w.z, step)
        for i in range(m.unknowns):
            w.z[i] += 100.0
        guess.improve(tile, m, g, w.z, w.a)
        for i in range(m.unknowns):
            missed[n] = max(missed[n], abs(w.z[i] - path[n + 1, i]))
            w.z[i] = path[n + 1, i]
        guess.learn(tile, m, g, w.z)


def _missed(path: Any) -> Any:
    model = build(load_scene("rigid-double-pendulum"))
    arrays, room = at_start(model, SINGLE, ALL)
    missed = np.zeros(len(path) - 1)
    _walk(SINGLE, arrays, room, guess.guess_room(model, SINGLE), path[:, : model.unknowns].copy(), 0.1, missed)
    return missed


@pytest.mark.slow
def test_a_cubic_path_is_guessed_once_it_is_seen() -> None:
    t = 0.1 * np.arange(9)[:, None]
    missed = _missed(1.0 + t - 2.0 * t**2 + 3.0 * t**3 * np.arange(1, 9))
    assert missed[0] > 50.0
    np.testing.assert_allclose(missed[5:], 0.0, atol=1e-12)


def test_a_path_that_jumps_is_guessed_anew() -> None:
    t = 0.1 * np.arange(12)[:, None]
    path = np.repeat(t**2, 8, axis=1)
    path[6:] += 1e6
    missed = _missed(path)
    np.testing.assert_allclose(missed[[4, 11 - 1]], 0.0, atol=1e-6)
    assert missed[5] > 1e5


@pytest.mark.parametrize("integrator", ["generalized-alpha", "energy-momentum", "implicit-gauss"])
@pytest.mark.parametrize("name", ["flexible-double-pendulum", "n-four-bar-2"])
def test_kept_factors_change_no_answer(name: str, integrator: str) -> None:
    """What is left of Newton's error at the usual tolerance is no larger than in a run that iterates to round-off."""
    times = np.linspace(0.0, 0.3, 7)[1:]
    settings = {"solver.integrator": integrator, "solver.step": 5e-3, "solver.energy_tolerance": 1.0}
    scene = load_scene(name).with_values(settings)
    usual, exact = simulate(scene, times), simulate(scene.with_values({"solver.newton_tolerance": 1e-13}), times)
    assert usual.ok
    assert exact.ok
    np.testing.assert_allclose(usual.points, exact.points, rtol=0, atol=1e-8)


def test_constraints_cost_no_more_than_they_touch() -> None:
    """The factor with multipliers of a forty-fold linkage: a few entries a row."""
    model = build(load_scene("n-four-bar-40"))
    pattern = tangent_tile(model, SINGLE, ALL, held=True).pattern
    assert pattern.size == model.unknowns + model.constraints.size
    assert pattern.slots < 7 * pattern.size


def test_many_constraints_move_as_by_an_explicit_integrator() -> None:
    times = np.array([0.025, 0.05])
    scene = load_scene("n-four-bar-40")
    implicit = simulate(scene.with_values({"solver.integrator": "generalized-alpha", "solver.step": 5e-4}), times)
    explicit = simulate(scene.with_values({"solver.integrator": "rk4", "solver.step": 5e-4}), times)
    assert implicit.ok
    np.testing.assert_allclose(implicit.points, explicit.points, rtol=0, atol=1e-6)
