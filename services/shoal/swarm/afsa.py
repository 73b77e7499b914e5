"""The artificial fish swarm algorithm as published.

Li Xiaolei, Shao Zhijiang, Qian Jixin, An optimizing method based on autonomous animats: fish-swarm algorithm,
Systems Engineering - Theory & Practice 22(11), 2002, 32-38; the behaviours as in the survey by Neshat, Sepidnam,
Sargolzaei, Toosi, Artificial Intelligence Review 42, 2014, 965-997. Each iteration goes through batches, so that all
fish of a batch are evaluated side by side; they all see the swarm as it was when the iteration began.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from enum import Enum, auto

import numpy as np
import numpy.typing as npt

from shoal.swarm.best import better_of, without_failures
from shoal.swarm.box import Box
from shoal.swarm.protocol import Array


class Stage(Enum):
    """What the candidates of a state are."""

    SCATTER = auto()  # the first swarm
    CENTRE = auto()  # the centres of the neighbours
    SOCIAL = auto()  # steps towards a centre (swarming) or the best neighbour (following)
    TRY = auto()  # random points within sight (foraging)
    ARRIVE = auto()  # steps towards what foraging found, random steps of those who found nothing


@dataclass(frozen=True, kw_only=True, eq=False)
class AfsaState:
    """A swarm within an iteration; lengths are fractions of the box.

    fish: (n, d), values: (n,); moves: points being evaluated (m, d) of the fish `owners` (m,)
    centre: mean place of the neighbours (n, d); leader: best neighbour (n,)
    goal: what foraging found (n, d), nan where nothing; hungry: who forages (n,); tries: batches of tries so far
    """

    stage: Stage
    moves: Array
    owners: npt.NDArray[np.intp]
    fish: Array
    values: Array
    centre: Array
    leader: npt.NDArray[np.intp]
    goal: Array
    hungry: npt.NDArray[np.bool_]
    tries: int
    rng: np.random.Generator
    best: Array
    best_value: float
    iteration: int
    finished: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Afsa:
    """AFSA with foraging, swarming and following.

    visual: radius of sight, step: longest step, both as fractions of the box. They are constant, as published, so the
    accuracy reached is limited by the step. A fish with a share of `crowding` (delta) or more of the swarm within
    sight neither swarms nor follows. 0.618 is the value in use with the textbook programs, whose step is a tenth of
    `visual` as well. A fish that neither swarms nor follows with success forages in up to `try_number` tries.
    """

    lower: Array
    upper: Array
    size: int = 40
    visual: float = 0.3
    step: float = 0.03
    crowding: float = 0.618
    try_number: int = 5

    def __post_init__(self) -> None:
        Box(self.lower, self.upper)
        if self.size < 2 or self.try_number < 1:
            raise ValueError(f"needs 2 fish and 1 try, found {self.size} and {self.try_number}")
        if not (self.visual > 0 and self.step > 0 and self.crowding > 0):
            raise ValueError("visual, step and crowding must be positive")

    @property
    def box(self) -> Box:
        """The box that is searched."""
        return Box(self.lower, self.upper)

    def init(self, rng: np.random.Generator) -> AfsaState:
        """Scatter the fish evenly over the box."""
        rng = copy.deepcopy(rng)
        fish = rng.random((self.size, self.box.dimension))
        return AfsaState(
            stage=Stage.SCATTER,
            moves=fish,
            owners=np.arange(self.size),
            fish=fish,
            values=np.full(self.size, np.inf),
            centre=fish,
            leader=np.arange(self.size),
            goal=np.full_like(fish, np.nan),
            hungry=np.ones(self.size, dtype=bool),
            tries=0,
            rng=rng,
            best=self.box.from_unit(fish)[0],
            best_value=np.inf,
            iteration=-1,
        )

    def ask(self, state: AfsaState) -> Array:
        """Points to evaluate next, (m, d)."""
        return self.box.from_unit(state.moves)

    def tell(self, state: AfsaState, values: Array) -> AfsaState:
        """Take the values of the batch, (m,), and go on to the next one."""
        told = without_failures(values, len(state.moves))
        best, best_value = better_of(state.best, state.best_value, self.ask(state), told)
        state = replace(state, rng=copy.deepcopy(state.rng), best=best, best_value=best_value)
        match state.stage:
            case Stage.SCATTER:
                return self._look_around(replace(_settle(state, told), iteration=0))
            case Stage.CENTRE:
                return self._swarm_and_follow(state, told)
            case Stage.SOCIAL:
                return self._forage(_take_better(state, told))
            case Stage.TRY:
                return self._forage(_remember_goals(state, told))
            case Stage.ARRIVE:
                return self._look_around(replace(_settle(state, told), iteration=state.iteration + 1))

    def _look_around(self, state: AfsaState) -> AfsaState:
        """Find the neighbours of each fish; ask for the food in their centre."""
        fish = state.fish
        distance = np.linalg.norm(fish[:, None] - fish[None], axis=2)
        near = (distance > 0.0) & (distance < self.visual)
        count = near.sum(axis=1)
        social = np.flatnonzero((count > 0) & (count < self.crowding * self.size))
        centre = near @ fish / np.maximum(count, 1)[:, None]
        state = replace(
            state,
            centre=centre,
            leader=np.argmin(np.where(near, state.values, np.inf), axis=1),
            goal=np.full_like(fish, np.nan),
            hungry=np.ones(self.size, dtype=bool),
            tries=0,
        )
        if social.size == 0:
            return self._forage(state)
        return replace(state, stage=Stage.CENTRE, owners=social, moves=centre[social])

    def _swarm_and_follow(self, state: AfsaState, centre_values: Array) -> AfsaState:
        """Step towards the centre and towards the best neighbour, where there is more food than here."""
        social = state.owners
        swarming = social[centre_values < state.values[social]]
        following = social[state.values[state.leader[social]] < state.values[social]]
        owners = np.concatenate([swarming, following])
        if owners.size == 0:
            return self._forage(state)
        goals = np.concatenate([state.centre[swarming], state.fish[state.leader[following]]])
        return replace(state, stage=Stage.SOCIAL, owners=owners, moves=self._step(state, state.fish[owners], goals))

    def _forage(self, state: AfsaState) -> AfsaState:
        """Let those who still seek look at one random point within sight each; at the end all hungry fish move."""
        seeking = np.flatnonzero(state.hungry & np.isnan(state.goal[:, 0]))
        if seeking.size == 0 or state.tries == self.try_number:
            return self._arrive(state)
        seen = state.fish[seeking] + self.visual * state.rng.uniform(-1.0, 1.0, (seeking.size, state.fish.shape[1]))
        return replace(state, stage=Stage.TRY, owners=seeking, moves=np.clip(seen, 0.0, 1.0), tries=state.tries + 1)

    def _arrive(self, state: AfsaState) -> AfsaState:
        owners = np.flatnonzero(state.hungry)
        if owners.size == 0:
            return self._look_around(replace(state, iteration=state.iteration + 1))
        fish, goals = state.fish[owners], state.goal[owners]
        astray = fish + self.step * state.rng.uniform(-1.0, 1.0, fish.shape)
        moves = np.where(np.isnan(goals), np.clip(astray, 0.0, 1.0), self._step(state, fish, goals))
        return replace(state, stage=Stage.ARRIVE, owners=owners, moves=moves)

    def _step(self, state: AfsaState, fish: Array, goals: Array) -> Array:
        """X + rand() step (X_goal - X) / |X_goal - X|, inside the box; one random number per fish."""
        way = goals - fish
        length = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), np.finfo(float).tiny)
        moved: Array = np.clip(fish + state.rng.random((len(fish), 1)) * self.step * way / length, 0.0, 1.0)
        return moved


def _settle(state: AfsaState, told: Array) -> AfsaState:
    """Put the owners where they asked to go, better or worse."""
    fish, values = state.fish.copy(), state.values.copy()
    fish[state.owners], values[state.owners] = state.moves, told
    return replace(state, fish=fish, values=values)


def _take_better(state: AfsaState, told: Array) -> AfsaState:
    """Of swarming and following take the better one if it improves on the fish; the others stay hungry."""
    least = state.values.copy()
    np.minimum.at(least, state.owners, told)
    taken = (told == least[state.owners]) & (told < state.values[state.owners])
    owners = state.owners[taken]
    hungry = state.hungry.copy()
    hungry[owners] = False
    moved = _settle(replace(state, owners=owners, moves=state.moves[taken]), told[taken])
    return replace(moved, hungry=hungry)


def _remember_goals(state: AfsaState, told: Array) -> AfsaState:
    found = told < state.values[state.owners]
    goal = state.goal.copy()
    goal[state.owners[found]] = state.moves[found]
    return replace(state, goal=goal)
