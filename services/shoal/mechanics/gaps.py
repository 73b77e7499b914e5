"""Contacts of a machine: one-sided limits of measures, dry friction along measures, and pairs of surfaces.

Each has a normal direction, along which its gap g >= 0 closes, and where it rubs one tangent in the plane and two in
space, along which it slips. Dry friction of a joint has no gap: it is closed for ever.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numba import njit

from shoal.mechanics import forces, pairs
from shoal.mechanics.forces import ANGLE, DISTANCE, LAW, NATURAL, Forces
from shoal.mechanics.numerics.tile import Array, Index, Tile
from shoal.mechanics.pairs import PROFILE, Pairs

LIMIT, DRY, PAIR = 0, 1, 2
"""Kinds of contacts: a limit of a measure, dry friction of a given force along a measure, two surfaces."""
RIGID, GIVES = 0, 1
"""Whether a contact is rigid, or gives way by a law of its force."""
STIFFNESS, EXPONENT, DAMPING, LOSS, VISCOSITY = range(5)
LAW_SIZE = 5
FEW = 3 * 3 + 4 * 3
"""Numbers of room for the equations of one contact: matrix, right side, solution, scale and order."""
PLANE = 2
"""Directions of a contact with one tangent."""
STICK, SLIP = 1.0, 2.0
"""Modes of closed contacts that rub."""
HIT, LIFT, SLIDE, STOP, PASS = 1.0, -1.0, 2.0, 3.0, 5.0
"""Events: a gap closes, a contact opens, one that sticks begins to slip, a slip ends."""


class Gaps(NamedTuple):
    """Contacts of one tile.

    tangents: slip directions of each, 0 where none rubs. kind, number: what it is, and its number among the pairs, or
    that of the first of its measures; last: that after the last of them. rubs: whether it has friction. rolls: whether
    it sticks whatever the force. measures: what is limited, less the limit as their natural values, or slips; weight:
    of each in the sum that is a gap, (measures, lanes), so 1 of a lower limit and of friction, -1 of an upper limit.
    restitution, tangential: rate after an impact over the rate before, with the opposite sign (Newton), along the
    normal and of stick. mu, mu_static: coefficients of friction in slip and of the limit of stick; given: friction that
    no normal force causes [N or N m]; share: of dry friction in a joint, per force of the joint [1 or m]. These are
    (contacts, lanes). held, parts: the first constraint of that joint, and how many make up its force. soft: RIGID, or
    that the force along the normal is that of a law, see `press`, with five numbers in law, (5 * contacts, lanes).
    resolution: gaps below this are closed, [m or rad].
    """

    size: int
    tangents: int
    kind: Index
    number: Index
    last: Index
    rubs: Index
    rolls: Index
    measures: Forces
    pairs: Pairs
    weight: Array
    restitution: Array
    tangential: Array
    mu: Array
    mu_static: Array
    given: Array
    share: Array
    held: Index
    parts: Index
    soft: Index
    law: Array
    resolution: float


class GapWork(NamedTuple):
    """Work space of one tile, by contact and lane unless stated. A direction is the normal or a tangent of a contact.

    memory: the continuous angles of angular measures. value, rate: g [m or rad] and its rate; margin: of a contact that
    slips the slip along `heading`, of one that sticks what is left to the limit of its friction. anchor: where a joint
    sticks by dry friction [rad or m]; its value is the way from there. speed: at which one that gives way was met
    [m/s]. feature: of the outline of the second body, `kept` while the contact is closed; left: the way to its end [m],
    onward: where that leads to (`profiles.touch`). before: value, rate, force, margin and left at the beginning of a
    step, (5 * contacts, lanes). closed: whether the contact is closed, unclear: whether its force was not unique at any
    time, in a way that moves the machine, mode: whether it sticks or slips; hit: what event of it a step has ended at;
    looked: whether it is looked at within a step; impulse: at the last event; given: friction that no normal force
    causes, with what joint forces allow. force: multiplier by direction, of a closed contact along the normal not
    negative [N or N m]; near: those of the last decision; dips: whether it, or the margin, was negative anywhere in the
    step. slip, bias: rate of each direction, and its derivative for accelerations of zero. heading: direction of slip,
    of one tangent its sign along it, of two in the axes of the ground as it was at the beginning of the step, (3 *
    contacts, lanes); axes: normal and tangents, (9 * contacts, lanes). gradient, response: of each direction, and the
    acceleration by a unit force, (directions * unknowns, lanes). none: the acceleration without forces, unit: a unit
    force, (rows, lanes). reaction: multipliers of the constraints: without forces, by a unit force of each direction,
    and as they are, ((directions + 2) * constraints, lanes). matrix, load, found, way, chosen: of one lane;
    few: of one contact. pair:
    `pairs.describe`. order: of the last impact, how far the impulses of contacts that strike one after the other would
    be from those at once, (lanes,). log: time, contact, kind, impulse and `order` of each event of the first lane,
    (RECORD * LOGGED,); number: of events, decisions: times at which contacts were decided on, alone: whether a lane of
    a tile of several takes steps by itself (`lane_events`), (lanes,), apart: what it has dissipated [J] and its power
    [W], (2 * lanes,).
    """

    memory: Array
    value: Array
    rate: Array
    margin: Array
    anchor: Array
    speed: Array
    feature: Array
    kept: Array
    left: Array
    onward: Array
    before: Array
    closed: Array
    unclear: Array
    mode: Array
    hit: Array
    looked: Array
    impulse: Array
    given: Array
    force: Array
    near: Array
    dips: Array
    slip: Array
    bias: Array
    heading: Array
    axes: Array
    gradient: Array
    response: Array
    none: Array
    unit: Array
    reaction: Array
    matrix: Array
    load: Array
    found: Array
    way: Array
    chosen: Array
    few: Array
    pair: Array
    order: Array
    log: Array
    number: Array
    decisions: Array
    alone: Array
    apart: Array


LOGGED, RECORD = 4096, 5
"""So many events of the first lane are kept, of so many numbers each."""
KEPT = 11
"""Numbers of the state of a contact: closed, mode, speed, feature, kept, three of heading, three of near."""


def room(width: int, g: Gaps, unknowns: int, rows: int, constraints: int) -> GapWork:
    """Work space as arrays."""
    n = g.size
    ways = n * (1 + g.tangents)
    each, whole, reaction = n * width, rows * width if n else 0, (ways + 2) * constraints * width if n else 0
    vectors, by_way = ways * unknowns * width, ways * width
    sizes = {
        "memory": g.measures.size * width, "before": 5 * each, "force": by_way, "near": by_way, "slip": by_way,
        "bias": by_way,
        "heading": 3 * each, "axes": 9 * each, "gradient": vectors, "response": vectors, "none": whole, "unit": whole,
        "reaction": reaction, "matrix": ways * ways, "load": ways, "found": ways, "way": ways, "chosen": n,
        "few": FEW if n else 0,
        "pair": pairs.ROOM if g.pairs.size else 0, "order": width if n else 0, "log": RECORD * LOGGED if n else 0,
        "number": width if n else 0, "decisions": width if n else 0, "alone": width if n else 0,
        "apart": 2 * width if n else 0,
    }  # fmt: skip
    work = GapWork._make([np.zeros(sizes.get(name, each)) for name in GapWork._fields])
    return work._replace(given=np.array(g.given, dtype=float).ravel())


def enter(gaps: Gaps, g: GapWork, kept: Array) -> None:
    """Put the state of the contacts of a single lane, (contacts, KEPT), back into its work space, see `keep`."""
    g.closed[:], g.mode[:], g.speed[:], g.feature[:], g.kept[:] = kept[:, :5].T
    g.heading[:] = kept[:, 5:8].ravel()
    g.near[:] = kept[:, 8 : 9 + gaps.tangents].ravel()


def shifted(gaps: Gaps, shifts: Mapping[int, float]) -> Gaps:
    """Return the contacts with less of a gap [m or rad], by the contact's number."""
    law, radius = gaps.measures.law.copy(), gaps.pairs.radius.copy()
    for contact, shift in shifts.items():
        number = int(gaps.number[contact])
        if gaps.kind[contact] == PAIR:
            radius[number] += shift
        else:
            law[LAW * number + NATURAL] += shift / gaps.weight[number]
    return gaps._replace(measures=gaps.measures._replace(law=law), pairs=gaps.pairs._replace(radius=radius))


@njit(cache=True, error_model="numpy")
def keep(tile: Tile, gaps: Gaps, g: GapWork, at_event: bool, out: Array, first: int) -> None:
    """Write what contacts do between two events from out[first] on, (contacts, KEPT, lanes); nan at an impact.

    at_event: whether this is the instant of the last event
    """
    width, ways = len(tile), 1 + gaps.tangents
    for lane in range(width):
        strikes = False
        for contact in range(gaps.size):
            strikes = strikes or (at_event and g.impulse[contact * width + lane] != 0.0)
        for contact in range(gaps.size):
            at, row = contact * width + lane, first + contact * KEPT * width + lane
            out[row], out[row + width], out[row + 2 * width] = g.closed[at], g.mode[at], g.speed[at]
            out[row + 3 * width], out[row + 4 * width] = g.feature[at], g.kept[at]
            for k in range(3):
                out[row + (5 + k) * width] = g.heading[(3 * contact + k) * width + lane]
                out[row + (8 + k) * width] = g.near[(contact * ways + k) * width + lane] if k < ways else 0.0
            if strikes:
                out[row] = np.nan


@njit(cache=True, error_model="numpy")
def look(
    tile: Tile, gaps: Gaps, z: Array, zdot: Array, g: GapWork, room: Array, every: bool, whole: bool
) -> None:  # fmt: skip
    """Look at every contact, or at those of which g.looked is not 0 in some lane. See `look_at`."""
    width = len(tile)
    for contact in range(gaps.size):
        wanted = every
        for lane in range(width):
            wanted = wanted or g.looked[contact * width + lane] != 0.0
        if wanted:
            look_at(tile, gaps, contact, z, zdot, g, room, whole)


@njit(cache=True, error_model="numpy")
def look_at(
    tile: Tile, gaps: Gaps, contact: int, z: Array, zdot: Array, g: GapWork, room: Array, whole: bool
) -> None:  # fmt: skip
    """Value, rate, slip and margin of slip; derived rows of z and zdot must be filled. room: of 6 d + 3 rows.

    Of pairs of surfaces axes and biases as well; those along tangents of closed contacts only, or if whole. Pointers.
    """
    width, ways = len(tile), 1 + gaps.tangents
    value = forces.value_row(gaps.measures) * width
    kind, number = gaps.kind[contact], gaps.number[contact]
    if kind == PAIR:
        for lane in range(width):
            directions = ways if whole or g.closed[contact * width + lane] != 0.0 else 1
            _look_at_pair(gaps, contact, width, lane, z, zdot, g, directions)
    else:
        for at in range(contact * width, (contact + 1) * width):
            g.value[at], g.rate[at] = 0.0, 0.0
        for part in range(number, gaps.last[contact]):
            forces.measure(tile, gaps.measures, part, z, g.memory, room)
            forces.slip(tile, gaps.measures, part, zdot, room)
            for lane in range(width):
                at, weight = contact * width + lane, gaps.weight[part * width + lane]
                g.value[at] += weight * room[value + lane]
                g.rate[at] += weight * room[value + width + lane]
        if kind == DRY:
            for lane in range(width):
                at = contact * width + lane
                g.value[at] -= g.anchor[at]
                g.slip[(contact * ways + 1) * width + lane], g.rate[at] = g.rate[at], 0.0
                g.axes[(9 * contact + 3) * width + lane] = 1.0
    if gaps.rubs[contact] > 0:
        for lane in range(width):
            if g.mode[contact * width + lane] == SLIP:
                g.margin[contact * width + lane] = slip_along(gaps, g, contact, width, lane)


@njit(cache=True, error_model="numpy", forceinline=True)
def is_outline(gaps: Gaps, contact: int) -> bool:
    """Return whether the second surface of a contact is an outline of features."""
    return gaps.kind[contact] == PAIR and gaps.pairs.shape[gaps.number[contact]] == PROFILE  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _look_at_pair(
    gaps: Gaps, contact: int, width: int, lane: int, z: Array, zdot: Array, g: GapWork, directions: int
) -> None:
    ways, rows, number = 1 + gaps.tangents, pairs.pair_rows(gaps.pairs.dimensions), gaps.number[contact]
    at = contact * width + lane
    if is_outline(gaps, contact) and g.kept[at] == 0.0:
        twin, other = gaps.pairs.profiles.twin[number], -1
        beside = at + twin * width
        if twin < 0 or (twin > 0 and g.kept[beside] != 0.0):
            other = int(g.feature[beside])
        g.feature[at] = pairs.nearest_feature(gaps.pairs, number, width, lane, z, zdot, other)
    feature, kept = int(g.feature[at]), g.kept[at] != 0.0
    g.left[at], g.onward[at] = pairs.describe(
        gaps.pairs, number, width, lane, directions, z, zdot, feature, kept, g.pair
    )
    g.value[contact * width + lane] = g.pair[0]
    for k in range(9):
        g.axes[(9 * contact + k) * width + lane] = g.pair[1 + k]
    for way in range(directions):
        at, end = (contact * ways + way) * width + lane, 10 + way * (rows + 2) + rows
        g.slip[at], g.bias[at] = g.pair[end], g.pair[end + 1]
    g.rate[contact * width + lane] = g.slip[contact * ways * width + lane]


@njit(cache=True, error_model="numpy", forceinline=True)
def exceeded(gaps: Gaps, g: GapWork, width: int, at: int) -> float:
    """Return LIFT of a closed contact that would have to pull, SLIDE of one that sticks beyond its limit, 0 of others.

    By the forces of the last acceleration.
    """
    opens = gaps.soft[at // width] == RIGID or g.rate[at] > 0.0
    if (
        gaps.kind[at // width] != DRY
        and opens
        and g.force[at // width * (1 + gaps.tangents) * width + at % width] < 0.0
    ):
        return LIFT
    return SLIDE if gaps.rubs[at // width] > 0 and g.mode[at] == STICK and g.margin[at] < 0.0 else 0.0


@njit(cache=True, error_model="numpy")
def slip_along(gaps: Gaps, g: GapWork, contact: int, width: int, lane: int) -> float:
    """Return the slip rate along the direction in which a contact has slipped [m/s or rad/s]."""
    ways, total = 1 + gaps.tangents, 0.0
    if ways == PLANE:
        return g.slip[(contact * ways + 1) * width + lane] * g.heading[3 * contact * width + lane]  # type: ignore[no-any-return]
    for k in range(3):
        here = 0.0
        for way in range(1, ways):
            axis = g.axes[(9 * contact + 3 * way + k) * width + lane]
            here += axis * g.slip[(contact * ways + way) * width + lane]
        total += here * g.heading[(3 * contact + k) * width + lane]
    return total


@njit(cache=True, error_model="numpy")
def press(gaps: Gaps, g: GapWork, contact: int, width: int, lane: int) -> tuple[float, float, float]:
    """Return the force of a contact that gives way by d = -g, K d^n (1 + (h + x/v) d') + c d' [N].

    K: STIFFNESS, n: EXPONENT, h: DAMPING, x: LOSS, c: VISCOSITY; v: the rate at which it was met (Hertz 1882, Hunt and
    Crossley 1975). It changes its sign where the contact opens. Then its elastic part, and what that has stored [J].
    """
    at, first = contact * width + lane, LAW_SIZE * contact
    depth, rate = -g.value[at], -g.rate[at]
    stiffness = gaps.law[(first + STIFFNESS) * width + lane]
    exponent = gaps.law[(first + EXPONENT) * width + lane]
    elastic = stiffness * abs(depth) ** exponent
    stored = elastic * abs(depth) / (exponent + 1.0)
    if depth <= 0.0:
        return -elastic, -elastic, stored
    loss = gaps.law[(first + LOSS) * width + lane]
    damping = gaps.law[(first + DAMPING) * width + lane] + (loss / g.speed[at] if loss > 0.0 else 0.0)
    viscous = gaps.law[(first + VISCOSITY) * width + lane] * rate
    return elastic * (1.0 + damping * rate) + viscous, elastic, stored


@njit(cache=True, error_model="numpy")
def add_unit(tile: Tile, gaps: Gaps, contact: int, way: int, z: Array, zdot: Array, g: GapWork, room: Array) -> None:
    """Add a unit force along one direction of a contact to g.unit, rows that forces act on, and find its bias.

    Of a pair in a single lane after `look_at` of the whole of it.
    """
    width, ways, number, d = len(tile), 1 + gaps.tangents, gaps.number[contact], gaps.measures.dimensions
    if gaps.kind[contact] == PAIR:
        rows = pairs.pair_rows(d)
        begin = 10 + way * (rows + 2)
        for lane in range(width):
            if width > 1:
                _look_at_pair(gaps, contact, width, lane, z, zdot, g, ways)
            for k in range(rows):
                g.unit[gaps.pairs.rows[rows * number + k] * width + lane] += g.pair[begin + k]
        return
    rows, bias = 3 * d, (contact * ways + way) * width
    for lane in range(width):
        g.bias[bias + lane] = 0.0
    for part in range(number, gaps.last[contact]):
        forces.measure(tile, gaps.measures, part, z, g.memory, room)
        for k in range(rows):
            row = gaps.measures.rows[rows * part + k]
            for lane in range(width):
                g.unit[row * width + lane] += gaps.weight[part * width + lane] * room[(rows + k) * width + lane]
        for lane in range(width):
            weight = gaps.weight[part * width + lane]
            g.bias[bias + lane] += weight * _bias(tile, gaps.measures, part, lane, z, zdot)


@njit(cache=True, error_model="numpy")
def _bias(tile: Tile, measures: Forces, number: int, lane: int, z: Array, zdot: Array) -> float:
    """Return the second derivative of a measure by time for accelerations of zero, zdot' g_qq zdot, in one lane."""
    width, d, first = len(tile), measures.dimensions, 3 * measures.dimensions * number
    rows, kind = measures.rows, measures.kind[number]
    if kind == ANGLE and d == 2:
        total = 0.0
        for end in range(2):
            x, y = rows[first + d * end] * width + lane, rows[first + d * end + 1] * width + lane
            square = z[x] * z[x] + z[y] * z[y]
            along, across = z[x] * zdot[x] + z[y] * zdot[y], z[x] * zdot[y] - z[y] * zdot[x]
            total += (1.0 if end == 0 else -1.0) * 2.0 * along * across / (square * square)
        return total
    # Products of vectors and of their rates, by component.
    rr, ru, uu, dd, de, ee, rd, turning, ue = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    x, y, xr, yr, xb, yb = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(d):
        a, b, c = (
            rows[first + k] * width + lane,
            rows[first + d + k] * width + lane,
            rows[first + 2 * d + k] * width + lane,
        )
        if kind == ANGLE:
            x, y = x + z[b] * z[a], y + z[b] * z[c]
            xr, yr = xr + zdot[b] * z[a] + z[b] * zdot[a], yr + zdot[b] * z[c] + z[b] * zdot[c]
            xb, yb = xb + 2.0 * zdot[b] * zdot[a], yb + 2.0 * zdot[b] * zdot[c]
        else:
            r, u = z[b] - z[a], zdot[b] - zdot[a]
            rr, ru, uu = rr + r * r, ru + r * u, uu + u * u
            dd, de, ee = dd + z[c] * z[c], de + z[c] * zdot[c], ee + zdot[c] * zdot[c]
            rd, turning, ue = rd + r * z[c], turning + r * zdot[c] + u * z[c], ue + u * zdot[c]
    if kind == ANGLE:
        square, turn = x * x + y * y, x * yr - y * xr
        return (x * yb - y * xb) / square - 2.0 * turn * (x * xr + y * yr) / (square * square)  # type: ignore[no-any-return]
    if kind == DISTANCE:
        return (uu - ru * ru / rr) / np.sqrt(rr)  # type: ignore[no-any-return]
    # r.d / |d|, the second derivative of a quotient.
    size = np.sqrt(dd)
    slope = de / size
    bend = (ee - slope * slope) / size
    place, rate = rd / size, turning
    first_rate = (rate - place * slope) / size
    return (2.0 * ue - place * bend - 2.0 * first_rate * slope) / size  # type: ignore[no-any-return]
