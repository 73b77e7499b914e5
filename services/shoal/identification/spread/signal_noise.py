"""What the noise of measured signals that drive a machine does to its motion, and so to an answer.

A drive is measured as the channels are, but no residual shows its noise: the machine of the model follows it. Draws of
that noise, smoothed as the signal was, are run instead of the signal; to first order the answer moves against what they
change of the channels. Where a place or an angle is driven, noise that is not stated is what the samples show: no body
moves so. A force may well be random, and has the noise that is stated.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shoal.identification.forward import ForwardModel
from shoal.identification.recording.units import unit
from shoal.identification.spread.given import Given
from shoal.identification.spread.model_error import difference, rms_of
from shoal.scene import Scene
from shoal.scene.function import Function
from shoal.scene.measured import PARTS
from shoal.scene.smoothing import strength_of
from shoal.trajectory import Array

_DRIVES = ("joints", "ground_points")
"""Parts of a scene whose functions of time are places and angles."""
_DRAWS = 24
"""Of the noise: their variance is that of the noise within a third."""
_FEWEST = 2
"""Draws that can be run at least."""
MATTERS = 0.03
"""Of what the residual leaves uncertain: what changes less, such as a signal's noise by its first draw, is nothing."""


def signal_noise(model: ForwardModel, point: Array, predicted: Mapping[str, Array], residual: Array) -> Given | None:
    """At a point whose channels by recording, and residuals (rows,), are known; None where no signal has noise.

    One simulation of every recording for each draw.
    """
    noisy = noisy_signals(model.scene)
    if not noisy:
        return None
    rng, moved = np.random.default_rng(0), list[Array]()
    least = MATTERS * rms_of(residual) / np.sqrt(len(residual))
    for _ in range(_DRAWS):
        drawn = {path: one.perturbed(noise, rng).model_dump(mode="json") for path, (one, noise) in noisy.items()}
        rows = difference(model, point, predicted, model.scene.with_values(drawn))
        if rows is None:
            continue
        moved.append(rows)
        if rms_of(moved[0]) < least:
            return None
    if len(moved) < _FEWEST:
        return None
    sizes = [f"{path} ({noise:.2g} {unit(path)}".rstrip() + ")" for path, (_, noise) in noisy.items()]
    shown = [path for path, (one, _) in noisy.items() if one.noise is None]
    remedy = f"; it is smoothed away if {' and '.join(shown)} state it as `noise`" if shown else ""
    scaled = np.array(moved) / np.sqrt(len(moved))
    return Given(scaled, float(len(moved)), f"the noise of {' and '.join(sizes)}", remedy)


def signals_of(scene: Scene) -> dict[str, Function]:
    """The functions of a scene that are tables, by path."""
    return {
        f"{part}.{name}.{field}": value
        for part in PARTS
        for name, member in getattr(scene, part).items()
        for field, value in member
        if isinstance(value, Function) and value.table is not None
    }


def noisy_signals(scene: Scene) -> dict[str, tuple[Function, float]]:
    """The functions of time of a scene that were measured with noise, and that, by path."""
    tables = {
        path: (signal, signal.noise if signal.noise is not None else _shown(path, signal))
        for path, signal in signals_of(scene).items()
    }
    return {path: found for path, found in tables.items() if found[1]}


def _shown(path: str, signal: Function) -> float:
    """The noise that the samples of a drive show, as far as they tell noise from motion."""
    if path.split(".")[0] not in _DRIVES or not signal.smooth:
        return 0.0
    times, values = np.array(signal.table).T
    return strength_of(times, values)[1]
