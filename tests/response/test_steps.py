"""Runs whose steps are too long for them are made with smaller ones, counted, and told."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import special
from scipy.integrate import solve_ivp
from shoal import simulate
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.notebook import uncertain
from shoal.response.machine import ResponseModel
from shoal.scene import Scene
from shoal.trajectory import Status

SOFT, STIFF, DRAWN, END, STEP = 4.0, 1e4, 0.1, 1.0, 0.018
"""Two bodies of 1 kg on springs [N/m]; the stiff one rests at its place. Leapfrog takes steps of 2 / sqrt(STIFF)."""


def springs(step: float) -> Scene:
    def spring(body: str, stiffness: float) -> dict[str, Any]:
        ground = {"body": "ground", "point": [-1.0, 0.0]}
        return {
            "kind": "spring",
            "first": ground,
            "second": {"body": body, "point": [0.0, 0.0]},
            "stiffness": stiffness,
            "length": 1.0,
        }

    guide = {"kind": "slider", "first": {"body": "ground", "point": [0.0, 0.0]}, "rotation": "locked"}
    return Scene.parse(
        {
            "name": "springs",
            "gravity": [0.0, 0.0],
            "bodies": {
                name: {"kind": "rigid-body", "mass": 1.0, "inertia": 1.0, "centre_of_mass": [0.0, 0.0]}
                for name in ("soft", "stiff")
            },
            "joints": {name: {**guide, "second": {"body": name, "point": [0.0, 0.0]}} for name in ("soft", "stiff")},
            "loads": {"soft-spring": spring("soft", SOFT), "stiff-spring": spring("stiff", STIFF)},
            "markers": {"P": {"body": "soft", "point": [0.0, 0.0]}},
            "initial": {"soft": {"position": [DRAWN, 0.0]}, "stiff": {"position": [0.0, 0.0]}},
            "solver": {"duration": END, "integrator": "leapfrog", "step": step, "samples": 4},
        }
    )


def expected_beyond(count: int, limit: float) -> float:
    """Return how many runs have a stiff spring beyond this: of the rules of 6, 12 and 24 points, and of those drawn."""
    beyond = 0.0
    for points in (6, 12, 24):
        z, weight = np.polynomial.hermite_e.hermegauss(points)
        some = np.outer(weight, weight) > 1e-12 * weight.sum() ** 2
        count -= int(some.sum())
        beyond += int(some[STIFF + 2000 * z > limit].sum())
    return beyond + count * float(special.ndtr(-(limit - STIFF) / 2000))


@pytest.mark.slow
def test_a_tail_beyond_the_stable_step() -> None:
    """Stiffness known to 20 %: many runs take smaller steps. The soft body's motion is in closed form.

    The steps' error jumps where smaller ones are taken, so that quadrature does not converge and chaos goes on.
    """
    vary = [f"loads.stiff-spring.stiffness~normal({STIFF},2000)", f"loads.soft-spring.stiffness~normal({SOFT},0.2)"]
    found = uncertain(springs(STEP), vary, [END], verify=False)
    assert found.ok, found.message
    assert found.failed == 0
    assert found.repeated == pytest.approx(expected_beyond(found.evaluations, (2 / STEP) ** 2), abs=8)
    z, weight = np.polynomial.hermite_e.hermegauss(40)
    place = DRAWN * np.cos(np.sqrt(SOFT + 0.2 * z) * END)
    mean = float(place @ weight / weight.sum())
    std = float(np.sqrt((place - mean) ** 2 @ weight / weight.sum()))
    assert found.statistics is not None
    # A step of h is off by (w h)^2 / 24 of the phase.
    off = DRAWN * 2 * END * (2 * STEP) ** 2 / 24
    assert found.column("P", "x", found.statistics.mean)[0] == pytest.approx(mean, abs=off)
    assert found.column("P", "x", found.statistics.std)[0] == pytest.approx(std, rel=1e-3)


def test_a_run_that_another_integrator_can_make() -> None:
    """A spring's end passes its anchor, where the force jumps; there explicit steps may become ever shorter."""
    stiffness, driven, end = 29.130278247578264, 5.559108123501284, 38.459483414117315
    ground = {"body": "ground", "point": [0.0, 0.0]}
    scene = Scene.parse(
        {
            "name": "through its anchor",
            "gravity": [0.0, 0.0],
            "bodies": {"b": {"kind": "point-mass", "mass": 1.0}},
            "joints": {"s": {"kind": "slider", "first": ground, "second": {"body": "b"}}},
            "loads": {
                "k": {
                    "kind": "spring",
                    "first": {"body": "ground", "point": [-1.0, 0.0]},
                    "second": {"body": "b"},
                    "stiffness": stiffness,
                    "length": 1.0,
                },
                "f": {"kind": "force", "at": {"body": "b"}, "force": [1.0, 0.0], "scale": f"cos({driven}*t)"},
            },
            "markers": {"p": {"body": "b"}},
            "initial": {"b": {"position": [0.0, 0.0]}},
            "solver": {"duration": end},
        }
    )

    def passed(t: float, y: Any, side: float) -> float:
        return float(y[0] + 1.0)

    passed.terminal = True  # type: ignore[attr-defined]
    at, state, side = 0.0, [0.0, 0.0], 1.0
    while at < end:
        found = solve_ivp(
            lambda t, y, side: [y[1], -stiffness * (y[0] + 1.0 - side) + np.cos(driven * t)],
            (at, end), state, "DOP853", args=(side,), events=passed, rtol=1e-11, atol=1e-12, max_step=0.01,
        )  # fmt: skip
        at, state, side = float(found.t[-1]), [-1.0 - side * 1e-15, found.y[1, -1]], -side
    values = {"loads.k.stiffness": np.array([stiffness, stiffness + 1e-3])}
    engine = get_engine("gauss")
    assert engine.simulate_many(scene, values, [end]).status[0] is Status.DIVERGED
    answers = ResponseModel(scene, np.array([end]), engine)(values)
    assert answers.good.all()
    assert answers.repeated == 1
    assert answers.values[0, 0] == pytest.approx(found.y[0, -1], abs=1e-6)


@pytest.mark.slow
def test_the_worst_case_beyond_the_stable_step_can_be_run() -> None:
    ends = {"loads.stiff-spring.stiffness": (STIFF, 2 * STIFF), "loads.soft-spring.stiffness": (3.8, 4.2)}
    found = uncertain(springs(STEP), ends, [END], limit=["P.x < -0.06"])
    assert found.ok, found.message
    assert found.repeated > 0
    shown = found.limits[0].shown
    assert shown is not None
    assert shown.status == "ok"
    exact = DRAWN * math.cos(math.sqrt(4.2) * END) + 0.06
    assert shown.margin == pytest.approx(exact, abs=1e-4)
    scene = springs(STEP).with_values(shown.values)
    assert simulate(scene, [END]).ok


def test_steps_that_are_too_long_for_the_machine_as_it_is_stated_are_refused() -> None:
    with pytest.raises(InputError, match="beyond the stability limit"):
        uncertain(springs(0.03), {"loads.soft-spring.stiffness": (3.8, 4.2)}, [END])
