"""Limits of an answer beside those that decide its verdict: profiles, mesh, time steps, theory."""

from __future__ import annotations

from collections.abc import Mapping

from shoal.findings import Finding
from shoal.identification import findings as kinds
from shoal.identification.conventions import NOTICED, SEVERAL
from shoal.identification.diagnostics.residual_tests import ResidualTests
from shoal.identification.uncertainty.intervals import Value
from shoal.identification.uncertainty.profiles import Profile
from shoal.mechanics.findings import SMALLER


def remarks(
    parameters: Mapping[str, Value],
    profiled: Mapping[str, Profile],
    curved: list[str],
    tests: ResidualTests,
    mesh: float | None,
    theory: float | None,
    bends: bool,
) -> list[Finding]:
    """Return what else limits an answer.

    curved: parameters whose intervals are those of their profiles
    mesh, theory: size of what a finer mesh, with shorter steps, and a fuller theory would change of the motion, None
    where neither limits; bends: whether the machine has a mesh, else it is the steps alone
    """
    found = []
    if better := ", ".join(name for name, profile in profiled.items() if profile.better):
        found.append(kinds.OPEN_PROFILE.found(f"a better fit than the answer was found on the profile of {better}"))
    if curved:
        bent = ", ".join(curved)
        text = f"the misfit is no parabola within the interval of {bent}, which holds that of the profile"
        found.append(kinds.CURVED.found(text))
    if mesh is not None:
        excess = _excess(tests, mesh)
        wanted = (tests.noise if tests.noise_stated else mesh) / 3
        if excess and bends:
            text = f"the mesh error of {tests.sized(mesh)} {excess}; --tolerance {wanted:.1g} finds a better mesh"
            found.append(kinds.MESH_ERROR.found(text, error=mesh, noise=tests.noise, tolerance=wanted))
        widened = _limited(parameters, "correction")
        if not bends and (excess or widened):
            widens = f"widens the interval of {widened}" if widened else ""
            change = " and ".join(part for part in (excess, widens) if part)
            found.append(
                kinds.TIME_ERROR.found(f"the time error of {tests.sized(mesh)} {change}: use {SMALLER}", error=mesh)
            )
    if theory is not None and (widened := _limited(parameters, "theory")):
        change = f"change the motion by about {tests.sized(theory)} and widen the interval of {widened}"
        text = f"shear and rotary inertia, which slender beams neglect, {change}"
        found.append(kinds.THEORY_ERROR.found(text, error=theory))
    return found


def beyond_noise(
    parameters: Mapping[str, Value], profiled: Mapping[str, Profile], tests: ResidualTests
) -> list[Finding]:
    """Return which intervals hold much more than the standard deviations, and what, if any does."""
    wide = [n for n, v in parameters.items() if v.identifiable and v.upper - v.lower > SEVERAL * 2 * v.std > 0.0]
    parts = {part for name in wide for part in ("correction", "theory") if getattr(parameters[name], part)}
    found = ["the model's own error"] * bool(parts) + ["the systematic residual"] * (tests.excess > 0.0)
    found += ["the curvature of the misfit"] * any(name in profiled for name in wide)
    if not wide or not found:
        return []
    text = f"the intervals of {', '.join(wide)} hold {' and '.join(found)} too, the standard deviations noise alone"
    return [kinds.WIDER_THAN_NOISE.found(text)]


def _limited(parameters: Mapping[str, Value], part: str) -> str:
    """Names of parameters whose intervals a part of the model's error widens, `correction` or `theory`."""
    parts = {name: abs(getattr(value, part) or 0.0) for name, value in parameters.items()}
    return ", ".join(n for n, v in parameters.items() if parts[n] > NOTICED * (v.upper - v.lower) / 2)


def _excess(tests: ResidualTests, mesh: float) -> str:
    """Against what the mesh, and not the measurement, limits the answer; empty if it does not."""
    if tests.noise_stated:
        return f"exceeds the noise of {tests.sized(tests.noise)}" if mesh > tests.noise else ""
    return "is all that the fit leaves" if mesh / SEVERAL < tests.size < mesh * SEVERAL else ""
