"""Tables of what is found from measured motion, and of what to measure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.markup import escape

from shoal.pictures.numbers import rounded
from shoal.pictures.units import fitness_unit, rms_unit
from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.identification import Estimate
    from shoal.identification.design import Design


def estimate_table(estimate: Estimate) -> None:
    """The verdict, then values with intervals, other minima, what the residuals say, and what to do next."""
    screen.say(f"verdict: {estimate.verdict}", style="bold")
    for reason in filter(None, estimate.message.split("; ")):
        screen.say(f"  {reason}")
    table = screen.table(f"{estimate.problem}, {estimate.method}", "parameter", "value", "95 % interval", "known")
    for name, value in {**estimate.parameters, **estimate.quantities}.items():
        known = "yes" if value.identifiable else "at bound" if value.at_bound else "no"
        # Two digits of the uncertainty; a value that is not known has none that mean anything.
        unit = value.std if value.identifiable and value.std > 0 else abs(value.value) * 1e-2
        interval = f"{rounded(value.lower, unit)} to {rounded(value.upper, unit)}" if value.identifiable else "-"
        label = f"{name} [{value.unit}]" if value.unit else name
        table.add_row(escape(label), rounded(value.value, unit), interval, known)
    screen.put(table)
    for sentence in estimate.combinations:
        screen.say(sentence)
    _minima(estimate)
    for sentence in estimate.residual_tests.sentences():
        screen.say(f"residual {sentence}")
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
    _effort(estimate)
    for step in estimate.advice:
        screen.say(f"next: {step}")


def _minima(estimate: Estimate) -> None:
    """At most five other minima, the best first."""
    others = sorted(estimate.minima, key=lambda minimum: minimum["fitness"])
    for other in others[:5]:
        values = ", ".join(f"{name} {value:.4g}" for name, value in other.items() if name != "fitness")
        screen.say(f"another minimum, fitness {other['fitness']:.3g} {fitness_unit(estimate)}: {values}")
    if len(others) > 5:
        screen.say(f"and {len(others) - 5} more minima, all worse")


def _effort(estimate: Estimate) -> None:
    """Where the data come from, what the search cost, and how the answer compares with a known truth."""
    screen.say(f"data: {estimate.data}")
    for note in estimate.notes:
        screen.say(f"note: {note}")
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
    beside = dict(found.second)
    best = found.ranked[0][0]
    title = f"{found.problem}: what to measure, {found.duration:g} s at {found.rate:g} samples a second"
    table = screen.table(title, "marker", "weakest", "std", "A", "D", f"with {best.name}: weakest", "std")
    now = found.weakest(found.now)
    table.add_row("as now", now[0], f"{now[1]:.2e}", f"{found.now.a:.1e}", f"{found.now.d:.1e}", "", "")
    for candidate, precision in found.ranked:
        name, std = found.weakest(precision)
        second = found.weakest(beside[candidate]) if candidate in beside else None
        pair = ("", "") if second is None else (second[0], f"{second[1]:.2e}")
        table.add_row(candidate.label, name, f"{std:.2e}", f"{precision.a:.1e}", f"{precision.d:.1e}", *pair)
    screen.put(table)
    table = screen.table(
        f"{best.label}: largest std over range, by duration and samples a second",
        "duration [s]",
        *(f"{rate:g}" for rate in found.rates),
    )
    for duration, row in zip(found.durations, found.table, strict=True):
        table.add_row(f"{duration:g}", *(f"{score:.1e}" for score in row))
    screen.put(table)
    angle = "" if found.angle_noise is None else f", {found.angle_noise:g} rad"
    values = ", ".join(f"{name} {value:.4g}" for name, value in found.values.items())
    screen.say(f"noise {found.noise:g} m{angle}; about {values}")
    screen.say("A, D: root mean square and geometric mean of the standard deviations over the ranges of the parameters")
    screen.say(f"sensitivities by two steps differ by {found.doubt:.0e}")
