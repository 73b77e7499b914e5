"""Uncertain responses in MLflow: one run a study, with its bounds or statistics, its charts and its worst cases."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from shoal.json_values import json_text
from shoal.response import Response
from shoal.scene.edited import as_yaml

from shoal_flows.tracking.engines import log_errors
from shoal_flows.tracking.store import Run, open_run
from shoal_flows.verdicts import verdict

POINTS = 300
"""Of a curve, at most."""


def log_response(study: str, found: Response, album: Mapping[str, bytes]) -> str:
    """One run; album: artifacts by path. Returns its id."""
    scene = found.stated
    tags = {"kind": "uncertain", "scene": scene.name, "findings": ", ".join(found.codes)}
    with open_run("Uncertain", f"{study} · uncertain", description=scene.description, tags=tags) as run:
        run.judge(*verdict(found))
        known = {f"vary.{one.name}": one.marginal.text for one in found.inputs.parameters}
        run.params({"study": study, "scene": scene.name, "method": found.method, "seed": found.seed, **known})
        run.params({"why": found.why, "engine": found.engine})
        run.text(as_yaml(scene.model_dump(mode="json")), "scene.yaml")
        run.text(json_text(found.to_json(), indent=1), "response.json")
        for path, content in album.items():
            run.picture(content, path)
        _figures(run, found)
        return run.run_id


def _figures(run: Run, found: Response) -> None:
    run.metric("wall_s", found.wall_s)
    for name in ("evaluations", "repeated", "failed", "horizon"):
        run.metric(f"final/{name}", float(getattr(found, name)))
    log_errors(run, found.errors)
    told = {}
    if found.bounds is not None:
        run.metric("final/gap", found.bounds.gap)
        told = {"lower": found.bounds.lower, "upper": found.bounds.upper}
    if found.statistics is not None:
        told |= {"mean": found.statistics.mean, "std": found.statistics.std}
    if found.boxes is not None:
        run.metric("final/gap", found.boxes.gap)
        mean, std = found.boxes.mean, found.boxes.std
        told = {"mean_lower": mean.lower, "mean_upper": mean.upper, "std_lower": std.lower, "std_upper": std.upper}
    some = np.unique(np.linspace(0, len(found.times) - 1, min(POINTS, len(found.times))).astype(int))
    for marker in found.markers:
        for quantity in found.quantities:
            for name, of in told.items():
                values = found.column(marker, quantity, of)
                run.metric(f"final/{marker}.{quantity}/{name}", float(values[-1]))
                steps = ((round(1000 * found.times[k]), float(values[k])) for k in some)
                run.series(f"{marker}.{quantity}/{name}", steps)
    for k, judged in enumerate(found.limits):
        run.params({f"limit.{k}": judged.limit.title})
        if judged.exceedance is not None:
            run.metric(f"final/limit.{k}/probability", judged.exceedance.estimate.probability)
        elif judged.between is not None:
            for side, chance in zip(("lower", "upper"), judged.between.estimates, strict=True):
                run.metric(f"final/limit.{k}/probability_{side}", chance)
        elif judged.kept is not None:
            run.metric(f"final/limit.{k}/kept", float(judged.kept))
