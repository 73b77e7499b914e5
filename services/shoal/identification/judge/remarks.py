"""What is said beside a verdict: other limits of an answer than those that decide it."""

from __future__ import annotations

from collections.abc import Mapping

from shoal.identification.judge.residual_tests import ResidualTests
from shoal.identification.spread.profiles import Profile
from shoal.identification.spread.value import Value

_NOTICED = 0.1
"""Of half an interval: a contribution to it that is worth a word."""
_ALIKE = 3.0
"""A residual within this factor of the mesh error is explained by it."""


def remarks(
    parameters: Mapping[str, Value],
    profiled: Mapping[str, Profile],
    curved: list[str],
    tests: ResidualTests,
    mesh: float | None,
    theory: float | None,
) -> list[str]:
    """A sentence for each other limit, or none.

    curved: parameters whose intervals are those of their profiles
    mesh, theory: size of what a finer mesh and a fuller theory would change of the motion, None where neither limits
    """
    found = []
    if better := ", ".join(name for name, profile in profiled.items() if profile.better):
        found.append(f"a better fit than the answer was found on the profile of {better}")
    if curved:
        bent = ", ".join(curved)
        found.append(f"the misfit is no parabola within the interval of {bent}, which is that of the profile")
    if mesh is not None and (excess := _excess(tests, mesh)):
        wanted = (tests.noise if tests.noise_stated else mesh) / 3
        found.append(f"the mesh error of {tests.sized(mesh)} {excess}; --tolerance {wanted:.1g} finds a better mesh")
    limited = [n for n, v in parameters.items() if abs(v.theory or 0.0) > _NOTICED * (v.upper - v.lower) / 2]
    if theory is not None and limited:
        change = f"change the motion by about {tests.sized(theory)} and widen the interval of {', '.join(limited)}"
        found.append(f"shear and rotary inertia, which slender beams neglect, {change}")
    return found


def _excess(tests: ResidualTests, mesh: float) -> str:
    """Against what the mesh, and not the measurement, limits the answer; empty if it does not."""
    if tests.noise_stated:
        return f"exceeds the noise of {tests.sized(tests.noise)}" if mesh > tests.noise else ""
    return "is all that the fit leaves" if mesh / _ALIKE < tests.size < mesh * _ALIKE else ""
