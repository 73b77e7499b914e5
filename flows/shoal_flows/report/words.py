"""Numbers as people read them, and the sentences that come before the tables."""

from __future__ import annotations

import numpy as np
from shoal.pictures.numbers import length, power

from shoal_flows.jobs import Fit
from shoal_flows.report.paper import AS, NAMES, TABLES
from shoal_flows.results import Compared, DemoResult, Study


def degrees(radians: float | None, digits: int = 4) -> str:
    """An angle in degrees, with its sign only if negative."""
    return "none" if radians is None else f"{np.degrees(radians):.{digits}f}"


def errors(fit: Fit) -> dict[str, float]:
    """Estimate minus truth [rad]."""
    return {name: fit.estimate.parameters[name].value - true for name, true in fit.estimate.truth.items()}


def covered(fit: Fit) -> bool:
    """Return whether every interval contains the truth."""
    values = fit.estimate.parameters
    return all(values[name].lower <= true <= values[name].upper for name, true in fit.estimate.truth.items())


def largest_error(fit: Fit) -> float:
    """Largest error of an angle [rad]."""
    return max(map(abs, errors(fit).values()))


def largest_distance(compared: Compared) -> float:
    """Largest distance [m] of two engines at the tip."""
    return max((row["largest"] or np.inf) for row in compared.answer.differences() if row["marker"] == "B")


def identified(title: str, study: Study) -> str:
    """Describe the identified values and their accuracy, by least squares."""
    fit = study.by_method().get("least-squares")
    if fit is None:
        return f"{title}: least squares failed ({next(iter(study.failures.values()), 'no reason given')})."
    e = fit.estimate
    values = " and ".join(f"{name} = {np.degrees(v.value):.3f}°" for name, v in e.parameters.items())
    truth = " and ".join(f"{np.degrees(true):.0f}°" for true in e.truth.values())
    return (
        f"{title}: {values}, where the data were computed with {truth}. The larger error is "
        f"{degrees(largest_error(fit))}°, the tip is matched to {length(e.rms)} (RMS), and "
        f"{e.evaluations} simulations were enough. Verdict: {e.verdict}."
    )


def against_swarms(title: str, study: Study) -> str:
    """Describe the swarms in comparison with least squares."""
    fits = study.by_method()
    if not {"iafsa", "iafsa-unseeded", "afsa", "iafsa-printed", "least-squares"} <= set(fits):
        return f"{title}: not every swarm ended."
    repaired, plain, printed, exact = (fits[m] for m in ("iafsa", "afsa", "iafsa-printed", "least-squares"))
    alone = fits["iafsa-unseeded"]
    gap = max(abs(a - b) for a, b in zip(errors(repaired).values(), errors(exact).values(), strict=True))
    return (
        f"{title}: by itself the repaired IAFSA ends {degrees(largest_error(alone), 3)}° from the truth after "
        f"{alone.estimate.evaluations} simulations, AFSA as published {degrees(largest_error(plain), 3)}° after "
        f"{plain.estimate.evaluations}. With the paper's seeds one of the first fish of IAFSA is the answer of least "
        f"squares; the repaired one ends within {power(gap, 0)} rad of it, the one as printed "
        f"{degrees(largest_error(printed), 3)}° from the truth{_outside(printed)}."
    )


def _outside(fit: Fit) -> str:
    bound = [name for name, value in fit.estimate.parameters.items() if value.at_bound or abs(value.value) > np.pi / 2]
    return f", with {' and '.join(bound)} outside the bounds of the search" if bound else ""


def same_mesh(title: str, study: Study) -> str:
    """Describe the residual if the data come from the mesh that is fitted."""
    fit = study.by_method().get("least-squares")
    if fit is None:
        return f"{title}: least squares failed on data of its own mesh."
    e = fit.estimate
    return (
        f"{title}: with data of the very mesh that is fitted (CasADi, 2/4 elements), least squares comes to within "
        f"{power(largest_error(fit), 0)} rad in {e.evaluations} evaluations, at a fitness of {power(e.fitness, 1)} m²."
    )


def like_with_like(title: str, case: str, same: Study, study: Study) -> str:
    """Describe the accuracy of the paper's swarms on data of the fitted mesh, as printed, and of a finer model."""
    on_own, on_other = same.by_method(), study.by_method()
    methods = {method: f"{NAMES[row]} {kind}" for row, kinds in AS.items() for method, kind in kinds.items()}
    if not set(methods) <= set(on_own) & set(on_other):
        return f"{title}: not every swarm ended."
    reached = [f"{name} {power(on_own[method].estimate.fitness, 1)} m²" for method, name in methods.items()]
    printed = [f"{NAMES[row]} {one.fitness} m²" for row, one in TABLES[case][1].items()]
    least = min(on_other[method].estimate.fitness for method in methods)
    return (
        f"{title}: on data of the mesh that is fitted, {', '.join(reached)}; the paper prints {' and '.join(printed)}. "
        f"On data of a finer model none of them comes below {power(least, 1)} m²: the rest is the error of the mesh."
    )


def confirmed(title: str, compared: Compared, study: Study) -> str:
    """Describe which engines confirm the result."""
    names = list(compared.answer.trajectories)
    text = (
        f"{title}: {', '.join(names[:-1])} and {names[-1]} put the tip of the paper's 2/4 mesh within "
        f"{length(largest_distance(compared))} of each other over the whole motion."
    )
    fits = study.by_method()
    if {"casadi", "least-squares"} <= set(fits):
        pairs = zip(errors(fits["casadi"]).values(), errors(fits["least-squares"]).values(), strict=True)
        gap = max(abs(a - b) for a, b in pairs)
        text += f" CasADi's own derivation, optimised by IPOPT, finds the same angles to {power(gap, 0)} rad."
    return text


def mesh_sentence(title: str, study: Study) -> str:
    """Describe the effect of the mesh, coarsest against finest."""
    if len(study.fits) < 2:
        return f"{title}: the meshes could not be compared."
    coarse, fine = study.fits[0], study.fits[-1]
    return (
        f"{title}: with {coarse.cell.name} the larger error is {degrees(largest_error(coarse), 2)}°, with "
        f"{fine.cell.name} {degrees(largest_error(fine), 5)}°."
    )


def headline(result: DemoResult) -> str:
    """The whole in one line."""
    worst = [largest_error(fit) for study in result.studies.values() for fit in study.fits if _answers(fit)]
    if not result.trusted or not worst:
        return "Not every answer can be trusted: " + "; ".join(result.doubts()) + "."
    return (
        f"Both pairs of initial angles are recovered from the motion of the tip, to {degrees(max(worst), 3)}° or "
        f"better, from data of a finer model in another engine."
    )


def _answers(fit: Fit) -> bool:
    return fit.cell.method in ("least-squares", "iafsa")
