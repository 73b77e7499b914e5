"""What a person sees in a terminal: tables of 80 columns, progress on standard error, files on request."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn
from rich.table import Table

from shoal.errors import InputError
from shoal.home import compiled
from shoal.pictures.choice import rows
from shoal.pictures.estimates import estimates
from shoal.pictures.numbers import rounded
from shoal.pictures.start import remarks
from shoal.trajectory import Array, plain

if TYPE_CHECKING:
    from shoal.doctor import Check
    from shoal.engines.compare import Comparison
    from shoal.engines.sweep import Sweep
    from shoal.identification import Estimate, Problem
    from shoal.identification.design import Design
    from shoal.mechanics.analysis.modes import Modes
    from shoal.mechanics.analysis.reactions import Reactions
    from shoal.mechanics.analysis.statics import Equilibrium
    from shoal.pictures.answer import Answer
    from shoal.scene import Scene
    from shoal.selection import Selection
    from shoal.trajectory import Trajectory

_NOTHING = 1e-12
"""Of the largest force: a force below it is the rounding of the arithmetic, and shown as zero."""
out = Console(highlight=False)
err = Console(stderr=True, highlight=False)


def show(data: Mapping[str, Any], as_json: bool, table: Callable[[], None]) -> None:
    """One JSON object, or the table."""
    if as_json:
        print(json.dumps(plain(data), allow_nan=False))  # noqa: T201 - this is the output
    else:
        table()


@contextmanager
def working(what: str) -> Iterator[None]:
    """A spinner on a terminal; nothing in a log file."""
    with _progress() as progress:
        progress.add_task(what, total=None)
        yield


@contextmanager
def fitness_progress(what: str) -> Iterator[Callable[[int, float, float, int], None]]:
    """A line that follows the best fitness of a running search, and what it has cost."""
    with _progress() as progress:
        task = progress.add_task(f"{what}: preparing the data", total=None)

        def note(iteration: int, best: float, mean: float, evaluations: int) -> None:
            progress.update(task, description=f"{what}: best fitness {best:.3e}, {evaluations} evaluations")

        yield note


@contextmanager
def rungs_progress(what: str) -> Iterator[Callable[[str], None]]:
    """A line that names the model just run."""
    with _progress() as progress:
        task = progress.add_task(f"{what}: looking for the cheapest model", total=None)
        yield lambda model: progress.update(task, description=f"{what}: ran {model}")


def _progress() -> Progress:
    if not compiled():
        err.print("compiling the solver for this machine; this takes a few minutes, once", soft_wrap=True)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    return Progress(*columns, console=err, transient=True, disable=not err.is_terminal)


def _table(title: str, *headings: str) -> Table:
    """An empty table; its title is printed at once, so that it is not folded to the width of the table."""
    out.print(title, style="bold")
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for index, heading in enumerate(headings):
        table.add_column(escape(heading), justify="left" if index == 0 else "right", overflow="fold")
    return table


def listing(title: str, items: Mapping[str, str]) -> None:
    """Names with their descriptions."""
    table = Table(title=title, title_justify="left", title_style="bold", box=None, show_header=False, pad_edge=False)
    table.add_column(no_wrap=True)
    table.add_column()
    for name, text in items.items():
        table.add_row(name, text)
    out.print(table)
    out.print()


def trajectory_table(trajectory: Trajectory, scene: Scene, selection: Selection | None = None) -> None:
    """Where the markers end, and the evidence."""
    if selection is not None:
        selection_table(selection)
    table = _table(f"{scene.name}, {trajectory.engine}, at t = {trajectory.times[-1]:g} s", "marker", "x [m]", "y [m]")
    for name in trajectory.markers:
        x, y = trajectory.marker(name)[-1]
        table.add_row(name, f"{x:z.9f}", f"{y:z.9f}")
    out.print(table)
    verification = trajectory.model.get("verification")
    unknown = verification is not None and trajectory.ok and verification["time_error"] is None
    _say(
        f"status {trajectory.status[0]}{', but its time error is not known' if unknown else ''}; energy off by "
        f"{trajectory.energy_drift[0]:.1e}, constraints by {trajectory.constraint_drift[0]:.1e}"
    )
    _say(f"{trajectory.steps} steps in {trajectory.wall_s * 1e3:.1f} ms")
    for remark in remarks(trajectory.model):
        _say(remark)
    if verification is not None:
        for sentence in estimates(verification):
            _say(sentence)


def selection_table(selection: Selection) -> None:
    """The ladder: what was tried, at what cost, how far off, and why it stopped."""
    chosen = selection.chosen
    title = (
        f"models for {selection.tolerance:g} m at the markers: {len(selection.rungs)} runs, {selection.wall_s:.2f} s"
    )
    table = _table(title, "model", "unknowns", "steps", "ms", "error [m]", "")
    for row in rows(selection):
        table.add_row(*row)
    out.print(table)
    for rod, reason in selection.rigid.items():
        _say(f"{rod} stays rigid: {reason}")
    verdict = "met" if selection.met else "not met"
    _say(f"{verdict}: {chosen.name}, estimated error {chosen.error:.1e} m; {selection.reason}")
    if selection.shear > selection.tolerance:
        _say(f"beyond the beams' theory: shear and rotary inertia, about {selection.shear:.0e} m")
    out.print()


def equilibrium_table(equilibrium: Equilibrium) -> None:
    """Where the markers rest, what the joints bear, and the evidence."""
    table = _table(f"{equilibrium.scene.name} at rest", "marker", "x [m]", "y [m]", "angle [rad]")
    for name in equilibrium.markers:
        x, y = equilibrium.marker(name)
        table.add_row(name, f"{x:z.9f}", f"{y:z.9f}", f"{equilibrium.angle(name):z.9f}")
    out.print(table)
    if equilibrium.reactions is not None:
        reactions_table([equilibrium.reactions])
    lowest = equilibrium.eigenvalues[:1].real
    _say(
        f"status {equilibrium.status}{f' ({equilibrium.message})' if equilibrium.message else ''}; "
        f"unbalanced {equilibrium.residual:.1e} of all forces, joints gape by {equilibrium.gap:.1e}"
        + "".join(f"; lowest eigenvalue {value:.4g} rad^2/s^2" for value in lowest)
        + f"; {equilibrium.iterations} iterations"
    )


def reactions_table(found: list[Reactions]) -> None:
    """What every joint exerts on its second body."""
    for reactions in found:
        title = f"joint forces on the second body at t = {reactions.time:g} s"
        table = _table(title, "joint", "kind", "fx [N]", "fy [N]", "torque [N m]", "unique")
        every = [(*joint.force, joint.torque) for joint in reactions.joints.values()]
        rounding = _NOTHING * float(np.max(np.abs(every), initial=0.0))
        for (name, joint), values in zip(reactions.joints.items(), every, strict=True):
            numbers = (f"{0.0 if abs(value) < rounding else value:.6g}" for value in values)
            table.add_row(name, joint.kind, *numbers, "yes" if joint.unique else "no")
        out.print(table)
        if reactions.redundancy:
            _say(
                f"{reactions.redundancy} more than needed: least forces are shown; "
                f"redundant: {', '.join(reactions.constraints) or 'none away from this position'}"
            )


def modes_table(modes: Modes) -> None:
    """Frequencies, slowest first."""
    headings = ("mode", "frequency [Hz]", "[rad/s]", "damping ratio", "growth [1/s]", "kind")
    table = _table(f"{modes.scene.name}: small motions about the {modes.about}", *headings)
    for number, mode in enumerate(modes.modes, 1):
        numbers = (mode.frequency, mode.angular_frequency, mode.damping_ratio, mode.eigenvalue.real)
        table.add_row(str(number), *(f"{value:.6g}" for value in numbers), mode.kind)
    out.print(table)
    if not modes.balanced:
        _say("the forces do not balance there; these are motions relative to its fall")


def estimate_table(estimate: Estimate) -> None:
    """The verdict, then values with intervals, other minima, what the residuals say, and what to do next."""
    _say(f"verdict: {estimate.verdict}", style="bold")
    for reason in filter(None, estimate.message.split("; ")):
        _say(f"  {reason}")
    table = _table(f"{estimate.problem}, {estimate.method}", "parameter", "value", "95 % interval", "known")
    for name, value in {**estimate.parameters, **estimate.quantities}.items():
        known = "yes" if value.identifiable else "at bound" if value.at_bound else "no"
        # Two digits of the uncertainty; a value that is not known has none that mean anything.
        unit = value.std if value.identifiable and value.std > 0 else abs(value.value) * 1e-2
        interval = f"{rounded(value.lower, unit)} to {rounded(value.upper, unit)}" if value.identifiable else "-"
        label = f"{name} [{value.unit}]" if value.unit else name
        table.add_row(escape(label), rounded(value.value, unit), interval, known)
    out.print(table)
    for sentence in estimate.combinations:
        _say(sentence)
    _minima(estimate)
    for sentence in estimate.residual_tests.sentences():
        _say(f"residual {sentence}")
    for name, found in estimate.profiles.items():
        sides = [side for side, is_open in (("below", found.lower_open), ("above", found.upper_open)) if is_open]
        _say(
            f"profile of {name}: {found.lower:.6g} to {found.upper:.6g}"
            + (f", open {' and '.join(sides)}" * bool(sides))
        )
    if estimate.bootstrap is not None:
        for name in estimate.parameters:
            low, high = estimate.bootstrap.interval(name)
            _say(f"bootstrap of {name}, {len(estimate.bootstrap.draws)} draws: {low:.6g} to {high:.6g}")
    _effort(estimate)
    for step in estimate.advice:
        _say(f"next: {step}")


def _minima(estimate: Estimate) -> None:
    """At most five other minima, the best first."""
    from shoal.pictures.units import fitness_unit

    others = sorted(estimate.minima, key=lambda minimum: minimum["fitness"])
    for other in others[:5]:
        values = ", ".join(f"{name} {value:.4g}" for name, value in other.items() if name != "fitness")
        _say(f"another minimum, fitness {other['fitness']:.3g} {fitness_unit(estimate)}: {values}")
    if len(others) > 5:
        _say(f"and {len(others) - 5} more minima, all worse")


def _effort(estimate: Estimate) -> None:
    """Where the data come from, what the search cost, and how the answer compares with a known truth."""
    from shoal.pictures.units import fitness_unit, rms_unit

    _say(f"data: {estimate.data}")
    for note in estimate.notes:
        _say(f"note: {note}")
    _say(
        f"fitness {estimate.fitness:.4e} {fitness_unit(estimate)}, RMS {estimate.rms:.3e} {rms_unit(estimate)}; "
        f"{estimate.evaluations} evaluations in {estimate.wall_s:.2f} s"
    )
    for stage in estimate.model.get("selection", ()):
        _say(
            f"model for {stage['tolerance']:g} m: {stage['model']}, off by about {stage['error']:.1e} m, "
            f"{stage['evaluations']} evaluations"
        )
    if estimate.truth:
        errors = (f"{name} {estimate.parameters[name].value - true:+.2e}" for name, true in estimate.truth.items())
        _say(f"against the truth of the computed data: {', '.join(errors)}")
    if estimate.model_error_rms is not None:
        _say(f"the mesh of the model is off by {estimate.model_error_rms:.1e} m (RMS); the intervals include it")


def _say(text: str, style: str = "") -> None:
    """A line of text, on a terminal folded at 80 columns, in a log file whole; what looks like markup is none."""
    out.print(escape(text), style=style, width=min(80, out.width), soft_wrap=not out.is_terminal)


def design_table(found: Design) -> None:
    """Candidates, the best first, each alone and beside the best one; then duration and rate."""
    beside = dict(found.second)
    best = found.ranked[0][0]
    title = f"{found.problem}: what to measure, {found.duration:g} s at {found.rate:g} samples a second"
    table = _table(title, "marker", "weakest", "std", "A", "D", f"with {best.name}: weakest", "std")
    now = found.aim.weakest(found.now)
    table.add_row("as now", now[0], f"{now[1]:.2e}", f"{found.now.a:.1e}", f"{found.now.d:.1e}", "", "")
    for candidate, precision in found.ranked:
        name, std = found.aim.weakest(precision)
        second = found.aim.weakest(beside[candidate]) if candidate in beside else None
        pair = ("", "") if second is None else (second[0], f"{second[1]:.2e}")
        table.add_row(candidate.label, name, f"{std:.2e}", f"{precision.a:.1e}", f"{precision.d:.1e}", *pair)
    out.print(table)
    table = _table(
        f"{best.label}: largest std over range, by duration and samples a second",
        "duration [s]",
        *(f"{rate:g}" for rate in found.rates),
    )
    for duration, row in zip(found.durations, found.table, strict=True):
        table.add_row(f"{duration:g}", *(f"{score:.1e}" for score in row))
    out.print(table)
    angle = "" if found.angle_noise is None else f", {found.angle_noise:g} rad"
    values = ", ".join(f"{name} {value:.4g}" for name, value in found.values.items())
    _say(f"noise {found.noise:g} m{angle}; about {values}")
    _say("A, D: root mean square and geometric mean of the standard deviations over the ranges of the parameters")
    _say(f"sensitivities by two steps differ by {found.doubt:.0e}")


def sweep_table(sweep: Sweep) -> None:
    """Displacements of every marker over the grid."""
    markers = list(sweep.positions)
    last = markers[-1]
    table = _table(
        f"{sweep.scene.name}: displacement of {last} after {sweep.time:g} s",
        *_short(list(sweep.grid)),
        f"{last}.dx [m]",
        f"{last}.dy [m]",
        "status",
    )
    for row in sweep.rows():
        numbers = [f"{row[path]:.6g}" for path in sweep.grid]
        moved = [row[f"{last}.dx"], row[f"{last}.dy"]]
        table.add_row(*numbers, *("-" if m is None else f"{m:.6f}" for m in moved), row["status"])
    out.print(table)
    if sweep.check is not None:
        _say(str(sweep.check))


def _short(paths: list[str]) -> list[str]:
    """Paths with their units, by their last two names where those tell them apart: OA.angle [rad]."""
    from shoal.identification.recording.units import unit

    ends = [".".join(path.split(".")[-2:]) for path in paths]
    names = ends if len(set(ends)) == len(ends) else paths
    return [f"{name} [{unit(path)}]" if unit(path) else name for name, path in zip(names, paths, strict=True)]


def comparison_table(comparison: Comparison) -> None:
    """Ends by engine, then differences by pair."""
    last = list(comparison.scene.markers)[-1]
    table = _table(
        f"{comparison.scene.name}: {last} at the end", "engine", "x [m]", "y [m]", "energy", "time", "status"
    )
    for name, trajectory in comparison.trajectories.items():
        x, y = trajectory.marker(last)[-1]
        time = f"{trajectory.wall_s * 1e3:.0f} ms"
        table.add_row(
            name, f"{x:.7f}", f"{y:.7f}", f"{trajectory.energy_drift[0]:.0e}", time, str(trajectory.status[0])
        )
    out.print(table)
    for name, reason in comparison.refused.items():
        _say(f"{name} refused: {reason}")
    table = _table("distances over all samples", "engines", "marker", "largest [m]", "final [m]")
    for row in comparison.differences():
        distances = ("-" if row[key] is None else f"{row[key]:.2e}" for key in ("largest", "final"))
        table.add_row(" - ".join(row["engines"]), row["marker"], *distances)
    out.print(table)


def doctor_table(checks: list[Check]) -> None:
    """What was looked at, and what to do."""
    table = _table("shoal doctor", "check", "", "found", "what to do")
    for check in checks:
        table.add_row(check.name, "ok" if check.ok else "FAILED", check.found, check.advice)
    table.columns[2].justify = table.columns[3].justify = "left"
    out.print(table)


def axis(path: str, text: str) -> Array:
    """LOW:HIGH:COUNT as values. Raises InputError."""
    try:
        low, high, count = text.split(":")
        first, last, number = float(low), float(high), int(count)
    except ValueError:
        raise InputError(f"vary: {path}={text} is not PATH=LOW:HIGH:COUNT, such as initial.OA.angle=0:1.5:31") from None
    if not (1 <= number <= 1_000_000) or not np.isfinite([first, last]).all():
        raise InputError(f"vary: {path}={text}: COUNT is between 1 and 1000000, LOW and HIGH are finite")
    return np.linspace(first, last, number)


def check_output(path: Path | None, endings: tuple[str, ...]) -> None:
    """Refuse a file that could not be written, before anything is computed. Raises InputError."""
    if path is None:
        return
    if path.suffix not in endings:
        raise InputError(f"out: {path} ends in {path.suffix or 'nothing'}; use one of {', '.join(endings)}")
    if not path.absolute().parent.is_dir():
        raise InputError(f"out: the folder {path.absolute().parent} does not exist")


def write_trajectory(trajectory: Trajectory, scene: Scene, path: Path, selection: Selection | None = None) -> None:
    """One lane as CSV, JSON, page, picture or moving picture; selection: how its model was chosen."""
    if path.suffix == ".csv":
        columns, table = ["t"], [trajectory.times]
        for name in trajectory.markers:
            columns += [f"{name}.x", f"{name}.y", f"{name}.angle"]
            table += [*trajectory.marker(name).T, trajectory.angle(name)]
        np.savetxt(path, np.column_stack(table), delimiter=",", header=",".join(columns), comments="", fmt="%.12g")
    elif path.suffix == ".json":
        _write_json(trajectory.to_json(), path)
    else:
        _pictures().trajectory(trajectory, scene, path, selection)


def write_estimate(estimate: Estimate, problem: Problem, path: Path) -> None:
    """An estimate as JSON (all of it, for `shoal report`), page, picture or moving picture."""
    if path.suffix == ".json":
        from shoal.pictures import answer, archive

        _write_json(archive.archived(answer.Answer(problem, estimate)), path)
    else:
        _pictures().estimate(estimate, problem, path)


def write_report(answers: Mapping[str, Answer], path: Path) -> None:
    """Identifications by name as one page. Raises InputError."""
    from shoal.pictures.study import study

    path.write_text(study(answers), encoding="utf-8")


def write_design(found: Design, path: Path) -> None:
    """A design as JSON or picture."""
    if path.suffix == ".json":
        _write_json(found.to_json(), path)
    else:
        _pictures().design(found, path)


def write_sweep(sweep: Sweep, path: Path) -> None:
    """A sweep as CSV, JSON or picture."""
    if path.suffix == ".csv":
        rows = sweep.rows()
        lines = [",".join(rows[0]), *(",".join("" if v is None else str(v) for v in row.values()) for row in rows)]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    elif path.suffix == ".json":
        _write_json(sweep.to_json(), path)
    else:
        _pictures().sweep(sweep, path)


def write_comparison(comparison: Comparison, path: Path) -> None:
    """A comparison as JSON or picture."""
    if path.suffix == ".json":
        _write_json(comparison.to_json(), path)
    else:
        _pictures().comparison(comparison, path)


def _pictures() -> Any:
    """The module that draws, which is slow to import and not needed otherwise."""
    from shoal.pictures import files

    return files


def _write_json(data: Mapping[str, Any], path: Path) -> None:
    path.write_text(json.dumps(plain(data), allow_nan=False, indent=1), encoding="utf-8")
