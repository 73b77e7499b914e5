"""The improved fish swarm exactly as the paper prints it (section 4.2, eq. 17 and steps 3-1 to 3-7).

Consequences of the printed steps, carried out literally:
- Step 3-7 returns to 3-3, which sets P = X: the fish lose their memory, personal and global, in every iteration. In
  eq. 17 p - x is therefore zero and c1 has no effect; p_g is the best of the present swarm only.
  The P_i of step 3-6 are overwritten before anything reads them, so they are not computed.
- The last term of eq. 17, rho rand() (rand() - x), pulls every fish in every iteration towards a random point of the
  unit cube [0, 1]^d in the units of the problem (radians), independent of the box. It does not decay, so the swarm
  cannot converge by itself; and a solution inside that cube is favoured.
- Nothing keeps the fish inside the box.
- With any epsilon > 0 step 3-7 stops at the first iteration in which the best does not move.

w, c1 and c2 are not given in the paper. The defaults are the constriction coefficients of Clerc and Kennedy, The
particle swarm - explosion, stability, and convergence in a multidimensional complex space, IEEE Transactions on
Evolutionary Computation 6(1), 2002, 58-73.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np

from shoal.swarm.best import better_of, without_failures
from shoal.swarm.box import Seeded
from shoal.swarm.protocol import Array

CONSTRICTION = 0.7298
ATTRACTION = 1.49618


@dataclass(frozen=True, kw_only=True, eq=False)
class IafsaPrintedState:
    """A swarm of n fish in the units of the problem.

    fish: X^k, being evaluated, velocity: V^k, (n, d)
    group_best, group_value: P_g^k of step 3-6 and its value, what step 3-7 returns; unlike `best` it can get worse
    previous_fish, previous_values: P^{k-1} and f(P^{k-1}) of steps 3-3 and 3-4
    """

    fish: Array
    velocity: Array
    previous_fish: Array
    previous_values: Array
    group_best: Array
    group_value: float
    rng: np.random.Generator
    best: Array
    best_value: float
    iteration: int
    finished: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class IafsaPrinted(Seeded):
    """IAFSA as printed; `tell` follows the numbered steps.

    traditional: x0, the optimum that a traditional method found; previous: the optimum of the previous time step
    (q_{tau-1}), in the first time step None.
    epsilon: threshold of step 3-7, 0 for never. use_velocity: the term w v of eq. 17; use_mutation: the term in rho.
    """

    w: float = CONSTRICTION
    c1: float = ATTRACTION
    c2: float = ATTRACTION
    rho: float = 2.0
    epsilon: float = 0.0
    use_velocity: bool = True
    use_mutation: bool = True

    def init(self, rng: np.random.Generator) -> IafsaPrintedState:
        """Steps 3-1 and 3-2: fish in the box, velocities zero, the last two fish are the seeds."""
        rng = copy.deepcopy(rng)
        fish = self.box.from_unit(rng.random((self.size, self.box.dimension)))
        if self.traditional is not None:
            fish[-2:] = self.traditional
        if self.previous is not None:
            fish[-2] = self.previous
        return IafsaPrintedState(
            fish=fish,
            velocity=np.zeros_like(fish),
            previous_fish=fish,
            previous_values=np.full(self.size, np.inf),
            group_best=fish[0],
            group_value=np.inf,
            rng=rng,
            best=fish[0],
            best_value=np.inf,
            iteration=-1,
            finished=False,
        )

    def ask(self, state: IafsaPrintedState) -> Array:
        """The swarm X^k, (n, d)."""
        return state.fish.copy()

    def tell(self, state: IafsaPrintedState, values: Array) -> IafsaPrintedState:
        """Steps 3-6 and 3-7 for X^k, then 3-3 to 3-5, which lead to X^{k+1}."""
        x = state.fish
        f_x = without_failures(values, self.size)
        best, best_value = better_of(state.best, state.best_value, x, f_x)

        # 3-4 of this pass and 3-6: the best of P^{k-1}, unless one of X^k is better.
        origin, origin_value = better_of(x[0], np.inf, state.previous_fish, state.previous_values)
        p_g, p_g_value = better_of(origin, origin_value, x, f_x)
        # 3-7
        finished = state.iteration >= 0 and bool(np.linalg.norm(p_g - origin) < self.epsilon)

        # 3-3 and 3-4 again
        p = x
        leader, _ = better_of(x[0], np.inf, p, f_x)
        # 3-5
        rng = copy.deepcopy(state.rng)
        v = self._velocity(rng, state.velocity, x, p, leader)
        return IafsaPrintedState(
            fish=x + v,
            velocity=v,
            previous_fish=p,
            previous_values=f_x,
            group_best=p_g,
            group_value=p_g_value,
            rng=rng,
            best=best,
            best_value=best_value,
            iteration=state.iteration + 1,
            finished=finished,
        )

    def _velocity(self, rng: np.random.Generator, v: Array, x: Array, p: Array, p_g: Array) -> Array:
        """Eq. 17; each rand() is an independent number in [0, 1) per fish and dimension."""
        r1, r2, r3, r4 = rng.random((4, *x.shape))
        inertia = self.w * v if self.use_velocity else np.zeros_like(v)
        mutation = self.rho * r3 * (r4 - x) if self.use_mutation else np.zeros_like(v)
        velocity: Array = inertia + self.c1 * r1 * (p - x) + self.c2 * r2 * (p_g - x) + mutation
        return velocity
