"""Data of the time loop: its input (`Frame`), its state and its record."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit, typeof

from shoal.compile.pointers import raw_type
from shoal.compile.structures import Reference
from shoal.mechanics import constraints
from shoal.mechanics.dynamics import Work
from shoal.mechanics.gaps import KEPT
from shoal.mechanics.halts import Halts
from shoal.mechanics.integrators.scheme import Scheme
from shoal.mechanics.model import Arrays, seen
from shoal.mechanics.numerics.tile import Array, Index, Tile

TURN = 2.0 * np.pi

BEGUN, DONE, ROOM, NOW, ENDING, TAKEN, WHOLE, NUMBER, CUTS, SAMPLE, HALT, EVENT, SWITCH, ROW, SINCE, WAITS = range(16)
"""Progress of the loop: whether it has begun and is done; after how many more steps it returns; the time that it has
reached and at which it ends [s]; the length of the last step [s], and whether that led to a whole step of a fixed
length; the numbers of whole steps, of others, of samples and of halts so far; and whether the last step ended at an
event of a contact, or where signals switch; and how many steps in a row did that, since when [s]; the
length of a step that waits for lanes that meet events by themselves [s]."""
PROGRESS = 16
_NONE: Index = np.zeros(0, dtype=np.int64)


class Marched(NamedTuple):
    """Record of the time loop. samples: (times * markers * sampled(d), lanes), see `sampled`; the rest: (lanes,).

    energy_error: largest |E + dissipated - E(0)| [J]; energy_scale: largest energy in motion [J], kinetic, of bent
    bodies and the size of that of springs; drift: largest violation of a constraint by its power of a length, (POWERS *
    lanes,); contacts: see `gaps.keep`, (times * contacts * KEPT, lanes); signals: those
    recorded, (times * outputs, lanes); begin: coordinates and rates at the start,
    made consistent, (2 * unknowns, lanes); ended, closeness, singular: as in `GaussWork` (near), (3 * lanes,) and
    (lanes,). Common to the lanes of a tile: steps taken, evaluations of the forces, the time reached [s].
    """

    samples: Array
    energy_error: Array
    energy_scale: Array
    drift: Array
    contacts: Array
    signals: Array
    begin: Array
    ended: Array
    closeness: Array
    singular: Array
    steps: Array
    evaluations: Array
    reached: Array


class LoopRoom(NamedTuple):
    """State of the loop between steps.

    past: coordinates, rates and accelerations at the beginning of the step, (3 * unknowns, lanes). q, v, a: the motion
    inside it, (rows, lanes). turns [rad], above: whole turns of every marker's direction, and on which side of the x
    axis it was, (markers, lanes). energy, start, dissipated [J], power, last_power [W]: (lanes,). gap, elongation: by
    constraint and by force element. progress: where the loop goes on, see `BEGUN`.
    """

    past: Array
    q: Array
    v: Array
    a: Array
    turns: Array
    above: Array
    energy: Array
    start: Array
    dissipated: Array
    power: Array
    last_power: Array
    gap: Array
    elongation: Array
    progress: Array


@njit(cache=True)
def sampled(dimensions: int) -> int:
    """Numbers in the sample of a marker.

    Its point, its direction, the turns [rad] that bring the angle of that near the continuous one, its velocity [m/s]
    and the rate of its direction [rad/s].
    """
    return 3 * dimensions + 2


def rooms(tile: Tile, arrays: Arrays, times: int, marker_rows: Index) -> tuple[Marched, LoopRoom]:
    """An empty record, and the room of the loop."""
    width, dimensions = len(tile), arrays.dimensions
    end, rows = arrays.unknowns * width, arrays.rows * width
    markers = marker_rows.size // (2 * dimensions)
    record = Marched(
        np.full(times * sampled(dimensions) * markers * width, np.nan),
        np.zeros(width),
        np.zeros(width),
        np.zeros(constraints.POWERS * width),
        np.full(times * arrays.gaps.size * KEPT * width, np.nan),
        np.full(times * (arrays.followed.outputs if arrays.followed else 0) * width, np.nan),
        np.zeros(2 * end),
        np.zeros(3 * width),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
    )
    room = LoopRoom(
        np.empty(3 * end),
        np.zeros(rows),
        np.zeros(rows),
        np.zeros(rows if arrays.gaps.size else 0),
        np.zeros(markers * width),
        np.zeros(markers * width),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
        np.zeros(width),
        np.empty(arrays.constraints.size * width),
        np.zeros(arrays.forces.size * width),
        np.zeros(PROGRESS),
    )
    return record, room


class Frame(NamedTuple):
    """Input of the time loop for one tile.

    step: [s], of schemes of fixed step, which take `steps` of them; adaptive ones end at the last of the times and take
    at most that number. times: at which the marker rows are sampled [s], increasing, `samples` of them; directed:
    number of marker rows; halts: where steps end, `stops` times and `marks` marks; there forces may jump, and driven
    constraints their rates. tolerance: from which rows count as dependent. first_event: address of the kernel of
    `contact_events.first`, 0 for machines without contacts; first_switch: of `switch_events.first`, 0 where no signal
    switches. outputs: number of signals that are recorded. apart: addresses of lanes that meet events of contacts by
    themselves, of so many `lanes`, see `lane_events`. What is not reached stays nan in the record.
    """

    tile: Tile
    scheme: Scheme
    arrays: Arrays
    room: Work
    own: LoopRoom
    record: Marched
    step: float
    steps: int
    times: Array
    samples: int
    marker_rows: Index
    directed: int
    halts: Halts
    stops: int
    marks: int
    tolerance: float
    first_event: int = 0
    first_switch: int = 0
    outputs: int = 0
    apart: Index = _NONE
    lanes: int = 0


def framed(
    tile: Tile,
    scheme: Scheme,
    arrays: Arrays,
    room: Work,
    step: float,
    steps: int,
    times: Array,
    marker_rows: Index,
    tolerance: float,
    halts: Halts,
) -> Frame:
    """The frame of a march from the state in `room`, with an empty record."""
    record, own = rooms(tile, arrays, len(times), marker_rows)
    sizes = len(times), marker_rows.size, halts.times.size, halts.marks.size
    samples, directed, stops, marks = sizes
    outputs = arrays.followed.outputs if arrays.followed else 0
    return Frame(
        tile, scheme, arrays, room, own, record, step, steps, times, samples,
        marker_rows, directed, halts, stops, marks, tolerance, outputs=outputs,
    )  # fmt: skip


def frame_type(frame: Frame) -> Any:
    """The compiler's type of a frame's place in memory, which takes a millisecond to find."""
    return Reference(raw_type(typeof(frame._replace(arrays=seen(frame.arrays)))))


FARTHEST, ENERGY_DRIFT, CONSTRAINT_DRIFT, ENERGY_SCALE = range(4)
STEPS, EVALUATIONS, REACHED, ENDED, UNCLOSED, CLOSENESS, SINGULAR, UNDECIDED = range(4, 12)
"""Rows of the numbers that a run is judged by: the largest distance of a marker from its nearest anchor [m]; the energy
error over the largest energy in motion; the largest violation of a constraint, relative to the machine's size;
and as `Marched` has them."""
NUMBERS = 12


@njit(cache=True, error_model="numpy")
def reduce_record(
    record: Marched,
    width: int,
    first: int,
    turns: Array,
    anchors: Array,
    floor: float,
    span: float,
    motion: Array,
    numbers: Array,
) -> None:
    """Reduce the record of a tile of a width to results of its lanes, the first of which is lane `first` of all.

    turns: of the stated directions of the markers [rad], (markers, lanes) or (markers, 1). anchors: on the ground,
    (anchors, d, lanes) or (anchors, d, 1). floor: no energy error is compared with less [J]; span: the machine's size
    [m]. motion, of all lanes: points, continuous angles [rad], velocities and rates of the markers, (times, markers,
    2 d + 2, lanes); numbers: (NUMBERS, lanes).
    """
    times, markers, rows, lanes = motion.shape
    d = rows // 2 - 1
    for lane in range(first, min(first + width, lanes)):
        own, turn, at = lane - first, lane % turns.shape[1], lane % anchors.shape[2]
        farthest = 0.0
        for k in range(times * markers):
            time, marker = k // markers, k % markers
            row = k * sampled(d) * width + own
            x, y = record.samples[row], record.samples[row + width]
            near = np.inf
            for anchor in range(len(anchors)):
                distance = np.hypot(x - anchors[anchor, 0, at], y - anchors[anchor, 1, at])
                for i in range(2, d):
                    distance = np.hypot(distance, record.samples[row + i * width] - anchors[anchor, i, at])
                near = near if distance > near else distance
            farthest = _larger(farthest, near)
            for i in range(d):
                motion[time, marker, i, lane] = record.samples[row + i * width]
                motion[time, marker, d + 1 + i, lane] = record.samples[row + (2 * d + 1 + i) * width]
            angle = np.arctan2(record.samples[row + (d + 1) * width], record.samples[row + d * width])
            angle += TURN * np.rint(record.samples[row + 2 * d * width] / TURN)
            motion[time, marker, d, lane] = angle + turns[marker, turn]
            motion[time, marker, 2 * d + 1, lane] = record.samples[row + (3 * d + 1) * width]
        drift, size = 0.0, 1.0
        for power in range(constraints.POWERS):
            drift = _larger(drift, record.drift[power * width + own] / size)
            size *= span
        numbers[FARTHEST, lane], numbers[CONSTRAINT_DRIFT, lane] = farthest, drift
        numbers[ENERGY_DRIFT, lane] = record.energy_error[own] / _larger(record.energy_scale[own], floor)
        numbers[ENERGY_SCALE, lane], numbers[STEPS, lane] = record.energy_scale[own], record.steps[own]
        numbers[EVALUATIONS, lane], numbers[REACHED, lane] = record.evaluations[own], record.reached[own]
        numbers[ENDED, lane], numbers[UNCLOSED, lane] = record.ended[own], record.ended[width + own]
        numbers[CLOSENESS, lane], numbers[SINGULAR, lane] = record.closeness[own], record.singular[own]
        numbers[UNDECIDED, lane] = record.ended[2 * width + own]


@njit(cache=True, error_model="numpy")
def _larger(a: float, b: float) -> float:
    """The larger of two numbers, or what of them is none."""
    return b if b > a or b != b else a
