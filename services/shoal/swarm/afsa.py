"""The artificial fish swarm algorithm as published.

Li Xiaolei, Shao Zhijiang, Qian Jixin, An optimizing method based on autonomous animats: fish-swarm algorithm,
Systems Engineering - Theory & Practice 22(11), 2002, 32-38; the behaviours as in the survey by Neshat, Sepidnam,
Sargolzaei, Toosi, Artificial Intelligence Review 42, 2014, 965-997.

All fish see the swarm as it was when the iteration began, and a fish's random numbers of an iteration are its own. So
they need not go in step: while one looks for food another may still look at a centre, and those that are evaluated side
by side are as many as there is room for. How many changes nothing of the search.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from shoal.swarm.best import better_of, without_failures
from shoal.swarm.box import Box
from shoal.swarm.protocol import Array

Fish = npt.NDArray[np.intp]
"""Numbers of fish."""
Which = npt.NDArray[np.bool_]
"""Of all fish, (n,)."""


class Stage(IntEnum):
    """Stage of a fish in an iteration: the purpose of the point that it asks to be evaluated."""

    CENTRE = 0  # the centre of its neighbours
    SWARM = 1  # a step towards it
    FOLLOW = 2  # a step towards the best neighbour
    TRY = 3  # a random point within sight (foraging)
    ARRIVE = 4  # a step towards what foraging found, or a random step
    DONE = 5  # none: it waits for the others


@dataclass(frozen=True, kw_only=True, eq=False)
class Luck:
    """The random numbers of an iteration, each fish's own.

    towards: rand() of steps towards the centre, the leader and food, (3, n, 1) in [0, 1); tries, (tries, n, d), and
    astray, (n, d): directions in [-1, 1)
    """

    towards: Array
    tries: Array
    astray: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class AfsaState:
    """A swarm within an iteration; lengths are fractions of the box.

    moves: points being evaluated (m, d), each of one of the fish `owners` (m,)
    fish, values: the swarm when the iteration began, (n, d), (n,); centre: mean place of the neighbours (n, d);
    leader: best neighbour (n,); luck: random numbers
    stage, tries: how far each fish is, and how many random points it has looked at, (n,); point: the one it wants to
    look at next (n, d); found, found_values: the best of swarming and following, and of those that are done where they
    are (n, d), (n,)
    """

    moves: Array
    owners: Fish
    fish: Array
    values: Array
    centre: Array
    leader: Fish
    luck: Luck
    stage: npt.NDArray[np.int8]
    tries: Fish
    point: Array
    found: Array
    found_values: Array
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
    batch: most points that are asked for at once, else a point of every fish; the search is the same.
    """

    lower: Array
    upper: Array
    size: int = 40
    visual: float = 0.3
    step: float = 0.03
    crowding: float = 0.618
    try_number: int = 5
    batch: int | None = None

    def __post_init__(self) -> None:
        Box(self.lower, self.upper)
        if self.size < 2 or self.try_number < 1:
            raise ValueError(f"needs 2 fish and 1 try, found {self.size} and {self.try_number}")
        if not (self.visual > 0 and self.step > 0 and self.crowding > 0):
            raise ValueError("visual, step and crowding must be positive")
        if self.batch is not None and self.batch < 1:
            raise ValueError(f"batch: needs 1 point or more, found {self.batch}")

    @property
    def box(self) -> Box:
        """The box that is searched."""
        return Box(self.lower, self.upper)

    def init(self, rng: np.random.Generator) -> AfsaState:
        """Scatter the fish evenly over the box: they all arrive."""
        rng = copy.deepcopy(rng)
        fish = rng.random((self.size, self.box.dimension))
        everyone = np.arange(self.size)
        state = AfsaState(
            moves=fish,
            owners=everyone,
            fish=fish,
            values=np.full(self.size, np.inf),
            centre=fish,
            leader=everyone,
            luck=self._luck(rng),
            stage=np.full(self.size, Stage.ARRIVE, dtype=np.int8),
            tries=np.zeros(self.size, dtype=np.intp),
            point=fish,
            found=fish,
            found_values=np.full(self.size, np.inf),
            rng=rng,
            best=self.box.from_unit(fish)[0],
            best_value=np.inf,
            iteration=-1,
        )
        return self._chosen(state)

    def ask(self, state: AfsaState) -> Array:
        """Points to evaluate next, (m, d)."""
        return self.box.from_unit(state.moves)

    def tell(self, state: AfsaState, values: Array) -> AfsaState:
        """Take the values of the points asked for, (m,), and let their fish go on."""
        told = without_failures(values, len(state.moves))
        best, best_value = better_of(state.best, state.best_value, self.ask(state), told)
        state = self._gone_on(replace(state, best=best, best_value=best_value), told)
        if np.all(state.stage == Stage.DONE):
            arrived = replace(state, fish=state.found, values=state.found_values, iteration=state.iteration + 1)
            state = self._look_around(arrived)
        return self._chosen(state)

    def _chosen(self, state: AfsaState) -> AfsaState:
        """Ask for the points of those fish that have the longest way to go."""
        waiting = np.flatnonzero(state.stage < Stage.DONE)
        behind = np.lexsort((state.tries[waiting], state.stage[waiting]))
        owners = waiting[behind[: self.batch]]
        return replace(state, owners=owners, moves=state.point[owners])

    def _luck(self, rng: np.random.Generator) -> Luck:
        shape = self.size, self.box.dimension
        tries = rng.uniform(-1.0, 1.0, (self.try_number, *shape))
        return Luck(towards=rng.random((3, self.size, 1)), tries=tries, astray=rng.uniform(-1.0, 1.0, shape))

    def _look_around(self, state: AfsaState) -> AfsaState:
        """Begin an iteration: find the neighbours of each fish; those that have some want to know their centre."""
        rng = copy.deepcopy(state.rng)
        fish = state.fish
        distance = np.linalg.norm(fish[:, None] - fish[None], axis=2)
        near = (distance > 0.0) & (distance < self.visual)
        count = near.sum(axis=1)
        social = (count > 0) & (count < self.crowding * self.size)
        centre = near @ fish / np.maximum(count, 1)[:, None]
        state = replace(
            state,
            rng=rng,
            luck=self._luck(rng),
            centre=centre,
            leader=np.argmin(np.where(near, state.values, np.inf), axis=1),
            stage=np.full(self.size, Stage.CENTRE, dtype=np.int8),
            tries=np.zeros(self.size, dtype=np.intp),
            point=centre,
            found=fish,
            found_values=np.full(self.size, np.inf),
        )
        return self._forage(state, ~social)

    def _gone_on(self, state: AfsaState, told: Array) -> AfsaState:
        """Move each fish whose value is known to its next stage."""
        asked = np.zeros(self.size, dtype=bool)
        asked[state.owners] = True
        value = np.full(self.size, np.inf)
        value[state.owners] = told
        central, swarmed, followed, tried, arrived = (asked & (state.stage == stage) for stage in list(Stage)[:-1])

        better = (swarmed | followed) & (value < state.found_values)
        state = _kept(state, better, value)
        swarming = central & (value < state.values)
        state = self._turned(state, swarming, Stage.SWARM, state.centre)
        # A fish compares both behaviours, whatever the first has brought.
        free = (central & ~swarming) | swarmed
        following = free & (state.values[state.leader] < state.values)
        state = self._turned(state, following, Stage.FOLLOW, state.fish[state.leader])
        social = (free & ~following) | followed
        content = social & (state.found_values < state.values)
        fed = tried & (value < state.values)
        state = self._turned(state, fed, Stage.ARRIVE, state.point)
        state = self._forage(state, (social & ~content) | (tried & ~fed))
        state = _kept(state, arrived, value)
        return replace(state, stage=np.where(arrived | content, np.int8(Stage.DONE), state.stage))

    def _forage(self, state: AfsaState, hungry: Which) -> AfsaState:
        """Let these fish look at a random point within sight, or go astray if they have looked at enough of them."""
        lost = hungry & (state.tries == self.try_number)
        trying = hungry & ~lost
        looks = state.luck.tries[np.minimum(state.tries, self.try_number - 1), np.arange(self.size)]
        seen = np.clip(state.fish + self.visual * looks, 0.0, 1.0)
        astray = np.clip(state.fish + self.step * state.luck.astray, 0.0, 1.0)
        point = np.where(trying[:, None], seen, np.where(lost[:, None], astray, state.point))
        stage = np.where(trying, np.int8(Stage.TRY), np.where(lost, np.int8(Stage.ARRIVE), state.stage))
        return replace(state, point=point, stage=stage, tries=state.tries + trying)

    def _turned(self, state: AfsaState, which: Which, stage: Stage, goals: Array) -> AfsaState:
        """These fish go on to a stage with X + rand() step (X_goal - X) / |X_goal - X|, inside the box."""
        luck = state.luck.towards[{Stage.SWARM: 0, Stage.FOLLOW: 1, Stage.ARRIVE: 2}[stage]]
        way = goals - state.fish
        length = np.maximum(np.linalg.norm(way, axis=1, keepdims=True), np.finfo(float).tiny)
        stepped = np.clip(state.fish + luck * self.step * way / length, 0.0, 1.0)
        point = np.where(which[:, None], stepped, state.point)
        return replace(state, stage=np.where(which, np.int8(stage), state.stage), point=point)


def _kept(state: AfsaState, which: Which, value: Array) -> AfsaState:
    """The state in which these fish have found the points they asked for, with these values (n,)."""
    found = np.where(which[:, None], state.point, state.found)
    return replace(state, found=found, found_values=np.where(which, value, state.found_values))
