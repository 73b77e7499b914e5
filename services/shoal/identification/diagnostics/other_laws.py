"""Friction laws left out beside a sought friction: how far each may move it, read from the table of hypotheses.

The effects of viscous friction, quadratic drag and dry friction on a few swings are so alike that a law which was left
out moves the sought number far beyond an interval that knows of none, and leaves almost no misfit. Each law is a row of
the table: where it is significant it is a suspect, and the intervals hold its refit instead of refuting the model.
Where it is not, a finding says how far as much of it as the data allow would move the sought friction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from shoal.findings import Finding
from shoal.identification.diagnostics.suspects.candidate import size_of
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
"""Times the interval: a friction that may be so much farther off with another law beside it is reported."""
_ALIKE = 1e-3
"""Of a friction: a smaller change is no matter of a friction law."""


@dataclass(frozen=True)
class OtherLaw:
    """Another law by which the joint of a sought friction may resist.

    sought: the friction's name; field: one of RESISTING, sought nowhere and left out of the joint
    end: the fit, to first order, with as much of it as the data allow, (parameters,)
    """

    sought: str
    joint: str
    field: str
    end: Array

    @property
    def name(self) -> str:
        """Return the name of its row in the table."""
        return f"{RESISTING[self.field]} of {self.joint}"


def other_laws(
    model: ForwardModel, point: Array, seen: Sensitivity, effects: Mapping[tuple[str, str, int], Sequence[Array]]
) -> list[OtherLaw]:
    """Return the other laws of each sought friction, by the effects that were measured for the table of hypotheses."""
    found = list[OtherLaw]()
    for name, path in zip(model.names, model.parameters.paths, strict=True):
        where, _, field = path.rpartition(".")
        joint_name = where.removeprefix("joints.")
        joint = model.scene.joints.get(joint_name)
        if field not in RESISTING or not isinstance(joint, Resisted):
            continue
        for other in RESISTING:
            law = resisting(joint_name, joint, other, size_of(model.scene))
            measured = effects.get((law.name, law.kind, 1))
            if measured is None or getattr(joint, other):
                continue
            end = _most(model, point, seen, measured[0][0] / law.probes[0, 0, 0])
            if end is not None:
                found.append(OtherLaw(name, joint_name, other, end))
    return found


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


def _most(model: ForwardModel, point: Array, seen: Sensitivity, column: Array) -> Array | None:
    """Return the fit, to first order, with the most of a law that may be; None where it has no effect.

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
    return np.asarray(point + most * slope)
