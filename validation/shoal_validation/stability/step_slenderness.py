"""Step against slenderness: the thickness of both rods, on the paper's mesh and with its moduli."""

from __future__ import annotations

from shoal_validation.stability.contract import Axis
from shoal_validation.stability.steps import step_map, tolerance_map

SLENDERNESS = Axis("length over thickness of AB", "", (20.0, 100.0, 500.0, 2000.0))


def _change(slenderness: float) -> dict[str, object]:
    return {"bodies.OA.height": 2.0 / slenderness, "bodies.AB.height": 2.0 / slenderness}


STEP = step_map(
    "step-slenderness",
    "How long may the steps of each method be as the rods get thinner?",
    "The explicit limit is the same at every thickness: the stretching of the cable elements sets it. Thin rods "
    "flutter, and implicit steps that do not resolve this lose energy or phase. Engines without a limit of the "
    "step go on beyond it.",
    SLENDERNESS,
    _change,
)
TOLERANCE = tolerance_map(
    "tolerance-slenderness",
    "What do loose tolerances cost as the rods get thinner?",
    "The same picture at every thickness: the tolerance decides, and the energy check catches what it let through.",
    SLENDERNESS,
    _change,
)
