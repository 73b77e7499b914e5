"""What the noise of measured signals that drive a machine does to its motion, and so to an answer.

A drive is measured as the channels are, but no residual shows its noise: the machine of the model follows it. Draws of
that noise, smoothed as the signal was, are run instead of the signal; to first order the answer moves against what they
change of the channels. Where a place or an angle is driven, noise that is not stated is what the samples show: no body
moves so. A force may well be random, and has the noise that is stated.
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
from shoal.scene.smoothing import strength_of
from shoal.trajectory import Array

_DRIVES = ("joints", "ground_points")
"""Parts of a scene whose functions of time are places and angles."""
_DRAWS = 24
"""Of the noise: their variance is that of the noise within a third."""
_MATTERS = 0.03
"""Of what the residual leaves uncertain: a signal's noise that changes less by its first draw is none."""
_NOTICED = 0.2
"""Of a variance: the part of the signals from which on it is said."""


@dataclass(frozen=True)
class SignalNoise:
    """Of each signal with noise its standard deviation, in SI units, by path (`sizes`).

    moved: what draws of all of it change of the residuals, (draws, rows), none where no signal has noise; shown: those
    whose noise nobody stated
    """

    sizes: Mapping[str, float]
    moved: Array
    shown: tuple[str, ...] = ()

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
        more = f"; it is smoothed away if {' and '.join(self.shown)} state it as `noise`" if self.shown else ""
        return f"the noise of {sizes} widens the interval of {', '.join(widened)}{more}" if widened else ""

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
    noisy = noisy_signals(model.scene)
    if not noisy:
        return NONE
    rng, moved = np.random.default_rng(0), list[Array]()
    least = _MATTERS * rms_of(residual) / np.sqrt(len(residual))
    for _ in range(_DRAWS):
        drawn = {path: one.perturbed(noise, rng).model_dump(mode="json") for path, (one, noise) in noisy.items()}
        rows = difference(model, point, predicted, model.scene.with_values(drawn))
        if rows is None:
            continue
        moved.append(rows)
        if rms_of(moved[0]) < least:
            return NONE
    sizes = {path: noise for path, (_, noise) in noisy.items()}
    shown = tuple(path for path, (one, _) in noisy.items() if one.noise is None)
    return SignalNoise(sizes, np.array(moved), shown) if len(moved) > 1 else NONE


def noisy_signals(scene: Scene) -> dict[str, tuple[Function, float]]:
    """The functions of time of a scene that were measured with noise, and that, by path."""
    tables = {
        f"{part}.{name}.{field}": (value, value.noise if value.noise is not None else _shown(part, value))
        for part in PARTS
        for name, member in getattr(scene, part).items()
        for field, value in member
        if isinstance(value, Function) and value.table is not None
    }
    return {path: found for path, found in tables.items() if found[1]}


def _shown(part: str, signal: Function) -> float:
    """The noise that the samples of a drive show, as far as they tell noise from motion."""
    if part not in _DRIVES or not signal.smooth:
        return 0.0
    times, values = np.array(signal.table).T
    return strength_of(times, values)[1]
