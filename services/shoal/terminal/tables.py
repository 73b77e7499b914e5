"""Tables of 80 columns: motions, what a scene is like, what is found from measured motion, the installation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from rich.markup import escape

from shoal.pictures.choice import rows
from shoal.pictures.estimates import estimates
from shoal.pictures.numbers import rounded
from shoal.pictures.start import remarks
from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.doctor import Check
    from shoal.engines.compare import Comparison
    from shoal.engines.sweep import Sweep
    from shoal.identification import Estimate
    from shoal.identification.design import Design
    from shoal.mechanics.analysis.equilibrium import Equilibrium
    from shoal.mechanics.analysis.joint_reactions import Reactions
    from shoal.mechanics.analysis.modes import Modes
    from shoal.response import Response
    from shoal.response.allocation import Allocation
    from shoal.response.limits import Judged
    from shoal.response.limits.judged import Between
    from shoal.scene import Scene
    from shoal.selection import Selection
    from shoal.trajectory import Trajectory

_NOTHING = 1e-12
"""Of the largest force: a force below it is the rounding of the arithmetic, and shown as zero."""


def trajectory_table(trajectory: Trajectory, scene: Scene, selection: Selection | None = None) -> None:
    """Where the markers end, and the evidence."""
    if selection is not None:
        selection_table(selection)
    table = screen.table(
        f"{scene.name}, {trajectory.engine}, at t = {trajectory.times[-1]:g} s",
        "marker",
        *(f"{axis} [m]" for axis in trajectory.axes),
    )
    for name in trajectory.markers:
        table.add_row(name, *(f"{part:z.9f}" for part in trajectory.marker(name)[-1]))
    screen.out.print(table)
    verification = trajectory.model.get("verification")
    unknown = verification is not None and trajectory.ok and verification["time_error"] is None
    screen.say(
        f"status {trajectory.status[0]}{', but its time error is not known' if unknown else ''}; energy off by "
        f"{trajectory.energy_drift[0]:.1e}, constraints by {trajectory.constraint_drift[0]:.1e}"
    )
    slowed = trajectory.model.get("slowed_modes")
    raised = f"; the inertia of {slowed} axial modes is raised to suit the step" if slowed else ""
    screen.say(f"{trajectory.steps} steps in {trajectory.wall_s * 1e3:.1f} ms{raised}")
    screen.say(*remarks(trajectory.model))
    if verification is not None:
        screen.say(*estimates(verification))


def selection_table(selection: Selection) -> None:
    """The ladder: what was tried, at what cost, how far off, and why it stopped."""
    chosen = selection.chosen
    title = (
        f"models for {selection.tolerance:g} m at the markers: {len(selection.rungs)} runs, {selection.wall_s:.2f} s"
    )
    table = screen.table(title, "model", "unknowns", "steps", "ms", "error [m]", "")
    for row in rows(selection):
        table.add_row(*row)
    screen.out.print(table)
    screen.say(*(f"{rod} stays rigid: {reason}" for rod, reason in selection.rigid.items()))
    verdict = "met" if selection.met else "not met"
    screen.say(f"{verdict}: {chosen.name}, estimated error {chosen.error:.1e} m; {selection.reason}")
    if selection.shear > selection.tolerance:
        screen.say(f"beyond the beams' theory: shear and rotary inertia, about {selection.shear:.0e} m")
    screen.out.print()


def sweep_table(sweep: Sweep) -> None:
    """Displacements of every marker over the grid."""
    markers = list(sweep.positions)
    last = markers[-1]
    axes = "xyz"[: sweep.scene.dimensions]
    table = screen.table(
        f"{sweep.scene.name}: displacement of {last} after {sweep.time:g} s",
        *_short(list(sweep.grid)),
        *(f"{last}.d{axis} [m]" for axis in axes),
        "status",
    )
    for row in sweep.rows():
        numbers = [f"{row[path]:.6g}" for path in sweep.grid]
        moved = [row[f"{last}.d{axis}"] for axis in axes]
        table.add_row(*numbers, *("-" if m is None else f"{m:.6f}" for m in moved), row["status"])
    screen.out.print(table)
    if sweep.check is not None:
        screen.say(str(sweep.check))


def response_table(response: Response) -> None:
    """The end: bounds with their gap, or mean, deviation and what it is owed to, or bounds of these."""
    title = f"{response.scene} at t = {response.times[-1]:g} s, {response.method}"
    headings: tuple[str, ...]
    if response.bounds is not None:
        headings = "lower", "upper", "outer lower", "outer upper"
        found = response.bounds
        columns = [found.lower, found.upper, found.lower_outer, found.upper_outer]
    elif response.boxes is not None:
        headings = "mean from", "to", "deviation from", "to", "5 % from", "95 % to"
        mean, std, quantiles = response.boxes.mean, response.boxes.std, response.boxes.quantiles
        columns = [mean.lower, mean.upper, std.lower, std.upper, quantiles[1].lower, quantiles[-2].upper]
    else:
        assert response.statistics is not None
        headings = "mean", "deviation", "5 %", "95 %"
        told = response.statistics
        columns = [told.mean, told.std, told.quantiles[1], told.quantiles[-2]]
    table = screen.table(title, "", *headings, *(("gap",) if response.bounds is not None else ()))
    for marker in response.markers:
        for quantity in response.quantities:
            unit = "rad" if quantity == "angle" else "m"
            numbers = (response.column(marker, quantity, column)[-1] for column in columns)
            form = "z.6f" if response.boxes is None else ".4g"
            cells = ["-" if np.isnan(x) else f"{x:{form}}" for x in numbers]
            if response.bounds is not None:
                gap = response.gap(marker, quantity)
                cells.append("-" if np.isnan(gap) else f"{gap:.0e}")
            table.add_row(f"{marker}.{quantity} [{unit}]", *cells)
    screen.out.print(table)
    if response.statistics is not None:
        _shares(response)
    for judged in response.limits:
        _limit(judged)
    if response.allocation is not None:
        _allocation(response.allocation)
    screen.say(f"status {response.status}; {response.evaluations} runs in {response.wall_s:.2f} s; {response.why}")
    for joint in response.inputs.joints:
        if joint.left:
            screen.say(
                f"left out of {joint.source}: {', '.join(f'{name} ({why})' for name, why in joint.left.items())}"
            )
    if response.repeated or response.failed:
        screen.say(f"{response.repeated} runs were repeated with smaller steps, {response.failed} failed all the same")
    if response.bounds is not None:
        gap = response.bounds.gap
        known = (
            "the gap to the outer ones is not known" if np.isnan(gap) else f"outer ones lie {gap:.1e} of the width off"
        )
        screen.say(f"bounds are attained by runs; {known}; they hold until {response.horizon:g} s")
    if response.boxes is not None:
        screen.say(
            f"statistics lie between these values, whatever the intervals are; they are known to "
            f"{response.boxes.gap:.1e} of the scatter, until {response.horizon:g} s"
        )
    errors = {"mesh": response.mesh_error, "step": response.step_error}
    told_of = [f"{name} {error:.1e} m" for name, error in errors.items() if error is not None]
    if told_of:
        screen.say(f"estimated errors of the runs that decide: {', '.join(told_of)}")
    if response.finer is not None:
        moved = [f"{name} by {one['by']:.1e} at {one['t']:g} s" for name, one in list(response.moved().items())[:3]]
        screen.say(
            f"{response.finer.runs} runs that attain bounds, on twice as fine a mesh, move most: {', '.join(moved)}"
        )


def _limit(judged: Judged) -> None:
    """What is told of a limit, and the values that show it."""
    title, shown = f"limit {judged.limit.text}", judged.shown
    if judged.between is not None:
        _between(title, judged, judged.between)
        how = "most probably with"
    elif judged.passing is not None:
        lower, upper = judged.passing.estimate.interval
        screen.say(
            f"{title}: is passed with probability {judged.passing.estimate.probability:.3g}, with 95 % confidence "
            f"between {lower[-1]:.3g} and {upper[-1]:.3g}",
            f"  by {judged.passing.why}; {judged.evaluations} runs",
            style="bold",
        )
        how = "most probably with"
    else:
        says = {True: "is kept for all values", False: "is passed", None: "is kept by all runs, which proves nothing"}
        screen.say(f"{title}: {says[judged.kept]}", style="bold")
        how = "passed with" if judged.kept is False else "nearest with"
    if shown is not None:
        known = ", ".join(f"{name} = {value:.6g}" for name, value in shown.parameters.items())
        screen.say(f"  {how} {known}: margin {shown.margin:.3g} {judged.limit.unit} at {shown.time:g} s")


def _between(title: str, judged: Judged, found: Between) -> None:
    """Two probabilities and the interval values that they are told at."""
    (least, largest), (lower, upper) = found.estimates, found.interval
    screen.say(
        f"{title}: is passed with a probability between {least:.3g} and {largest:.3g}, with 95 % confidence between "
        f"{lower:.3g} and {upper:.3g}",
        style="bold",
    )
    for name, at in (("least", found.at_lower), ("largest", found.at_upper)):
        screen.say(f"  {name} with {', '.join(f'{path} = {value:.6g}' for path, value in at.items())}")
    screen.say(f"  by {found.places} interval values and {judged.evaluations} runs")


def _allocation(found: Allocation) -> None:
    """Tolerances that keep the limit, and what tightening the stated ones does."""
    told = found.to_json()
    table = screen.table(f"tolerances that keep {found.limit}", "", "stated", "found", "factor", "effect of 1 %")
    for name, one in told["parameters"].items():
        numbers = one["tolerance_stated"], one["tolerance"], one["factor"], one["effect_of_one_per_cent"]
        table.add_row(escape(name), *(f"{x:.3g}" for x in numbers))
    screen.out.print(table)
    what = "probability" if found.inputs.random.all() else "least margin"
    screen.say(
        f"{what} {found.stated:.3g} with the stated tolerances, {found.confirmed:.3g} with those found, which cost "
        f"{found.cost:.3g} times as much; to tighten first: {told['tighten_first']}; {found.evaluations} runs"
    )


def _shares(response: Response) -> None:
    """Sobol's total indices at the end."""
    assert response.statistics is not None
    marker = response.markers[-1]
    axes = response.axes
    table = screen.table(f"share of the variance of {marker} (total Sobol index)", "", *axes)
    for k, name in enumerate(response.inputs.names):
        shares = [response.column(marker, axis, response.statistics.total[k])[-1] for axis in axes]
        table.add_row(escape(name), *("-" if np.isnan(x) else f"{x:.3f}" for x in shares))
    screen.out.print(table)


def _short(paths: list[str]) -> list[str]:
    """Paths with their units, by their last two names where those tell them apart: OA.angle [rad]."""
    from shoal.pictures.units import labelled

    ends = [".".join(path.split(".")[-2:]) for path in paths]
    names = ends if len(set(ends)) == len(ends) else paths
    return [labelled(path, name) for path, name in zip(paths, names, strict=True)]


def comparison_table(comparison: Comparison) -> None:
    """Ends by engine, then differences by pair."""
    last = list(comparison.scene.markers)[-1]
    table = screen.table(
        f"{comparison.scene.name}: {last} at the end", "engine", "x [m]", "y [m]", "energy", "time", "status"
    )
    for name, trajectory in comparison.trajectories.items():
        x, y = trajectory.marker(last)[-1]
        time = f"{trajectory.wall_s * 1e3:.0f} ms"
        table.add_row(
            name, f"{x:.7f}", f"{y:.7f}", f"{trajectory.energy_drift[0]:.0e}", time, str(trajectory.status[0])
        )
    screen.out.print(table)
    screen.say(*(f"{name} refused: {reason}" for name, reason in comparison.refused.items()))
    table = screen.table("distances over all samples", "engines", "marker", "largest [m]", "final [m]")
    for row in comparison.differences():
        distances = ("-" if row[key] is None else f"{row[key]:.2e}" for key in ("largest", "final"))
        table.add_row(" - ".join(row["engines"]), row["marker"], *distances)
    screen.out.print(table)


def equilibrium_table(equilibrium: Equilibrium) -> None:
    """Where the markers rest, what the joints bear, and the evidence."""
    axes = [f"{axis} [m]" for axis in "xyz"[: equilibrium.scene.dimensions]]
    table = screen.table(f"{equilibrium.scene.name} at rest", "marker", *axes, "angle [rad]")
    for name in equilibrium.markers:
        place = (f"{part:z.9f}" for part in equilibrium.marker(name))
        table.add_row(name, *place, f"{equilibrium.angle(name):z.9f}")
    screen.out.print(table)
    if equilibrium.reactions is not None:
        reactions_table([equilibrium.reactions])
    lowest = equilibrium.eigenvalues[:1].real
    screen.say(
        f"status {equilibrium.status}{f' ({equilibrium.message})' if equilibrium.message else ''}; "
        f"unbalanced {equilibrium.residual:.1e} of all forces, joints gape by {equilibrium.gap:.1e}"
        + ("" if equilibrium.mesh_error is None else f"; estimated mesh error {equilibrium.mesh_error:.1e} m")
        + "".join(f"; lowest eigenvalue {value:.4g} rad^2/s^2" for value in lowest)
        + f"; {equilibrium.iterations} iterations"
    )


def reactions_table(found: list[Reactions]) -> None:
    """What every joint exerts on its second body."""
    for reactions in found:
        title = f"joint forces on the second body at t = {reactions.time:g} s"
        every = [
            (*joint.force, *(joint.torque if isinstance(joint.torque, tuple) else (joint.torque,)))
            for joint in reactions.joints.values()
        ]
        spatial = any(len(values) > 3 for values in every)
        numbered = [f"{kind}{axis} [{unit}]" for kind, unit in (("f", "N"), ("m", "N m")) for axis in "xyz"]
        headings = numbered if spatial else ["fx [N]", "fy [N]", "torque [N m]"]
        table = screen.table(title, "joint", "kind", *headings, "unique")
        rounding = _NOTHING * float(np.max(np.abs(every), initial=0.0))
        for (name, joint), values in zip(reactions.joints.items(), every, strict=True):
            numbers = (f"{0.0 if abs(value) < rounding else value:.6g}" for value in values)
            table.add_row(name, joint.kind, *numbers, "yes" if joint.unique else "no")
        screen.out.print(table)
        if reactions.redundancy:
            screen.say(
                f"{reactions.redundancy} more than needed: least forces are shown; "
                f"redundant: {', '.join(reactions.constraints) or 'none away from this position'}"
            )


def modes_table(modes: Modes) -> None:
    """Frequencies, slowest first."""
    headings = ("mode", "frequency [Hz]", "[rad/s]", "damping ratio", "growth [1/s]", "kind")
    table = screen.table(f"{modes.scene.name}: small motions about the {modes.about}", *headings)
    for number, mode in enumerate(modes.modes, 1):
        numbers = (mode.frequency, mode.angular_frequency, mode.damping_ratio, mode.eigenvalue.real)
        table.add_row(str(number), *(f"{value:.6g}" for value in numbers), mode.kind)
    screen.out.print(table)
    if modes.mesh_errors:
        screen.say(f"estimated mesh error of the eigenvalues: {max(modes.mesh_errors):.1e} of their size, at most")
    if not modes.balanced:
        screen.say("the forces do not balance there; these are motions relative to its fall")


def estimate_table(estimate: Estimate) -> None:
    """The verdict, then values with intervals, other minima, what the residuals say, and what to do next."""
    screen.say(f"verdict: {estimate.verdict}", style="bold")
    screen.say(*(f"  {reason}" for reason in filter(None, estimate.message.split("; "))))
    table = screen.table(f"{estimate.problem}, {estimate.method}", "parameter", "value", "95 % interval", "known")
    for name, value in {**estimate.parameters, **estimate.quantities}.items():
        known = "yes" if value.identifiable else "at bound" if value.at_bound else "no"
        # Two digits of the uncertainty; a value that is not known has none that mean anything.
        unit = value.std if value.identifiable and value.std > 0 else abs(value.value) * 1e-2
        interval = f"{rounded(value.lower, unit)} to {rounded(value.upper, unit)}" if value.identifiable else "-"
        label = f"{name} [{value.unit}]" if value.unit else name
        table.add_row(escape(label), rounded(value.value, unit), interval, known)
    screen.out.print(table)
    screen.say(*estimate.combinations)
    _minima(estimate)
    screen.say(*(f"residual {sentence}" for sentence in estimate.residual_tests.sentences()))
    for name, found in estimate.profiles.items():
        sides = [side for side, is_open in (("below", found.lower_open), ("above", found.upper_open)) if is_open]
        screen.say(
            f"profile of {name}: {found.lower:.6g} to {found.upper:.6g}"
            + (f", open {' and '.join(sides)}" * bool(sides))
        )
    if estimate.bootstrap is not None:
        for name in estimate.parameters:
            low, high = estimate.bootstrap.interval(name)
            screen.say(f"bootstrap of {name}, {len(estimate.bootstrap.draws)} draws: {low:.6g} to {high:.6g}")
    _posterior(estimate)
    _predictions(estimate)
    _effort(estimate)
    screen.say(*(f"next: {step}" for step in estimate.advice))


def _posterior(estimate: Estimate) -> None:
    """What draws say of each parameter, and what they are worth."""
    found = estimate.posterior
    if found is None:
        return
    title = f"posterior, {found.noise}: {len(found.flat)} draws in {found.wall_s:.1f} s"
    table = screen.table(title, "parameter", "median", "central 95 %", "effective", "tails", "R-hat")
    for name, one in found.marginals.items():
        ends = f"{rounded(one.lower, one.sd)} to {rounded(one.upper, one.sd)}"
        sizes = f"{one.size:.0f}", f"{one.tail:.0f}", f"{one.r_hat:.3f}"
        table.add_row(escape(name), rounded(one.median, one.sd), ends, *sizes)
    screen.out.print(table)
    lost = f", {found.failed} could not be simulated" if found.failed else ""
    screen.say(f"{found.evaluations} simulations, {100 * found.accepted:.0f} % of the proposals accepted{lost}")


def _predictions(estimate: Estimate) -> None:
    """What was held out: how far off the prediction is, and how far off it may be."""
    if not estimate.prediction:
        return
    table = screen.table("predicted, not fitted", "held out [s]", "channel", "RMS", "limit (95 %)", "inside")
    for one in estimate.prediction:
        where = f"{one.recording} " if len(estimate.measurement.recordings) > 1 else ""
        for channel in one.channels:
            inside = {True: "yes", False: "NO", None: "-"}[channel.inside]
            limit = "-" if channel.inside is None else f"{channel.limit:.2g}"
            table.add_row(
                escape(f"{where}{one.window[0]:g} to {one.window[1]:g}"),
                escape(f"{channel.name} [{channel.unit}]"),
                *(f"{channel.rms:.2g}", limit, inside),
            )
    screen.out.print(table)


def _minima(estimate: Estimate) -> None:
    """At most five other minima, the best first."""
    from shoal.pictures.units import fitness_unit

    others = sorted(estimate.minima, key=lambda minimum: minimum["fitness"])
    for other in others[:5]:
        values = ", ".join(f"{name} {value:.4g}" for name, value in other.items() if name != "fitness")
        screen.say(f"another minimum, fitness {other['fitness']:.3g} {fitness_unit(estimate)}: {values}")
    if len(others) > 5:
        screen.say(f"and {len(others) - 5} more minima, all worse")


def _effort(estimate: Estimate) -> None:
    """Where the data come from, what the search cost, and how the answer compares with a known truth."""
    from shoal.pictures.units import fitness_unit, rms_unit

    screen.say(f"data: {estimate.data}")
    screen.say(*(f"note: {note}" for note in estimate.notes))
    screen.say(
        f"fitness {estimate.fitness:.4e} {fitness_unit(estimate)}, RMS {estimate.rms:.3e} {rms_unit(estimate)}; "
        f"{estimate.evaluations} evaluations in {estimate.wall_s:.2f} s"
    )
    for stage in estimate.model.get("selection", ()):
        screen.say(
            f"model for {stage['tolerance']:g} m: {stage['model']}, off by about {stage['error']:.1e} m, "
            f"{stage['evaluations']} evaluations"
        )
    if estimate.truth:
        errors = (f"{name} {estimate.parameters[name].value - true:+.2e}" for name, true in estimate.truth.items())
        screen.say(f"against the truth of the computed data: {', '.join(errors)}")
    if estimate.model_error_rms is not None:
        screen.say(f"the mesh of the model is off by {estimate.model_error_rms:.1e} m (RMS); the intervals include it")


def design_table(found: Design) -> None:
    """Candidates, the best first, each alone and beside the best one; then duration and rate."""
    from shoal.identification.design import SENSORS

    beside = dict(found.second)
    best = found.ranked[0][0]
    title = f"{found.problem}: what to measure, {found.duration:g} s at {found.rate:g} samples a second"
    table = screen.table(title, "sensor", "weakest", "std", "A", "D", f"with {best.name}: weakest", "std")
    now = found.aim.weakest(found.now)
    table.add_row("as now", now[0], f"{now[1]:.2e}", f"{found.now.a:.1e}", f"{found.now.d:.1e}", "", "")
    for candidate, precision in found.ranked:
        name, std = found.aim.weakest(precision)
        second = found.aim.weakest(beside[candidate]) if candidate in beside else None
        pair = ("", "") if second is None else (second[0], f"{second[1]:.2e}")
        table.add_row(candidate.label, name, f"{std:.2e}", f"{precision.a:.1e}", f"{precision.d:.1e}", *pair)
    screen.out.print(table)
    table = screen.table(
        f"{best.label}: largest std over range, by duration and samples a second",
        "duration [s]",
        *(f"{rate:g}" for rate in found.rates),
    )
    for duration, row in zip(found.durations, found.table, strict=True):
        table.add_row(f"{duration:g}", *(f"{score:.1e}" for score in row))
    screen.out.print(table)
    units = {"position": "m", "angle": "rad"} | SENSORS
    noise = ", ".join(f"{size:g} {units[kind]}" for kind, size in found.noise.items())
    values = ", ".join(f"{name} {value:.4g}" for name, value in found.values.items())
    screen.say(f"noise {noise}; about {values}")
    screen.say("A, D: root mean square and geometric mean of the standard deviations over the ranges of the parameters")
    screen.say(f"sensitivities by two steps differ by {found.doubt:.0e}")


def doctor_table(checks: list[Check]) -> None:
    """What was looked at, and what to do."""
    table = screen.table("shoal doctor", "check", "", "found", "what to do")
    for check in checks:
        table.add_row(check.name, "ok" if check.ok else "FAILED", check.found, check.advice)
    table.columns[2].justify = table.columns[3].justify = "left"
    screen.out.print(table)
