"""Results as tables in Markdown, for Prefect's pages."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.identification.design import Design
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.pictures.estimates import estimates
from shoal.pictures.numbers import looked_at
from shoal.pictures.start import reasons, remarks
from shoal.response import Response
from shoal.selection import Selection
from shoal.trajectory import Trajectory

from shoal_flows.exports import Exports

_ROWS = 50


def of_motion(motion: Trajectory) -> str:
    """Return the final positions of the markers of an accepted motion, and its checks."""
    ends = [(name, *motion.marker(name)[-1]) for name in motion.markers]
    shown = table(("marker", *_places(motion.axes)), ends) if motion.ok else "No places are shown, as it is rejected."
    evidence = f"{motion.status[0]}; energy drift {motion.energy_drift[0]:.1e}, constraint drift "
    evidence += f"{motion.constraint_drift[0]:.1e}, {motion.steps} steps, {motion.wall_s:.3f} s"
    notes = remarks(motion.model) + list(estimates(motion))
    return "\n\n".join([shown, evidence, *notes])


def of_comparison(comparison: Comparison) -> str:
    """Return the distance of each pair of engines."""
    rows = [("-".join(row["engines"]), row["marker"], row["largest"], row["final"]) for row in comparison.differences()]
    rows += [(engine, "refused", reason, "") for engine, reason in comparison.refused.items()]
    shown = table(("engines", "marker", "largest distance [m]", "distance at the end [m]"), rows)
    notes = next(filter(None, (remarks(motion.model) for motion in comparison.trajectories.values())), [])
    if comparison.errors.estimates:
        notes = [f"Known error of the model that they share: {comparison.errors}.", *notes]
    return "\n\n".join([shown, *notes])


def of_sweep(result: Sweep) -> str:
    """The points, at most as many as a page can show."""
    rows = result.rows()
    shown = table(list(rows[0]), (row.values() for row in rows[:_ROWS]))
    notes = [*reasons(result), *filter(None, [result.elsewhere.describe("points")])]
    notes += [] if result.check is None else [f"{result.check}."]
    notes += [f"The first {_ROWS} of {len(rows)} points; all are in sweep.csv."] if len(rows) > _ROWS else []
    return "\n\n".join([shown, *notes])


def of_response(found: Response) -> str:
    """Return bounds or statistics of every marker at the end, the limits, and the checks."""
    header, rows = found.table()
    brief = ("mean_lower", "mean_upper", "std_lower", "std_upper") if found.boxes is not None else ()
    ends: dict[str, dict[str, float]] = {}
    for name, value in zip(header[1:], rows[-1, 1:].tolist(), strict=True):
        of, _, told = name.partition(".")[2].partition(".")
        if not brief or told in brief:
            ends.setdefault(f"{name.partition('.')[0]}.{of}", {})[told] = value
    shown = table(("at the end", *next(iter(ends.values()))), ((of, *told.values()) for of, told in ends.items()))
    evidence = f"{found.status}, {found.errors.brief}; {found.evaluations} runs; {found.why}"
    said = [evidence, *(one.text for one in found.findings)]
    for one in found.limits:
        event = one.limit.event
        kept = f"{one.limit.verdict(one.kept)}{f' {looked_at(one.times)}' if one.kept else ''}"
        told = (
            kept
            if one.exceedance is None
            else f"{event} {looked_at(one.times)} with probability {one.exceedance.estimate.described}"
        )
        if one.between is not None:
            least, largest = (each.described for each in one.estimates)
            told = f"{event} {looked_at(one.times)} with a probability between {least} and {largest}"
        said.append(f"{one.limit.title}: {told}")
    return "\n\n".join([shown, *(one for one in said if one)])


def of_equilibrium(found: Equilibrium) -> str:
    """Return the markers at rest, and the checks."""
    rows = [(name, *found.marker(name), found.angle(name)) for name in found.markers]
    evidence = f"{found.status}, {found.errors.brief}; {found.residual:.1e} of the forces is not balanced, "
    evidence += f"{found.iterations} iterations"
    places = _places("xyz"[: found.scene.dimensions])
    return table(("marker", *places, "angle [rad]"), rows) + f"\n\n{evidence}"


def of_selection(found: Selection) -> str:
    """Every model that was tried, and why the chosen one."""
    rows = (
        (candidate.name, candidate.role, candidate.error, "chosen" if candidate is found.chosen else "")
        for candidate in found.candidates
    )
    return table(("model", "role", "estimated error [m]", ""), rows) + f"\n\n{found.reason}; error {found.errors}"


def of_exports(found: Exports) -> str:
    """Return the files written, and the distance of each tool's motion from Shoal's."""
    shown = table(("file", "bytes"), ((name, len(content)) for name, content in found.files.items()))
    told = (f"{tool}: its motion is within {distance:.2g} m of Shoal's" for tool, distance in found.distances.items())
    return "\n\n".join([shown, *told])


def of_design(found: Design) -> str:
    """Return the possible measurements, the best first, with the standard deviation of every parameter."""
    rows = [(sensor.label, *precision.std) for sensor, precision in found.ranked]
    return table(("sensor", *(f"std of {name}" for name in found.aim.names)), [("today", *found.now.std), *rows])


def _places(axes: str) -> list[str]:
    return [f"{axis} [m]" for axis in axes]


def table(headings: Sequence[str], rows: Iterable[Iterable[Any]]) -> str:
    """A table of numbers and words."""
    lines = [headings, ["---"] * len(headings), *([_cell(value) for value in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines)


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.9g}"
    return "" if value is None else str(value).replace("|", "\\|").replace("\n", " ")
