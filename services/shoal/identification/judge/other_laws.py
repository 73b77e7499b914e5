"""What a sought friction rests on: that its joint resists by no other law. A little of one may not show in a recording.

The effects of viscous friction, quadratic drag and dry friction on a few swings are so alike that a law which was left
out moves the sought number far beyond an interval that knows of none, and leaves hardly a misfit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.identification.judge.suspects.candidate import Candidate
from shoal.identification.judge.suspects.fits import Together
from shoal.identification.judge.suspects.of_machine import RESISTING, resisting
from shoal.identification.judge.suspects.size import size_of
from shoal.identification.spread.intervals import Refit
from shoal.identification.spread.sensitivity import Sensitivity
from shoal.identification.spread.value import Value
from shoal.scene.joints import Resisted
from shoal.trajectory import Array

_FAR = 2.0
"""Times the interval: a friction that is so much less certain with another law beside it is told."""


@dataclass(frozen=True)
class OtherLaw:
    """A friction that is sought, by its name, and the fit with another law of its joint freed, to first order.

    field: one of RESISTING, which is sought nowhere and was left out of the joint
    """

    sought: str
    joint: str
    field: str
    refit: Refit

    @property
    def fits(self) -> bool:
        """Whether some of the law fits better than none."""
        return bool(self.refit.point[-1] > 0.0)

    @property
    def value(self) -> Value:
        """Of the sought friction with the other law beside it."""
        return self.refit.values()[self.sought]


def other_laws(model: ForwardModel, point: Array, seen: Sensitivity) -> list[OtherLaw]:
    """Each friction that is sought, with each other law that its joint may have. Runs are not counted."""
    taken, found = {*model.parameters.paths, *model.problem.ties}, []
    for name, path in zip(model.names, model.parameters.paths, strict=True):
        where, _, field = path.rpartition(".")
        joint_name = where.removeprefix("joints.")
        joint = model.scene.joints.get(joint_name)
        if field not in RESISTING or not isinstance(joint, Resisted):
            continue
        for other in RESISTING:
            if f"{where}.{other}" not in taken and not getattr(joint, other):
                candidate = resisting(joint_name, joint, other, size_of(model.scene))
                if (refit := _refit(model, point, seen, candidate)) is not None:
                    found.append(OtherLaw(name, joint_name, other, refit))
    return found


def sentences(laws: list[OtherLaw], values: dict[str, Value]) -> list[str]:
    """One for each friction that is known much less well if its joint resists by another law too."""
    wide: dict[tuple[str, str], list[tuple[str, float]]] = {}
    for law in laws:
        width = law.value.upper - law.value.lower
        if width > _FAR * (values[law.sought].upper - values[law.sought].lower):
            wide.setdefault((law.sought, law.joint), []).append((RESISTING[law.field], width))
    return [
        f"should {joint} have {' or '.join(name for name, _ in others)} as well, which may not show here, {sought} is "
        f"known to +-{max(width for _, width in others) / 2:.2g} only"
        for (sought, joint), others in wide.items()
    ]


def _refit(model: ForwardModel, point: Array, seen: Sensitivity, candidate: Candidate) -> Refit | None:
    """With a law freed that was left out, of which there is none if less would fit; None where it has no effect."""
    probe = candidate.probes[0, 0]
    effect = Together(model, [candidate]).residuals([0], [np.append(point, candidate.vector(probe))])[0] - seen.residual
    if not (np.all(np.isfinite(effect)) and np.any(effect)):
        return None
    jacobian = np.column_stack([seen.jacobian, effect / probe[0]])
    scale = np.append(model.sizes(point), probe)
    change = scale * np.linalg.lstsq(jacobian * scale, -seen.residual)[0]
    if change[-1] < 0.0:
        change *= 0.0
    there = np.append(np.clip(point + change[:-1], model.lower, model.upper), change[-1])
    return Refit(candidate.freed(model), there, seen.residual + jacobian @ change, jacobian)
