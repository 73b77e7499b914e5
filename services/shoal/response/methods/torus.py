"""Torus: frequencies and Fourier coefficients as polynomials of the parameters, for motions with one or two of them.

A motion with incommensurate frequencies winds around a torus: x(t) = sum of c_k exp(i k.w t) over small whole k. The
frequencies w of each run are the lines of its spectrum (Laskar, Frequency analysis for multi-dimensional systems,
Physica D 67, 1993), made exact by variable projection (Golub and Pereyra, SIAM Journal on Numerical Analysis 10, 1973).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from scipy.signal import windows

from shoal.mechanics.numerics.newton import newton
from shoal.response.expansion import fit
from shoal.response.inputs import Inputs, IntArray
from shoal.response.methods.long_time import UnsuitableError, Watch, at_every_instant, stated
from shoal.response.polynomials import Terms
from shoal.response.study import Found, Study
from shoal.trajectory import Array

ORDERS = 3, 5, 7, 9, 11
"""Sums of |k|, tried until the middle run is fitted or gets no better."""
TOLD = 1e-9
"""Misfit of a run, as a share of its deviation, that is good enough."""
MISFIT = 1e-3
"""Above which a run is none of these."""
LINES = 8
"""Of a spectrum that may be base frequencies."""
PER_TERM = 6
"""Instants for every coefficient."""
PADDED = 8
"""Factor of zero padding of the spectrum."""
REFINED = 12
"""Gauss-Newton steps, at most."""
SETTLED = 1e-10
"""Phase at the end [rad] by which frequencies change no more."""


@dataclass(frozen=True)
class LineSpectrum:
    """Line spectrum of one run. frequencies [rad/s], (base,); coefficients: of cosines, then sines, (2 K, signals)"""

    frequencies: Array
    coefficients: Array
    misfit: float


@dataclass(frozen=True)
class Wound:
    """A surrogate by way of frequencies.

    frequencies: coefficients, (terms, base); waves: coefficients, (terms, 2 K, signals); orders: k, (K, base)
    """

    inputs: Inputs
    terms: Terms
    frequencies: Array
    waves: Array
    orders: IntArray
    instants: Array

    def __call__(self, xi: Array) -> Array:
        """Return all columns, (places, columns)."""
        basis = self.inputs.basis(xi, self.terms)
        parts = basis @ self.frequencies, np.tensordot(basis, self.waves, 1)
        return at_every_instant(len(xi), len(self.instants), lambda at: self._at(*parts, at))

    def each(self, xi: Array, columns: IntArray) -> Array:
        """Return one column at each place, (places,)."""
        signals = self.waves.shape[2]
        basis = self.inputs.basis(xi, self.terms)
        found = np.empty(len(xi))
        block = max(1, 20_000_000 // self.waves[0].size)
        for k in range(0, len(xi), block):
            some = slice(k, k + block)
            parts = self._at(
                basis[some] @ self.frequencies, np.tensordot(basis[some], self.waves, 1), columns[some] // signals
            )
            found[some] = parts[np.arange(len(parts)), columns[some] % signals]
        return found

    def _at(self, frequencies: Array, waves: Array, at: IntArray) -> Array:
        angle = self.instants[at, None] * (frequencies @ self.orders.T)
        return np.asarray(np.einsum("ij,ijs->is", np.concatenate([np.cos(angle), np.sin(angle)], axis=1), waves))


@dataclass
class Torus:
    """Representation of runs by lines of their spectra, see `LongTime`. It remembers the runs before, whose frequencies
    decide which lines of the next to take.
    """

    watch: Watch
    name = "torus"
    orders: IntArray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.int64))
    known: Array | None = None

    def __post_init__(self) -> None:
        span = self.watch.times[-1]
        self._range = np.maximum(np.std(self.watch.first, axis=0), 1e-12 * np.abs(self.watch.first).max())
        lines = _lines(self.watch.times, self.watch.first / self._range)
        choices = [lines[[i, j]] for i, j in combinations(range(len(lines)), 2)] + [lines[:1]]
        tried = [self._fitted(self.watch.first, choice, whole(len(choice), 3)) for choice in choices]
        best = min(tried, key=lambda one: one.misfit)
        order = 3
        for order in ORDERS:
            orders = whole(len(best.frequencies), order)
            if PER_TERM / 3 * 2 * len(orders) > len(self.watch.times):
                break
            found = self._fitted(self.watch.first, best.frequencies, orders)
            if found.misfit > 0.5 * best.misfit and order > 3:
                break
            best, self.orders = found, orders
            if best.misfit < TOLD:
                break
        if best.misfit > MISFIT:
            raise UnsuitableError(
                f"the motion has not one or two frequencies only: those found over {span:g} s miss it by "
                f"{best.misfit:.1g} of its deviation"
            )
        self.known = best.frequencies

    def of(self, course: Array) -> LineSpectrum:
        """The lines of one run. Raises UnsuitableError where they do not fit it."""
        assert self.known is not None
        lines = _lines(self.watch.times, course / self._range, 2 * LINES)
        near = np.array([lines[np.argmin(np.abs(lines - one))] for one in self.known])
        found = self._fitted(course, near, self.orders)
        if found.misfit > MISFIT:
            raise UnsuitableError(
                f"the frequencies of the middle run are not those of another ({found.misfit:.1g} missed)"
            )
        return found

    def surrogate(self, study: Study, xi: Array, runs: list[LineSpectrum], terms: Terms) -> Wound:
        """Fit frequencies and Fourier coefficients."""
        parts = np.stack([np.concatenate([run.frequencies, run.coefficients.ravel()]) for run in runs])
        found = fit(study.inputs, xi, parts, terms).coefficients
        base = len(runs[0].frequencies)
        waves = found[:, base:].reshape(len(terms), *runs[0].coefficients.shape)
        return Wound(study.inputs, terms, found[:, :base], waves, self.orders, study.when)

    def _fitted(self, course: Array, frequencies: Array, orders: IntArray) -> LineSpectrum:
        """Fit the frequencies by the Gauss-Newton method; coefficients are eliminated (variable projection)."""
        times, most = self.watch.times, PER_TERM * 2 * len(orders)
        some = np.arange(len(times))
        if len(times) > most:
            some = np.sort(np.random.default_rng(0).choice(len(times), most, replace=False))
        t, y = times[some], course[some] / self._range

        def projected(w: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
            angle = t[:, None] * (orders @ w)
            cosine, sine = np.cos(angle), np.sin(angle)
            basis = np.concatenate([cosine, sine[:, 1:]], axis=1)
            q, r = np.linalg.qr(basis)
            c = np.linalg.lstsq(r, q.T @ y, rcond=1e-13)[0]
            a, b = c[: len(orders)], np.concatenate([np.zeros((1, c.shape[1])), c[len(orders) :]])
            return cosine, sine, q, a, b, y - basis @ c

        def correct(w: Array) -> tuple[Array, float]:
            cosine, sine, q, a, b, rest = projected(w)
            slopes = []
            for k in range(len(w)):
                slope = t[:, None] * (cosine @ (orders[:, k, None] * b) - sine @ (orders[:, k, None] * a))
                slopes.append((slope - q @ (q.T @ slope)).ravel())
            step = np.linalg.lstsq(np.stack(slopes, axis=1), rest.ravel(), rcond=1e-12)[0]
            return np.asarray(step, dtype=float), float(np.abs(step).max() * times[-1])

        w = newton(correct, np.array(frequencies), close=SETTLED, longest=0.5 * np.pi, most=REFINED).point
        *_, a, b, rest = projected(w)
        return LineSpectrum(w, np.concatenate([a, b]) * self._range, float(np.abs(rest).max()))


def whole(base: int, order: int) -> IntArray:
    """Return all k with |k| summing up to at most the order, one of each k and -k; the first is 0."""
    axes = np.meshgrid(*[np.arange(-order, order + 1)] * base, indexing="ij")
    every = np.stack([axis.ravel() for axis in axes], axis=1)
    every = every[np.abs(every).sum(axis=1) <= order]
    first = np.array([next((int(k) for k in row if k), 0) for row in every])
    return np.concatenate([np.zeros((1, base), dtype=np.int64), every[first > 0]])


def _lines(times: Array, course: Array, most: int = LINES) -> Array:
    """The strongest lines of the spectrum [rad/s], the strongest first."""
    window = windows.nuttall(len(times), sym=False)[:, None]
    power = (np.abs(np.fft.rfft((course - course.mean(axis=0)) * window, PADDED * len(times), axis=0)) ** 2).sum(axis=1)
    power = np.log(power + 1e-300)
    peaks = np.flatnonzero((power[1:-1] > power[:-2]) & (power[1:-1] >= power[2:])) + 1
    peaks = peaks[np.argsort(-power[peaks])]
    peaks = peaks[peaks > 3 * PADDED][:most]
    if not len(peaks):
        raise UnsuitableError("the motion has no frequencies")
    left, here, right = power[peaks - 1], power[peaks], power[peaks + 1]
    at = peaks + 0.5 * (left - right) / (left - 2 * here + right)
    return np.asarray(2 * np.pi * at / (PADDED * len(times) * (times[1] - times[0])))


def torus(study: Study) -> Found:
    """Bound by a torus. Raises InputError, also where the motion has more frequencies, or they resonate."""
    return stated(study, Torus, "torus")
