"""The memory of one tile's march, which is put back to its start by one copy and marched in again."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from threading import Event
from typing import Any, TypeVar

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import forces, states
from shoal.mechanics.dynamics import Work, derived_rows, work_space
from shoal.mechanics.elements.families import lay
from shoal.mechanics.event_record import recorded
from shoal.mechanics.gaps import RECORD
from shoal.mechanics.halts import Halts
from shoal.mechanics.integrators import Choice, choose, facts
from shoal.mechanics.integrators.scheme import connect
from shoal.mechanics.kernels import Seek, Sought, ready
from shoal.mechanics.lane_events import ADDRESSES
from shoal.mechanics.least.principle import PROJECTION
from shoal.mechanics.march import March
from shoal.mechanics.marched import Marched, framed
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array, Tile, pack
from shoal.mechanics.signals import begin_samples, hold, nearest_tie, switches_held
from shoal.scene import Solver

T = TypeVar("T")
_LINE = 8
"""Numbers in a line of the processor's cache."""


def at_start(model: Model, tile: Tile, part: slice) -> tuple[Arrays, Work]:
    """The arrays and the work space of one tile of lanes that stands at its start, as a march takes them."""
    arrays = model.tile(tile, part)
    room = work_space(tile, arrays)
    arrays = ready(tile, arrays, room)
    put_at_start(model, tile, part, arrays, room)
    return arrays, room


def put_at_start(model: Model, tile: Tile, part: slice, arrays: Arrays, room: Work) -> None:
    """Put the coordinates, the rates and the turns of a model's start into a work space."""
    room.z[: model.unknowns * len(tile)] = pack(model.q0, part, tile)
    room.zdot[: model.unknowns * len(tile)] = pack(model.v0, part, tile)
    if model.forces.size:
        derived_rows(tile, arrays, room)
        room.memory[:] = forces.initial_memory(tile, arrays.forces, room.z, pack(model.start_angles, part, tile))
    if followed := arrays.followed:
        derived_rows(tile, arrays, room)
        start = pack(model.signal_angles, part, tile)
        if switches_held(arrays, tile):
            hold(followed, room.signals)
        room.signals[: start.size] = forces.initial_memory(tile, followed.measures, room.z, start)
        begin_samples(followed, room.signals, len(tile))
    if model.gaps.size:
        derived_rows(tile, arrays, room)
        start = pack(model.gap_angles, part, tile)
        room.gaps.memory[:] = forces.initial_memory(tile, arrays.gaps.measures, room.z, start)


def lean(arrays: Arrays, room: Work) -> Work:
    """The same room without its dense matrices, whose size is the square of the machine's, where no step enters them.

    The accelerations of machines with many constraints and the removal of drift are sparse saddle point problems.
    """
    if not arrays.saddle.many or arrays.method != PROJECTION:
        return room
    none, gauss = np.zeros(0), room.gauss
    lane = gauss.lane._replace(rows=np.zeros((0, 0)), triangle=np.zeros((0, 0)))
    return room._replace(gauss=gauss._replace(response=none, gram=none, lane=lane))


class Workspace:
    """Room for the march of one tile of a model at given times [s], for one march at a time.

    seek: who seeks the accelerations, see `simulate`. spare: lanes at the end of the tile on which no element acts.
    whole: whether all coordinates are sampled beside the markers, see `states.split`.
    """

    def __init__(
        self,
        solver: Solver,
        model: Model,
        choice: Choice,
        tile: Tile,
        part: slice,
        times: Array,
        halts: Halts,
        seek: Callable[[Arrays, Work], Seek] | None = None,
        spare: int = 0,
        whole: bool = False,
    ) -> None:
        if seek is not None and model.rubbing.size:
            raise InputError(
                "solver.acceleration: swarms know no friction by the forces of joints (mu); use projection"
            )
        if seek is not None and model.scene.states:
            name = next(iter(model.scene.states))
            raise InputError(f"solver.acceleration: swarms know no states, as states.{name}; use projection")
        self._model, self._part, self._tile = model, part, tile
        if seek is not None and model.gaps.size:
            raise InputError(
                f"solver.acceleration: swarms know no contacts, as of {model.gap_fields[0]}; use projection"
            )
        arrays, room = at_start(model, tile, part)
        if seek is None and facts(choice.name).sparse_constraints:
            room = lean(arrays, room)
        if spare:
            elements = tuple(family._replace(spare=spare) for family in arrays.elements)
            arrays = arrays._replace(elements=elements, families=lay(elements))
        settings = choose(solver, model, tile, part, choice.name)
        steps = solver.max_steps if facts(choice.name).adaptive else int(np.ceil(times[-1] / solver.step - 1e-9))
        steps += int(np.count_nonzero(halts.due)) if facts(choice.name).adaptive else 0
        rows = np.concatenate([model.marker_rows.ravel(), states.rows(model)]) if whole else model.marker_rows.ravel()
        scheme = connect(tile, settings, arrays, room)
        frame = framed(tile, scheme, arrays, room, solver.step, steps, times.copy(), rows, solver.rank_tolerance, halts)
        if model.gaps.size and len(tile) > 1:
            lanes = part.stop - part.start
            frame = frame._replace(apart=np.zeros(ADDRESSES * lanes, dtype=np.int64), lanes=lanes)
        log = frame.room.gaps.log
        own = frame.room, settings, frame.own, frame.record
        self._block, (room, self._settings, loop, record) = gathered(own, log)
        scheme = connect(tile, self._settings, arrays, room)
        frame = frame._replace(room=room, scheme=scheme, own=loop, record=record)
        self._sought = None if seek is None else Sought(seek(arrays, room), model.unknowns)
        if self._sought is not None:
            frame = frame._replace(arrays=self._sought.joined(arrays, room))
        known = facts(choice.name)
        numbers = max(1, model.unknowns) * len(tile)
        self.march = March(frame, known.seconds_per_unknown[model.constraints.size > 0] * known.stages * numbers)
        self._start = self._block[: self._block.size - log.size].copy()

    @property
    def size(self) -> int:
        """Numbers that it holds."""
        return self._block.size

    @property
    def events(self) -> list[dict[str, Any]]:
        """Events of contacts in a march of one lane, the first `LOGGED` of them, see `event_record.recorded`."""
        gaps, fields = self.march.frame.room.gaps, self._model.gap_fields
        if not fields:
            return []
        log = gaps.log[: RECORD * int(gaps.number[0])].reshape(-1, RECORD)
        # Where a log is full, what became of its contacts later is not known.
        whole = len(log) == int(gaps.number[0])
        return recorded(log, fields, gaps.closed if whole else np.zeros_like(gaps.closed))

    @property
    def recorded(self) -> dict[str, list[float]]:
        """Signals, states and loads that follow them at the sampled times, of a march of one lane."""
        names = self._model.recorded
        columns = self.march.frame.record.signals.reshape(-1, max(1, len(names))).T.tolist()
        return dict(zip(names, columns, strict=False))

    @property
    def nearest_tie(self) -> dict[str, Any]:
        """The measured value nearest to a tie between two roundings, of a march of one lane; empty without any."""
        followed = self.march.frame.arrays.followed
        if not followed or not np.any(followed.samples.quantum):
            return {}
        near, time, number, codes = nearest_tie(followed, self.march.frame.room.signals)
        return {"signal": self._model.sampled[number], "time": time, "quanta": 0.5 - near, "checksum": codes}

    @property
    def closed(self) -> list[str]:
        """Joints whose contacts are closed at the end of a march of one lane."""
        return self._named(self.march.frame.room.gaps.closed)

    @property
    def unclear(self) -> list[str]:
        """Joints and contacts whose forces, of several that move the machine differently, are a choice."""
        return self._named(self.march.frame.room.gaps.unclear)

    def _named(self, flags: Array) -> list[str]:
        names = (field.split(".")[1] for field in self._model.gap_fields)
        return list(dict.fromkeys(name for name, one in zip(names, flags, strict=True) if one != 0.0))

    @property
    def left(self) -> tuple[Array, Array, Array]:
        """Coordinates and rates at the last sampling time, and the turns of angle forces, of a march of one lane.

        Behind these are those of the measures of signals.
        """
        frame, n, signals = self.march.frame, self._model.unknowns, self._model.signals
        turns = np.append(frame.room.memory, frame.room.signals[: signals.measures.size if signals else 0])
        return frame.own.q[:n].copy(), frame.own.v[:n].copy(), turns

    def clear(self) -> None:
        """Make the room of the march as it was, but for the log of events, which is counted."""
        np.copyto(self._block[: self._start.size], self._start)

    def run(self, model: Model, part: slice, stop: Event | None = None) -> Marched:
        """The record of a march from the start of a model that differs in its start only; good until the next one.

        stop: as for `March`.
        """
        self.clear()
        if model is not self._model or part != self._part:
            frame = self.march.frame
            put_at_start(model, self._tile, part, frame.arrays, frame.room)
        self.march(stop)
        if self._sought is not None and self._sought.error is not None:
            raise self._sought.error
        return self.march.frame.record


def gathered(structure: T, last: Array | None = None) -> tuple[Array, T]:
    """One block of memory, and the structure with its arrays of real numbers copied into it, on lines of the cache.

    last: the array that comes last, of a multiple of a line
    """
    arrays = {id(array): array for array in _reals(structure)}
    if last is not None:
        arrays[id(last)] = arrays.pop(id(last))
    sizes = [-(-array.size // _LINE) * _LINE for array in arrays.values()]
    room = np.zeros(sum(sizes) + _LINE)
    first = -(room.ctypes.data // room.itemsize) % _LINE
    block, views, end = room[first : first + sum(sizes)], {}, 0
    for (key, array), size in zip(arrays.items(), sizes, strict=True):
        views[key] = block[end : end + array.size].reshape(array.shape)
        views[key][...] = array
        end += size
    return block, _replaced(structure, views)


def _reals(structure: Any) -> Iterator[Array]:
    if isinstance(structure, np.ndarray) and structure.dtype == float:
        yield structure
    elif isinstance(structure, tuple):
        for part in structure:
            yield from _reals(part)


def _replaced(structure: Any, views: dict[int, Array]) -> Any:
    if isinstance(structure, tuple):
        parts = [_replaced(part, views) for part in structure]
        return structure._make(parts) if hasattr(structure, "_make") else tuple(parts)
    return views.get(id(structure), structure)
