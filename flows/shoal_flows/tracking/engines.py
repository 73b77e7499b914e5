"""Comparisons, sweeps and single motions in MLflow."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.error_budget import ErrorBudget
from shoal.json_values import json_text
from shoal.pictures.choice import tells_places
from shoal.pictures.engines import engines
from shoal.pictures.files import rows
from shoal.pictures.style import png
from shoal.pictures.sweep import sweep as draw_sweep
from shoal.scene import Scene
from shoal.scene.edited import as_yaml
from shoal.selection import Selection
from shoal.trajectory import Trajectory

from shoal_flows.tracking.motion import log_ends, log_motion, tip
from shoal_flows.tracking.store import Run, open_run
from shoal_flows.verdicts import verdict


def log_comparison(comparison: Comparison, picture: bytes | None = None) -> str:
    """A parent run with the differences, a child per engine with its motion; returns the parent's id."""
    scene = comparison.scene
    tags = {"kind": "study", "scene": scene.name}
    with open_run("Comparison", f"{scene.name} · compare", description=scene.description, tags=tags) as study:
        study.judge(*verdict(comparison))
        study.params({**stated(scene), "engines": ", ".join(comparison.trajectories), **_refused(comparison)})
        for row in comparison.differences():
            pair = "-".join(row["engines"])
            for part in ("largest", "final"):
                if row[part] is not None:
                    study.metric(f"difference/{pair}/{row['marker']}/{part}", row[part])
        log_errors(study, comparison.errors)
        marker = tip(list(scene.markers))
        shown = picture or png(engines(comparison, marker, f"{scene.name}: the engines over each other"))
        study.picture(shown, "engines.png")
        study.text(json_text(comparison.differences(), indent=1), "differences.json")
        for name, motion in comparison.trajectories.items():
            tags = {"kind": "engine", "scene": scene.name, "findings": ", ".join(motion.codes)}
            with open_run("Comparison", name, tags=tags, parent=study.run_id) as run:
                run.judge(*verdict(motion))
                log_motion_of(run, scene, motion)
        return study.run_id


def log_forward(scene: Scene, motion: Trajectory, album: Mapping[str, bytes]) -> str:
    """One run; album: pictures by the name of their file. Returns its id."""
    tags = {"kind": "forward", "scene": scene.name, "findings": ", ".join(motion.codes)}
    name = f"{scene.name} · {motion.engine}"
    with open_run("Forward", name, description=scene.description, tags=tags) as run:
        run.judge(*verdict(motion))
        log_motion_of(run, scene, motion)
        for file, content in album.items():
            run.picture(content, file)
        return run.run_id


def log_sweep(result: Sweep) -> str:
    """One run with the table and, for one or two values, a picture per marker; returns its id."""
    scene = result.scene
    tags = {"kind": "sweep", "scene": scene.name}
    with open_run("Sweep", f"{scene.name} · sweep", description=scene.description, tags=tags) as run:
        run.judge(*verdict(result))
        spans = {f"vary.{path}": f"{v.min():g} to {v.max():g}" for path, v in result.grid.items()}
        run.params({**stated(scene), "engine": result.engine, "time": result.time, **spans})
        run.text(as_yaml(scene.model_dump(mode="json")), "scene.yaml")
        run.metric("final/points", len(result.status))
        run.metric("final/wall_s", result.wall_s)
        run.metric("final/failed_points", sum(status != "ok" for status in result.status))
        if result.check is not None:
            log_errors(run, result.errors)
        run.text(rows(result), "sweep.csv")
        if len(result.grid) <= 2:
            for marker in result.displacements:
                run.picture(png(draw_sweep(result, marker)), f"displacement-{marker}.png")
        return run.run_id


def log_motion_of(run: Run, scene: Scene, motion: Trajectory, selection: Selection | None = None) -> None:
    """Log the model of a scene, and the trajectories of its markers if accepted; selection: of its model."""
    kept = (item for item in motion.model.items() if not item[0].startswith(("initial", "verification", "errors")))
    made = {f"model.{name}": value for name, value in kept}
    run.params({**stated(scene), "engine": motion.engine, **made})
    run.text(as_yaml(scene.model_dump(mode="json")), "scene.yaml")
    log_errors(run, motion.errors)
    run.metric("final/energy_drift", float(motion.energy_drift[0]))
    run.metric("final/constraint_drift", float(motion.constraint_drift[0]))
    run.metric("final/steps", motion.steps)
    run.metric("final/wall_s", motion.wall_s)
    told = tells_places(motion, selection)
    if told:
        log_ends(run, motion)
    log_motion(run, motion, told=told)


def log_errors(run: Run, errors: ErrorBudget) -> None:
    """The sum of the known errors [m], and its parts."""
    if errors.total is not None:
        run.metric("final/error", errors.total)
    for source, error in errors.known.items():
        run.metric(f"final/{source}_error", error)


def stated(scene: Scene) -> dict[str, Any]:
    """Return the parameters that identify a scene."""
    return {"scene": scene.name, "scene.fingerprint": scene.fingerprint, "step": scene.solver.step}


def _refused(comparison: Comparison) -> Mapping[str, str]:
    return {f"refused.{name}": reason for name, reason in comparison.refused.items()}
