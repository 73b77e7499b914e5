"""From the demo's result to one HTML file."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

from jinja2 import PackageLoader
from shoal.home import home
from shoal.pictures.numbers import length
from shoal.pictures.pages import environment

from shoal_flows import provenance, workers
from shoal_flows.pictures import Picture, show_motion
from shoal_flows.plan import CASES, SEED, TITLES
from shoal_flows.report import tables, words
from shoal_flows.report.paper import TABLES
from shoal_flows.results import DemoResult, Study


def write_report(result: DemoResult, folder: Path | None = None) -> Path:
    """Write `index.html` to `folder` (default: report/ in Shoal's home); returns its path."""
    target = (folder or home() / "report") / "index.html"
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(render(result), encoding="utf-8")
    return target


def render(result: DemoResult) -> str:
    """The report as HTML without a reference to anything outside."""
    template = environment(PackageLoader("shoal_flows", "report")).get_template("demo.html.j2")
    return template.render(
        title="Two initial angles from the motion of the tip",
        lead=words.headline(result),
        trusted=result.trusted,
        cases=[_case(result, case) for case in result.studies],
        provenance=_provenance(),
        workers=workers.count(),
    )


def _case(result: DemoResult, case: str) -> dict[str, Any]:
    title, study, mesh, compared = TITLES[case], result.studies[case], result.meshes[case], result.comparisons[case]
    first = study.fits[0].estimate if study.fits else None
    return {
        "name": case,
        "title": title,
        "identified": words.identified(title, study),
        "swarms": words.against_swarms(title, study),
        "confirmed": words.confirmed(title, compared, study),
        "same_mesh": words.same_mesh(title, result.same_mesh[case]),
        "mesh_words": words.mesh_sentence(title, mesh),
        "data": first.data if first else "none",
        "model": ", ".join(f"{name}={value}" for name, value in first.model.items()) if first else "nothing",
        "paper_table": TABLES[case][0],
        "paper_rows": tables.paper_rows(case, result.same_mesh[case], study),
        "paper_words": words.like_with_like(title, case, result.same_mesh[case], study),
        "method_rows": tables.method_rows(study),
        "mesh_rows": tables.mesh_rows(mesh),
        "engine_rows": tables.engine_rows(compared),
        "commands": tables.commands(case, CASES[case], study, compared),
        "fingerprints": [
            list(row) for row in tables.fingerprints([*study.fits, *mesh.fits, *result.same_mesh[case].fits]).items()
        ],
        "motion": workers.run(show_motion, study.fits) if study.fits else None,
        "figures": [_figure(title, name, study) for name in study.pictures],
        "engines_figure": _picture(
            compared.picture,
            f"{title}: position of the tip against time by {', '.join(compared.answer.trajectories)}, which lie on "
            f"one line, and below their distances, at most {length(words.largest_distance(compared))}.",
            "Above, the motions, drawn in falling widths so that each shows; below, what lies between them.",
        ),
        "mesh_figure": _picture(
            mesh.pictures["mesh_error"],
            f"{words.mesh_sentence(title, mesh)} Points for true error, predicted error and interval on four meshes.",
            "True error, error predicted by the estimate, and half the 95 % interval, logarithmic.",
        ),
    }


_CAPTIONS = {
    "trajectory": (
        "measured positions of the tip as circles, the motion of the fitted model as a line through them.",
        "The best fit over the data.",
    ),
    "convergence": (
        "best fitness against counted evaluations for every method, both axes logarithmic; the table has the numbers.",
        "A marker stands where a method ended. The dotted line is what the model’s own mesh is off by.",
    ),
    "residuals": (
        "distance of model and data against time for every method; methods that reach the same fit lie on one line.",
        "What remains of the motion that the fitted model does not explain.",
    ),
}


def _figure(title: str, name: str, study: Study) -> dict[str, str]:
    alt, caption = _CAPTIONS[name]
    return _picture(study.pictures[name], f"{title}: {alt}", caption)


def _picture(picture: Picture, alt: str, caption: str) -> dict[str, str]:
    source = "data:image/svg+xml;base64," + base64.b64encode(picture[1]).decode()
    return {"source": source, "alt": alt, "caption": caption}


def _provenance() -> list[tuple[str, str]]:
    revision = provenance.revision() or "not in a repository"
    versions = ", ".join(f"{package} {found}" for package, found in provenance.versions().items())
    return [("versions", versions), ("revision", revision), ("platform", provenance.machine()), ("seed", str(SEED))]
