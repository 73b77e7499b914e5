"""Order and tolerance through nine impacts, by elliptic functions; peers of the same case, and the study of costs."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from shoal_validation.contacts.cases import CASES, G, pendulum, struck
from shoal_validation.contacts.peers import PEERS, ours
from shoal_validation.contacts.precision import Point, cheapest, costs

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")


def error(name: str, **solver: Any) -> float:
    case = CASES[name]()
    run = ours(case, **solver)
    assert run.ok
    return case.error(run.angles, run.places)


def test_the_reference_is_the_motion_of_the_rod() -> None:
    """Nine impacts located by scipy."""

    def gap(_: float, y: Any) -> float:
        return float(y[0] + 0.2)

    gap.terminal, gap.direction = True, -1.0  # type: ignore[attr-defined]
    time, state, impacts = 0.0, [np.pi / 3, 0.0], 0
    while True:
        way = solve_ivp(lambda _, y: [y[1], -1.5 * G * np.sin(y[0])], (time, 10.0), state, events=gap, method="DOP853",
                        rtol=1e-12, atol=1e-13)  # fmt: skip
        if way.status == 0:
            break
        time, state, impacts = way.t[-1], [-0.2 + 1e-15, -0.8 * way.y[1, -1]], impacts + 1
    assert impacts == 9
    assert struck(-0.2, 0.8, np.pi / 3, 10.0) == pytest.approx(way.y[0, -1], abs=1e-10)


@pytest.mark.parametrize(
    ("integrator", "least", "order", "within"), [("leapfrog", 10_000, 2, 0.1), ("rk4", 1000, 4, 0.2)]
)
def test_fixed_steps_keep_their_order_through_nine_impacts(
    integrator: str, least: float, order: int, within: float
) -> None:
    """Slope over three octaves, from so many steps in 10 s, where the term of the next order is small enough."""
    counts = least * 2.0 ** np.arange(0.0, 3.1, 0.5)
    errors = [error("pendulum", integrator=integrator, step=float(10.0 / count)) for count in counts]
    assert -np.polyfit(np.log(counts), np.log(errors), 1)[0] == pytest.approx(order, abs=within)


def test_the_error_of_dop853_is_proportional_to_its_tolerance_down_to_round_off() -> None:
    """Within a factor of 20 of it from 1e-4 to 1e-12, for all nine decades."""
    for tolerance in 10.0 ** -np.arange(4.0, 13.0):
        assert error("pendulum", relative_tolerance=float(tolerance)) < 20.0 * tolerance


@pytest.mark.parametrize("name", ["guide", "balls"])
def test_ours_meets_the_references(name: str) -> None:
    assert error(name, relative_tolerance=1e-12) < 5e-11


@pytest.mark.parametrize("peer", [pytest.param(one, marks=[pytest.mark.slow] * (one == "Exudyn")) for one in PEERS])
def test_peers_come_near_the_first_impacts_of_the_reference(peer: str) -> None:
    """Two impacts in 1.3 s, by 1e-4 s a step: errors of a hundredth, as springs and first order have."""
    pytest.importorskip({"Exudyn": "exudyn", "MuJoCo": "mujoco"}.get(peer, "numpy"))
    case = pendulum(time=1.3)
    run = PEERS[peer](case, 13_000, *((1.0,) if peer != "Moreau-Jean" else ()))
    assert run.ok
    assert case.error(run.angles, run.places) < 0.02


def test_the_cost_of_an_error_is_that_of_the_cheapest_setting_within_it() -> None:
    measured = [("dop853", "a", 1e-4, 1e-3), ("dop853", "b", 1e-8, 2e-3), ("Exudyn", "c", 2e-3, 0.5),
                ("Exudyn", "d", 1e-3, 3.0)]  # fmt: skip
    points = [Point("pendulum", *one) for one in measured]
    found = cheapest(points, "pendulum", ("Exudyn",), 3e-3)
    assert found is not None
    assert found.setting == "c"
    assert cheapest(points, "pendulum", ("Exudyn",), 1e-4) is None
    row = next(line for line in costs(points).splitlines() if "3e-03" in line)
    assert "1 ms: dop853, a" in row
    assert "500 ms, 500 times: c" in row
    assert row.count("not reached") == 2
