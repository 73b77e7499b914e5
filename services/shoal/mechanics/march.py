"""The time loop of one tile: sample, advance, account for power, look at energy and drift.

    march ── _sample ─ scheme.interpolate (the integrator's dense output)
          ── _advance ─ scheme.advance (the integrator's step) ─ kernels.acceleration ─ dynamics.accelerate ─ least
          ── _account ─ what loads, dampers and drives did in the step
          ── _look ─ kernels.energies, constraints.drift

An integrator's step stands in its own file; `integrators.scheme` calls it by its address. A step is cut
short where functions of time are not smooth (`halts`). The compiled loop runs for a fraction of a second at a time and
goes on where it has paused (`marched.Progress`), so that signals are heard and a hopeless run is ended.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numba import carray, njit, typeof, types

from shoal.compile import function_pointers, simd, structures
from shoal.compile.pointers import pointer, raw_type, shift
from shoal.compile.structures import Reference
from shoal.mechanics import constraints, gaps, kernels, lane_events, signals, switch_events
from shoal.mechanics import contact_events as events
from shoal.mechanics.derived import derive
from shoal.mechanics.dynamics import Work, instant, loaded, remember
from shoal.mechanics.halts import RESOLUTION, Halts, elongations, leapt
from shoal.mechanics.integrators.scheme import Scheme, advance, interpolate, restart
from shoal.mechanics.least.work import HERE
from shoal.mechanics.marched import (
    BEGUN,
    CUTS,
    DONE,
    ENDING,
    EVENT,
    HALT,
    NOW,
    NUMBER,
    ROOM,
    ROW,
    SAMPLE,
    SINCE,
    SWITCH,
    TAKEN,
    WAITS,
    WHOLE,
    Frame,
    LoopRoom,
    Marched,
    frame_type,
    framed,
    sampled,
)
from shoal.mechanics.model import Arrays, seen
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.signals import CHATTERS, switches_held

ASSEMBLY = 30
"""Iterations that may assemble a mechanism whose stated start is only roughly consistent."""
CHECKS = 64
"""Energy and drift are looked at about so many times in a run of fixed steps."""
CHECK_EVERY = 4
"""An adaptive run is looked at every so many steps, each of which is worth a dozen looks."""
PAUSE = 0.1
"""After about so long [s] the compiled loop returns: unnoticed by who waits, and beside it the return takes no time."""
CHATTER = 100.0
"""So many steps in a row within one that would else be taken, each ended by a switch, are no motion (OpenModelica)."""
SHORT = 1e-4
"""Implicit steps below this part of the fixed one are taken by Taylor's series: its error of a' h^3/6 is then 1e-12 of
that of the step, while accelerations as differences of places, round-off/h^2, would have lost eight digits."""
AIMS = 3
"""At most so often a step is aimed at an event: its dense output is of lower order than its end."""
ROUND_OFF = 2.0**-52
"""Of numbers."""
GROWTH = 4.0
"""Largest ratio of the numbers of steps until one return and until the next."""
CREEPING = 10.0
"""So much faster than now a run may become that is not given up: steps are a sixth of the next ones at most."""
SHARE = 0.01
"""The part of its steps over which a run is judged: a few are short wherever a singular position is passed."""
LOBATTO = 0.5 - 0.5 / np.sqrt(5.0)
"""Inner node of the four-point Lobatto rule on the unit interval, of order 6; its weights are 1/12 and 5/12."""


class March:
    """A march that is ready to run from the state in its frame's room, as often as that is put there.

    The compiled loop gets nothing but an address, at which the frame lies with pointers for its arrays.
    """

    def __init__(self, frame: Frame, seconds: float = PAUSE) -> None:
        """seconds: that a step takes, by order of magnitude."""
        self.frame, self._first = frame, PAUSE / seconds
        self.own_march: Callable[[int], March] | None = None
        self._storage = structures.storage()
        arrays = seen(frame.arrays)
        structures.write(arrays.storage, arrays)
        structures.write(frame.room.storage, frame.room)
        event = _first_event(frame) if arrays.gaps.size > 0 and len(frame.tile) == 1 else 0
        switch = _first_switch(frame) if switches_held(frame.arrays, frame.tile) else 0
        structures.write(self._storage, frame._replace(arrays=arrays, first_event=event, first_switch=switch))
        width = len(frame.tile)
        if width not in _LOOPS:
            _LOOPS[width] = function_pointers.address(loop, (frame_type(frame),))
        self._loop = _LOOPS[width]

    def __call__(self, stop: threading.Event | None = None) -> None:
        """Run; the record is in the frame, the state at the end in its room. Holds no lock of the interpreter.

        stop: raises KeyboardInterrupt once this is set, as a thread that waits for others does when it hears a signal.
        The end of the main thread, which hears signals, is heard as well.
        """
        progress = self.frame.own.progress
        steps, before, slow = self._first, (0.0, 0.0), False
        progress[:], self.frame.apart[:] = 0.0, 0
        while True:
            progress[ROOM], begin = max(1.0, steps), time.perf_counter()
            _call(self._loop, self._storage)
            if progress[DONE]:
                return
            if progress[WAITS]:
                self._give_marches()
                continue
            if (stop is not None and stop.is_set()) or not threading.main_thread().is_alive():
                raise KeyboardInterrupt
            now = progress[NOW], progress[NUMBER]
            if now[1] - before[1] >= SHARE * self.frame.steps:
                creeping, before = self._creeps(*before, *now), now
                if creeping and slow:
                    return
                slow = creeping
            steps = progress[ROOM] * min(GROWTH, PAUSE / (time.perf_counter() - begin))

    def _give_marches(self) -> None:
        """Give the lanes that come near events marches of their own."""
        for lane in np.flatnonzero(self.frame.room.gaps.alone[: self.frame.lanes]):
            found = self.frame.apart[lane_events.ADDRESSES * lane :][: lane_events.ADDRESSES]
            if not found[0]:
                assert self.own_march is not None
                found[:] = self.own_march(int(lane)).addresses

    @property
    def addresses(self) -> list[int]:
        """Addresses by which `lane_events` finds the march of one lane."""
        frame = self.frame
        visit = kernels.address(("visit", len(frame.tile)), lambda: lane_events.visit_kernel(frame))
        places = (array.ctypes.data for array in (self._storage, frame.record.samples, frame.record.contacts))
        return [visit, self._loop, *places]

    def _creeps(self, begin: float, first: float, now: float, number: float) -> bool:
        """Return whether a lane is at a singular position, and the run, if ten times as fast, would still not end."""
        frame = self.frame
        if not np.any(frame.room.gauss.near == HERE):
            return False
        rest, left = frame.own.progress[ENDING] - now, frame.steps - number
        return bool(CREEPING * left * (now - begin) < rest * (number - first))


_LOOPS: dict[int, int] = {}
"""Addresses of the compiled loops, by the width of a tile."""


def event_kernel(frame: Frame) -> kernels.Kernel:
    """Return the kernel that finds the first event within a step, for machines with contacts, with its types."""
    parts = frame.scheme, seen(frame.arrays), frame.room, frame.own
    number = types.float64
    kinds = typeof(frame.tile), *(Reference(raw_type(typeof(part))) for part in parts), number, number, number
    return events.first, kinds


def _first_event(frame: Frame) -> int:
    return kernels.address(("first event", len(frame.tile)), lambda: event_kernel(frame))


def switch_kernel(frame: Frame) -> kernels.Kernel:
    """Return the kernel that finds the first switch of signals within a step, with its types."""
    parts = frame.arrays.followed, frame.scheme, seen(frame.arrays), frame.room, frame.own
    kinds = typeof(frame.tile), *(Reference(raw_type(typeof(part))) for part in parts), types.float64, types.float64
    return switch_events.first, kinds


def _first_switch(frame: Frame) -> int:
    return kernels.address(("first switch", len(frame.tile)), lambda: switch_kernel(frame))


def march(*arguments: Any) -> Marched:
    """March once, with the arguments of `framed`."""
    ready = March(framed(*arguments))
    ready()
    return ready.frame.record


@njit(cache=True, nogil=True)
def _call(address: int, storage: Array) -> None:
    function_pointers.call(address, (pointer(storage),))


@njit(cache=True, error_model="numpy")
def loop(frame):  # type: ignore[no-untyped-def]
    """The march of a frame."""
    tile, scheme, m, w, k, record = frame.tile, frame.scheme, frame.arrays, frame.room, frame.own, frame.record
    step, steps, tolerance = frame.step, frame.steps, frame.tolerance
    times, marker_rows = carray(frame.times, frame.samples), carray(frame.marker_rows, frame.directed)
    stops, marks = carray(frame.halts.times, frame.stops), carray(frame.halts.marks, frame.marks)
    due = carray(frame.halts.due, frame.stops)
    halts = Halts(stops, frame.halts.start, marks, due, frame.halts.first)
    free, last, own = scheme.adaptive, halts.times.size - 1, k.progress
    if own[BEGUN] == 0.0:
        w.until[0] = np.nextafter(halts.times[0], 0.0) if last >= 0 else np.inf
        _begin(tile, m, w, k, record, marker_rows, tolerance, halts.first)
        own[BEGUN], own[TAKEN], own[WHOLE] = 1.0, step, 1.0
        own[ENDING] = times[-1] if free or (last >= 0 and halts.times[last] == times[-1]) else steps * step
    ending = own[ENDING]
    snap = RESOLUTION * ending
    check_every = CHECK_EVERY if free else max(1, steps // CHECKS)
    now, taken, number, cuts, whole = own[NOW], own[TAKEN], int(own[NUMBER]), int(own[CUTS]), own[WHOLE] > 0.0
    sample, halt, room = np.int64(own[SAMPLE]), int(own[HALT]), number + int(own[CUTS]) + int(own[ROOM])
    while True:
        slack, earlier = 1e-9 * (taken if free else step), sample
        while sample < len(times) and times[sample] <= now + slack:
            _sample(tile, scheme, m, w, k, marker_rows, times[sample] - now, taken, slack, record.samples, sample)
            _keep_contacts(tile, m, w, record, sample, False)
            if frame.outputs > 0:
                kept = shift(record.signals, sample * frame.outputs * len(tile))
                signals.follow(tile, m, w, instant(w, times[sample]), k.q, k.v, kept, signals.RECORD)
            sample += 1
        if frame.lanes > 0 and sample > earlier:
            lane_events.take_samples(tile, m, w, record, frame.apart, frame.lanes, marker_rows, earlier, sample)
        if own[SWITCH] > 0.0:
            own[SWITCH] = 0.0
            signals.follow(tile, m, w, now, w.z, w.zdot, w.z, signals.TURN)
            _leave_halt(tile, scheme, m, w, k, now, tolerance, record.energy_scale)
            own[SINCE] = now if own[ROW] == 0.0 else own[SINCE]
            own[ROW] += 1.0
            if own[ROW] >= CHATTER:
                _end_chatter(tile, m, w, now)
        if own[EVENT] > 0.0:
            own[EVENT] = 0.0
            _leave_event(tile, scheme, m, w, k, now, tolerance, record.energy_scale)
            if sample > 0 and abs(times[sample - 1] - now) <= slack:
                _keep_contacts(tile, m, w, record, sample - 1, True)
        own[DONE] = 1.0 if number == steps or now >= ending else own[DONE]
        if own[DONE] > 0.0 or number + cuts >= room:
            break
        jumps = halt <= last and now == halts.times[halt]
        if jumps:
            asked = halts.due[halt]
            halt += 1
            w.until[0] = np.nextafter(halts.times[halt], 0.0) if halt <= last else np.inf
            if asked != 0:
                signals.follow(tile, m, w, now, w.z, w.zdot, w.z, signals.SAMPLE + signals.PARTS * asked)
            if frame.first_switch != 0:
                signals.follow(tile, m, w, now, w.z, w.zdot, w.z, signals.SETTLE)
            _leave_halt(tile, scheme, m, w, k, now, tolerance, record.energy_scale)
            if m.gaps.size > 0 and len(tile) == 1 and events.jumped(tile, m, w) > 0.0:
                _leave_event(tile, scheme, m, w, k, now, tolerance, record.energy_scale)
        target = ending if free else min((number + 1) * step, ending)
        halted = halt <= last and halts.times[halt] <= target + snap
        if halted:
            target = halts.times[halt]
        rest = step if whole and not (free or halted) else target - now
        sampling = sample < len(times) and (free or times[sample] < now + step * (1 - 1e-9))
        begin, before, complete = now, number, whole
        finders = frame.first_event, frame.first_switch
        short = SHORT * step if scheme.divides else 0.0
        if own[WAITS] > 0.0:
            taken, own[WAITS] = own[WAITS], 0.0
        else:
            taken = _advance(tile, scheme, m, w, k, halts, finders, now, rest, snap, short, tolerance, sampling)
            if frame.lanes > 0:
                lane_events.approach(tile, m, w, taken)
                if lane_events.lacks(w, frame.apart, frame.lanes):
                    own[WAITS] = taken
                    break
        if own[SWITCH] == 0.0 or now + taken - own[SINCE] > step:
            own[ROW] = 0.0
        arrived = taken >= rest
        if free:
            number += 1
            now = target if arrived else now + taken
        else:
            # Fixed steps are counted, not summed, so that requested times fall on steps exactly.
            grid = (number + 1) * step
            whole = arrived and (not halted or abs(grid - target) <= snap)
            now = (target if halted else grid) if arrived else now + taken
            number += 1 if whole else 0
            cuts += 0 if whole else 1
        if frame.lanes > 0:
            lane_events.meet(
                tile, m, w, k, record, frame.apart, frame.lanes, begin, now, before, complete, sample, halt, jumps
            )
        remember(tile, m, w)
        _count_turns(tile, m, w, k, marker_rows)
        if loaded(m):
            _account(tile, scheme, m, w, k, begin, taken, tolerance)
        if frame.lanes > 0:
            lane_events.account(tile, w, k)
        due = (number + cuts) % check_every == 0 or number == steps or now >= ending
        if due and not _look(tile, m, w, k, now, record):
            own[DONE] = 1.0
            break
    own[NOW], own[TAKEN], own[NUMBER], own[CUTS], own[WHOLE] = now, taken, number, cuts, 1.0 if whole else 0.0
    own[SAMPLE], own[HALT] = sample, halt
    for lane in range(len(tile)):
        record.steps[lane] = number + cuts
        record.evaluations[lane] = scheme.evaluations[0]
        record.reached[lane], record.closeness[lane] = now, w.gauss.closeness[lane]
        record.singular[lane] = w.gauss.near[lane]
    for i in range(3 * len(tile)):
        record.ended[i] = w.gauss.ended[i]


@njit(cache=True, error_model="numpy")
def _begin(
    tile: Tile, m: Arrays, w: Work, k: LoopRoom, record: Marched, marker_rows: Index, tolerance: float, due: int
) -> None:
    """Make the start consistent and keep it, find its acceleration, its energy and the sides of the directions.

    due: samples that are taken at the start.
    """
    end = m.unknowns * len(tile)
    kernels.settle(tile, m, w, 0.0, tolerance, ASSEMBLY)
    if m.table.signals != 0:
        if due != 0:
            kernels.acceleration(tile, m, w, 0.0, w.z, w.zdot, tolerance, w.a)
            signals.follow(tile, m, w, 0.0, w.z, w.zdot, w.z, signals.SAMPLE + signals.PARTS * due)
        signals.follow(tile, m, w, 0.0, w.z, w.zdot, w.z, signals.SETTLE)
    for i in range(end):
        record.begin[i], record.begin[end + i] = w.z[i], w.zdot[i]
    kernels.acceleration(tile, m, w, 0.0, w.z, w.zdot, tolerance, w.a)
    for lane in range(len(tile)):
        k.last_power[lane] = w.power[lane]
    for i in range(end):
        if not np.isfinite(w.a[i]) and w.gauss.ended[i % len(tile)] < 0.0:
            w.gauss.ended[i % len(tile)] = 0.0
    _energy(tile, m, w, k.start, record.energy_scale)
    _count_turns(tile, m, w, k, marker_rows)
    for i in range(marker_rows.size // (2 * m.dimensions) * len(tile)):
        k.turns[i] = 0.0
    if m.gaps.size > 0 and len(tile) == 1:
        k.progress[EVENT] = events.touching(tile, m, w)
    elif m.gaps.size > 0:
        events.begin(tile, m, w)


@njit(cache=True, error_model="numpy")
def _sample(
    tile: Tile,
    scheme: Scheme,
    m: Arrays,
    w: Work,
    k: LoopRoom,
    marker_rows: Index,
    ahead: float,
    taken: float,
    slack: float,
    samples: Array,
    sample: int,
) -> None:
    """The markers at a time that is `ahead` [s] of the end of the last step, of length `taken`."""
    width, d = len(tile), m.dimensions
    inside = abs(ahead) > slack
    if not inside:
        for i in range(m.unknowns * width):
            k.q[i], k.v[i] = w.z[i], w.zdot[i]
    else:
        interpolate(tile, scheme, m, w, k.past, 1.0 + ahead / taken, taken, k.q, k.v)
    derive(tile, m.derived, k.q, m.unknowns, m.rows, False)
    derive(tile, m.derived, k.v, m.unknowns, m.rows, True)
    markers = marker_rows.size // (2 * d)
    for marker in range(markers):
        first = sampled(d) * (sample * markers + marker) * width
        rows = 2 * d * marker
        for row in range(2 * d):
            source = marker_rows[rows + row] * width
            for lane in range(width):
                samples[first + row * width + lane] = k.q[source + lane]
                if row < d:
                    samples[first + (2 * d + 1 + row) * width + lane] = k.v[source + lane]
        for lane in range(width):
            x_row, y_row = marker_rows[rows + d] * width + lane, marker_rows[rows + d + 1] * width + lane
            x, y = k.q[x_row], k.q[y_row]
            turns = k.turns[marker * width + lane]
            if inside:
                turns += np.arctan2(w.z[y_row], w.z[x_row]) - np.arctan2(y, x)
            samples[first + 2 * d * width + lane] = turns
            samples[first + (3 * d + 1) * width + lane] = (x * k.v[y_row] - y * k.v[x_row]) / (x * x + y * y)


@njit(cache=True, error_model="numpy", forceinline=True)
def _keep_contacts(tile: Tile, m: Arrays, w: Work, record: Marched, sample: int, at_event: bool) -> None:
    """Keep what the contacts do at a sample, or from it on where it is at an event."""
    if m.gaps.size > 0:
        gaps.keep(tile, m.gaps, w.gaps, at_event, record.contacts, sample * m.gaps.size * gaps.KEPT * len(tile))


@njit(cache=True, error_model="numpy")
def _leave_halt(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, now: float, tolerance: float, scale: Array
) -> None:
    """Go on from a time at which forces or driven rates jump: these are taken up at once, for what energy it takes."""
    restart(scheme)
    if m.driven:
        _energy(tile, m, w, k.energy, scale)
        kernels.meet(tile, m, w, now, tolerance)
        for lane in range(len(tile)):
            k.dissipated[lane] += k.energy[lane]
        _energy(tile, m, w, k.energy, scale)
        for lane in range(len(tile)):
            k.dissipated[lane] -= k.energy[lane]
    if m.gaps.size > 0:
        kernels.look(tile, m, w, w.z, w.zdot)
    kernels.acceleration(tile, m, w, now, w.z, w.zdot, tolerance, w.a)
    for lane in range(len(tile)):
        k.last_power[lane] = w.power[lane]


@njit(cache=True, error_model="numpy")
def _leave_event(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, now: float, tolerance: float, scale: Array
) -> None:
    """Go on from an event of contacts: an impact takes its energy."""
    restart(scheme)
    _energy(tile, m, w, k.energy, scale)
    for lane in range(len(tile)):
        k.dissipated[lane] += k.energy[lane]
    kernels.decide(tile, m, w, now, tolerance)
    kernels.look(tile, m, w, w.z, w.zdot)
    _energy(tile, m, w, k.energy, scale)
    for lane in range(len(tile)):
        k.dissipated[lane] -= k.energy[lane]
        k.last_power[lane] = w.power[lane]


@njit(cache=True, error_model="numpy", forceinline=True)
def _advance(
    tile: Tile,
    scheme: Scheme,
    m: Arrays,
    w: Work,
    k: LoopRoom,
    halts: Halts,
    finders: tuple[int, int],
    now: float,
    rest: float,
    snap: float,
    short: float,
    tolerance: float,
    keep: bool,
) -> float:
    """One step of at most `rest` [s], shorter where it would leap over a part of a force law; returns its length.

    finders: addresses of `event_kernel` and `switch_kernel`. short: below it a step is but a Taylor series [s]. keep:
    whether the motion inside it will be needed.
    """
    end = m.unknowns * len(tile)
    watched, touches = halts.marks.size > 0, m.gaps.size > 0 and len(tile) == 1
    first_event, first_switch = finders
    if keep or watched or m.gaps.size > 0 or first_switch != 0 or (scheme.adaptive and loaded(m)):
        for i in range(end):
            k.past[i], k.past[end + i], k.past[2 * end + i] = w.z[i], w.zdot[i], w.a[i]
    if watched:
        derive(tile, m.derived, w.z, m.unknowns, m.force_rows, False)
        elongations(tile, m.forces, w.z, w.memory, w.element, k.elongation)
    taken, aims, turns = float(rest), 0, False
    if touches:
        events.proceed(tile, m, w)
    while True:
        asked = taken
        if asked > short:
            taken = advance(tile, scheme, m, w, now, asked)
        else:
            _extrapolate(tile, scheme, m, w, now, asked, tolerance)
        again, aims, turns = taken, aims if taken >= asked else 0, turns and taken >= asked
        if watched and taken > snap:
            derive(tile, m.derived, w.z, m.unknowns, m.force_rows, False)
            if leapt(tile, m.forces, halts, k.elongation, w.z, w.memory, w.element):
                again, aims = 0.5 * taken, 0
        if touches and again == taken:
            if aims == 0:
                power = w.power[0]  # at the end of the step, where looking inside it leaves another
                arguments = (scheme, m, w, k, now, taken, tolerance)
                found = function_pointers.ask(first_event, (tile, *arguments))
                w.power[0] = power
                if found <= 1.0:
                    again, aims = found * taken, 1
            elif aims <= AIMS:
                late = min(events.miss(tile, m, w, taken), rest - taken)
                if abs(late / taken) ** 3 > ROUND_OFF:
                    again, aims = taken + late, aims + 1
                elif late != 0.0:
                    events.move(tile, scheme, m, w, k, taken, late)
                    again, taken = taken + late, taken + late
        if first_switch != 0 and again == taken and not turns:
            power = w.power[0]  # as for contacts
            found = function_pointers.ask(first_switch, (tile, m.signals, scheme, m, w, k, now, taken))
            w.power[0] = power
            if found <= 1.0:
                again, turns = max(found * taken, snap), True
        if again == taken:
            if first_switch != 0:
                k.progress[SWITCH] = 1.0 if turns else 0.0
            if touches:
                k.progress[EVENT] = 1.0 if aims > 0 else 0.0
            return taken
        for i in range(end):
            w.z[i], w.zdot[i], w.a[i] = k.past[i], k.past[end + i], k.past[2 * end + i]
        if touches and aims <= 1:
            events.begin(tile, m, w)
        restart(scheme)
        taken = again


@njit(cache=True, error_model="numpy")
def _extrapolate(tile: Tile, scheme: Scheme, m: Arrays, w: Work, now: float, h: float, tolerance: float) -> None:
    """Take a step of h [s] by the Taylor series of the motion, from its acceleration."""
    for i in range(m.unknowns * len(tile)):
        w.z[i] += h * (w.zdot[i] + 0.5 * h * w.a[i])
        w.zdot[i] += h * w.a[i]
    restart(scheme)
    kernels.acceleration(tile, m, w, now + h, w.z, w.zdot, tolerance, w.a)


@njit(cache=True, error_model="numpy")
def _end_chatter(tile: Tile, m: Arrays, w: Work, now: float) -> None:
    """End a motion in which signals switch for ever within one step."""
    for lane in range(len(tile)):
        if w.gauss.ended[lane] < 0.0:
            w.gauss.ended[lane], w.gauss.ended[2 * len(tile) + lane] = now, CHATTERS
    for i in range(m.unknowns * len(tile)):
        w.z[i] = np.nan


@njit(cache=True, error_model="numpy", forceinline=True)
def _account(
    tile: Tile, scheme: Scheme, m: Arrays, w: Work, k: LoopRoom, begin: float, taken: float, tolerance: float
) -> None:
    """Add what was dissipated less what was supplied in the step [J]: its mean power, or a quadrature over it."""
    width, free = len(tile), scheme.adaptive
    for lane in range(width):
        k.power[lane] = w.power[lane]
    if free:
        for x in (LOBATTO, 1.0 - LOBATTO):
            interpolate(tile, scheme, m, w, k.past, x, taken, k.q, k.v)
            if m.driven or m.rubbing.size > 0 or m.gaps.tangents > 0 or m.gives:
                kernels.acceleration(tile, m, w, begin + x * taken, k.q, k.v, tolerance, w.stage)
            else:
                kernels.force(tile, m, w, begin + x * taken, k.q, k.v, w.stage)
            for lane in range(width):
                k.dissipated[lane] += taken * 5.0 / 12.0 * w.power[lane]
    weight = 1.0 / 12.0 if free else 0.5
    for lane in range(width):
        other = k.power[lane] if scheme.averages else k.last_power[lane]
        k.dissipated[lane] += weight * taken * (other + k.power[lane])
        k.last_power[lane] = k.power[lane]


@njit(cache=True, error_model="numpy")
def _look(tile: Tile, m: Arrays, w: Work, own: LoopRoom, now: float, record: Marched) -> bool:
    """Keep the largest errors of energy and constraints; false if no lane is a number anymore."""
    _energy(tile, m, w, own.energy, record.energy_scale)
    derive(tile, m.derived, w.z, m.unknowns, m.held_rows, False)
    constraints.drift(tile, m.constraints, m.functions, now, w.z, own.gap, record.drift)
    width, c, alive = len(tile), m.constraints, False
    for k in range(c.size * width):
        if abs(own.gap[k]) > c.open[k] and w.gauss.ended[k % width] < 0.0:
            w.gauss.ended[k % width], w.gauss.ended[width + k % width] = now, k // width
    for lane in range(width):
        error = abs(own.energy[lane] + own.dissipated[lane] - own.start[lane])
        if not error <= record.energy_error[lane]:
            record.energy_error[lane] = error
        if not np.isfinite(error) and w.gauss.ended[lane] < 0.0:
            w.gauss.ended[lane] = now
        alive = alive or np.isfinite(error)
    return alive


@njit(cache=True, error_model="numpy", forceinline=True)
def _count_turns(tile: Tile, m: Arrays, w: Work, k: LoopRoom, marker_rows: Index) -> None:
    """Add 2 pi to the turns where a marker's direction has passed the negative x axis."""
    width, d = len(tile), m.dimensions
    for marker in range(marker_rows.size // (2 * d)):
        rows = marker_rows[2 * d * marker + d], marker_rows[2 * d * marker + d + 1]
        for row in rows:
            if row >= m.held_rows:
                derive(tile, m.derived, w.z, row, row + 1, False)
        at, left = marker * width, 1.0 - simd.heaviside(simd.load(tile, w.z, rows[0] * width))
        above = simd.heaviside(simd.load(tile, w.z, rows[1] * width))
        simd.add_to(k.turns, at, (2.0 * np.pi) * left * (simd.load(tile, k.above, at) - above))
        simd.store(k.above, at, above)


@njit(cache=True, error_model="numpy")
def _energy(tile: Tile, m: Arrays, w: Work, total: Array, scale: Array) -> None:
    """Energy of the state [J], and the largest kinetic and elastic one so far.

    The potential of springs may be negative, such as that of a constant force: its size counts.
    """
    width = len(tile)
    kernels.energies(tile, m, w)
    for lane in range(width):
        kinetic, elastic, bodies = w.energy[lane], w.energy[width + lane], w.energy[3 * width + lane]
        total[lane] = kinetic + elastic + w.energy[2 * width + lane]
        moving = kinetic + bodies + abs(elastic - bodies)
        if not moving <= scale[lane]:
            scale[lane] = moving
