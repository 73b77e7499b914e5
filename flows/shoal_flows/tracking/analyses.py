"""Equilibria, chosen models, designs of measurements and exports in MLflow: one run each, which ends in its figures."""

from __future__ import annotations

from collections.abc import Mapping

from shoal.identification.design import Design
from shoal.json_values import json_text
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.pictures.design import design as draw_design
from shoal.pictures.style import png
from shoal.scene.edited import as_yaml
from shoal.selection import Selection

from shoal_flows.exports import Exports
from shoal_flows.tracking.engines import log_errors, log_motion_of, stated
from shoal_flows.tracking.store import open_run
from shoal_flows.verdicts import verdict


def log_statics(found: Equilibrium, picture: bytes) -> str:
    """One run; returns its id. picture: of the machine at rest"""
    scene = found.scene
    tags = {"kind": "statics", "scene": scene.name, "findings": ", ".join(found.codes)}
    with open_run("Statics", f"{scene.name} · statics", description=scene.description, tags=tags) as run:
        run.judge(*verdict(found))
        run.params({**stated(scene), "time": found.time})
        run.text(as_yaml(scene.model_dump(mode="json")), "scene.yaml")
        run.text(json_text(found.to_json(), indent=1), "equilibrium.json")
        for name in found.markers:
            for axis, value in zip("xyz"[: scene.dimensions], found.marker(name), strict=True):
                run.metric(f"final/{name}/{axis}", float(value))
        run.metric("final/residual", found.residual)
        run.metric("final/iterations", found.iterations)
        log_errors(run, found.errors)
        run.picture(picture, "rest.png")
        return run.run_id


def log_selection(found: Selection, album: Mapping[str, bytes]) -> str:
    """One run with the motion of the chosen model, and the ladder that led there; album: pictures by the name of their
    file. Returns its id.
    """
    scene = found.chosen.scene
    tags = {"kind": "selection", "scene": scene.name, "findings": ", ".join(found.trajectory.codes)}
    with open_run("Selection", f"{scene.name} · select", description=scene.description, tags=tags) as run:
        run.judge(*verdict(found))
        log_motion_of(run, scene, found.trajectory, found)
        run.params({"tolerance": found.tolerance, "chosen": found.chosen.name})
        run.metric("final/estimated_error", found.chosen.error)
        log_errors(run, found.errors)
        run.metric("final/rungs", len(found.candidates))
        run.text(json_text(found.to_json(), indent=1), "selection.json")
        for file, content in album.items():
            run.picture(content, file)
        return run.run_id


def log_design(found: Design) -> str:
    """One run with the table of what could be measured; returns its id."""
    tags = {"kind": "design", "problem": found.problem}
    with open_run("Design", f"{found.problem} · design", tags=tags) as run:
        run.judge(*verdict(found))
        asked = {"noise": json_text(found.noise), "duration": found.duration, "rate": found.rate}
        run.params({"problem": found.problem, "best": found.ranked[0][0].label, **asked})
        best = found.ranked[0][1]
        for kind, precision in (("now", found.now), ("best", best)):
            for name, std in zip(found.aim.names, precision.std, strict=True):
                run.metric(f"final/{kind}/{name}", float(std))
        run.metric("final/doubt", found.doubt)
        run.text(json_text(found.to_json(), indent=1), "design.json")
        run.picture(png(draw_design(found)), "design.png")
        return run.run_id


def log_exports(found: Exports) -> str:
    """One run with the files, and the motion where its table was asked for; returns its id."""
    scene = found.scene
    tags = {"kind": "export", "scene": scene.name}
    with open_run("Export", f"{scene.name} · export", description=scene.description, tags=tags) as run:
        run.judge(*verdict(found))
        if found.motion is None:
            run.params(stated(scene))
            run.text(as_yaml(scene.model_dump(mode="json")), "scene.yaml")
        else:
            log_motion_of(run, scene, found.motion)
        run.params({"files": ", ".join(found.files)})
        run.metric("final/files", len(found.files))
        for tool, distance in found.distances.items():
            run.metric(f"final/distance/{tool}", distance)
        for name, content in found.files.items():
            run.file(content, f"export/{name}")
        return run.run_id
