"""Views of the run table, kept with an experiment: MLflow's pages list them under "Views"."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

_CREATED = 1_767_225_600_000
"""When the views were made [ms]: a fixed instant, so that the same views are the same tags."""
_WIDTHS = {"params.problem": 220, "tags.verdict": 150, "tags.answer": 360, "tags.fit": 200}
"""Of columns whose texts are cut otherwise [px]; the first three are seen on a screen of 1440."""
_WIDE = 160
"""Of a column of numbers [px]: MLflow writes them without exponents."""


@dataclass(frozen=True)
class View:
    """A saved view.

    columns: of the run table, as `kind.name`; filters: facets of the search, by MLflow's names; charts: metrics with
    steps whose charts come first, by sections (what stands before the slash) in this order
    """

    name: str
    columns: Sequence[str]
    filters: Mapping[str, str | bool] = field(default_factory=dict)
    charts: Sequence[str] = ()

    @property
    def tag(self) -> str:
        """The value of the tag by which an experiment keeps it."""
        keys = {column: f"{kind}.`{name}`" for column in self.columns for kind, _, name in [column.partition(".")]}
        shown = list(keys.values())
        widths = {key: _WIDTHS.get(of, _WIDE) for of, key in keys.items() if of in _WIDTHS or of.startswith("metrics")}
        columns = {"selectedColumns": shown, "columnOrder": shown, "columnWidths": widths}
        state = {**self.filters, **columns, **(_charts(self.charts) if self.charts else {})}
        stamps = {"createdAt": _CREATED, "updatedAt": _CREATED}
        return json.dumps({"name": self.name, **stamps, "state": json.dumps(state)})


def _charts(metrics: Sequence[str]) -> dict[str, object]:
    """Charts before those that MLflow makes by itself, in its own form."""
    sections = dict.fromkeys(metric.partition("/")[0] for metric in metrics)
    common = {"isGenerated": True, "deleted": False}
    return {
        "isAccordionReordered": True,
        "compareRunSections": [
            {"uuid": f"shoal-{name}", "name": name, "display": True, "isReordered": True, **common} for name in sections
        ],
        "compareRunCharts": [
            {
                "type": "LINE",
                "uuid": f"shoal-{metric}",
                "metricSectionId": f"shoal-{metric.partition('/')[0]}",
                "metricKey": metric,
                "selectedMetricKeys": [metric],
                "displayName": metric.partition("/")[2],
                "runsCountToCompare": 10,
                "lineSmoothness": 0,
                "xAxisScaleType": "linear",
                "scaleType": "linear",
                "range": {},
                "xAxisKey": "step",
                "selectedXAxisMetricKey": "",
                "yAxisKey": "metric",
                "yAxisExpressions": [],
                "ignoreOutliers": False,
                "useGlobalXaxisKey": True,
                "useGlobalLineSmoothing": True,
                **common,
            }
            for metric in metrics
        ],
    }


_STUDY = ("params.problem", "tags.verdict", "tags.answer", "params.method", "tags.fit")
_FIT = (*_STUDY, "metrics.final/evaluations", "metrics.final/fitness")
_SEARCH = ("fitness/best log10", "fitness/best", "fitness/evaluations", "tip/x", "tip/y")
_TIP = ("tip/x", "tip/y")
_BEST: Mapping[str, str | bool] = {
    "searchFilter": "tags.kind = 'optimisation'",
    "orderByKey": "metrics.`final/fitness`",
    "orderByAsc": True,
}
VIEWS: dict[str, dict[str, View]] = {
    "Identification": {
        "best": View("Fits, best first", _FIT, _BEST, _SEARCH),
        "best-today": View(
            "Fits of the last 24 hours, best first", _FIT, {**_BEST, "startTime": "LAST_24_HOURS"}, _SEARCH
        ),
        # MLflow takes two seconds longer to draw a hundred rows with its column `Dataset`.
        "studies": View("Studies", (*_STUDY, "params.data"), {"searchFilter": "tags.kind = 'study'"}),
        "recordings": View(
            "Studies, by recording", ("attributes.Dataset", *_STUDY), {"searchFilter": "tags.kind = 'study'"}
        ),
    },
    "Comparison": {
        "studies": View(
            "Comparisons", ("params.scene", "params.engines", "tags.verdict"), {"searchFilter": "tags.kind = 'study'"}
        ),
    },
    "Forward": {
        "studies": View(
            "Motions", ("params.scene", "params.engine", "tags.verdict", "metrics.final/energy_drift"), charts=_TIP
        ),
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
