"""Contacts with friction by Coulomb's law: forces p and the rates G p + c that they leave, of a few contacts.

Normal: p >= 0, G p + c >= 0, one of them zero. Tangents: |p_T| <= mu p_N + given; where the rate along them is not zero
|p_T| is that large and against it. G = W M^-1 W' is that of all directions, so that one problem serves accelerations,
whose slip may be known, and impacts. Not convex: for large mu there may be no solution or several (Painleve 1895).
Block Gauss-Seidel iteration, each contact exactly in its turn (Jean 1999), then the equations of the modes that it
leaves.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.compile.pointers import shift
from shoal.mechanics.gaps import DRY, RIGID, SLIP, STICK, Gaps
from shoal.mechanics.numerics.tile import Array, Index

OPEN, KNOWN = 0.0, 3.0
"""Modes beside STICK and SLIP: open, and slip whose direction is known before."""
FINE, NO_FORCE, SEVERAL, UNDECIDED = 0, 1, 2, 3
"""Outcomes: found; Painleve's paradox, no force or several; the iteration has not ended."""
JAMS = 6
"""Trouble beside these: friction by the force of its joint finds no force, or several (`motion`)."""
TROUBLES = 8
"""By which outcomes are counted on: the number of the contact, times this, is added to its outcome."""
SWEEPS = 20_000
SETTLED = 1e-15
"""Change in a sweep, over the largest force, that ends the iteration."""
DEPENDENT = 1e-11
"""Pivot, over the largest entry, below which a direction depends on others: its force is zero."""
UNCLEAR = 1e-6
"""Difference of accelerations, over what makes them up, by which forces that are not unique move a machine."""
SHARES, RELIEF = 12, 0.5
"""Times at which contacts that depend on each other are lowered, and by how much, as one is beyond its limit."""
FAINT = 1e-9
"""Least scale of a force, over the largest: a smaller one is none that could be lowered."""
ANGLES = 32
"""Directions of slip in space that are tried, between which the one is bracketed."""


@njit(cache=True, error_model="numpy")
def solve(n: int, matrix: Array, load: Array, out: Array, null: Array) -> int:
    """Solve A x = load of consistent equations, with x = 0 where they leave it open; (n, n) in rows. Returns the rank.

    null: vectors z with A z = 0 that span all of them, one after the other, (n * n,). Destroys both. Gauss's
    elimination with complete pivoting of the rows and columns scaled to 1.
    """
    scale, order = np.zeros(n), np.zeros(n)
    rank = _eliminate(n, matrix, load, out, scale, order)
    for free in range(rank, n):
        first = (free - rank) * n
        for i in range(n):
            null[first + i] = 0.0
        null[first + int(order[free])] = 1.0
        for k in range(rank - 1, -1, -1):
            total = matrix[k * n + free]
            for j in range(k + 1, rank):
                total += matrix[k * n + j] * null[first + int(order[j])]
            null[first + int(order[k])] = -total / matrix[k * n + k]
        for i in range(n):
            null[first + i] *= scale[i]
    return rank  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _eliminate(n: int, matrix: Array, load: Array, out: Array, scale: Array, order: Array) -> int:
    """Eliminate as `solve` does, with scales of the columns and their order, (n,), in room. Arrays or pointers."""
    rank = 0
    for i in range(n):
        scale[i], order[i] = 1.0, i
    for turn in range(2):
        for i in range(n):
            largest = 0.0
            for j in range(n):
                largest = max(largest, abs(matrix[i * n + j] if turn == 0 else matrix[j * n + i]))
            largest = 1.0 / largest if largest > 0.0 else 1.0
            for j in range(n):
                matrix[i * n + j if turn == 0 else j * n + i] *= largest
            if turn == 0:
                load[i] *= largest
            else:
                scale[i] = largest
    for k in range(n):
        best, row, column = DEPENDENT, -1, -1
        for i in range(k, n):
            for j in range(k, n):
                if abs(matrix[i * n + j]) > best:
                    best, row, column = abs(matrix[i * n + j]), i, j
        if row < 0:
            break
        for j in range(n):
            matrix[k * n + j], matrix[row * n + j] = matrix[row * n + j], matrix[k * n + j]
        load[k], load[row] = load[row], load[k]
        for i in range(n):
            matrix[i * n + k], matrix[i * n + column] = matrix[i * n + column], matrix[i * n + k]
        order[k], order[column] = order[column], order[k]
        for i in range(k + 1, n):
            factor = matrix[i * n + k] / matrix[k * n + k]
            if factor != 0.0:
                for j in range(k, n):
                    matrix[i * n + j] -= factor * matrix[k * n + j]
                load[i] -= factor * load[k]
        rank = k + 1
    for i in range(n):
        out[i] = 0.0
    for k in range(rank - 1, -1, -1):
        total = load[k]
        for j in range(k + 1, rank):
            total -= matrix[k * n + j] * out[int(order[j])]
        out[int(order[k])] = total / matrix[k * n + k]
    for i in range(n):
        out[i] *= scale[i]
    return rank


@njit(cache=True, error_model="numpy")
def hold(
    gaps: Gaps,
    given: Array,
    width: int,
    lane: int,
    mode: Array,
    way: Array,
    matrix: Array,
    load: Array,
    near: Array,
    out: Array,
) -> bool:
    """Find the forces p of contacts whose modes are known: their rates G p + c vanish but for slip.

    Returns whether other forces that obey the same laws would move the machine otherwise, as of contacts that bear one
    load and slip with different coefficients of friction.

    given: friction that no normal force causes, by contact and lane; mode: by contact; way: direction of slip in the
    tangents, by direction; load: c, of a contact that gives way its
    force in place of that along the normal. near: forces of the same contacts, by direction and lane: where contacts
    depend on each other p is not unique, and of all the least in the sum of its squares, each over the normal force or
    the limit of friction there, so that no contact is at its limit while others are not. Where one is beyond it, the
    others take more.
    """
    ways, n = 1 + gaps.tangents, 0
    each = np.zeros(gaps.size * ways, np.int64)
    for row in range(gaps.size * ways):
        out[row] = 0.0
        if mode[row // ways] != OPEN:
            each[n], n = row, n + 1
    equations, right, found, null = np.zeros(n * n), np.zeros(n), np.zeros(n), np.zeros(n * n)
    _state(gaps, given, width, lane, mode, way, matrix, load, n, each, equations, right)
    unclear, free = False, n - solve(n, equations, right, found, null)
    if free > 0:
        other, scale, share = found.copy(), np.zeros(n), np.ones(n)
        for i in range(n):
            contact, k = each[i] // ways, each[i] % ways
            normal = abs(near[contact * ways * width + lane])
            most = limit(gaps, given, contact, width, lane, normal, True) if k > 0 else normal
            scale[i] = most if most < np.inf else normal
        for _ in range(SHARES):
            _lower(n, free, null, scale * share, found)
            if not _relieve(gaps, given, width, lane, mode, n, each, found, share):
                break
        else:  # there are no such forces: some slip
            _lower(n, free, null, scale, found)
        for i in range(n):
            change, whole = 0.0, 0.0
            for j in range(n):
                entry = matrix[each[i] * gaps.size * ways + each[j]]
                change += entry * (found[j] - other[j])
                whole += abs(entry) * (abs(found[j]) + abs(other[j]))
            unclear = unclear or abs(change) > UNCLEAR * whole
    for i in range(n):
        out[each[i]] = found[i]
    return unclear


@njit(cache=True, error_model="numpy")
def _lower(n: int, free: int, null: Array, scale: Array, x: Array) -> None:
    """Add to x the combination of null vectors that leaves the least of its squares, each entry over its scale.

    By modified Gram-Schmidt, which orthogonalises the vectors and takes them out of x as one more (Bjorck 1967).
    """
    ways, whole, rest, least = np.zeros(free * n), null[: free * n].copy(), np.zeros(n), FAINT * np.max(scale)
    for i in range(n):
        weight = 1.0 / max(scale[i], least)
        rest[i] = x[i] * weight
        for k in range(free):
            ways[k * n + i] = whole[k * n + i] * weight
    for k in range(free):
        square = 0.0
        for i in range(n):
            square += ways[k * n + i] ** 2
        for other in range(k + 1, free + 1):
            along = 0.0
            for i in range(n):
                along += ways[k * n + i] * (rest[i] if other == free else ways[other * n + i])
            along /= square
            for i in range(n):
                if other == free:
                    rest[i] -= along * ways[k * n + i]
                    x[i] -= along * whole[k * n + i]
                else:
                    ways[other * n + i] -= along * ways[k * n + i]
                    whole[other * n + i] -= along * whole[k * n + i]


@njit(cache=True, error_model="numpy")
def _relieve(
    gaps: Gaps, given: Array, width: int, lane: int, mode: Array, n: int, each: Index, found: Array, share: Array
) -> bool:
    """Lower the shares of contacts that stick beyond the limit of their friction; return whether there are some."""
    ways, some = 1 + gaps.tangents, False
    for i in range(n):
        contact, square = each[i] // ways, 0.0
        if each[i] % ways > 0 or mode[contact] != STICK or gaps.rubs[contact] == 0:
            continue
        for k in range(1, ways):
            square += found[i + k] ** 2
        if np.sqrt(square) > limit(gaps, given, contact, width, lane, found[i], True):
            some = True
            for k in range(1, ways):
                share[i + k] *= RELIEF
    return some


@njit(cache=True, error_model="numpy")
def _state(
    gaps: Gaps, given: Array, width: int, lane: int, mode: Array, way: Array, matrix: Array, load: Array, n: int,
    each: Index, equations: Array, right: Array,
) -> None:  # fmt: skip
    """State the equations of the n directions in `each`, those of the contacts that are not open."""
    ways = 1 + gaps.tangents
    size = gaps.size * ways
    for i in range(n):
        row, contact, k = each[i], each[i] // ways, each[i] % ways
        at, slips = contact * width + lane, mode[contact] == SLIP or mode[contact] == KNOWN
        right[i] = 0.0
        for j in range(n):
            equations[i * n + j] = 0.0
        if k > 0 and slips:
            # p_T = -(mu p_N + given) u
            equations[i * n + i] = 1.0
            equations[i * n + i - k] = gaps.mu[at] * way[row]
            right[i] = -given[at] * way[row]
        elif is_unknown(gaps, contact, k, mode[contact]):
            for j in range(n):
                equations[i * n + j] = matrix[row * size + each[j]]
            right[i] = -load[row]
        else:
            equations[i * n + i] = 1.0
            if k == 0 and gaps.soft[contact] != RIGID:
                right[i] = load[row]


@njit(cache=True, error_model="numpy", forceinline=True)
def is_unknown(gaps: Gaps, contact: int, k: int, mode: float) -> bool:
    """Return whether the force along a direction follows from the rate that it is to make vanish."""
    if mode == OPEN:
        return False
    if k == 0:
        return gaps.kind[contact] != DRY and gaps.soft[contact] == RIGID  # type: ignore[no-any-return]
    return mode == STICK and gaps.rubs[contact] > 0 and (k == 1 or gaps.kind[contact] != DRY)


@njit(cache=True, error_model="numpy")
def decide(
    gaps: Gaps,
    few: Array,
    given: Array,
    width: int,
    lane: int,
    mode: Array,
    way: Array,
    matrix: Array,
    load: Array,
    out: Array,
    impulsive: bool,
) -> int:
    """Find modes and forces of contacts at once; returns the outcome.

    mode: OPEN of those to be left out, KNOWN of those whose slip is known, with its direction in way; any other of
    those to be decided. Replaces modes and ways by those that hold. impulsive: whether these are impulses, of which
    given friction has none. few: room of one contact, (`gaps.FEW`,).
    """
    ways = 1 + gaps.tangents
    n = gaps.size * ways
    rest, begun, asked = np.zeros(n), np.zeros(n), np.zeros(gaps.size)
    outcome, change, largest = FINE, np.inf, 0.0
    each, some = np.zeros(n, np.int64), 0
    for contact in range(gaps.size):
        asked[contact] = mode[contact]
        for row in range(contact * ways, (contact + 1) * ways):
            if asked[contact] != OPEN:
                each[some], some = row, some + 1
    for i in range(n):
        out[i] = 0.0
    for _ in range(SWEEPS):
        largest, change, outcome = 0.0, 0.0, FINE
        for contact in range(gaps.size):
            if asked[contact] == OPEN:
                continue
            first = contact * ways
            for k in range(ways):
                row = first + k
                rest[row], begun[row] = load[row], out[row]
                for i in range(some):
                    j = each[i]
                    if j < first or j >= first + ways:
                        rest[row] += matrix[row * n + j] * out[j]
            if gaps.soft[contact] != RIGID:
                rest[first] = load[first]
            found = alone(
                gaps, few, given, contact, width, lane, asked[contact], mode, way, matrix, rest, out, impulsive
            )
            if found > outcome % TROUBLES:
                outcome = found + TROUBLES * contact
            for row in range(first, first + ways):
                change, largest = max(change, abs(out[row] - begun[row])), max(largest, abs(out[row]))
        if change <= SETTLED * largest:
            break
    if outcome != FINE:
        return outcome
    # What holds still sticks, though its friction be at its limit, as another contact holds it.
    for contact in range(gaps.size):
        if mode[contact] == SLIP:
            along, size = 0.0, 0.0
            for row in range(contact * ways + 1, contact * ways + ways):
                rate, size = load[row], size + abs(load[row])
                for j in range(n):
                    rate += matrix[row * n + j] * out[j]
                    size += abs(matrix[row * n + j] * out[j])
                along += rate * way[row]
            if abs(along) <= DEPENDENT * size:
                mode[contact] = STICK
    near = np.zeros(n * width)
    for i in range(n):
        near[i * width + lane] = out[i]
    hold(gaps, given, width, lane, mode, way, matrix, load, near, begun)
    if _agrees(gaps, given, width, lane, mode, begun):
        for i in range(n):
            out[i] = begun[i]
        if not impulsive:
            _let_share(gaps, given, width, lane, asked, mode, way, matrix, load, near, out)
        return FINE
    return FINE if change <= 1e-9 * largest else UNDECIDED


@njit(cache=True, error_model="numpy")
def _let_share(
    gaps: Gaps, given: Array, width: int, lane: int, asked: Array, mode: Array, way: Array, matrix: Array, load: Array,
    near: Array, out: Array,
) -> None:  # fmt: skip
    """Let contacts that others spare, but that would press as well, bear their share: of two at one place each half."""
    ways = 1 + gaps.tangents
    n = gaps.size * ways
    modes, forces, most, some = np.zeros(gaps.size), np.zeros(n), 0.0, False
    for contact in range(gaps.size):
        most = max(most, out[contact * ways])
    for contact in range(gaps.size):
        first, modes[contact] = contact * ways, mode[contact]
        if asked[contact] == OPEN or mode[contact] != OPEN or gaps.soft[contact] != RIGID:
            continue
        rate, size = load[first], abs(load[first])
        for j in range(n):
            rate += matrix[first * n + j] * out[j]
            size += abs(matrix[first * n + j] * out[j])
        if size > 0.0 and abs(rate) <= DEPENDENT * size:
            modes[contact], near[first * width + lane] = KNOWN if asked[contact] == KNOWN else STICK, most
            some = True
    if not some:
        return
    hold(gaps, given, width, lane, modes, way, matrix, load, near, forces)
    agrees = _agrees(gaps, given, width, lane, modes, forces)
    for contact in range(gaps.size):
        agrees = agrees and (modes[contact] == mode[contact] or forces[contact * ways] > UNCLEAR * most)
    if agrees:
        for contact in range(gaps.size):
            mode[contact] = modes[contact]
        for i in range(n):
            out[i] = forces[i]


@njit(cache=True, error_model="numpy")
def _agrees(gaps: Gaps, given: Array, width: int, lane: int, mode: Array, p: Array) -> bool:
    """Return whether forces of contacts with these modes keep the limits of friction."""
    ways = 1 + gaps.tangents
    for contact in range(gaps.size):
        first, square = contact * ways, 0.0
        if mode[contact] != OPEN and p[first] < 0.0:
            return False
        for k in range(1, ways):
            square += p[first + k] ** 2
        if mode[contact] == STICK and np.sqrt(square) > limit(gaps, given, contact, width, lane, p[first], True):
            return False
    return True


@njit(cache=True, error_model="numpy", forceinline=True)
def limit(gaps: Gaps, given: Array, contact: int, width: int, lane: int, normal: float, static: bool) -> float:
    """Return the limit of friction under a normal force [N]."""
    at = contact * width + lane
    if gaps.rolls[contact] > 0:
        return np.inf
    return (gaps.mu_static[at] if static else gaps.mu[at]) * normal + given[at]  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def alone(
    gaps: Gaps, few: Array, given: Array, contact: int, width: int, lane: int, asked: float, mode: Array, way: Array,
    matrix: Array, rest: Array, out: Array, impulsive: bool,
) -> int:  # fmt: skip
    """Decide one contact exactly, with the rates that the others leave; returns the outcome."""
    ways, at = 1 + gaps.tangents, contact * width + lane
    n, first = gaps.size * ways, contact * ways
    for k in range(ways):
        out[first + k] = 0.0
    if gaps.kind[contact] == DRY:
        row, most = first + 1, given[at]
        if asked != KNOWN:
            own = matrix[row * n + row]
            mode[contact] = STICK
            if abs(rest[row]) <= most * own:
                out[row] = -rest[row] / own if own > 0.0 else 0.0
                return FINE
            mode[contact], way[row] = SLIP, np.sign(rest[row])
        out[row] = -most * way[row]
        return FINE
    if gaps.soft[contact] != RIGID:
        _under(gaps, few, given, contact, width, lane, asked, mode, way, matrix, rest, out)
        return FINE
    normal, own = rest[first], matrix[first * n + first]
    mode[contact] = KNOWN if asked == KNOWN else STICK
    if gaps.rubs[contact] == 0:
        mode[contact] = STICK if normal < 0.0 else OPEN
        out[first] = max(0.0, -normal / own)
        return FINE
    if asked == KNOWN:
        weight = own
        for k in range(1, ways):
            weight -= gaps.mu[at] * matrix[first * n + first + k] * way[first + k]
        if weight <= 0.0:
            return NO_FORCE if normal < 0.0 else SEVERAL
        out[first] = max(0.0, -normal / weight)
        for k in range(1, ways):
            out[first + k] = -gaps.mu[at] * out[first] * way[first + k]
        mode[contact] = KNOWN if normal < 0.0 else OPEN
        return FINE
    if normal >= 0.0:
        mode[contact] = OPEN
        return FINE
    right, push, square = shift(few, ways * ways), shift(few, ways * ways + ways), 0.0
    for i in range(ways):
        right[i] = -rest[first + i]
        for j in range(ways):
            few[i * ways + j] = matrix[(first + i) * n + first + j]
    _eliminate(ways, few, right, push, shift(few, ways * ways + 2 * ways), shift(few, ways * ways + 3 * ways))
    for k in range(1, ways):
        square += push[k] ** 2
    tangential = np.sqrt(square)
    within = push[0] >= 0.0 and tangential <= limit(gaps, given, contact, width, lane, push[0], True)
    if within and _vanish(ways, n, first, matrix, rest, push):
        for k in range(ways):
            out[first + k] = push[k]
        return FINE
    mode[contact] = SLIP
    return _slip(gaps, contact, gaps.mu[at], push, matrix, rest, way, out)  # type: ignore[no-any-return]


@njit(cache=True, error_model="numpy")
def _vanish(ways: int, n: int, first: int, matrix: Array, rest: Array, push: Array) -> bool:
    """Return whether forces of one contact take away its rates along all directions.

    Joints may let no more than one of them be: a pinned rod cannot leave a wall with e > 0 and not slip.
    """
    for i in range(first, first + ways):
        left, size = rest[i], abs(rest[i])
        for k in range(ways):
            part = matrix[i * n + first + k] * push[k]
            left, size = left + part, size + abs(part)
        if abs(left) > DEPENDENT * size:
            return False
    return True


@njit(cache=True, error_model="numpy")
def _under(
    gaps: Gaps, few: Array, given: Array, contact: int, width: int, lane: int, asked: float, mode: Array, way: Array,
    matrix: Array, rest: Array, out: Array,
) -> None:  # fmt: skip
    """Let a contact stick or slip under a normal force that is known."""
    ways, at = 1 + gaps.tangents, contact * width + lane
    n, first, normal = gaps.size * ways, contact * ways, rest[contact * ways]
    out[first], mode[contact] = normal, KNOWN if asked == KNOWN else STICK
    if gaps.rubs[contact] == 0:
        return
    if asked != KNOWN:
        right, push, square = shift(few, ways * ways), shift(few, ways * ways + ways), 0.0
        for i in range(ways):
            right[i] = -rest[first + i] - matrix[(first + i) * n + first] * normal if i > 0 else 0.0
            for j in range(ways):
                inside = i > 0 and j > 0
                few[i * ways + j] = matrix[(first + i) * n + first + j] if inside else (1.0 if i == j else 0.0)
        _eliminate(ways, few, right, push, shift(few, ways * ways + 2 * ways), shift(few, ways * ways + 3 * ways))
        for k in range(1, ways):
            square += push[k] ** 2
        size = np.sqrt(square)
        if size <= limit(gaps, given, contact, width, lane, max(normal, 0.0), True):
            for k in range(1, ways):
                out[first + k] = push[k]
            return
        mode[contact] = SLIP
        for k in range(1, ways):
            way[first + k] = -push[k] / size
    for k in range(1, ways):
        out[first + k] = -gaps.mu[at] * normal * way[first + k]


@njit(cache=True, error_model="numpy")
def _slip(gaps: Gaps, contact: int, mu: float, push: Array, matrix: Array, rest: Array, way: Array, out: Array) -> int:
    """Let a contact begin to slip: find the direction u of slip in which friction is against the rate that is left."""
    ways = 1 + gaps.tangents
    first = contact * ways
    if ways == 2:
        for side in (1.0, -1.0):
            u = -side if push[1] > 0.0 else side
            if _try(gaps, contact, mu, u, 0.0, matrix, rest, out)[1] >= 0.0 and out[first] > 0.0:
                way[first + 1] = u
                return FINE
        return NO_FORCE
    base = np.arctan2(-push[2], -push[1])
    step, found = 2.0 * np.pi / ANGLES, False
    low, across, _ = base, 0.0, 0.0
    for turn in range(ANGLES + 1):
        # Around the direction against the force of stick, on both sides in turn.
        here = base + step * ((turn + 1) // 2) * (1.0 if turn % 2 else -1.0)
        left, right = here - 0.5 * step, here + 0.5 * step
        before, along = _try(gaps, contact, mu, np.cos(left), np.sin(left), matrix, rest, out)
        after, further = _try(gaps, contact, mu, np.cos(right), np.sin(right), matrix, rest, out)
        if before * after <= 0.0 and (along > 0.0 or further > 0.0):
            low, across, found = left, before, True
            break
    if not found:
        return NO_FORCE
    high = low + step
    for _ in range(80):
        middle = 0.5 * (low + high)
        value, along = _try(gaps, contact, mu, np.cos(middle), np.sin(middle), matrix, rest, out)
        if value * across > 0.0:
            low, across = middle, value
        else:
            high = middle
    u, v = np.cos(0.5 * (low + high)), np.sin(0.5 * (low + high))
    _, along = _try(gaps, contact, mu, u, v, matrix, rest, out)
    way[first + 1], way[first + 2] = u, v
    return FINE if along > 0.0 and out[first] > 0.0 else NO_FORCE


@njit(cache=True, error_model="numpy")
def _try(
    gaps: Gaps, contact: int, mu: float, u: float, v: float, matrix: Array, rest: Array, out: Array
) -> tuple[float, float]:
    """Return the parts of the rate across and along a direction of slip (u, v), with the force that it brings in out.

    In the plane v is zero. The normal rate is zero.
    """
    ways = 1 + gaps.tangents
    n, first = gaps.size * ways, contact * ways
    weight = matrix[first * n + first] - mu * matrix[first * n + first + 1] * u
    if ways == 3:
        weight -= mu * matrix[first * n + first + 2] * v
    out[first] = -rest[first] / weight if weight > 0.0 else -1.0
    out[first + 1] = -mu * out[first] * u
    one, other = rest[first + 1], 0.0
    if ways == 3:
        out[first + 2], other = -mu * out[first] * v, rest[first + 2]
    for j in range(ways):
        one += matrix[(first + 1) * n + first + j] * out[first + j]
        if ways == 3:
            other += matrix[(first + 2) * n + first + j] * out[first + j]
    return u * other - v * one, u * one + v * other
