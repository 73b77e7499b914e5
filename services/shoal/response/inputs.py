"""The uncertain parameters together: from standardised variables to values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby

import numpy as np
from scipy import special
from scipy.stats import qmc

from shoal.errors import InputError
from shoal.response.marginals import Marginal, Normal
from shoal.response.polynomials import HERMITE, Recurrence, Terms
from shoal.scene import expression
from shoal.trajectory import Array

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
ENDS = 1e-12, 1 - 1e-12
"""Probabilities up to which quantiles are taken: seven standard deviations of a normal variable."""
Correlations = Mapping[tuple[str, str], float]
"""Of the normal variables behind two parameters (a Gaussian copula), by their names."""


@dataclass(frozen=True)
class Joint:
    """Joint knowledge of the parameters of one source.

    source: its name; correlations: of its parameters; ties: path -> expression in what `known` names and in constants;
    known: name in expressions -> name of the parameter; left: what is not taken from the source, and why
    """

    source: str
    correlations: Correlations
    ties: Mapping[str, str] = field(default_factory=dict)
    known: Mapping[str, str] = field(default_factory=dict)
    constants: Mapping[str, float] = field(default_factory=dict)
    left: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class UncertainParameter:
    """An uncertain parameter.

    name: as it was given; factors: path -> what its value is multiplied by there (more than one path: a tie); joint:
    with others of the same source
    """

    name: str
    marginal: Marginal
    factors: Mapping[str, float]
    joint: Joint | None = None


@dataclass(frozen=True)
class Inputs:
    """Parameters and their correlations. Raises InputError."""

    parameters: tuple[UncertainParameter, ...]
    correlations: Correlations | None = None

    def __post_init__(self) -> None:
        names = self.names
        if not names:
            raise InputError("vary: needs at least one parameter, such as --vary bodies.OA.length=0.98:1.02")
        paths = [path for one in self.parameters for path in one.factors]
        paths += [path for joint in self.joints for path in joint.ties]
        if twice := sorted({path for path in paths if paths.count(path) > 1}):
            raise InputError(f"vary: {twice[0]} is varied twice")
        known = {pair: value for joint in self.joints for pair, value in joint.correlations.items()}
        if known:
            object.__setattr__(self, "correlations", {**known, **(self.correlations or {})})
        for pair in self.correlations or {}:
            for name in pair:
                if name not in names:
                    raise InputError(f"correlate: {name!r} is not varied; there are {', '.join(names)}")
                if not self.parameters[names.index(name)].marginal.random:
                    raise InputError(f"correlate: {name} is an interval; only random parameters correlate")
        if self.correlations:
            _ = self._factor

    @property
    def joints(self) -> list[Joint]:
        """Sources of several parameters, each once."""
        return list({id(one.joint): one.joint for one in self.parameters if one.joint is not None}.values())

    @property
    def names(self) -> list[str]:
        """Names of the parameters, in order."""
        return [one.name for one in self.parameters]

    def __len__(self) -> int:
        return len(self.parameters)

    @cached_property
    def random(self) -> BoolArray:
        """Mask of the random parameters, (parameters,)."""
        return np.array([one.marginal.random for one in self.parameters], dtype=bool)

    @property
    def mixed(self) -> bool:
        """Return whether some parameters are random and others intervals."""
        return bool(self.random.any() and not self.random.all())

    def some(self, which: BoolArray) -> Inputs:
        """Return the inputs of these parameters alone, (parameters,); correlated ones are all random."""
        kept = tuple(one for one, wanted in zip(self.parameters, which, strict=True) if wanted)
        names = {one.name for one in kept}
        pairs = {pair: value for pair, value in (self.correlations or {}).items() if names >= set(pair)}
        return Inputs(kept, pairs or None)

    @cached_property
    def _correlated(self) -> list[int]:
        named = {name for pair in self.correlations or {} for name in pair}
        return [k for k, name in enumerate(self.names) if name in named]

    @cached_property
    def _factor(self) -> Array:
        """Cholesky's factor of the correlated parameters. Raises InputError."""
        names = [self.names[k] for k in self._correlated]
        matrix = np.eye(len(names))
        for (one, other), value in (self.correlations or {}).items():
            if not -1 < value < 1 or one == other:
                raise InputError(f"correlate: {one},{other}={value:g}: needs two parameters and a value in (-1, 1)")
            i, j = names.index(one), names.index(other)
            matrix[i, j] = matrix[j, i] = value
        try:
            return np.asarray(np.linalg.cholesky(matrix), dtype=float)
        except np.linalg.LinAlgError:
            raise InputError("correlate: these correlations contradict each other (no positive matrix)") from None

    @property
    def root(self) -> Array:
        """Cholesky's factor of the correlations of all parameters, (parameters, parameters)."""
        found = np.eye(len(self))
        if self._correlated:
            found[np.ix_(self._correlated, self._correlated)] = self._factor
        return found

    def _standard(self, k: int) -> bool:
        """Return whether xi of a parameter is a standard normal variable, whichever its distribution."""
        return k in self._correlated

    @property
    def unbounded(self) -> BoolArray:
        """Mask of the parameters whose xi is a normal variable, (parameters,)."""
        return np.array([self.recurrence(k) is HERMITE for k in range(len(self))], dtype=bool)

    def recurrence(self, k: int) -> Recurrence:
        """Return the recurrence of the polynomials that are orthonormal under the measure of one parameter's xi."""
        return HERMITE if self._standard(k) else self.parameters[k].marginal.basis

    def values(self, xi: Array) -> dict[str, Array]:
        """Path -> value of every run; xi: (runs, parameters)."""
        return self._given(self._numbers(xi))

    def _numbers(self, xi: Array) -> Array:
        """Values of the parameters, both (runs, parameters)."""
        found = []
        correlated = xi[:, self._correlated] @ self._factor.T if self._correlated else None
        for k, one in enumerate(self.parameters):
            s = xi[:, k]
            if correlated is not None and self._standard(k):
                z = correlated[:, self._correlated.index(k)]
                s = z if isinstance(one.marginal, Normal) else one.marginal.quantile(special.ndtr(z))
            found.append(one.marginal.value(s))
        return np.stack(found, axis=1)

    def _given(self, numbers: Array) -> dict[str, Array]:
        """Path -> value, of values of the parameters, (runs, parameters)."""
        pairs = zip(self.parameters, numbers.T, strict=True)
        given = {path: at * factor for one, at in pairs for path, factor in one.factors.items()}
        for joint in self.joints:
            known = {word: numbers[:, self.names.index(name)] for word, name in joint.known.items()}
            for path, text in joint.ties.items():
                values_of = expression.evaluate_array(text, {**joint.constants, **known})
                given[path] = np.broadcast_to(values_of, len(numbers)).astype(float)
        return given

    @property
    def _first(self) -> Array:
        """Ratio of the stated value to that of the parameter, (parameters,)."""
        return np.array([next(iter(one.factors.values()), 1.0) for one in self.parameters])

    def named(self, xi: Array) -> Array:
        """Values of the parameters as the user states them, (runs, parameters)."""
        return np.asarray(self._numbers(np.atleast_2d(xi)) * self._first)

    def at(self, named: Array) -> dict[str, float]:
        """Path -> value where the parameters have these values, (parameters,), as the user states them."""
        return {path: float(at[0]) for path, at in self._given((named / self._first)[None]).items()}

    def quantiles(self, x: Array) -> Array:
        """Germs at independent probabilities, both (runs, parameters)."""
        found = [
            special.ndtri(x[:, k]) if self._standard(k) else one.marginal.quantile(x[:, k])
            for k, one in enumerate(self.parameters)
        ]
        return np.stack(found, axis=1)

    def standard(self, places: Array) -> Array:
        """Germs at places of independent standard normal variables, both (runs, parameters)."""
        found = [
            places[:, k]
            if self._standard(k) or isinstance(one.marginal, Normal)
            else one.marginal.quantile(inside(special.ndtr(places[:, k])))
            for k, one in enumerate(self.parameters)
        ]
        return np.stack(found, axis=1)

    def sobol(self, count: int, seed: int, skip: int = 0) -> Array:
        """Quasi-random xi: Sobol's sequence, scrambled (Owen), after the first `skip`."""
        power = max(int(np.ceil(np.log2(max(skip + count, 1)))), 0)
        return self.quantiles(inside(qmc.Sobol(len(self), rng=seed).random_base2(power)[skip : skip + count]))

    def drawn(self, count: int, seed: int) -> Array:
        """Random standardised variables."""
        return self.quantiles(inside(np.random.default_rng(seed).random((count, len(self)))))

    def highest(self, degree: int) -> tuple[int, ...]:
        """The highest degree of each parameter's polynomials up to this one: few observations carry few."""
        return tuple(min(degree, len(self.recurrence(k).a), len(self.recurrence(k).b) - 1) for k in range(len(self)))

    def polynomials(self, k: int, xi: Array, degree: int) -> Array:
        """Return the polynomials of one parameter at its xi, (runs,), from degree 0, (runs, degree + 1)."""
        return self.recurrence(k)(xi, degree)

    def basis(self, xi: Array, terms: Terms) -> Array:
        """Return every product of polynomials at every place, (runs, terms)."""
        highest = terms.max(axis=0)
        values_of, found = self.table(xi, highest), np.ones((len(terms), len(xi)))
        # Terms are rows, which is faster.
        for k in np.flatnonzero(highest).tolist():
            found *= values_of[terms[:, k], k]
        return np.ascontiguousarray(found.T)

    def table(self, xi: Array, highest: IntArray) -> Array:
        """Polynomials of each parameter up to its highest degree at least, (degrees, parameters, runs).

        Parameters with the same polynomials are evaluated together.
        """
        rows = [
            (which, recurrence.rows(np.ascontiguousarray(xi[:, which].T), int(highest[which].max())))
            for recurrence, which in self._alike
        ]
        if len(rows) == 1:
            return rows[0][1]
        found = np.ones((int(highest.max()) + 1, len(self), len(xi)))
        for which, values_of in rows:
            found[: len(values_of), which] = values_of
        return found

    @cached_property
    def _alike(self) -> list[tuple[Recurrence, list[int]]]:
        """Parameters in a row that have the same polynomials."""
        each = [self.recurrence(k) for k in range(len(self))]
        groups = [list(group) for _, group in groupby(range(len(each)), lambda k: id(each[k]))]
        return [(each[group[0]], group) for group in groups]


def inside(x: Array) -> Array:
    """Return probabilities off 0 and 1, where quantiles are infinite."""
    return np.clip(x, *ENDS)
