"""A study of uncertain parameters as one page that needs nothing else: answer, worst case in motion, charts, limits."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from shoal.engines import get_engine
from shoal.errors import ComputationError, InputError
from shoal.findings import sentence
from shoal.pictures.drawn import Drawn
from shoal.pictures.estimates import budget
from shoal.pictures.gaps import gaps
from shoal.pictures.indices import indices
from shoal.pictures.instants import FEW
from shoal.pictures.motion import scene_motion
from shoal.pictures.numbers import length, looked_at
from shoal.pictures.pages import animation, render, software
from shoal.pictures.probability import probability
from shoal.pictures.response import response
from shoal.response import Response
from shoal.response.limits import LimitResult
from shoal.response.worst import Worst, worst
from shoal.trajectory import Array

MARKERS, CASES = 4, 3
"""So many markers and worst cases are shown."""


def uncertainty(found: Response) -> str:
    """The page as HTML without a reference to anything outside."""
    cases = _cases(found)
    return render(
        "uncertainty.html.j2",
        title=f"{found.scene}: uncertain parameters",
        grade=found.grade,
        lead=_lead(found),
        parameters=_parameters(found),
        limits=[_limit(one) for one in found.limits],
        looked_at=looked_at(found.times),
        motions=[_over_nominal(found, case) for case in cases],
        cases=[_case(case) for case in cases],
        pictures=[one.embedded() for one in _pictures(found)],
        passages=[_passage(one).embedded() for one in found.limits if one.estimates],
        allocation=_allocation(found),
        allocated=_allocated(found),
        reasons=[sentence(one.text) for one in found.findings],
        advice=[sentence(one) for one in found.advice],
        remarks=_remarks(found),
        provenance=_provenance(found),
    )


def _lead(found: Response) -> str:
    if not found.ok:
        return f"Not to be believed as it stands ({found.status}): {found.findings[0].text}."
    told = found.bounds.upper - found.bounds.lower if found.bounds is not None else None
    if told is not None:
        widest, marker = _largest(found, told)
        return (
            f"Places of {marker} differ by up to {length(widest)} {looked_at(found.times)}; runs attain the bounds. "
            f"Known error of the model: {budget(found.errors)}."
        )
    if found.boxes is not None:
        deviation, among = found.boxes.std.upper, "Over all interval values, "
    else:
        assert found.statistics is not None
        deviation, among = found.statistics.std, ""
    spread, marker = _largest(found, deviation)
    return (
        f"{among}{marker} scatters with a standard deviation of up to {length(spread)} {looked_at(found.times)}. "
        f"Known error of the model: {budget(found.errors)}."
    )


def _largest(found: Response, of: Array) -> tuple[float, str]:
    """Return the largest value of all coordinates [m], and its marker."""
    return max((float(found.column(marker, axis, of).max()), marker) for marker in found.markers for axis in found.axes)


def _parameters(found: Response) -> list[list[str]]:
    return [[one.name, one.marginal.text or "a distribution"] for one in found.inputs.parameters]


def _limit(one: LimitResult) -> list[str]:
    shown = one.shown
    how = "–" if shown is None else ", ".join(f"{name} = {value:.5g}" for name, value in shown.parameters.items())
    if one.between is not None:
        lower, upper = one.between.interval
        chances = " to ".join(each.described for each in one.estimates)
        return [one.limit.title, chances, f"{lower:.3g} to {upper:.3g}", how]
    if one.exceedance is None:
        says = f"{one.limit.verdict(one.kept)}{f' {looked_at(one.times)}' if one.kept else ''}"
        error = f" ({one.errors.brief})" if one.errors.estimates else ""
        return [one.limit.title, says, f"{one.margin:.3g} {one.limit.unit}{error}", how]
    low, high = one.interval
    return [one.limit.title, one.exceedance.estimate.described, f"{low:.3g} to {high:.3g}", how]


def _cases(found: Response) -> list[Worst]:
    """Those that can be shown."""
    try:
        return worst(found)[:CASES]
    except InputError:
        return []


def _over_nominal(found: Response, case: Worst) -> dict[str, Any]:
    engine, until = get_engine(found.engine), float(found.times[-1])
    try:
        moving, nominal = (scene_motion(scene, engine, until) for scene in (case.scene, found.stated))
    except (ComputationError, InputError):
        return {}
    frames = min(len(moving.times), len(nominal.times))
    shown = replace(
        moving,
        name=case.of,
        times=moving.times[:frames],
        outlines={name: path[:frames] for name, path in moving.outlines.items()},
        markers={name: path[:frames] for name, path in moving.markers.items()},
        behind={name: path[:frames] for name, path in nominal.outlines.items()},
    )
    return animation(shown, f"Worst case of {case.of}")


def _case(case: Worst) -> list[str]:
    shown = case.shown
    values = ", ".join(f"{name} = {value:.6g}" for name, value in shown.parameters.items())
    errors = "unknown" if shown.errors is None else str(shown.errors.budget)
    return [case.of, values, f"{shown.margin:.4g}", f"{shown.time:.4g}", errors]


def _pictures(found: Response) -> list[Drawn]:
    drawn = []
    few = len(found.times) <= FEW
    band = "What runs attain at the instants looked at" if few else "The band that runs attain"
    what = f"{band}, with outer bounds" if found.bounds is not None else "Mean and quantiles"
    if found.boxes is not None:
        what = "Where the mean and the 5 % and 95 % quantiles may lie"
    for marker in found.markers[-MARKERS:]:
        alt = f"{what} of {marker} over time."
        drawn.append(Drawn(f"response-{marker}", response(found, marker), alt, f"{what} of {marker}."))
    last = found.markers[-1]
    if found.statistics is None:
        lie = "Outer bounds lie a gap beyond what runs attain"
        if found.boxes is not None:
            lie = "Outer bounds of the mean lie a gap beyond those told; the scatter is its spread and a deviation"
        words = f"{lie}; the known error of the model is that of the runs that decide."
        alt = f"{'Widths' if found.boxes is None else 'Scatter'}, gaps and errors of {last} over time."
        drawn.append(Drawn("gaps", gaps(found, last), alt, words))
    shares = found.statistics.total if found.statistics is not None else None
    shares = found.boxes.shares if found.boxes is not None else shares
    if shares is not None and not np.isnan(shares).all():
        words = "The share of the variance that goes with a parameter, alone and with others"
        words += "." if found.boxes is None else ": from the least to the largest over all interval values."
        drawn.append(Drawn("indices", indices(found, last), f"Total Sobol indices of {last} over time.", words))
    return drawn


def _passage(one: LimitResult) -> Drawn:
    event = one.limit.event.removeprefix("is ")
    words = f"The probability that the {one.limit.stated} has been {event} at an instant looked at, by each of them."
    return Drawn(f"passage-{one.limit.text}", probability(one), words, f"{words[:-1]}: {one.limit.title}.")


def _allocation(found: Response) -> list[list[str]]:
    if found.allocation is None:
        return []
    told = found.allocation.to_json()["parameters"]
    keys = "tolerance_stated", "tolerance", "factor", "effect_of_one_per_cent"
    return [[name, *(f"{one[key]:.3g}" for key in keys)] for name, one in told.items()]


def _allocated(found: Response) -> list[str]:
    """Describe the allocated tolerances."""
    told = found.allocation
    if told is None:
        return []
    return [
        f"The {told.what} is {told.stated:.3g} with the stated tolerances and {told.confirmed_text} with those found, "
        f"which cost {told.cost:.3g} times as much.",
        f"To tighten first: {told.first or 'none'}.",
    ]


def _remarks(found: Response) -> list[str]:
    remarks = [f"{one.limit.title}: {one.exceedance.why}." for one in found.limits if one.exceedance is not None]
    for one in found.limits:
        if one.between is not None:
            for side, at in (("least", one.between.at_lower), ("most", one.between.at_upper)):
                values = ", ".join(f"{name} = {value:.5g}" for name, value in at.items())
                remarks.append(f"{one.limit.title}: {side} probable with {values}.")
    if found.repeated or found.failed:
        remarks.append(f"{found.repeated} runs were repeated with smaller steps; {found.failed} failed all the same.")
    if (found.bounds or found.boxes) is not None and found.horizon < found.times[-1]:
        what = "Bounds hold" if found.boxes is None else "Statistics are known"
        remarks.append(f"{what} until {found.horizon:.4g} s.")
    return remarks


def _provenance(found: Response) -> list[tuple[str, str]]:
    return [
        ("method", f"{found.method}: {found.why}"),
        ("effort", f"{found.evaluations} runs, {sum(one.evaluations for one in found.limits)} more for limits"),
        ("errors", f"{budget(found.errors)}, of the runs that decide"),
        ("engine", found.engine),
        ("seed", str(found.seed)),
        ("scene", found.stated.fingerprint),
        ("versions", software()),
    ]
