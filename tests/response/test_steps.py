"""Runs whose steps are too long for them are made with smaller ones, counted, and told."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy import special
from shoal import simulate
from shoal.errors import InputError
from shoal.response import uncertain
from shoal.scene import Scene

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


def test_a_tail_beyond_the_stable_step() -> None:
    """Stiffness known to 20 %: an eighth of the runs take smaller steps. The soft body's motion is in closed form."""
    vary = [f"loads.stiff-spring.stiffness~normal({STIFF},2000)", f"loads.soft-spring.stiffness~normal({SOFT},0.2)"]
    found = uncertain(springs(STEP), vary, [END], verify=False)
    assert found.ok, found.message
    assert found.failed == 0
    beyond = special.ndtr(-((2 / STEP) ** 2 - STIFF) / 2000)
    assert found.repeated == pytest.approx(beyond * found.evaluations, abs=0.1 * found.evaluations)
    assert found.repeated > 0
    z, weight = np.polynomial.hermite_e.hermegauss(40)
    place = DRAWN * np.cos(np.sqrt(SOFT + 0.2 * z) * END)
    mean = float(place @ weight / weight.sum())
    assert found.statistics is not None
    # A step of h is off by (w h)^2 / 24 of the phase.
    off = DRAWN * 2 * END * (2 * STEP) ** 2 / 24
    assert found.column("P", "x", found.statistics.mean)[0] == pytest.approx(mean, abs=off)


def test_the_worst_case_beyond_the_stable_step_can_be_run() -> None:
    ends = {"loads.stiff-spring.stiffness": (STIFF, 2 * STIFF), "loads.soft-spring.stiffness": (3.8, 4.2)}
    found = uncertain(springs(STEP), ends, [END], limits=["P.x < -0.06"])
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
