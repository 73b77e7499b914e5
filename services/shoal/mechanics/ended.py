"""The state in which a run leaves its machine, by body, so that it does not depend on how coordinates are numbered."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from shoal.mechanics.assembly.loads import Loads
from shoal.mechanics.assembly.placement import place
from shoal.mechanics.derived import RowAllocator
from shoal.mechanics.forces import ANGLE
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array
from shoal.scene.ended import BodyState, End, mesh_of
from shoal.scene.signals import continuous_states


@dataclass(frozen=True, eq=False)
class Ended(Mapping[str, Any]):
    """The state as `End` has it, in plain data, worked out when it is asked for.

    q, v: coordinates and rates, each (unknowns,); turns: of force elements and then of the measures of signals, angles:
    of the markers [rad].
    time: of the end [s].
    """

    model: Model
    time: float
    q: Array
    v: Array
    turns: Array
    angles: Array

    def __getitem__(self, field: str) -> Any:
        return self._plain[field]

    def __iter__(self) -> Iterator[str]:
        return iter(self._plain)

    def __len__(self) -> int:
        return len(self._plain)

    @cached_property
    def _plain(self) -> dict[str, Any]:
        scene = self.model.stated
        bodies = {}
        for name, body in scene.bodies.items():
            vectors = self.model.frames[name].vectors
            bodies[name] = BodyState.model_construct(
                element=body.element,
                mesh=mesh_of(body),
                length=getattr(body, "length", None),
                vectors=tuple(tuple(one.at(self.q).tolist()) for one in vectors),
                rates=tuple(tuple(one.rate(self.v).tolist()) for one in vectors),
            )
        turns = named_turns(self.model, self.turns)
        angles = dict(zip(scene.markers, self.angles.tolist(), strict=True))
        own = continuous_states(scene)
        sizes = [float(state.size) for state in own.values()]
        values = self.v[len(self.v) - len(sizes) :] * sizes
        states = dict(zip(own, values.tolist(), strict=True))
        counted = dict(zip(measured(self.model), self.turns[self.model.forces.size :].tolist(), strict=True))
        end = End.model_construct(
            t=self.time, bodies=bodies, turns=turns, angles=angles, states=states, measures=counted
        ).model_dump(mode="json")
        return {field: value for field, value in end.items() if value or field not in ("states", "measures")}

    def __reduce__(self) -> tuple[Any, ...]:
        # A model holds addresses of this process.
        return dict, (self._plain,)


def named_turns(model: Model, turns: Array) -> dict[str, tuple[float, ...]]:
    """Return the angles [rad] that force elements have counted, (forces,), by the name of their joint or load."""
    named: dict[str, tuple[float, ...]] = {}
    for name, number in _counting(model):
        named[name] = (*named.get(name, ()), float(turns[number]))
    return named


def start_angles(model: Model, named: Sequence[Mapping[str, Sequence[float]]]) -> Array:
    """Return the angles [rad] with which force elements start, (forces, lanes), from those of each lane by name.

    Elements that have no name there, such as friction that only other lanes have, keep the angles of the model.
    """
    angles = np.tile(model.start_angles, len(named) // model.start_angles.shape[1])
    counting = _counting(model)
    for lane, turns in enumerate(named):
        left = {name: iter(of_name) for name, of_name in turns.items()}
        for name, number in counting:
            angles[number, lane] = next(left.get(name, iter(())), angles[number, lane])
    return angles


def measured(model: Model) -> list[str]:
    """Return the names of the measures of signals, in their order."""
    if not model.signals:
        return []
    loads = Loads(model.stated, place(model.stated), RowAllocator(0), 0.0)
    loads.signals.record()
    loads.signals.sample()
    return loads.signals.measures.names


def _counting(model: Model) -> list[tuple[str, int]]:
    """Return the force elements that count turns: the name of the joint or the load, and the element's number."""
    numbers = np.flatnonzero(model.forces.kind == ANGLE)
    if not numbers.size:
        return []
    names = Loads(model.stated, place(model.stated), RowAllocator(0), 0.0).names
    return [(names[number], int(number)) for number in numbers]
