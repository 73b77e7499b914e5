"""What can be known, in the user's words."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal.identification import Measurement, Problem, Verdict, identify, load_problem
from shoal.identification.uncertainty.rank import products


@pytest.mark.parametrize(
    ("names", "directions", "expected"),
    [
        (["k", "m"], [[1.0, 1.0]], ["k/m"]),
        (["E", "rho"], [[0.7, 0.7]], ["E/rho"]),
        (["m", "g"], [[1.0, -1.0]], ["m*g"]),
        (["I", "m", "k"], [[1.0, 1.0, 1.0]], ["I/k", "I/m"]),
        (["m", "v"], [[2.0, -1.0]], ["m*v^2"]),
        (["a", "b", "c"], [[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]], ["a*b*c"]),
    ],
)
def test_products_that_stay(names: list[str], directions: list[list[float]], expected: list[str]) -> None:
    assert products(np.array(directions).T, names) == expected


def test_directions_without_small_powers_have_no_product() -> None:
    assert products(np.array([[1.0, 0.3719]]).T, ["a", "b"]) == []
    assert products(np.array([[1.0]]), ["k2"]) == []


def test_a_damped_swing_shows_friction_over_mass_only() -> None:
    """Data: one angle by scipy, l'' = -g/l cos - c/(m l^2) l'."""

    def rate(_: float, y: np.ndarray) -> list[float]:
        return [y[1], -9.81 * np.cos(y[0]) - 0.2 * y[1]]

    times = np.arange(1, 201) / 100
    run = solve_ivp(rate, (0, 2), [-0.3, 0.0], "DOP853", t_eval=times, rtol=1e-10, atol=1e-10)
    angle = run.y[:1].T + 1e-3 * np.random.default_rng(0).standard_normal((200, 1))
    problem = Problem.parse(
        {
            "name": "swing",
            "scene": "single-pendulum",
            "parameters": {
                "theta": {"path": "initial.OA.angle", "lower": -1.5, "upper": 1.5},
                "c": {"path": "joints.O.friction", "lower": 0.01, "upper": 5.0, "start": 1.0, "scale": "log"},
                "m": {"path": "bodies.OA.mass", "lower": 0.1, "upper": 10.0, "start": 2.0},
            },
            "channels": [{"marker": "A", "quantity": "angle", "column": "angle"}],
            "quantities": {"c/m": "c / m"},
            "source": {"kind": "file"},
        },
        "swing",
    )
    measurement = Measurement.single(times, tuple(problem.channels), angle, "scipy", noise=1e-3)
    estimate = identify(problem, method="least-squares", measurement=measurement)
    assert estimate.verdict is Verdict.COMBINATION, estimate.message
    assert estimate.combinations == ["only c/m is known, not its factors"]
    assert estimate.quantities["c/m"].lower <= 0.2 <= estimate.quantities["c/m"].upper
    assert estimate.parameters["theta"].identifiable
    assert not estimate.parameters["c"].identifiable
    assert not estimate.parameters["m"].identifiable
    told = estimate.to_json()["parameters"]
    assert [told["m"][field] for field in ("std", "lower", "upper")] == [None, None, None]
    assert told["theta"]["lower"] < told["theta"]["value"] < told["theta"]["upper"]
    assert f"m {estimate.parameters['m'].value:.6g} (not known)" in repr(estimate)


@pytest.mark.slow
def test_a_flexible_machine_shows_stiffness_over_density_only() -> None:
    """Data: CasADi's own beams."""
    problem = load_problem("paper-case-1-same-mesh")
    stiff = {"lower": 1e6, "upper": 1e9, "start": 1.5e7, "scale": "log"}
    dense = {"lower": 1e3, "upper": 1e5, "start": 5000.0, "scale": "log"}
    data = problem.model_dump() | {
        "parameters": {"E": stiff, "rho": dense},
        "ties": {
            f"bodies.{rod}.{field}": text
            for rod, factor in (("OA", 10), ("AB", 1))
            for field, text in (("youngs_modulus", f"{factor} * E"), ("density", "rho"))
        },
    }
    problem = Problem.parse(data, "stiffness")
    estimate = identify(problem, method="least-squares")
    assert estimate.combinations == ["only E/rho is known, not its factors"]
    assert estimate.parameters["E"].value / estimate.parameters["rho"].value == pytest.approx(2e7 / 5540, rel=1e-4)
