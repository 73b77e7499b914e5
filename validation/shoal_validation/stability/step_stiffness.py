"""Step against stiffness: Young's moduli of both rods from rubber to ten times steel, on the paper's mesh."""

from __future__ import annotations

from shoal_validation.stability.contract import Axis
from shoal_validation.stability.steps import step_map, tolerance_map

FACTORS = Axis("Young's modulus over the paper's", "", (1e-2, 1.0, 1e2, 1e4))


def _change(factor: float) -> dict[str, object]:
    return {"bodies.OA.youngs_modulus": 2e8 * factor, "bodies.AB.youngs_modulus": 2e7 * factor}


STEP = step_map(
    "step-stiffness",
    "How long may the steps of each method be as the rods get stiffer?",
    "An explicit method is refused along a diagonal: its longest step falls with the root of the stiffness. Implicit "
    "ones are limited by the motion, not by the stiffness. Implicit Gauss damps the motion, which its energy shows. "
    "Capped inertia stretches the step of leapfrog three- to tenfold; beyond, where it slows what moves the machine, "
    "the second run rejects it.",
    FACTORS,
    _change,
)
TOLERANCE = tolerance_map(
    "tolerance-stiffness",
    "What do loose tolerances cost as the rods get stiffer?",
    "The implicit radau5 keeps its word at any stiffness. The explicit dop853 walks along its stability limit: "
    "with a loose tolerance its energy fails, and with the tightest one on the stiffest rods a million steps do "
    "not suffice.",
    FACTORS,
    _change,
)
