"""Views of the run table, kept with an experiment: MLflow's pages list them under "Views"."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

_CREATED = 1_767_225_600_000
"""When the views were made [ms]: a fixed instant, so that the same views are the same tags."""
_WIDE = 160
"""Of a column of numbers [px]: MLflow writes them without exponents."""


@dataclass(frozen=True)
class View:
    """A saved view. columns: of the run table, as `kind.name`; filters: facets of the search, by MLflow's names."""

    name: str
    columns: Sequence[str]
    filters: Mapping[str, str | bool] = field(default_factory=dict)

    @property
    def tag(self) -> str:
        """The value of the tag by which an experiment keeps it."""
        parts = (column.partition(".") for column in self.columns)
        keys = {f"{kind}.`{name}`": kind for kind, _, name in parts}
        widths = {key: _WIDE for key, kind in keys.items() if kind == "metrics"}
        columns = {"selectedColumns": list(keys), "columnOrder": list(keys), "columnWidths": widths}
        state = {**self.filters, **columns}
        stamps = {"createdAt": _CREATED, "updatedAt": _CREATED}
        return json.dumps({"name": self.name, **stamps, "state": json.dumps(state)})


_FIT = (
    "params.problem",
    "params.method",
    "tags.verdict",
    "metrics.final/fitness",
    "metrics.final/rms",
    "metrics.final/evaluations",
)
_BEST: Mapping[str, str | bool] = {
    "searchFilter": "tags.kind = 'optimisation'",
    "orderByKey": "metrics.`final/fitness`",
    "orderByAsc": True,
}
VIEWS: dict[str, dict[str, View]] = {
    "Identification": {
        "best": View("Fits, best first", _FIT, _BEST),
        "best-today": View("Fits of the last 24 hours, best first", _FIT, {**_BEST, "startTime": "LAST_24_HOURS"}),
        # MLflow takes two seconds longer to draw a hundred rows with its column `Dataset`.
        "studies": View("Studies", (*_FIT[:-1], "params.data"), {"searchFilter": "tags.kind = 'study'"}),
        "recordings": View(
            "Studies, by recording", ("attributes.Dataset", *_FIT[:-1]), {"searchFilter": "tags.kind = 'study'"}
        ),
    },
    "Comparison": {
        "studies": View(
            "Comparisons", ("params.scene", "params.engines", "tags.verdict"), {"searchFilter": "tags.kind = 'study'"}
        ),
    },
    "Forward": {
        "studies": View("Motions", ("params.scene", "params.engine", "tags.verdict", "metrics.final/energy_drift")),
    },
    "Sweep": {
        "studies": View("Sweeps", ("params.scene", "params.engine", "tags.verdict", "metrics.final/points")),
    },
    "Uncertain": {
        "studies": View("Studies", ("params.study", "params.method", "tags.verdict", "metrics.final/evaluations")),
    },
    "Validation": {
        "studies": View("Nights", ("tags.verdict", "params.night", "metrics.lines/passed", "metrics.lines/failed")),
    },
}
"""By experiment and key."""


def tags(experiment: str) -> dict[str, str]:
    """The views of an experiment as its tags."""
    return {f"mlflow.sharedViewState.{key}": view.tag for key, view in VIEWS.get(experiment, {}).items()}
