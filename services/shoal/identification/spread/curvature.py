"""Whether the misfit rises from an answer as a parabola does, as intervals by linear theory take for granted.

Noise that is as large as the motion, or a pose near a stretched one, makes an interval so wide that the model is not
linear within it (Bates and Watts 1980). The misfit at its ends tells: there the rise is compared with the one that
the derivatives promise. Where they disagree the profile likelihood gives the interval.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import ForwardModel
from shoal.identification.spread.profiles import Profile, profile
from shoal.identification.spread.sensitivity import Sensitivity
from shoal.identification.spread.uncertainty import Linearisation, spread
from shoal.identification.spread.value import Value
from shoal.trajectory import Array

_LEAST, _MOST = 0.7, 1.4
"""Of the promised rise at the end of an interval; in between the end is right within a fifth."""


def bent(model: ForwardModel, point: Array, at: Linearisation, seen: Sensitivity) -> list[int]:
    """Which parameters have an interval at whose ends the misfit is not as promised. Not counted. Raises TimeIsUp.

    The others follow by linear theory; one call for all ends. What another drive or another known field would make of
    the answer is no move along this misfit: the intervals are those of the residuals alone.
    """
    at = at.alone
    share = at.pseudo_inverse @ at.pseudo_inverse.T
    moves = []
    for k in range(len(point)):
        half = spread(lambda p, k=k: float(p[k]), point, at).half  # type: ignore[misc]
        along = share[:, k] / share[k, k] * half if share[k, k] > 0.0 and np.isfinite(half) else np.zeros(len(point))
        moves += [-along, along]
    ends = np.clip(point + np.array(moves), *model.box_at(point))
    rows = model.uncounted(np.concatenate([point[None], ends]))
    base = float(rows[0] @ rows[0])
    promised = np.sum((seen.residual + (ends - point) @ seen.jacobian.T) ** 2, axis=1) - base
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = (np.sum(rows[1:] ** 2, axis=1) - base) / promised
    wrong = (promised > 0.0) & ~((ratio > _LEAST) & (ratio < _MOST))
    return sorted({int(k) // 2 for k in np.flatnonzero(wrong)})


def by_profile(
    model: ForwardModel, ends: list[Array], at: Linearisation, parameters: Mapping[str, Value], which: list[int]
) -> tuple[dict[str, Value], dict[str, Profile]]:
    """The parameters with intervals by their profiles, where these were wanted, and the profiles.

    ends: the answer, and other minima in its valley, which the intervals hold too, (parameters,) each; they also hold
    what linear theory says where it is not the residuals alone that count.
    What a better mesh and theory would change is in the interval as before. A side that the data leave open is not
    known, and neither is a parameter for whose profile no time is left.
    """
    found, profiled = dict(parameters), dict[str, Profile]()
    for k in which:
        name = model.names[k]
        known = found[name]
        try:
            seen = profile(model, ends[0], at, k)
        except TimeIsUp:
            found[name] = replace(known, identifiable=False)
            continue
        more = abs(known.correction or 0.0) + abs(known.theory or 0.0)
        told = known.identifiable and not seen.open
        lower, upper = (known.lower, known.upper) if len(ends) > 1 or at.given else (seen.lower, seen.upper)
        lower, upper = min(lower, seen.lower - more), max(upper, seen.upper + more)
        found[name] = replace(known, lower=lower, upper=upper, identifiable=told)
        profiled[name] = seen
    return found, profiled
