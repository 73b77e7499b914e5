"""What the noise of measured signals that drive a machine does to its motion, and so to an answer.

A drive is measured as the channels are, but no residual shows its noise: the machine of the model follows it. Draws of
that noise, smoothed as the signal was, are run instead of the signal; to first order the answer moves against what they
change of the channels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.identification.recording.units import unit
from shoal.identification.spread.covariance import Noise
from shoal.identification.spread.model_error import difference, rms_of
from shoal.identification.spread.uncertainty import Linearisation
from shoal.scene import Scene
from shoal.scene.function import Function
from shoal.scene.measured import PARTS
from shoal.trajectory import Array

_DRAWS = 24
"""Of the noise: their variance is that of the noise within a third."""
_MATTERS = 0.03
"""Of what the residual leaves uncertain: a signal's noise that changes less by its first draw is none."""
_NOTICED = 0.2
"""Of a variance: the part of the signals from which on it is said."""


@dataclass(frozen=True)
class SignalNoise:
    """Of each signal with noise its standard deviation, in SI units, by path (`sizes`).

    moved: what draws of all of it change of the residuals, (draws, rows), none where no signal has noise
    """

    sizes: Mapping[str, float]
    moved: Array

    def left(self, jacobian: Array, pseudo_inverse: Array) -> float:
        """Size of the residual that it leaves beside what the parameters follow, root mean square."""
        if not len(self.moved):
            return 0.0
        return rms_of(self.moved - (self.moved @ pseudo_inverse.T) @ jacobian.T)

    def sentence(self, at: Linearisation, names: Sequence[str]) -> str:
        """Which parameters it makes less certain, at a linearisation that has its part; empty if none."""
        if not len(self.moved):
            return ""
        variance = np.diag(at.covariance)
        widened = [name for k, name in enumerate(names) if at.parts[-1][k, k] > _NOTICED * variance[k] > 0.0]
        sizes = " and ".join(f"{path} ({size:.2g} {unit(path)}".rstrip() + ")" for path, size in self.sizes.items())
        return f"the noise of {sizes} widens the interval of {', '.join(widened)}" if widened else ""

    def spread(self, at: Linearisation) -> Linearisation:
        """The linearisation with its part in the covariance, whose variance is known as well as the draws tell it."""
        if not len(self.moved):
            return at
        shifts = self.moved @ at.pseudo_inverse.T
        share, noise = shifts.T @ shifts / len(shifts), Noise(0.0, 0.0, float(len(shifts)))
        return replace(at, parts=np.concatenate([at.parts, share[None]]), noise=(*at.noise, noise))


NONE = SignalNoise({}, np.empty((0, 0)))


def signal_noise(model: ForwardModel, point: Array, predicted: Mapping[str, Array], residual: Array) -> SignalNoise:
    """At a point whose channels by recording, and residuals (rows,), are known.

    One simulation of every recording for each draw.
    """
    noisy = dict(noisy_signals(model.scene))
    if not noisy:
        return NONE
    rng, moved = np.random.default_rng(0), list[Array]()
    least = _MATTERS * rms_of(residual) / np.sqrt(len(residual))
    for _ in range(_DRAWS):
        drawn = {path: one.perturbed(rng).model_dump(mode="json") for path, one in noisy.items()}
        rows = difference(model, point, predicted, model.scene.with_values(drawn))
        if rows is None:
            continue
        moved.append(rows)
        if rms_of(moved[0]) < least:
            return NONE
    sizes = {path: one.noise for path, one in noisy.items()}
    return SignalNoise(sizes, np.array(moved)) if len(moved) > 1 else NONE


def noisy_signals(scene: Scene) -> list[tuple[str, Function]]:
    """The functions of time of a scene that were measured with noise, by path."""
    return [
        (f"{part}.{name}.{field}", value)
        for part in PARTS
        for name, member in getattr(scene, part).items()
        for field, value in member
        if isinstance(value, Function) and value.noise
    ]
