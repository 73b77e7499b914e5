"""Predicted precision of the parameters by some of the channels, until a time (Fisher information)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shoal.identification.uncertainty.linearisation import determined
from shoal.trajectory import Array


@dataclass(frozen=True)
class Precision:
    """Precision of a measurement: standard deviation of each parameter (of its logarithm where that is sought).

    std: inf where nothing is known, (parameters,); the others relative to the ranges between the bounds
    a: root of the mean variance; d: geometric mean over the axes of the ellipsoid; unknown: directions left open
    """

    std: Array
    a: float
    d: float
    unknown: int


@dataclass(frozen=True)
class Bundle:
    """Sensitivities over the noise, (times, channels, parameters): `present` channels of today, then the sensors'.

    error: by how much they may be off, likewise; prior: the rows of priors, (priors, parameters)
    given: what standard deviations of what is taken as known change over the noise, (n, times, channels)
    begins: whether the first instant is a sample at every rate, else the first sample is an interval after time zero
    """

    times: Array
    table: Array
    error: Array
    prior: Array
    given: Array
    span: Array
    present: int
    begins: bool = False

    @classmethod
    def of(
        cls,
        times: Array,
        jacobian: Array,
        moved: Array,
        channels: int,
        span: Array,
        present: int,
        begins: bool = False,
    ) -> Bundle:
        """From a Jacobian over the noise and its error, (rows and priors, 2, parameters), of channels at all times.

        moved: what is taken as known changes of the same rows over the noise, (n, rows and priors)
        """
        rows = len(times) * channels
        table, error = np.moveaxis(jacobian[:rows].reshape(len(times), channels, 2, -1), 2, 0)
        given = moved[:, :rows].reshape(len(moved), len(times), channels)
        return cls(times, table, error, jacobian[rows:, 0], given, span, present, begins)

    def precision(self, columns: Sequence[int], end: float, every: int = 2) -> Precision:
        """By some of the channels until a time [s], at every n-th instant."""
        # The grid is twice as fine as today's sampling.
        sampled = slice(0 if self.begins else every - 1, None, every)
        keep = (self.times <= end * (1 + 1e-9))[sampled]
        rows, error = (
            part[sampled][keep][:, list(columns)].reshape(-1, len(self.span)) for part in (self.table, self.error)
        )
        moved = self.given[:, sampled][:, keep][:, :, list(columns)].reshape(len(self.given), len(rows))
        moved = np.pad(moved, ((0, 0), (0, len(self.prior))))
        return precision(np.concatenate([rows, self.prior]), self.span, error, moved)


def precision(jacobian: Array, span: Array, error: Array | None = None, moved: Array | None = None) -> Precision:
    """Precision by rows of sensitivities over the noise, (rows, parameters), for ranges `span` (parameters,).

    error: by how much they may be off, (rows, parameters); what is no larger, along some direction, determines nothing
    moved: of the rows over the noise, by independent standard deviations of what is taken as known, (n, rows): a fit
    follows it
    """
    count = len(span)
    rows = np.concatenate([jacobian * span, np.zeros((count, count))])
    _, singular, right = np.linalg.svd(np.linalg.qr(rows, mode="r"))
    known = determined(singular, right, None if error is None else error * span)
    inverse = np.where(known, 1.0 / np.where(known, singular, 1.0), 0.0)
    # Along the axes of what the noise leaves open.
    axes = inverse[:, None] * right
    if moved is not None and len(moved):
        axes = np.concatenate([axes, (moved @ (jacobian * span)) @ axes.T @ axes])
    relative = np.linalg.norm(axes, axis=0)
    hidden = np.linalg.norm(right[~known], axis=0) > 1e-3
    relative = np.where(hidden, np.inf, relative)
    sizes = np.linalg.svd(axes, compute_uv=False) if np.all(known) else np.array([np.inf])
    d = float(np.exp(np.mean(np.log(sizes))))
    return Precision(relative * span, float(np.sqrt(np.mean(relative**2))), d, int(np.sum(~known)))


@dataclass(frozen=True)
class Aim:
    """Aim of a design: a parameter by its name, or None for the weakest, whichever that is.

    names: of the parameters; span: their ranges between the bounds, (parameters,)
    """

    names: tuple[str, ...]
    span: Array
    parameter: str | None

    def weakest(self, found: Precision) -> tuple[str, float]:
        """The parameter that counts, and its standard deviation."""
        k = int(np.argmax(found.std / self.span)) if self.parameter is None else self.names.index(self.parameter)
        return self.names[k], float(found.std[k])

    def score(self, found: Precision) -> float:
        """Standard deviation of the parameter that counts over its range: the smaller the better."""
        name, std = self.weakest(found)
        return std / float(self.span[self.names.index(name)])
