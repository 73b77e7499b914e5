"""The tables of docs/accuracy-figures.md, from the data of one run."""

from __future__ import annotations

from collections import Counter

from shoal_validation.document import table
from shoal_validation.work_precision.contract import MANY, Point
from shoal_validation.work_precision.converged import converged
from shoal_validation.work_precision.front import front
from shoal_validation.work_precision.gauss import SCENE_MESH
from shoal_validation.work_precision.measure import HEADLINE, Study
from shoal_validation.work_precision.table import costs


def tables(studies: list[Study], machine: dict[str, str]) -> str:
    """All tables as Markdown."""
    parts = [
        "Measured on " + ", ".join(f"{name} {value}" for name, value in machine.items()) + ".",
        "### The references",
        references(studies),
        "### What it costs to come within an error",
        reach(studies),
        "### The same error in other ways",
        further(studies),
        *(f"### The front of {one.problem.name}\n\n{fronts(one)}" for one in studies if one.problem.name == HEADLINE),
        "### Runs that do not count, and families left out",
        failures(studies),
    ]
    return "\n\n".join(parts)


def references(studies: list[Study]) -> str:
    """Sources of the references of every chart, and their accuracy."""
    rows = []
    for study in studies:
        known = study.problem.reference
        rows.append([study.problem.name, known.source, f"{known.error:.1e}"])
        on_mesh = any(point.mesh_error for point in study.points)
        mesh = converged(study.problem, SCENE_MESH) if on_mesh else None
        if mesh:
            rows.append([f"{study.problem.name}, {SCENE_MESH} converged in time", mesh.source, f"{mesh.error:.1e}"])
    return table(["problem", "reference", "its own error [m]"], rows)


def reach(studies: list[Study]) -> str:
    """Ours beside the cheapest Exudyn setting, one line per problem and error."""
    head = ["problem", "error [m]", "ours", "Exudyn, cheapest", "times", "its time loop alone", "times"]
    rows = []
    for line in (line for study in studies for line in costs(study)):
        loop = _time(line.loop.loop_seconds) if line.loop else ""
        cells = [_named(line.ours), _named(line.exudyn), _times(line.ratio), loop, _times(line.loop_ratio)]
        rows.append([line.problem, f"{line.reach:.0e}", *cells])
    return table(head, rows)


def further(studies: list[Study]) -> str:
    """Cost of the same error in other ways: many at once, the other families."""
    rows = []
    for study in studies:
        for line in (line for line in costs(study) if line.many or line.other):
            many = _named(line.many) if any(p.family == MANY for p in study.points) else "not measured"
            rows.append([line.problem, f"{line.reach:.0e}", many, _named(line.other, family=True)])
    return table(["problem", "error [m]", "ours, each of 64 at once", "best of CasADi, scipy, MuJoCo"], rows)


def fronts(study: Study) -> str:
    """The front of one problem by name, single simulations only."""
    best = front([p for p in study.points if p.family != MANY], study.problem.reference.error)
    return table(["time", "error [m]", "method"], ([_time(p.seconds), f"{p.error:.1e}", p.label] for p in best))


def failures(studies: list[Study]) -> str:
    """Runs that ended without a number, by method and status; and omitted methods."""
    rows = []
    for study in studies:
        for family in dict.fromkeys(p.family for p in study.points):
            points = [p for p in study.points if p.family == family]
            bad = Counter((p.method, p.status) for p in points if not p.ok)
            if bad:
                counts = "; ".join(f"{method}: {count} {status}" for (method, status), count in bad.items())
                rows.append([study.problem.name, family, str(len(points)), counts])
        rows += [[study.problem.name, family, "0", why] for family, why in study.left_out.items()]
    return table(["problem", "family", "runs", "without a number"], rows)


def _named(point: Point | None, family: bool = False) -> str:
    if point is None:
        return "not reached"
    parts = [point.family if family else "", point.method, point.mesh, point.setting]
    return f"{_time(point.seconds)}: {', '.join(part for part in parts if part)}"


def _time(seconds: float | None) -> str:
    if seconds is None:
        return ""
    return f"{seconds * 1e3:.3g} ms" if seconds < 1 else f"{seconds:.3g} s"


def _times(ratio: float | None) -> str:
    return "" if ratio is None else f"{ratio:.1f}"
