"""Intervals without theory: refits to data whose residuals are resampled, in blocks that keep their correlation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import AT_ONCE, ForwardModel
from shoal.identification.methods.lanes import Descent, descend_each, differentiate_many
from shoal.identification.recording.measurement import Recording
from shoal.json_values import plain
from shoal.trajectory import Array


@dataclass(frozen=True)
class Bootstrap:
    """Draws of the parameters in their own units, (draws, parameters); failed: refits without a finite end."""

    names: tuple[str, ...]
    draws: Array
    failed: int

    def interval(self, name: str) -> tuple[float, float]:
        """The 2.5 and 97.5 percentiles."""
        column = self.draws[:, self.names.index(name)]
        low, high = np.percentile(column, [2.5, 97.5]) if len(column) else (np.nan, np.nan)
        return float(low), float(high)

    def to_json(self) -> dict[str, Any]:
        """Intervals and standard deviations by parameter."""
        stds = np.std(self.draws, axis=0, ddof=1) if len(self.draws) > 1 else np.full(len(self.names), np.nan)
        table = {n: {"interval": self.interval(n), "std": s} for n, s in zip(self.names, stds, strict=True)}
        return plain({"draws": len(self.draws), "failed": self.failed, "parameters": table})  # type: ignore[no-any-return]


def bootstrap(
    model: ForwardModel, point: Array, predicted: dict[str, Array], rho: float, draws: int, rng: np.random.Generator
) -> Bootstrap:
    """Moving blocks (Kuensch 1989) of the residuals at an answer on the predicted channels, refitted from the answer.

    rho: lag-1 correlation of the residuals, which sets the length of the blocks; fewer draws where time ends
    """
    models = [_redrawn_all(model, predicted, rho, len(point), rng) for _ in range(draws)]
    together = draws if model.deadline is None else max(1, AT_ONCE // (1 + len(point)))
    ends = list[Descent]()
    for first in range(0, draws, max(together, 1)):
        try:
            ends += _refitted(model, models[first : first + together], point)
        except TimeIsUp:
            break
    found = [model.parameters.to_values(end.point) for end in ends if np.isfinite(end.fitness)]
    return Bootstrap(model.names, np.array(found).reshape(-1, len(point)), len(ends) - len(found))


def _refitted(model: ForwardModel, drawn: Sequence[ForwardModel], point: Array) -> list[Descent]:
    """Descents of models that differ in their data only, from one point: their runs stand side by side."""

    def differentiate(chosen: Sequence[int], points: Sequence[Array]) -> tuple[list[Array], list[Array]]:
        def residuals(lanes: Array, owners: Array) -> Array:
            seen = {name: model.observe(lanes, name) for name in model.measurement.recordings}
            parts = [np.flatnonzero(owners == owner) for owner in np.unique(owners)]
            rows = [
                drawn[chosen[owners[part[0]]]].compared(
                    lanes[part], {name: found[part] for name, found in seen.items()}
                )
                for part in parts
            ]
            return np.concatenate(rows)

        rows, jacobians = differentiate_many(model, np.array(points), residuals)
        return list(rows), list(jacobians)

    return descend_each(drawn, [point] * len(drawn), differentiate)


def _redrawn_all(
    model: ForwardModel, predicted: dict[str, Array], rho: float, parameters: int, rng: np.random.Generator
) -> ForwardModel:
    recordings = {
        name: _redrawn(recording, predicted[name], rho, parameters, rng)
        for name, recording in model.measurement.recordings.items()
    }
    return model.aside(measurement=replace(model.measurement, recordings=recordings))


def block_length(count: int, rho: float) -> int:
    """Samples in a block: the best for the variance of a mean of an AR(1) series (Carlstein 1986), at least one."""
    rho = min(max(rho, 0.0), 0.999)
    best = count ** (1 / 3) * (2 * rho / (1 - rho**2)) ** (2 / 3)
    return int(np.clip(np.ceil(best), 1, max(1, count // 3)))


def _redrawn(
    recording: Recording, predicted: Array, rho: float, parameters: int, rng: np.random.Generator
) -> Recording:
    """The recording with residuals drawn in blocks of neighbouring samples, all channels together; gaps stay."""
    residual = recording.values - predicted
    residual = residual - np.nanmean(residual, axis=0)
    count = len(residual)
    # Residuals are smaller than the noise by what the parameters have followed.
    rows = np.isfinite(residual).sum()
    residual = residual * np.sqrt(rows / max(1, rows - parameters))
    length = block_length(count, rho)
    first = rng.integers(0, count - length + 1, size=-(-count // length))
    order = (first[:, None] + np.arange(length)).ravel()[:count]
    fresh = np.where(np.isfinite(residual[order]), residual[order], 0.0)
    return replace(recording, values=np.where(np.isfinite(recording.values), predicted + fresh, np.nan))
