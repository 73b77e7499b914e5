"""Draws from the posterior of the parameters about an answer, uniform within the bounds but for the problem's priors.

The density is that of the misfit: a normal one where the size of the noise is stated, else Student's t, which is what
remains of it when that size is integrated out. Residuals that are correlated, unequal or systematic make least squares
know less than their sum of squares says. So its curvature is adjusted to the covariance that the intervals have
(Ribatet, Cooley and Davison, Statistica Sinica 22, 2012); with white noise nothing changes.

Sampled by emcee (Foreman-Mackey et al. 2013) in several ensembles that know nothing of each other: by independent draws
from a distribution that is fitted to the posterior, and by differences of walkers, which follow shapes that it has not.
Where draws about the answer, weighted by the density, are worth much, they tell that distribution and where walkers
begin; elsewhere a beginning of the chains does.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.errors import InputError
from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import ForwardModel
from shoal.identification.spread.chances import student_above
from shoal.identification.spread.covariance import Block
from shoal.identification.spread.uncertainty import ABSORBED, LEVEL, Linearisation
from shoal.identification.spread.value import Value
from shoal.trajectory import Array, plain

if TYPE_CHECKING:
    import xarray as xr
    from emcee import EnsembleSampler

ENSEMBLES, WALKERS = 4, 16
"""Independent ensembles, and the least walkers in each: whole tiles of lanes, also of half of them."""
MIXED = 1.01
"""R-hat up to which ensembles count as mixed."""
_TRIED = 8
"""Weighted draws about the answer for each walker."""
_ALIKE = 0.5
"""Effective share of the weighted draws from which the posterior is like the distribution about the answer."""
_BEGINNING = 40
"""Steps that are not kept where it is not; the second half of them tells what independent draws are made from."""
_AT_ONCE = 30
"""Steps between looks at the draws; every look waits longer than the last."""
_MOST = 400_000
"""Draws after which the search for more ends."""
_FREEDOM = 5.0
"""Of the Student distribution of independent draws, whose tails should be heavier than those of the posterior."""
_MOVES = {True: (0.75, 0.2, 0.05), False: (0.3, 0.6, 0.1)}
"""Shares of independent draws, of differences of walkers, and of stretches, where the posterior is like what is drawn
from about the answer, and elsewhere: more of the first mix faster there, but leave the tails of bent ones without their
due."""
_NEWS = 0.2
"""Of an interval: a difference to it that is worth a word."""


@dataclass(frozen=True)
class Marginal:
    """Of one parameter in its own unit: moments, median, the central 95 %, and how much the draws are worth for it.

    size, tail: effective sizes for the middle and for the tails, see `mixing`
    """

    mean: float
    sd: float
    median: float
    lower: float
    upper: float
    size: float
    tail: float
    r_hat: float


@dataclass(frozen=True)
class Posterior:
    """Draws (ensembles, steps, walkers, parameters) in the parameters' own units, and what they say.

    noise: the density that was taken; accepted: share of proposals; failed: proposals that could not be simulated
    """

    names: tuple[str, ...]
    draws: Array
    marginals: dict[str, Marginal]
    noise: str
    wanted: int
    converged: bool
    accepted: float
    evaluations: int
    failed: int
    seed: int
    wall_s: float

    @property
    def flat(self) -> Array:
        """All draws, (draws, parameters)."""
        return self.draws.reshape(-1, len(self.names))

    @property
    def correlations(self) -> Array:
        """Of the parameters, (parameters, parameters)."""
        return np.atleast_2d(np.corrcoef(self.flat.T))

    @property
    def worth(self) -> float:
        """The least effective size of all parameters."""
        return min(min(one.size, one.tail) for one in self.marginals.values())

    def sentence(self) -> str:
        """Why the draws are not what was asked for; empty if they are."""
        if self.converged:
            return ""
        most = max(one.r_hat for one in self.marginals.values())
        return (
            f"the posterior has not converged: after {len(self.flat)} draws R-hat is {most:.3f} (at most {MIXED:g}), "
            f"the effective size {self.worth:.0f} of {self.wanted}"
        )

    def to_json(self) -> dict[str, Any]:
        """All but the draws."""
        told = {
            "status": "converged" if self.converged else "not converged",
            "noise": self.noise,
            "draws": len(self.flat),
            "ensembles": self.draws.shape[0],
            "walkers": self.draws.shape[2],
            "wanted": self.wanted,
            "effective_size": self.worth,
            "accepted": self.accepted,
            "evaluations": self.evaluations,
            "failed": self.failed,
            "seed": self.seed,
            "wall_s": self.wall_s,
            "parameters": {
                name: {**vars(one), "interval": (one.lower, one.upper)} for name, one in self.marginals.items()
            },
            "correlations": self.correlations,
        }
        return plain(told)  # type: ignore[no-any-return]

    def to_xarray(self) -> xr.Dataset:
        """The group `posterior` of ArviZ: every parameter over `chain` and `draw`; `ensemble` is a chain's own.

        Every walker is a chain. Raises InputError without xarray.
        """
        try:
            import xarray as xr
        except ModuleNotFoundError:
            raise InputError("xarray is not installed; install shoal with its extra 'notebook'") from None
        ensembles, steps, walkers, _ = self.draws.shape
        chains = self.draws.swapaxes(1, 2).reshape(ensembles * walkers, steps, -1)
        coordinates = {
            "chain": np.arange(ensembles * walkers),
            "draw": np.arange(steps),
            "ensemble": ("chain", np.repeat(np.arange(ensembles), walkers)),
        }
        about = {"inference_library": "emcee", "noise": self.noise, "seed": self.seed, "converged": int(self.converged)}
        columns = {name: (("chain", "draw"), chains[:, :, k]) for k, name in enumerate(self.names)}
        return xr.Dataset(columns, coordinates, about)


def require_sampler() -> None:
    """Raises InputError where the sampler is not installed."""
    if find_spec("emcee") is None:
        raise InputError("sample: emcee is not installed; install shoal with its extra 'sample'")


def posterior(
    model: ForwardModel,
    point: Array,
    at: Linearisation,
    blocks: list[Block],
    least: float,
    wanted: int,
    seed: int = 0,
) -> Posterior:
    """Draw until so many effective ones are there, or no more can be had.

    point: the answer; least: its sum of squares; wanted: effective size for the middle and the tails of each parameter.
    Time that is up ends it too, what was drawn until then counts. Raises InputError, and TimeIsUp with too few draws.
    """
    require_sampler()
    from emcee.state import State

    begin = time.perf_counter()
    target = _target(model, point, at, blocks, least)
    walkers = ENSEMBLES * max(WALKERS, 2 * (len(point) + 1))
    rng = np.random.RandomState(np.random.MT19937(seed))
    about = _Independent(point, target.spread)
    tried = about.draw(_TRIED * walkers, rng)
    weights = _weights(target(tried) - about.log_density(tried))
    alike = bool(weights @ weights * len(weights) <= 1.0 / _ALIKE)
    if alike:
        end = State(tried[rng.choice(len(tried), walkers, p=weights)], random_state=rng.get_state())
        near = _Independent.of(tried, about, weights)
    else:
        first = _sampler(target, about, walkers, alike)
        end = first.run_mcmc(State(target.possible(about, walkers, rng), random_state=rng.get_state()), _BEGINNING)
        near = _Independent.of(first.get_chain(discard=_BEGINNING // 2, flat=True), about)
    sampler = _sampler(target, near, walkers, alike)
    more, found = _AT_ONCE, None
    try:
        while found is None or not (found.converged or len(found.flat) >= _MOST):
            end = sampler.run_mcmc(end, more)
            found = _told(model, target, sampler, wanted, seed, time.perf_counter() - begin)
            more = max(more, sampler.iteration // 2)
    except TimeIsUp:
        if found is None:
            raise
    return found


def news(found: Posterior, values: Mapping[str, Value]) -> list[str]:
    """A sentence for every parameter whose central 95 % are not the interval that stands in the answer."""
    said, model = [], list[str]()
    for name, one in found.marginals.items() if found.converged else ():
        value = values[name]
        apart = max(abs(one.lower - value.lower), abs(one.upper - value.upper)) - _NEWS * (one.upper - one.lower)
        if not value.identifiable or apart <= 0.0:
            continue
        if apart <= abs(value.correction or 0.0) + abs(value.theory or 0.0):
            model.append(name)
        else:
            said.append(f"the posterior of {name} has 95 % between {one.lower:.6g} and {one.upper:.6g}")
    if model:
        said.append(f"the posterior of {', '.join(model)} leaves the error of the model out, which the interval has")
    return said


class _Independent:
    """Student's t about a centre, draws of which know nothing of where a walker is."""

    def __init__(self, centre: Array, root: Array) -> None:
        self.centre, self.root, self.inverse = centre, root, np.linalg.inv(root)

    @classmethod
    def of(cls, draws: Array, before: _Independent, weights: Array | None = None) -> _Independent:
        """Of the mean and the covariance of draws (draws, parameters); that before where they have none."""
        covariance = np.atleast_2d(np.cov(draws.T, aweights=weights))
        try:
            return cls(np.average(draws, axis=0, weights=weights), np.asarray(np.linalg.cholesky(covariance)))
        except np.linalg.LinAlgError:
            return before

    def draw(self, count: int, rng: np.random.RandomState) -> Array:
        """Points, (count, parameters)."""
        normal = rng.standard_normal((count, len(self.centre)))
        wide = np.sqrt(_FREEDOM / rng.chisquare(_FREEDOM, (count, 1)))
        return np.asarray(self.centre + (normal * wide) @ self.root.T)

    def log_density(self, points: Array) -> Array:
        """Of points (count, parameters), but for a constant."""
        away = np.sum(((points - self.centre) @ self.inverse.T) ** 2, axis=1)
        return np.asarray(-(_FREEDOM + len(self.centre)) / 2 * np.log1p(away / _FREEDOM))

    def propose(self, points: Array, rng: np.random.RandomState) -> tuple[Array, Array]:
        """New points and the logarithm of the ratio of densities, as emcee wants it."""
        fresh = self.draw(len(points), rng)
        return fresh, self.log_density(points) - self.log_density(fresh)


def _weights(logarithms: Array) -> Array:
    """Of draws, which add up to 1, from their logarithms; all of the first draw where none can be simulated."""
    most = float(np.max(logarithms))
    if not np.isfinite(most):
        return np.asarray(np.eye(len(logarithms))[0])
    weights = np.exp(logarithms - most)
    return np.asarray(weights / np.sum(weights))


class _Target:
    """The logarithm of the density that is sampled.

    turned: what a step from the answer is multiplied by before it is simulated; size: variance by which the sum of
    squares is divided; freedom: of Student's t, inf for a normal density; spread: root of the covariance
    """

    def __init__(
        self,
        model: ForwardModel,
        point: Array,
        least: float,
        turned: Array,
        size: float,
        freedom: float,
        spread: Array,
    ) -> None:
        self.model, self.point, self.least = model, point, least
        self.turned, self.size, self.freedom, self.spread = turned, size, freedom, spread
        self.lower, self.upper = model.box_at(point)
        self.evaluations = self.failed = 0

    def __call__(self, points: Array) -> Array:
        """Of points (count, parameters); -inf outside the bounds and where nothing can be simulated."""
        found = np.full(len(points), -np.inf)
        inside = np.flatnonzero(np.all((points >= self.lower) & (points <= self.upper), axis=1))
        if inside.size:
            rows = self.model.uncounted(self.point + (points[inside] - self.point) @ self.turned.T)
            rise = (np.sum(rows**2, axis=1) - self.least) / self.size
            self.evaluations += len(inside)
            self.failed += int(np.count_nonzero(~np.isfinite(rise)))
            found[inside] = np.where(np.isfinite(rise), self._log(rise), -np.inf)
        return found

    def _log(self, rise: Array) -> Array:
        if not np.isfinite(self.freedom):
            return -rise / 2
        return -(self.freedom + len(self.point)) / 2 * np.log1p(np.maximum(rise / self.freedom, -0.99))

    def possible(self, near: _Independent, count: int, rng: np.random.RandomState) -> Array:
        """So many points with a density, (count, parameters), from a distribution that narrows until it has some."""
        points = np.empty((0, len(self.point)))
        for attempt in range(30):
            tried = self.point + (near.draw(count, rng) - self.point) * 0.8**attempt
            points = np.concatenate([points, tried[np.isfinite(self(tried))]])
            if len(points) >= count:
                return points[:count]
        raise InputError("sample: no parameters beside the answer can be simulated; nothing can be drawn")


def _target(model: ForwardModel, point: Array, at: Linearisation, blocks: list[Block], least: float) -> _Target:
    """The density whose curvature at the answer is that of its covariance, in scaled parameters that are known."""
    across = at.unknown.shape[1] if at.unknown.size else 0
    known = np.linalg.svd(at.unknown)[0][:, across:] if across else np.eye(len(point))
    parts = known.T @ (at.parts / np.outer(at.scale, at.scale)) @ known
    covariance = parts.sum(axis=0)
    freedom = _freedom(parts, at, blocks)
    lever = known.T @ (at.pseudo_inverse / at.scale[:, None])
    alone = lever @ lever.T  # the inverse of the Gram matrix G of the Jacobian
    covariance = covariance + (ABSORBED * at.systematic / _quantile(freedom)) ** 2 * alone
    # M' G M / size = C^-1 with det M = 1: M is 1 if C is proportional to the inverse of G.
    root = np.linalg.inv(np.linalg.cholesky(alone))
    inner = _root(root @ covariance @ root.T, -0.5)
    factor = float(np.linalg.det(inner)) ** (1.0 / len(inner))
    outside = np.eye(len(point)) - known @ known.T
    turned = known @ np.linalg.solve(root, inner @ root) / factor @ known.T + outside
    wide = outside @ np.diag((model.upper - model.lower) / at.scale / np.sqrt(12.0)) @ outside
    spread = known @ _root(covariance, 0.5) @ known.T + wide
    turned, spread = at.scale[:, None] * turned / at.scale, at.scale[:, None] * spread
    return _Target(model, point, least, turned, factor**-2, freedom, spread)


def _freedom(parts: Array, at: Linearisation, blocks: list[Block]) -> float:
    """Of the whole covariance, from the shares (blocks, p, p) whose noise is not stated (Satterthwaite 1946)."""
    stated = [b.known or (b.stated > 0 and n.variance <= b.stated**2) for b, n in zip(blocks, at.noise, strict=False)]
    stated += [False] * (len(at.noise) - len(blocks))
    shares = np.einsum("bij,ji->b", parts, np.linalg.inv(parts.sum(axis=0))) / parts.shape[1]
    doubt = sum(s**2 / n.freedom for s, n, sure in zip(shares, at.noise, stated, strict=True) if not sure)
    return float(1.0 / doubt) if doubt > 0.0 else np.inf


def _quantile(freedom: float) -> float:
    return student_above(min(freedom, 1e9), 0.5 - LEVEL / 2)


def _root(matrix: Array, power: float) -> Array:
    """Of a symmetric positive matrix."""
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.maximum(values, 1e-300) ** power) @ vectors.T)


def _sampler(target: Callable[[Array], Array], near: _Independent, walkers: int, alike: bool) -> EnsembleSampler:
    from emcee import EnsembleSampler
    from emcee.moves import DEMove, MHMove, StretchMove

    # Halves are every other walker, so that each has its part of every ensemble, in order.
    among = [_apart(move(randomize_split=False)) for move in (DEMove, StretchMove)]
    moves = list(zip((MHMove(near.propose), *among), _MOVES[alike], strict=True))
    return EnsembleSampler(walkers, len(near.centre), target, moves=moves, vectorize=True)


def _apart(move: Any) -> Any:
    """A move of emcee that looks at walkers of the same ensemble only."""
    propose = move.get_proposal

    def proposal(half: Array, others: list[Array], rng: np.random.RandomState) -> tuple[Array, Array]:
        pairs = zip(np.split(half, ENSEMBLES), np.split(others[0], ENSEMBLES), strict=True)
        found = [propose(mine, [theirs], rng) for mine, theirs in pairs]
        return np.concatenate([fresh for fresh, _ in found]), np.concatenate([factor for _, factor in found])

    move.get_proposal = proposal
    return move


def _told(
    model: ForwardModel, target: _Target, sampler: EnsembleSampler, wanted: int, seed: int, wall: float
) -> Posterior:
    chain = sampler.get_chain()
    points = chain.reshape(len(chain), ENSEMBLES, -1, chain.shape[-1]).swapaxes(0, 1)
    draws = model.parameters.to_values(points.reshape(-1, points.shape[-1])).reshape(points.shape)
    marginals = {name: _marginal(draws[..., k]) for k, name in enumerate(model.names)}
    worth = min(min(one.size, one.tail) for one in marginals.values())
    mixed = max(one.r_hat for one in marginals.values()) <= MIXED
    law = f"Student's t with {target.freedom:.3g} degrees of freedom" if np.isfinite(target.freedom) else "normal"
    return Posterior(
        names=model.names,
        draws=draws,
        marginals=marginals,
        noise=law,
        wanted=wanted,
        converged=bool(mixed and worth >= wanted),
        accepted=float(np.mean(sampler.acceptance_fraction)),
        evaluations=target.evaluations,
        failed=target.failed,
        seed=seed,
        wall_s=wall,
    )


def _marginal(draws: Array) -> Marginal:
    """Of one parameter's draws (ensembles, steps, walkers)."""
    lower, median, upper = (float(x) for x in np.quantile(draws, [0.5 - LEVEL / 2, 0.5, 0.5 + LEVEL / 2]))
    from shoal.identification.spread.mixing import bulk_size, r_hat, tail_size

    sizes = bulk_size(draws), tail_size(draws), r_hat(draws)
    return Marginal(float(draws.mean()), float(draws.std(ddof=1)), median, lower, upper, *sizes)
