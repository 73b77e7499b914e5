"""`elastic` of a spring at elongations from nanometres to hundreds of metres: against scipy on the law as written."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.mechanics.fitting import antiderivative, fit_law
from shoal.mechanics.functions import value
from shoal.mechanics.simulate import simulate
from shoal.scene import Function, Scene


def sled(law: str, start: float, duration: float) -> Scene:
    """A mass of 1 kg on a rail, held by a spring to a place far behind it; its elongation is where the mass is."""
    behind = 10.0 * abs(start)
    mass, ground = {"body": "m"}, {"body": "ground", "point": [0.0, 0.0]}
    return Scene.parse({
        "name": "sled", "gravity": [0.0, 0.0], "bodies": {"m": {"kind": "point-mass", "mass": 1.0}},
        "joints": {"rail": {"kind": "slider", "first": ground, "second": mass}},
        "loads": {"s": {"kind": "spring", "first": {"body": "ground", "point": [-behind, 0.0]}, "second": mass,
                        "stiffness": 0.0, "length": behind, "elastic": law}},
        "markers": {"m": mass}, "initial": {"m": {"position": [start, 0.0]}}, "solver": {"duration": duration},
    })  # fmt: skip


@pytest.mark.parametrize(
    ("law", "force", "start", "duration"),
    [
        ("4*t", lambda x: 4 * x, 1e-8, 2.0),
        ("4*t", lambda x: 4 * x, 150.0, 2.0),
        ("t**3", lambda x: x**3, 1.0, 4.0),
        ("1e12*t**3", lambda x: 1e12 * x**3, 1e-6, 8.0),
        ("exp(t) - 1", lambda x: np.exp(x) - 1, 0.5, 4.0),
        ("1e-3*(exp(40*t) - 1)", lambda x: 1e-3 * (np.exp(40 * x) - 1), 0.05, 4.0),
        ("1e9*max(t, 0)**1.5", lambda x: 1e9 * max(x, 0.0) ** 1.5, 1e-5, 0.004),
        ("2*t + 0.5*sin(8*t)", lambda x: 2 * x + 0.5 * np.sin(8 * x), 120.0, 4.0),
    ],
)
@pytest.mark.by_day(2)
def test_a_mass_moves_by_the_law_as_it_is_written(
    law: str, force: Callable[[float], float], start: float, duration: float
) -> None:
    times = np.linspace(0.0, duration, 9)[1:]
    run = simulate(sled(law, start, duration), times)
    assert run.ok, run.message
    wanted = solve_ivp(
        lambda _, y: [y[1], -force(y[0])], (0, duration), [start, 0.0], "DOP853", times, rtol=1e-12, atol=1e-13 * start
    )
    np.testing.assert_allclose(run.marker("m")[:, 0], wanted.y[0], atol=1e-7 * start)


@pytest.mark.parametrize("law", ["1/(0.2 - t)", "t", "3*t"])
def test_where_a_law_is_not_known_a_run_ends_and_says_so(law: str) -> None:
    """A pull that has a pole, and one that ends at a thousand metres."""
    scene = sled(law, 0.1 if "/" in law else 990.0, 4.0).with_values({"initial.m.velocity": [400.0, 0.0]})
    run = simulate(scene, np.array([4.0]))
    assert not run.ok
    assert any(step.startswith("`elastic` of the loads is known from") for step in run.advice)


@pytest.mark.parametrize("law", ["t**3", "exp(t) - 1", "max(t, 0)**1.5", "t - 0.3", "5 + t", "-2*tanh(5*t)"])
@pytest.mark.by_day(2)
def test_energy_is_the_integral_of_the_force_at_every_size(law: str) -> None:
    """By Gauss and Legendre on the law itself, from zero to elongations of all decades."""
    known, (nodes, weights) = antiderivative(fit_law(Function.model_validate(law))), np.polynomial.legendre.leggauss(30)
    for size in 10.0 ** np.arange(-8, 1):
        places = size * (nodes + 1) / 2
        wanted = size / 2 * weights @ Function.model_validate(law)(places.astype(np.longdouble)).astype(float)
        assert value(known, size) == pytest.approx(wanted, rel=1e-6), size
