"""A study of identifications in MLflow: the study is the parent run, each optimisation a child."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np
from shoal.identification import Estimate, Measurement
from shoal.json_values import json_text
from shoal.pictures.signals import signals
from shoal.pictures.study import best_of as best_name
from shoal.scene import Rod

from shoal_flows.jobs import Cell, Fit
from shoal_flows.pictures import Album
from shoal_flows.tracking.data import of_measurement
from shoal_flows.tracking.motion import log_motion
from shoal_flows.tracking.store import Run, open_run
from shoal_flows.verdicts import verdict

ARCHIVE = "estimate.json"
"""The artifact that `shoal report` reads."""


@contextmanager
def open_study(name: str, cells: Sequence[Cell], measurement: Measurement) -> Iterator[Run]:
    """The parent run of a study."""
    problem = cells[0].title
    description = f"{len(cells)} optimisations of {problem}; data: {measurement.origin}"
    with open_run("Identification", name, description=description, tags={"kind": "study", "problem": problem}) as run:
        run.params({"problem": problem, "data": measurement.origin, "cells": ", ".join(cell.name for cell in cells)})
        run.data = of_measurement(measurement)
        yield run


def log_outcome(study: Run, fits: Sequence[Fit], failures: Mapping[str, str], pictures: Mapping[str, bytes]) -> None:
    """Log the outcome of a study over all its fits; failures: messages by the name of the cell."""
    study.metric("study/trusted", sum(f.estimate.verdict.trusted for f in fits))
    study.metric("study/failed", len(failures))
    for name, picture in pictures.items():
        study.picture(picture, name)
    table = summary(fits, failures)
    study.text(table, "summary.md")
    study.describe(f"{table}\n{study.tags['mlflow.note.content']}")
    if best := best_of(fits):
        study.judge(*verdict(best.estimate))
        study.tags["machine"] = best.estimate.scene.name
        study.params({"method": best.cell.name})
        study.tags |= _columns(best.estimate)
        study.metric("final/fitness", best.estimate.fitness)
        study.metric("final/rms", best.estimate.rms)
        for name, value in best.estimate.parameters.items():
            study.metric(f"final/{name}", value.value)
            study.metric(f"interval/{name}/lower", value.lower)
            study.metric(f"interval/{name}/upper", value.upper)


def best_of(fits: Sequence[Fit]) -> Fit | None:
    """The best of those that can be trusted, else of all; None if there are none."""
    by_name = {fit.cell.name: fit for fit in fits}
    return by_name[best_name({name: fit.estimate for name, fit in by_name.items()})] if by_name else None


def summary(fits: Sequence[Fit], failures: Mapping[str, str]) -> str:
    """The study as a table in Markdown."""
    lines = ["| method | values | fitness | RMS | evaluations | time [s] | verdict |", "|---|---|---|---|---|---|---|"]
    for fit in fits:
        e = fit.estimate
        values = _values(e)
        numbers = f"{e.fitness:.4e} | {e.rms:.3e} | {e.evaluations} | {e.wall_s:.2f}"
        lines.append(f"| {fit.cell.name} | {values} | {numbers} | {e.verdict} |")
    lines += [f"| {name} | {reason} | | | | | failed |" for name, reason in failures.items()]
    return "\n".join(lines) + "\n"


def answer(fits: Sequence[Fit]) -> str:
    """The best fit in one line."""
    best = best_of(fits)
    if best is None:
        return "no optimisation came to its end"
    return f"{_values(best.estimate)}: {best.estimate.verdict} ({best.cell.name})"


def _values(estimate: Estimate) -> str:
    return ", ".join(f"{name} = {value.value:.6f}" for name, value in estimate.parameters.items())


def _columns(estimate: Estimate) -> dict[str, str]:
    """The answer and its fit for columns of the run table, rounded: MLflow writes all digits of its metrics."""
    values = {**estimate.parameters, **estimate.quantities}
    return {
        "answer": ", ".join(
            f"{name} {rounded(value.value, value.lower, value.upper)}" for name, value in values.items()
        ),
        "fit": f"fitness {estimate.fitness:.2e}, RMS {estimate.rms:.2e}",
    }


def rounded(value: float, lower: float, upper: float) -> str:
    """Return a value with half of its interval, to two digits of that; a value without an interval to three digits."""
    half = (upper - lower) / 2
    if not (math.isfinite(half) and half > 0):
        return f"{value:.3g} (open)"
    digits = 1 - math.floor(math.log10(half))
    if not -4 <= digits <= 6:
        return f"{value:.{max(1, digits + math.floor(math.log10(abs(value) or 1)))}e} ± {half:.1e}"
    return f"{round(value, digits):.{max(digits, 0)}f} ± {round(half, digits):.{max(digits, 0)}f}"


def log_fit(fit: Fit, album: Album, study: str) -> str:
    """A child of the run `study` with all there is to know about one fit; returns its id."""
    cell, estimate = fit.cell, fit.estimate
    tags = {"kind": "optimisation", "problem": cell.title, "method": cell.method}
    tags |= {"findings": ", ".join(estimate.codes), **_columns(estimate)}
    judged = verdict(estimate)
    about = "" if judged.doubts else estimate.message
    with open_run("Identification", cell.name, tags=tags, parent=study, description=about, took=estimate.wall_s) as run:
        run.judge(*judged)
        scene = estimate.scene
        run.data = of_measurement(estimate.measurement)
        mesh = {name: sum(b.mesh.values()) for name, b in scene.bodies.items() if isinstance(b, Rod) and b.mesh}
        run.params({"problem": cell.title, "method": cell.method, "seed": cell.seed, "engine": cell.engine})
        run.params({"scene": scene.name, "scene.fingerprint": scene.fingerprint, "data": estimate.data})
        run.params({"mesh": ", ".join(f"{name}: {n}" for name, n in mesh.items()) or "rigid", **cell.values})
        _log_progress(run, fit)
        _log_result(run, fit)
        for name, recording in estimate.measurement.recordings.items():
            prefix = f"{name}/" if len(fit.motions) > 1 else ""
            motion = fit.motions[name]
            log_motion(run, motion, recording.channels[0].marker, prefix, told=motion.ok)
        for name, picture in album.pictures.items():
            run.picture(picture, name)
        run.text(album.page, "report.html")
        run.text(json_text(album.archive, indent=1), ARCHIVE)
        return run.run_id


def _log_progress(run: Run, fit: Fit) -> None:
    """Fitness by iteration, and after how many evaluations the best of each iteration had been found."""
    counted, values = fit.estimate.history
    for iteration, best, mean in fit.estimate.iterations:
        run.metric("fitness/best", best, iteration)
        # MLflow's charts begin with linear axes, on which all but the first steps lie on the floor.
        run.metric("fitness/best log10", math.log10(best) if best > 0 else -math.inf, iteration)
        run.metric("fitness/mean", mean, iteration)
        reached = np.flatnonzero(values <= best)
        if reached.size:
            run.metric("fitness/evaluations", float(counted[reached[0]]), iteration)


def _log_result(run: Run, fit: Fit) -> None:
    estimate = fit.estimate
    run.metric("final/fitness", estimate.fitness)
    run.metric("final/rms", estimate.rms)
    run.metric("final/evaluations", estimate.evaluations)
    run.metric("final/wall_s", estimate.wall_s)
    run.metric("final/trusted", float(estimate.verdict.trusted))
    run.metric("final/residual_autocorrelation", estimate.residual_autocorrelation)
    for signal in signals(estimate):
        run.metric(f"rms/{signal.recording}/{signal.channel.label}", signal.rms)
    for name, value in {**estimate.parameters, **estimate.quantities}.items():
        run.metric(f"final/{name}", value.value)
        run.metric(f"interval/{name}/lower", value.lower)
        run.metric(f"interval/{name}/upper", value.upper)
        run.metric(f"interval/{name}/std", value.std)
        if value.correction is not None:
            run.metric(f"correction/{name}", value.correction)
    for name, true in estimate.truth.items():
        run.metric(f"error/{name}", estimate.parameters[name].value - true)
    for one in estimate.prediction:
        window = f"{one.recording}/{one.window[0]:g} to {one.window[1]:g} s"
        for channel in one.channels:
            run.metric(f"held out/{window}/{channel.marker}.{channel.quantity}/rms", channel.rms)
            run.metric(f"held out/{window}/{channel.marker}.{channel.quantity}/limit", channel.limit)
    if estimate.posterior is not None:
        run.metric("posterior/effective", estimate.posterior.worth)
        for name, drawn in estimate.posterior.marginals.items():
            for what in ("mean", "sd", "lower", "upper", "r_hat"):
                run.metric(f"posterior/{name}/{what}", getattr(drawn, what))
