"""Draws from the posterior of the parameters about an answer, uniform within the bounds but for the problem's priors.

Sampled by emcee (Foreman-Mackey et al. 2013) in several ensembles that know nothing of each other: by independent draws
from a distribution that is fitted to the posterior, and by differences of walkers, which follow shapes that it has not.
Where draws about the answer, weighted by the density, are worth much, they give that distribution and where walkers
begin; elsewhere a beginning of the chains does.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.compile import clock
from shoal.errors import InputError, needs_extra
from shoal.findings import Finding
from shoal.identification import findings as kinds
from shoal.identification.conventions import LEVEL
from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import ForwardModel
from shoal.identification.uncertainty.chains import ENSEMBLES, Independent, possible, sampler, weights
from shoal.identification.uncertainty.covariance import Block
from shoal.identification.uncertainty.density import Density, density
from shoal.identification.uncertainty.intervals import Value
from shoal.identification.uncertainty.linearisation import Linearisation
from shoal.json_values import plain
from shoal.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr
    from emcee import EnsembleSampler

WALKERS = 16
"""The least in each ensemble: whole tiles of lanes, also of half of them."""
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
_NEWS = 0.2
"""Of an interval: a difference to it that is worth a word."""


@dataclass(frozen=True)
class PosteriorMarginal:
    """Marginal of one parameter in its own unit: moments, median, central 95 %, and effective sample sizes.

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
    marginals: dict[str, PosteriorMarginal]
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
        """Correlations of the parameters, (parameters, parameters)."""
        return np.atleast_2d(np.corrcoef(self.flat.T))

    @property
    def worth(self) -> float:
        """The least effective size of all parameters."""
        return min(min(one.size, one.tail) for one in self.marginals.values())

    def findings(self) -> list[Finding]:
        """Return why the draws are not what was asked for, if they are not."""
        if self.converged:
            return []
        most = max(one.r_hat for one in self.marginals.values())
        text = (
            f"the posterior has not converged: after {len(self.flat)} draws R-hat is {most:.3f} (at most {MIXED:g}), "
        )
        text += f"the effective size {self.worth:.0f} of {self.wanted}"
        return [kinds.NOT_MIXED.found(text, r_hat=most, effective_size=self.worth)]

    def to_json(self) -> dict[str, Any]:
        """All but the draws."""
        fields = {
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
        return plain(fields)  # type: ignore[no-any-return]

    def to_xarray(self) -> xr.Dataset:
        """The group `posterior` of ArviZ: every parameter over `chain` and `draw`; `ensemble` is a chain's own.

        Every walker is a chain. Raises InputError without xarray.
        """
        with needs_extra("notebook"):
            import xarray as xr
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
    """Draw until there are enough effective draws, or no more can be had.

    point: the answer; least: its sum of squares; wanted: effective size for the middle and the tails of each parameter.
    Time that is up ends it too, what was drawn until then counts. Raises InputError, and TimeIsUp with too few draws.
    """
    require_sampler()
    from emcee.state import State

    begin = clock.now()
    target = density(model, point, at, blocks, least)
    walkers = ENSEMBLES * max(WALKERS, 2 * (len(point) + 1))
    rng = np.random.RandomState(np.random.MT19937(seed))
    about = Independent(point, target.spread)
    tried = about.draw(_TRIED * walkers, rng)
    shares = weights(target(tried) - about.log_density(tried))
    alike = bool(shares @ shares * len(shares) <= 1.0 / _ALIKE)
    if alike:
        end = State(tried[rng.choice(len(tried), walkers, p=shares)], random_state=rng.get_state())
        near = Independent.of(tried, about, shares)
    else:
        first = sampler(target, about, walkers, alike)
        end = first.run_mcmc(State(possible(target, about, walkers, rng), random_state=rng.get_state()), _BEGINNING)
        near = Independent.of(first.get_chain(discard=_BEGINNING // 2, flat=True), about)
    chains = sampler(target, near, walkers, alike)
    more, found = _AT_ONCE, None
    try:
        while found is None or not (found.converged or len(found.flat) >= _MOST):
            end = chains.run_mcmc(end, more)
            found = _summarise(model, target, chains, wanted, seed, clock.now() - begin)
            more = max(more, chains.iteration // 2)
    except TimeIsUp:
        if found is None:
            raise
    return found


def differences(found: Posterior, values: Mapping[str, Value]) -> list[Finding]:
    """Return a finding for every parameter whose central 95 % are not the interval of the answer."""
    said, model = list[Finding](), list[str]()
    for name, one in found.marginals.items() if found.converged else ():
        value = values[name]
        apart = max(abs(one.lower - value.lower), abs(one.upper - value.upper)) - _NEWS * (one.upper - one.lower)
        if not value.identifiable or apart <= 0.0:
            continue
        if apart <= abs(value.correction or 0.0) + abs(value.theory or 0.0):
            model.append(name)
        else:
            text = f"the posterior of {name} has 95 % between {one.lower:.6g} and {one.upper:.6g}"
            said.append(kinds.POSTERIOR_DIFFERS.found(text, lower=one.lower, upper=one.upper))
    if model:
        text = f"the posterior of {', '.join(model)} leaves the error of the model out, which the interval has"
        said.append(kinds.POSTERIOR_DIFFERS.found(text))
    return said


def _summarise(
    model: ForwardModel, target: Density, chains: EnsembleSampler, wanted: int, seed: int, wall: float
) -> Posterior:
    chain = chains.get_chain()
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
        accepted=float(np.mean(chains.acceptance_fraction)),
        evaluations=target.evaluations,
        failed=target.failed,
        seed=seed,
        wall_s=wall,
    )


def _marginal(draws: Array) -> PosteriorMarginal:
    """Return the marginal of one parameter's draws (ensembles, steps, walkers)."""
    # Ranks are scipy's, which an identification without draws need not load.
    from shoal.identification.uncertainty.chains import bulk_size, r_hat, tail_size

    lower, median, upper = (float(x) for x in np.quantile(draws, [0.5 - LEVEL / 2, 0.5, 0.5 + LEVEL / 2]))
    sizes = bulk_size(draws), tail_size(draws), r_hat(draws)
    return PosteriorMarginal(float(draws.mean()), float(draws.std(ddof=1)), median, lower, upper, *sizes)
