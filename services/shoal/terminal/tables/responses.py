"""Tables of uncertain machines: bounds or statistics, limits, tolerances, shares of the variance."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from rich.markup import escape

from shoal.findings import message
from shoal.pictures.numbers import looked_at
from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.response import Response
    from shoal.response.allocation import Allocation
    from shoal.response.limits import LimitResult
    from shoal.response.limits.result import ProbabilityBounds
    from shoal.response.probability_boxes import ProbabilityBoxes


def response_table(response: Response) -> None:
    """The end: bounds with their gap, or mean, deviation and what it is owed to, or bounds of these."""
    title = f"{response.scene} at t = {response.times[-1]:g} s, {response.method}"
    headings: tuple[str, ...]
    if response.bounds is not None:
        headings = "lower", "upper", "outer low", "outer high"
        found = response.bounds
        columns = [found.lower, found.upper, found.lower_outer, found.upper_outer]
    elif response.boxes is not None:
        headings = "mean from", "to", "deviation from", "to", "5 % from", "95 % to"
        mean, std, quantiles = response.boxes.mean, response.boxes.std, response.boxes.quantiles
        columns = [mean.lower, mean.upper, std.lower, std.upper, quantiles[1].widest[0], quantiles[-2].widest[1]]
    else:
        assert response.statistics is not None
        headings = "mean", "deviation", "5 %", "95 %"
        told = response.statistics
        columns = [told.mean, told.std, told.quantiles[1], told.quantiles[-2]]
    estimated = response.errors.total is not None
    headings += ("gap",) if response.bounds is not None else ()
    table = screen.table(title, "", *headings, *(("error",) if estimated else ()))
    for marker in response.markers:
        for quantity in response.quantities:
            unit = "rad" if quantity == "angle" else "m"
            numbers = (response.column(marker, quantity, column)[-1] for column in columns)
            forms = ["z.6f"] * 4 if response.boxes is None else [".4g", ".4g", ".2g", ".2g", ".4g", ".4g"]
            cells = ["-" if np.isnan(x) else f"{x:{form}}" for x, form in zip(numbers, forms, strict=True)]
            if response.bounds is not None:
                gap = response.gap(marker, quantity)
                cells.append("-" if np.isnan(gap) else f"{gap:.0e}")
            if estimated:
                cells.append(f"{response.column(marker, quantity, response.model)[-1]:.0e}")
            table.add_row(escape(f"{marker}.{quantity} [{unit}]"), *cells)
    screen.out.print(table)
    if response.statistics is not None:
        _shares(response)
    if response.boxes is not None and response.boxes.shares is not None:
        _shares_between(response, response.boxes)
    for result in response.limits:
        _limit(result)
    if response.allocation is not None:
        _allocation(response.allocation)
    screen.say(
        f"status {response.status}, {response.errors.brief}; {response.evaluations} runs in "
        f"{response.wall_s:.2f} s; {response.why}",
        style=screen.COLOURS[response.grade],
    )
    screen.findings(response)
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
            f"outer ones lie {gap:.1e} of the width off{_by_model(response)}; they hold until {response.horizon:g} s"
        )
        unknown = "how much farther other values go is not known"
        screen.say(f"bounds {looked_at(response.times)} are attained by runs; {unknown if np.isnan(gap) else known}")
        if response.unseen is not None:
            screen.say(
                f"{response.controls} of the runs lie all over the box: what is told may be otherwise in "
                f"{100 * response.unseen:.2g} % of it at most, with 95 % confidence"
            )
    if (boxes := response.boxes) is not None:
        screen.say(
            f"statistics {looked_at(response.times)} lie between these values, whatever the intervals are; they are "
            f"known to {boxes.gap:.1e} of the scatter, deviations to {boxes.std_gap:.1e} of their size"
            f"{_by_model(response)}, until {response.horizon:g} s"
        )
    if response.errors.estimates:
        screen.say(f"estimated error of the runs that decide: {response.errors}")
    if response.finer is not None:
        moved = [f"{name} by {one['by']:.1e} at {one['t']:g} s" for name, one in list(response.moved().items())[:3]]
        screen.say(
            f"{response.finer.runs} runs that attain bounds, on twice as fine a mesh, move most: {', '.join(moved)}"
        )


def _by_model(response: Response) -> str:
    """Describe the part of the model's error in a gap."""
    return "" if response.errors.total is None else f" and the known error of the model, {response.errors.total:.1e} m"


def _limit(result: LimitResult) -> None:
    """Print the result of a limit, and the values at which it is decided."""
    title, shown, at = result.limit.title, result.shown, looked_at(result.times)
    if result.between is not None:
        _between(title, result, result.between)
        how = "most probably with"
    elif result.exceedance is not None:
        estimate = result.exceedance.estimate
        lower, upper = result.interval
        screen.say(
            f"{title}: {result.limit.event} {at} with probability {estimate.described}, with 95 % confidence between "
            f"{lower:.3g} and {upper:.3g}",
            f"  by {result.exceedance.why}; {result.evaluations} runs",
            style="bold",
        )
        how = "most probably with" if result.exceedance.points else "nearest with"
    else:
        undecided = f"{result.limit.verdict(True)} in all runs {at}, which proves nothing"
        undecided = f"is not decided {at}: {message(result.reasons)}" if result.hidden else undecided
        holds = f"{result.limit.verdict(True)} for all values {at}"
        says = {True: holds, False: result.limit.verdict(False), None: undecided}
        screen.say(f"{title}: {says[result.kept]}", style="bold")
        how = f"{result.limit.event.removeprefix('is ')} with" if result.kept is False else "nearest with"
    if shown is not None:
        known = ", ".join(f"{name} = {value:.6g}" for name, value in shown.parameters.items())
        error = f", {result.errors.brief}" if result.errors.estimates else ""
        margin = f"margin {shown.margin:.3g} {result.limit.unit} at {shown.time:g} s{error}"
        screen.say(f"  {how} {known}: {margin if math.isfinite(shown.margin) else shown.message}")


def _between(title: str, result: LimitResult, found: ProbabilityBounds) -> None:
    """Print two bounds of a probability, and the interval values at which they are attained."""
    (least, largest), (lower, upper) = result.estimates, found.interval
    screen.say(
        f"{title}: {result.limit.event} {looked_at(result.times)} with a probability between {least.described} and "
        f"{largest.described}, with 95 % confidence between {lower:.3g} and {upper:.3g}",
        style="bold",
    )
    for name, at in (("least", found.at_lower), ("largest", found.at_upper)):
        screen.say(f"  {name} with {', '.join(f'{path} = {value:.6g}' for path, value in at.items())}")
    screen.say(f"  by {found.places} interval values and {result.evaluations} runs")


def _allocation(found: Allocation) -> None:
    """Tolerances that keep the limit, and what tightening the stated ones does."""
    told = found.to_json()
    title = f"tolerances with which {found.required} holds"
    table = screen.table(title, "", "stated", "found", "factor", "effect of 1 %")
    for name, one in told["parameters"].items():
        numbers = one["tolerance_stated"], one["tolerance"], one["factor"], one["effect_of_one_per_cent"]
        table.add_row(escape(name), *(f"{x:.3g}" for x in numbers))
    screen.out.print(table)
    screen.say(
        f"{found.what} {found.stated:.3g} with the stated tolerances, {found.confirmed_text} with those found, which "
        f"cost {found.cost:.3g} times as much; to tighten first: {found.first or 'none'}; {found.evaluations} runs"
    )


def _shares_between(response: Response, found: ProbabilityBoxes) -> None:
    """The least and the largest of Sobol's total indices at the end, over all interval values."""
    assert found.shares is not None
    marker, axes = response.markers[-1], response.axes
    table = screen.table(f"share of the variance of {marker} (total Sobol index), from and to", "", *axes)
    for k, name in enumerate(response.random):
        ends = [[response.column(marker, axis, found.shares[1, side, k])[-1] for side in (0, 1)] for axis in axes]
        table.add_row(escape(name), *("-" if np.isnan(low) else f"{low:.3f} to {high:.3f}" for low, high in ends))
    screen.out.print(table)


def _shares(response: Response) -> None:
    """Sobol's total indices at the end."""
    assert response.statistics is not None
    marker = response.markers[-1]
    axes = response.axes
    if np.all(np.isnan(response.statistics.total)):
        return
    table = screen.table(f"share of the variance of {marker} (total Sobol index)", "", *axes)
    for k, name in enumerate(response.inputs.names):
        shares = [response.column(marker, axis, response.statistics.total[k])[-1] for axis in axes]
        table.add_row(escape(name), *("-" if np.isnan(x) else f"{x:.3f}" for x in shares))
    screen.out.print(table)
