"""Random functions of random parameters whose mean and deviation are known: are these met, and is their error told?"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce

import numpy as np
from scipy import stats
from shoal.response import respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Frozen, Marginal, Normal, Uniform
from shoal.response.runs import Answers
from shoal.trajectory import Array

COUNTS = 1, 2, 3, 5, 8
"""Parameters of a function."""
FINE = 2**17
"""Places of the quadrature over one variable."""
REACH = 12.0
"""Of a normal variable, in deviations."""

Function = Callable[[Array], Array]


@dataclass(frozen=True)
class Form:
    """A function of independent parameters, (parameters, runs) to (runs,), with its mean and its deviation."""

    seed: int
    name: str
    inputs: Inputs
    function: Function
    mean: float
    std: float


@dataclass(frozen=True)
class Met:
    """True and reported errors of mean and deviation as shares of the deviation."""

    form: Form
    runs: int
    why: str
    errors: tuple[float, float]
    told: tuple[float, float]

    @property
    def kept(self) -> tuple[bool, bool]:
        """Return whether the reported error is not smaller than the true one."""
        return tuple(true <= told + 1e-7 for true, told in zip(self.errors, self.told, strict=True))  # type: ignore[return-value]


def drawn(seed: int) -> Form:
    """One of the kinds, with one to eight parameters, narrow or wide."""
    random = np.random.default_rng((seed, 1897))
    make = KINDS[seed % len(KINDS)]
    return make(seed, random, int(random.choice(COUNTS)))


def tried(form: Form) -> Met:
    """By `auto`."""

    def model(values: Mapping[str, Array]) -> Answers:
        told = form.function(np.stack([values[f"x{k}"] for k in range(len(form.inputs))]))
        return Answers(told[:, None], np.ones(len(told), dtype=bool))

    answer = respond(model, form.inputs, 1, seed=form.seed)
    found = answer.statistics
    assert found is not None
    errors = abs(found.mean[0] - form.mean) / form.std, abs(found.std[0] - form.std) / form.std
    told = float(found.error[0]) / form.std, float(found.std_error[0]) / form.std
    return Met(form, answer.runs.evaluations, answer.found.why, errors, told)


def _moments(of: Function, marginal: Marginal) -> tuple[float, float]:
    """Mean and mean square of a function of one parameter."""
    if isinstance(marginal, Normal):
        xi = np.linspace(-REACH, REACH, FINE + 1)
        weights = stats.norm.pdf(xi)
    else:
        xi = marginal.quantile((np.arange(FINE) + 0.5) / FINE)
        weights = np.ones(FINE)
    told = of(marginal.value(xi))
    weights = weights / weights.sum()
    return float(weights @ told), float(weights @ told**2)


def _inputs(marginals: list[Marginal]) -> Inputs:
    return Inputs(tuple(UncertainParameter(f"x{k}", one, {f"x{k}": 1.0}) for k, one in enumerate(marginals)))


def _shape(random: np.random.Generator, size: float) -> tuple[str, Function]:
    """A smooth function of a variable of mean 0 and deviation 1; size: how far it bends."""
    at = float(random.uniform(-1.5, 1.5))
    return [
        ("exp", lambda s: np.exp(size * s)),
        ("cos", lambda s: np.cos(2 * size * s + at)),
        ("tanh", lambda s: np.tanh(size * s + at)),
        ("square", lambda s: (s + at) ** 2),
        ("runge", lambda s: 1 / (1 + (size * s + at) ** 2)),
    ][int(random.integers(5))]


def _ridge(seed: int, random: np.random.Generator, count: int) -> Form:
    """Function of one direction of normal variables."""
    way = random.normal(size=count) if random.random() < 0.5 else np.ones(count)
    way /= np.linalg.norm(way)
    name, of = _shape(random, float(np.exp(random.uniform(np.log(0.1), np.log(0.9)))))
    mean, square = _moments(of, Normal(0.0, 1.0))
    inputs = _inputs([Normal(0.0, 1.0)] * count)
    return Form(seed, f"ridge: {name}", inputs, lambda x: of(way @ x), mean, float(np.sqrt(square - mean**2)))


def _two_ridges(seed: int, random: np.random.Generator, count: int) -> Form:
    """The product of functions of two directions of normal variables."""
    count = max(count, 2)
    ways = np.linalg.qr(random.normal(size=(count, 2)))[0].T
    parts = [_shape(random, float(np.exp(random.uniform(np.log(0.1), np.log(0.7))))) for _ in ways]
    means, squares = np.transpose([_moments(of, Normal(0.0, 1.0)) for _, of in parts])
    mean, square = float(np.prod(means)), float(np.prod(squares))
    name = " times ".join(name for name, _ in parts)

    def function(x: Array) -> Array:
        return np.asarray(parts[0][1](ways[0] @ x) * parts[1][1](ways[1] @ x))

    inputs = _inputs([Normal(0.0, 1.0)] * count)
    return Form(seed, f"two directions: {name}", inputs, function, mean, float(np.sqrt(square - mean**2)))


def _lognormals(seed: int, random: np.random.Generator, count: int) -> Form:
    """A product of powers of lognormal variables."""
    widths = np.exp(random.uniform(np.log(0.03), np.log(0.5), count)) / np.sqrt(count) * 2
    powers = random.choice([-2.0, -1.0, 1.0, 2.0, 0.5], count)
    inputs = _inputs([Normal(0.0, float(width), logarithmic=True) for width in widths])
    s = float(((widths * powers) ** 2).sum())
    mean = float(np.exp(s / 2))
    std = float(mean * np.sqrt(np.expm1(s)))
    return Form(seed, "lognormals", inputs, lambda x: np.prod(x ** powers[:, None], axis=0), mean, std)


def _g_function(seed: int, random: np.random.Generator, count: int) -> Form:
    """Sobol's, with a kink in every parameter."""
    weights = np.exp(random.uniform(np.log(0.3), np.log(30.0), count))
    inputs = _inputs([Uniform(0.0, 1.0)] * count)
    std = float(np.sqrt(np.prod(1 + 1 / (3 * (1 + weights) ** 2)) - 1))

    def function(x: Array) -> Array:
        return np.asarray(np.prod((np.abs(4 * x - 2) + weights[:, None]) / (1 + weights[:, None]), axis=0))

    return Form(seed, "g-function", inputs, function, 1.0, std)


def _kinked(seed: int, random: np.random.Generator, count: int) -> Form:
    """The size of a plane over normal variables."""
    way, at = random.normal(size=count), float(random.uniform(-2, 2))
    way /= np.linalg.norm(way)
    mean, square = _moments(lambda s: np.abs(s - at), Normal(0.0, 1.0))
    inputs = _inputs([Normal(0.0, 1.0)] * count)
    return Form(seed, "kink", inputs, lambda x: np.abs(way @ x - at), mean, float(np.sqrt(square - mean**2)))


def _marginal(random: np.random.Generator) -> Marginal:
    width = float(random.uniform(0.05, 0.5))
    known: list[Marginal] = [
        Normal(1.0, width),
        Normal(0.0, width / 2, logarithmic=True),
        Uniform(1 - width, 1 + width),
        Frozen(stats.triang(float(random.uniform(0.1, 0.9)), 1 - width, 2 * width)),
        Frozen(stats.beta(2.0, float(random.uniform(2.0, 5.0)), 1 - width, 2 * width)),
        Frozen(stats.truncnorm(-2.0, 2.0, 1.0, width)),
    ]
    return known[int(random.integers(len(known)))]


def _bounded(marginal: Marginal, name: str, of: Function) -> Function:
    """The exponential of a lognormal variable has no moments."""
    return np.tanh if name == "exp" and isinstance(marginal, Normal) and marginal.logarithmic else of


def _mixture(seed: int, random: np.random.Generator, count: int) -> Form:
    """A product, or a sum, of functions of parameters of every distribution."""
    marginals = [_marginal(random) for _ in range(count)]
    parts = [_bounded(one, *_shape(random, float(random.uniform(0.1, 0.8)))) for one in marginals]
    moments = [_moments(of, marginal) for of, marginal in zip(parts, marginals, strict=True)]
    means, squares = np.transpose(moments)

    def every(x: Array) -> list[Array]:
        return [of(at) for of, at in zip(parts, x, strict=True)]

    inputs = _inputs(marginals)
    if random.random() < 0.5:
        std = float(np.sqrt((squares - means**2).sum()))
        return Form(seed, "sum", inputs, lambda x: np.sum(every(x), axis=0), float(means.sum()), std)
    mean = float(means.prod())
    std = float(np.sqrt(squares.prod() - mean**2))
    return Form(seed, "product", inputs, lambda x: reduce(np.multiply, every(x)), mean, std)


def _oscillator(seed: int, random: np.random.Generator, count: int) -> Form:
    """Oscillators of uncertain stiffness after some cycles, together."""
    cycles = random.uniform(0.5, 8.0, count)
    inputs = _inputs([Normal(1.0, float(random.uniform(0.005, 0.05))) for _ in cycles])

    def course(stiffness: Array, end: float) -> Array:
        return np.asarray(np.cos(np.sqrt(np.abs(stiffness)) * 2 * np.pi * end))

    pairs = zip(cycles, inputs.parameters, strict=True)
    moments = [_moments(lambda k, end=end: course(k, end), one.marginal) for end, one in pairs]  # type: ignore[misc]
    means, squares = np.transpose(moments)

    def function(x: Array) -> Array:
        return np.asarray(np.sum([course(at, end) for end, at in zip(cycles, x, strict=True)], axis=0))

    return Form(seed, "oscillators", inputs, function, float(means.sum()), float(np.sqrt((squares - means**2).sum())))


KINDS = [_ridge, _two_ridges, _lognormals, _g_function, _kinked, _mixture, _oscillator]
