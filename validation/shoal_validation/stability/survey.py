"""Runs a map, counts what became of its cells, and keeps the result as JSON."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from shoal.json_values import plain

from shoal_validation.judge import Outcome
from shoal_validation.stability.contract import Axis, Cell, Panel, StabilityMap


@dataclass(frozen=True)
class Result:
    """A map that was run."""

    name: str
    question: str
    teaches: str
    x: Axis
    y: Axis
    panels: tuple[Panel, ...]

    @property
    def summary(self) -> str:
        """Silently wrong cells of ours, of others with our checks, and of others without, in one line."""
        ours = [panel for panel in self.panels if panel.ours]
        others = [panel for panel in self.panels if not panel.ours]
        groups = (
            ("ours", ours),
            ("other engines", [panel for panel in others if panel.checked]),
            ("other engines unchecked", [panel for panel in others if not panel.checked]),
        )
        return "silently wrong: " + ", ".join(
            f"{name} {sum(panel.count[Outcome.SILENT] for panel in group)} of {sum(len(p.cells) for p in group)}"
            for name, group in groups
            if group
        )

    @property
    def silent(self) -> list[tuple[str, Cell]]:
        """Silently wrong cells of ours, with the name of the method."""
        return [
            (panel.method, cell)
            for panel in self.panels
            if panel.ours
            for cell in panel.cells
            if cell.outcome is Outcome.SILENT
        ]

    def to_json(self) -> dict[str, Any]:
        """Plain data: axes once, the cells of each panel row by row of y."""
        data: dict[str, Any] = plain(
            {
                "question": self.question,
                "x": [self.x.title, *self.x.values],
                "y": [self.y.title, *self.y.values],
                "panels": {panel.method: [_brief(cell) for cell in panel.cells] for panel in self.panels},
            }
        )
        return data


def _brief(cell: Cell) -> dict[str, Any]:
    """Record of a cell: its class and the evidence, to three digits; settings where it is silently wrong."""
    evidence: dict[str, Any] = {"outcome": str(cell.outcome), "status": cell.status, "steps": cell.steps}
    for name in ("error", "energy_drift", "constraint_drift"):
        evidence[name] = float(f"{getattr(cell, name):.3g}")
    if cell.branch:
        evidence["branch"] = "wrong"
    if cell.message:
        evidence["message"] = cell.message
    if cell.outcome is Outcome.SILENT:
        evidence |= {"scene": cell.scene, "settings": cell.settings}
    return evidence


def survey(asked: StabilityMap, note: Callable[[str], None] = lambda _: None) -> Result:
    """Run every cell of a map; `note` is called for each finished panel."""
    panels = []
    for method in asked.methods:
        cells = tuple(asked.cell(method, x, y) for y in asked.y.values for x in asked.x.values)
        panel = Panel(method.name, method.ours, method.checked, cells)
        panels.append(panel)
        note(f"{asked.name}, {method.name}: " + ", ".join(f"{number} {kind}" for kind, number in panel.count.items()))
    return Result(asked.name, asked.question, asked.teaches, asked.x, asked.y, tuple(panels))


def stored(asked: StabilityMap, kept: dict[str, Any]) -> Result:
    """A map as `Result.to_json` keeps it, for a picture: its cells have their classes, and no settings."""
    places = [(x, y) for y in asked.y.values for x in asked.x.values]
    panels = []
    for method in asked.methods:
        rows = zip(places, kept["panels"][method.name], strict=True)
        cells = tuple(_read(place, evidence) for place, evidence in rows)
        panels.append(Panel(method.name, method.ours, method.checked, cells))
    return Result(asked.name, asked.question, asked.teaches, asked.x, asked.y, tuple(panels))


def _read(place: tuple[Any, Any], evidence: dict[str, Any]) -> Cell:
    numbers = {
        name: float("nan" if evidence[name] is None else evidence[name])
        for name in ("error", "energy_drift", "constraint_drift")
    }
    return Cell(
        *place,
        outcome=Outcome(evidence["outcome"]),
        status=evidence["status"],
        steps=evidence["steps"],
        branch="branch" in evidence,
        message=evidence.get("message", ""),
        scene=evidence.get("scene", ""),
        settings=evidence.get("settings", {}),
        **numbers,
    )
