"""No run of ours may say `ok` and be wrong: a few cells of every stability map, and all cells as slow tests."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from shoal.trajectory import Status
from shoal_validation.judge import Outcome
from shoal_validation.stability import MAPS
from shoal_validation.stability.charts import draw
from shoal_validation.stability.contract import StabilityMap
from shoal_validation.stability.methods import EXUDYN, unchecked
from shoal_validation.stability.page import section
from shoal_validation.stability.survey import Result, survey

FEW: dict[str, tuple[tuple[str, ...], tuple[Any, ...], tuple[Any, ...]]] = {
    "step-stiffness": (("leapfrog", "energy-momentum"), (3e-4, 1e-2, 5e-2), (1e-2, 1.0)),
    "tolerance-stiffness": (("dop853",), (1e-6, 1e-3, 1e-1), (1e-2, 1.0)),
    "step-slenderness": (("leapfrog", "generalized-alpha 1", "auto"), (3e-4, 1e-2, 5e-2), (20.0, 500.0)),
    "tolerance-slenderness": (("dop853",), (1e-3, 1e-1), (20.0, 500.0)),
    "step-machine": (
        ("leapfrog", "rk4", "generalized-alpha 1", "energy-momentum", "dop853"),
        (1e-3, 1e-2, 1e-1),
        ("pendulum", "parallelogram", "slider-crank"),
    ),
    "tolerance-machine": (("dop853", "radau5"), (1e-9, 1e-6, 1e-1), ("parallelogram", "slider-crank")),
    "singular": (("projection", "kkt", "proximal, drift left", "baumgarte"), (0.0, 1e-8, 1e-2), (1.0, 30.0)),
    "rank-tolerance": (("dop853", "leapfrog"), (0.0, 1e-6, 1e-2), (1e-12, 1e-5, 1e-2)),
    "quadrature": (("gauss, cable, full", "gauss, quintic"), (1, 2), (20.0, 500.0)),
    "long-runs": (("leapfrog", "rk4", "generalized-alpha 0.9"), (1e3, 1e4), (1e-3,)),
    "chaos": (("leapfrog", "energy-momentum", "dop853"), (1.0, 8.0), (1e-3, 5e-2)),
    "space-singular": (
        ("projection", "kkt", "proximal, drift left", "dop853"),
        (0.0, 1e-8, 1e-2),
        ("parallelogram on balls", "bennett"),
    ),
    "space-step": (("leapfrog", "rk4", "energy-momentum"), (1e-3, 1e-1), ("spherical-pendulum", "bricard")),
    "space-spin": (("leapfrog", "rk4", "generalized-alpha 1"), (1e-3, 1e-2), (1.0, 1000.0)),
    "space-slenderness": (("leapfrog", "generalized-alpha 0.9"), (2e-4, 1e-2), (100.0, 500.0)),
    "space-twist": (("director rod, generalized-alpha",), (1, 4), (0.0, 24.0)),
    "chaos-flexible": (("leapfrog", "generalized-alpha 1"), (0.5, 2.5), (5e-4, 1e-3)),
    "contacts-step": (("auto", "leapfrog"), (0.0, 0.8, 1.0), (0.02, 1e-3)),
    "contacts-gap": (("auto", "rk4"), (-0.5, 0.0), (0.0, 0.8)),
    "contacts-grazing": (("auto", "leapfrog", "semi-implicit-euler"), (1e-9, 1e-4), (0.02, 1e-3)),
    "contacts-friction": (("auto", "leapfrog"), (0.0, 0.2, 1.0), (0.0, 0.95)),
    "contacts-count": (("auto", "rk4"), (1, 8), (1e-3,)),
}
"""Methods, x and y of the fast tests; among them cells at which a single run says `ok` and is wrong."""

LONG = ("step-stiffness", "step-slenderness", "tolerance-machine", "space-step", "space-slenderness", "space-twist")


def _few(name: str) -> StabilityMap:
    methods, x, y = FEW[name]
    whole = MAPS[name]
    chosen = tuple(method for method in whole.methods if method.name in methods)
    assert len(chosen) == len(methods)
    return replace(whole, methods=chosen, x=replace(whole.x, values=x), y=replace(whole.y, values=y))


def _silent(result: Result) -> list[str]:
    return [
        f"{method}: {result.x.name} {cell.x}, {result.y.name} {cell.y}, error {cell.error:.3g} m"
        for method, cell in result.silent
    ]


def test_a_few_cells_of_every_map_are_chosen() -> None:
    assert set(FEW) == set(MAPS)


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.slow] * (name in LONG)) for name in FEW])
@pytest.mark.by_day(2)
def test_nothing_of_ours_is_silently_wrong_on_a_few_cells(name: str) -> None:
    result = survey(_few(name))
    assert _silent(result) == []
    # A map on which nothing holds would guard nothing.
    assert any(cell.outcome is Outcome.HOLDS for panel in result.panels for cell in panel.cells)


@pytest.mark.slow
@pytest.mark.parametrize("name", MAPS)
def test_nothing_of_ours_is_silently_wrong_on_the_whole_map(name: str) -> None:
    whole = MAPS[name]
    assert _silent(survey(replace(whole, methods=tuple(method for method in whole.methods if method.ours)))) == []


def test_maps_find_a_silently_wrong_run() -> None:
    """Exudyn's own word on the parallelogram with a step far too long; with our checks the same run is rejected."""
    checked = EXUDYN[1]
    where = MAPS["step-machine"]
    assert where.cell(unchecked(checked), 0.1, "parallelogram").outcome is Outcome.SILENT
    assert where.cell(checked, 0.1, "parallelogram").status == Status.ENERGY


def test_a_step_beyond_the_limit_is_refused_and_says_why() -> None:
    where = MAPS["step-stiffness"]
    cell = where.cell(where.methods[0], 5e-2, 1.0)
    assert cell.outcome is Outcome.REFUSED
    assert "beyond the stability limit" in cell.message


def test_a_turned_coupler_is_the_wrong_branch() -> None:
    where = MAPS["singular"]
    method = next(one for one in where.methods if one.name == "augmented-lagrangian, drift left")
    assert any(where.cell(method, 1e-2, ratio).branch for ratio in where.y.values)


def test_chart_and_section_are_written(tmp_path: Path) -> None:
    result = survey(_few("step-machine"))
    draw(result, tmp_path / "chart.png")
    assert (tmp_path / "chart.png").read_bytes().startswith(b"\x89PNG")
    text = section([result])
    assert result.question in text
    assert "| ours | 0 |" in text
