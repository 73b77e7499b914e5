"""What a sought friction rests on: that its joint resists by no other law. A little of one may not show in a recording.

The effects of viscous friction, quadratic drag and dry friction on a few swings are so alike that a law which was left
out moves the sought number far beyond an interval that knows of none, and leaves hardly a misfit.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from shoal.findings import Finding
from shoal.identification.diagnostics.suspects.candidate import FaultHypothesis, Together, size_of
from shoal.identification.diagnostics.suspects.of_machine import RESISTING, resisting
from shoal.identification.findings import OTHER_LAW
from shoal.identification.forward import ForwardModel
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.intervals import Value
from shoal.identification.uncertainty.linearisation import inverse, linearise, spread
from shoal.identification.uncertainty.sensitivity import Sensitivity
from shoal.scene.joints import Resisted
from shoal.trajectory import Array

_FAR = 2.0
"""Times the interval: a friction that may be so much farther off with another law beside it is told."""
_ALIKE = 1e-3
"""Of a friction: nobody who knows it so well asks for more."""


@dataclass(frozen=True)
class OtherLaw:
    """Another law by which the joint of a friction that is sought may resist, and how much of it the data allow.

    sought: the friction's name; field: one of RESISTING, sought nowhere and left out of the joint
    fits: whether some of it fits better than none; end: the fit, to first order, with as much of it as may be, (p,)
    """

    sought: str
    joint: str
    field: str
    fits: bool
    end: Array


def other_laws(model: ForwardModel, point: Array, seen: Sensitivity) -> list[OtherLaw]:
    """Each friction that is sought, with each other law that its joint may have. Runs are not counted."""
    taken = {*model.parameters.paths, *model.problem.ties}
    asked, beside = list[tuple[str, str, str]](), dict[tuple[str, str], FaultHypothesis]()
    for name, path in zip(model.names, model.parameters.paths, strict=True):
        where, _, field = path.rpartition(".")
        joint_name = where.removeprefix("joints.")
        joint = model.scene.joints.get(joint_name)
        if field not in RESISTING or not isinstance(joint, Resisted):
            continue
        for other in RESISTING:
            if f"{where}.{other}" not in taken and not getattr(joint, other):
                asked.append((name, joint_name, other))
                beside[joint_name, other] = resisting(joint_name, joint, other, size_of(model.scene))
    if not beside:
        return []
    candidates = list(beside.values())
    probes = [candidate.probes[0, 0] for candidate in candidates]
    points = [np.append(point, candidate.vector(probe)) for candidate, probe in zip(candidates, probes, strict=True)]
    effects = Together(model, candidates).residuals(range(len(candidates)), points) - seen.residual
    most = [_most(model, point, seen, effect / probe[0]) for effect, probe in zip(effects, probes, strict=True)]
    ends = dict(zip(beside, most, strict=True))
    return [OtherLaw(name, joint, law, *end) for name, joint, law in asked if (end := ends[joint, law]) is not None]


def wider_by_other_laws(
    laws: list[OtherLaw], values: dict[str, Value], there: Callable[[OtherLaw], Value]
) -> list[Finding]:
    """Return a finding for each friction that is known much less well if its joint resists by another law too.

    there: the sought friction at the end of a law
    """
    wide: dict[tuple[str, str], dict[str, Value]] = {}
    for law in laws:
        known, other = values[law.sought], there(law)
        least = max(_FAR * (known.upper - known.lower) / 2, _ALIKE * abs(known.value))
        if known.identifiable and abs(other.value - known.value) > least:
            wide.setdefault((law.sought, law.joint), {})[RESISTING[law.field]] = other
    texts = [
        f"should {joint} have {' or '.join(others)} as well, which may not show here, {sought} is only known to be "
        "from {:.4g} to {:.4g}".format(*_whole([values[sought], *others.values()]))
        for (sought, joint), others in wide.items()
    ]
    return [OTHER_LAW.found(text) for text in texts]


def _whole(found: list[Value]) -> tuple[float, float]:
    """From the lowest to the highest of the ends of intervals."""
    return min(one.lower for one in found), max(one.upper for one in found)


def _most(model: ForwardModel, point: Array, seen: Sensitivity, column: Array) -> tuple[bool, Array] | None:
    """Return whether a law that was left out fits, and the fit with the most of it that may be; None where it has no
    effect.

    column: its effect on the residuals, for each unit of it. The most is the upper end of its interval, or less where
    a parameter comes to its bound.
    """
    if not (np.all(np.isfinite(column)) and np.any(column)):
        return None
    known = model.sizes(point)
    slope = -inverse(seen.jacobian, known, seen.error)[0] @ column
    # By a size of the law that changes the motion as much as the parameters do, so that it counts among them.
    size = float(np.linalg.norm(seen.jacobian * known, axis=0).max() / np.linalg.norm(column))
    freed, scale = np.column_stack([seen.jacobian, column]), np.append(known, size)
    error = np.column_stack([seen.error, np.zeros_like(column)])
    change = -inverse(freed, scale, error)[0] @ seen.residual
    amount = float(change[-1])
    left = seen.residual + freed @ change if amount > 0.0 else seen.residual
    at = linearise(freed, left, scale, blocks_of(model, len(left)), error)
    most = max(0.0, amount + spread(lambda p: float(p[-1]), np.append(point, 0.0), at).half)
    with np.errstate(divide="ignore", invalid="ignore"):
        room = np.where(slope < 0.0, model.lower - point, model.upper - point) / slope
    most = min([most, *room[slope != 0.0]])
    return amount > 0.0, point + most * slope
