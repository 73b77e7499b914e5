"""The improved fish swarm, repaired: what the paper's section 4.2 aims at, made to converge.

Against the printed steps (see `iafsa_printed`):
- the fish keep their memory: step 3-7 returns to 3-4, so P and P_g of step 3-6 survive;
- the mutation is selective and fades. The term rho rand() (rand() - x) of eq. 17 leaves the velocity; instead a fish
  mutates with the probability `mutation` around its own best place by differences between the memories of others
  (Storn, Price, Differential evolution, Journal of Global Optimization 11, 1997, 341-359, variant current-to-best/1):
  its amplitude and its directions are those of the spread that the swarm still has. A mutant that is worse leaves no
  trace, because only improvements enter the memory;
- lengths are fractions of the box, and the fish are reflected at its walls, where they lose their velocity.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np

from shoal.swarm.best import better_of, without_failures
from shoal.swarm.box import Seeded, reflect
from shoal.swarm.iafsa_printed import ATTRACTION, CONSTRICTION
from shoal.swarm.protocol import Array


@dataclass(frozen=True, kw_only=True, eq=False)
class IafsaState:
    """A swarm of n fish; lengths are fractions of the box.

    fish: X, being evaluated, velocity: V, memory: P, (n, d); memory_values: f(P), (n,)
    """

    fish: Array
    velocity: Array
    memory: Array
    memory_values: Array
    rng: np.random.Generator
    best: Array
    best_value: float
    iteration: int
    finished: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Iafsa(Seeded):
    """IAFSA as repaired; one batch of `size` evaluations per iteration.

    traditional, previous: they replace the last and the last but one fish. mutation: probability with which a fish
    mutates. tolerance: the search is finished when all memories lie within this fraction of the box; 0 for when they
    coincide. value_tolerance: or when their values, not all the same, agree to this fraction of the best.
    use_velocity: the term w v of eq. 17; use_mutation: the mutation.
    """

    w: float = CONSTRICTION
    c1: float = ATTRACTION
    c2: float = ATTRACTION
    mutation: float = 0.7
    tolerance: float = 0.0
    value_tolerance: float = 0.0
    use_velocity: bool = True
    use_mutation: bool = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if not 0.0 <= self.mutation <= 1.0:
            raise ValueError(f"mutation is a probability, found {self.mutation}")

    def init(self, rng: np.random.Generator) -> IafsaState:
        """Steps 3-1 and 3-2: fish in the box, velocities zero, the last two fish are the seeds."""
        rng = copy.deepcopy(rng)
        fish = rng.random((self.size, self.box.dimension))
        if self.traditional is not None:
            fish[-1] = self.box.to_unit(self.traditional)
        if self.previous is not None:
            fish[-2] = self.box.to_unit(self.previous)
        return IafsaState(
            fish=fish,
            velocity=np.zeros_like(fish),
            memory=fish,
            memory_values=np.full(self.size, np.inf),
            rng=rng,
            best=self.box.from_unit(fish)[0],
            best_value=np.inf,
            iteration=-1,
            finished=False,
        )

    def ask(self, state: IafsaState) -> Array:
        """The swarm X^k in the units of the problem, (n, d)."""
        return self.box.from_unit(state.fish)

    def tell(self, state: IafsaState, values: Array) -> IafsaState:
        """Step 3-6 for X^k, then 3-5, which leads to X^{k+1}."""
        x = state.fish
        f_x = without_failures(values, self.size)
        best, best_value = better_of(state.best, state.best_value, self.ask(state), f_x)
        improved = f_x < state.memory_values
        p = np.where(improved[:, None], x, state.memory)
        f_p = np.where(improved, f_x, state.memory_values)

        rng = copy.deepcopy(state.rng)
        p_g = p[np.argmin(f_p)]
        v = self._velocity(rng, state.velocity, x, p, p_g)
        fish, v = reflect(x + v, v)
        if self.use_mutation:
            chosen = rng.random((self.size, 1)) < self.mutation
            fish = np.where(chosen, reflect(_mutants(rng, p, p_g), v)[0], fish)
        return IafsaState(
            fish=fish,
            velocity=v,
            memory=p,
            memory_values=f_p,
            rng=rng,
            best=best,
            best_value=best_value,
            iteration=state.iteration + 1,
            finished=self._is_finished(p, f_p),
        )

    def _is_finished(self, p: Array, f_p: Array) -> bool:
        lowest, highest = float(f_p.min()), float(f_p.max())
        alike = 0.0 < highest - lowest <= self.value_tolerance * lowest
        return alike or bool(np.ptp(p, axis=0).max() <= self.tolerance)

    def _velocity(self, rng: np.random.Generator, v: Array, x: Array, p: Array, p_g: Array) -> Array:
        """Eq. 17 without its last term; each rand() is an independent number per fish and dimension."""
        r1, r2 = rng.random((2, *x.shape))
        inertia = self.w * v if self.use_velocity else np.zeros_like(v)
        velocity: Array = inertia + self.c1 * r1 * (p - x) + self.c2 * r2 * (p_g - x)
        return velocity


def _mutants(rng: np.random.Generator, p: Array, p_g: Array) -> Array:
    """P_i + F (P_g - P_i) + F (P_a - P_b) with a, b two fish by lot and F in [1/2, 1) per fish, (n, d)."""
    a, b = rng.integers(len(p), size=(2, len(p)))
    factor = rng.uniform(0.5, 1.0, (len(p), 1))
    mutants: Array = p + factor * (p_g - p + p[a] - p[b])
    return mutants
