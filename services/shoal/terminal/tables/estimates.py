"""Tables of identifications and of experiment designs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape

from shoal.pictures.numbers import rounded
from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.identification import Estimate
    from shoal.identification.design import Design


def estimate_table(estimate: Estimate) -> None:
    """The verdict, then values with intervals, other minima, what the residuals say, and what to do next."""
    screen.say(f"verdict: {estimate.verdict}", style="bold")
    screen.say(*(f"  {one.text}" for one in estimate.findings))
    table = screen.table(f"{estimate.problem}, {estimate.method}", "parameter", "value", "95 % interval", "known")
    for name, value in {**estimate.parameters, **estimate.quantities}.items():
        known = estimate.known(value)
        # Two digits of the uncertainty; a value that is not known has none that mean anything.
        unit = value.std if known == "yes" and value.std > 0 else abs(value.value) * 1e-2
        interval = f"{rounded(value.lower, unit)} to {rounded(value.upper, unit)}" if known == "yes" else "-"
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
    """Print the posterior of each parameter, with the diagnostics of the sampler."""
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
    """Print the errors of predictions of held-out data, and their predicted standard deviations."""
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

    others = estimate.minima
    for other in others[:5]:
        values = ", ".join(f"{name} {value:.4g}" for name, value in other.items() if name != "fitness")
        screen.say(f"another minimum, fitness {other['fitness']:.3g} {fitness_unit(estimate)}: {values}")
    if len(others) > 5:
        screen.say(f"and {len(others) - 5} more minima, all worse")


def _effort(estimate: Estimate) -> None:
    """Print the source of the data, the cost of the search and the error where the truth is known."""
    from shoal.pictures.units import fitness_unit, rms_unit

    screen.say(f"data: {estimate.data}")
    screen.say(*(f"note: {note}" for note in estimate.notes))
    screen.say(
        f"fitness {estimate.fitness:.4e} {fitness_unit(estimate)}, RMS {estimate.rms:.3e} {rms_unit(estimate)} "
        f"for each place or angle; {estimate.evaluations} evaluations in {estimate.wall_s:.2f} s"
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
        error = f"{estimate.model_error_rms:.1e} m (RMS)"
        screen.say(f"mesh and steps of the model are off by {error}; the intervals include it")


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
    screen.say(f"noise {noise}; about {values}", *(f"with {what}" for what in found.given))
    screen.say("A, D: root mean square and geometric mean of the standard deviations over the ranges of the parameters")
    screen.say(f"sensitivities by two steps differ by {found.doubt:.0e}")
