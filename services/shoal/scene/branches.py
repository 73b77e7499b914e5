"""Breakpoints of an expression (jumps and kinks) by interval bisection, and the smooth expressions between them.

step, ramp, abs, min and max switch where an argument (or a difference of two) passes a number. These roots are
isolated by interval arithmetic (Moore, Kearfott and Cloud, Introduction to Interval Analysis, 2009, chapter 8;
`enclosure`): an interval holds none where the bounds of the argument exclude 0; where those of its derivative do, the
signs at its ends decide; other intervals are bisected. A root is the first double-precision number at which the
computed argument has changed its sign. Poles of quotients, logarithms, powers and tangents are located in the same way
and refused.
"""

from __future__ import annotations

from typing import Any, NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt

from shoal.errors import InputError
from shoal.scene.enclosure import at, common_zero, enclose
from shoal.scene.formula import Node, make, value, written

Array = npt.NDArray[Any]

_MOST_INTERVALS = 2**17
"""Intervals examined for one argument, at most: a bound on time."""
_MOST_SWITCHES = 20_000
_ULP = 2.0**-52
_NOWHERE = 2.0**-100
"""Fraction of the range that is too short to be bisected further, beside the spacing of numbers."""
_INSIDE = (0.5, (3.0 - 5.0**0.5) / 2.0, 2.0**-0.5)
"""Where in a piece the sign of a tree is looked at: half-way, where it may touch 0 by symmetry, and elsewhere."""


class Branches(NamedTuple):
    """A function in pieces: between edges[k] and edges[k + 1] it is the smooth tree nodes[k]."""

    edges: Array
    nodes: list[Node]

    def groups(self) -> dict[Node, Array]:
        """The numbers of the pieces that have the same tree."""
        found: dict[Node, list[int]] = {}
        for k, node in enumerate(self.nodes):
            found.setdefault(node, []).append(k)
        return {node: np.array(numbers) for node, numbers in found.items()}

    def around(self, t: float, left: bool) -> Node:
        """The tree that holds just before (left) or from t on."""
        number = np.searchsorted(self.edges, t, side="left" if left else "right") - 1
        return self.nodes[min(max(int(number), 0), len(self.nodes) - 1)]


def branches(node: Node, begin: float, end: float) -> Branches:
    """Split a tree into smooth pieces over [begin, end].

    Raises InputError where it has a pole or no value, or where its switches cannot be separated.
    """
    return _Cutter(node, begin, end).cut(node)


class _Cutter:
    """Cuts the trees of one function over one range."""

    def __init__(self, whole: Node, begin: float, end: float) -> None:
        self.whole, self.begin, self.end = whole, begin, end

    def cut(self, node: Node) -> Branches:
        """The pieces of a part of the function: those of its arguments, cut where its operation asks for it."""
        if not isinstance(node, tuple):
            return Branches(np.array([self.begin, self.end]), [node])
        operation, *arguments = node
        parts = [self.cut(argument) for argument in arguments]
        edges = np.unique(np.concatenate([part.edges for part in parts]))
        columns = [[part.nodes[k] for k in _number(part.edges, edges)] for part in parts]
        rule = _DECIDE.get(operation)
        if rule is None:
            return Branches(edges, [make(operation, *row) for row in zip(*columns, strict=True)])
        return rule(self, operation, edges, columns)

    def switch(self, operation: str, edges: Array, columns: list[list[Node]]) -> Branches:
        """step, ramp, abs, min and max, each by its branches."""
        first = columns[0]
        tested = first if len(columns) == 1 else [make("-", *row) for row in zip(*columns, strict=True)]
        finer = self._roots(operation, edges, tested)
        if operation == "ramp":
            beyond = [make("-", node, 1.0) for node in first]
            finer = np.unique(np.concatenate([finer, self._roots(operation, edges, beyond)]))
        number = _number(edges, finer)
        sign = self._signs(finer, [tested[k] for k in number])
        over = self._signs(finer, [beyond[k] for k in number]) if operation == "ramp" else np.zeros(len(number))
        rows = zip(sign, over, number, strict=True)
        return Branches(
            finer, [_branch(operation, one, other, *(part[k] for part in columns)) for one, other, k in rows]
        )

    def guard(self, operation: str, edges: Array, columns: list[list[Node]]) -> Branches:
        """Quotients, powers, logarithms, square roots and tangents, refused where they have a pole or no value."""
        rows = list(zip(*columns, strict=True))
        tested = [_critical(operation, row) for row in rows]
        finer = self._roots(operation, edges, tested)
        number = _number(edges, finer)
        sign = self._signs(finer, [tested[k] for k in number])
        for n, k in enumerate(number):
            if operation in ("sqrt", "log", "**") and sign[n] < 0:
                self._refuse(f"takes {_named(operation)} of {written(tested[k])}, which is negative", finer[n])
        for n, k in enumerate(number):
            for t in finer[n : n + 2].tolist():
                if t not in edges or _is_zero(tested[k], t):
                    self._check_zero(operation, rows[k], tested[k], t)
        return Branches(finer, [make(operation, *rows[k]) for k in number])

    def _check_zero(self, operation: str, row: tuple[Node, ...], tested: Node, t: float) -> None:
        """Refuse a pole; not roots and positive powers of 0, and not a fraction whose upper side vanishes as well."""
        if operation == "sqrt" or (operation == "**" and isinstance(row[1], float) and row[1] > 0):
            return
        if operation == "/" and common_zero(row[0], row[1], t):
            return
        why = f"has a pole: {written(tested)} is 0"
        self._refuse(why, t, "; keep it away from 0, by max() or a small term")

    def _signs(self, edges: Array, nodes: list[Node]) -> Array:
        """Return the sign of every piece's tree, which touches 0 inside at most, as sin(t) - 1 does."""
        out = np.zeros(len(nodes))
        for node, numbers in Branches(edges, nodes).groups().items():
            width = edges[numbers + 1] - edges[numbers]
            inside = np.array([_values(node, edges[numbers] + part * width) for part in _INSIDE])
            largest = np.argmax(np.abs(inside), axis=0)
            out[numbers] = np.sign(np.take_along_axis(inside, largest[None], 0)[0])
        return out

    def _roots(self, operation: str, edges: Array, nodes: list[Node]) -> Array:
        """Return the edges, and all roots between them where the tree of a piece changes sign or, for poles, is 0."""
        found = [edges]
        for node, numbers in Branches(edges, nodes).groups().items():
            if isinstance(node, tuple) or node == "t":
                found.append(self._isolate(operation, node, edges[numbers], edges[numbers + 1]))
        every = np.unique(np.concatenate(found))
        # Neighbours within rounding are one place.
        apart = np.diff(every, prepend=-np.inf) > 4 * _ULP * np.abs(every)
        apart |= np.isin(every, edges)
        every = np.asarray(every[apart])
        if every.size > _MOST_SWITCHES:
            self._refuse(f"switches more than {_MOST_SWITCHES} times", self.begin)
        return every

    def _isolate(self, operation: str, node: Node, lower: Array, upper: Array) -> Array:
        strict = operation in ("/", "log", "**", "tan")
        brackets, found, looked = [], [], 0
        nowhere = _NOWHERE * (self.end - self.begin)
        while lower.size:
            looked += lower.size
            if looked > _MOST_INTERVALS:
                self._refuse(f"switches too often, or {written(node)} touches 0,", float(lower[0]))
            low, high = enclose(node, lower, upper, 1)
            free = (low[0] > 0) | (high[0] < 0)
            if not strict:
                free |= (low[0] == 0) | (high[0] == 0)
            monotone = (low[1] > 0) | (high[1] < 0) | ((low[1] == 0) & (high[1] == 0))
            sure = ~free & monotone
            brackets.append(np.stack([lower[sure], upper[sure]]))
            open_ = ~free & ~monotone
            lower, upper = lower[open_], upper[open_]
            short = upper - lower <= np.maximum(4 * _ULP * np.maximum(np.abs(lower), np.abs(upper)), nowhere)
            found += self._undecided(operation, node, lower[short], upper[short])
            lower, upper = lower[~short], upper[~short]
            middle = (lower + upper) / 2
            # A root at 0, the commonest place, is found as that.
            middle = np.where((lower < 0) & (upper > 0), 0.0, middle)
            lower, upper = np.concatenate([lower, middle]), np.concatenate([middle, upper])
        lower, upper = np.concatenate(brackets, axis=1)
        return np.concatenate([self._refined(node, lower, upper), found])

    def _undecided(self, operation: str, node: Node, lower: Array, upper: Array) -> list[float]:
        """Decide about intervals of the width of round-off in which a tree may touch or cross 0."""
        if operation in ("/", "log", "**", "tan", "sqrt"):
            return [float(t) for t in lower]
        found = []
        for one, other in zip(lower, upper, strict=True):
            low, high = at(node, np.array([one, other]))
            signs = np.where(low[0] > 0, 1, np.where(high[0] < 0, -1, 0))
            if signs[0] * signs[1] < 0:
                found.append(float(other))
            elif operation == "step" and signs[0] * signs[1] == 0:
                self._refuse(f"has a step where {written(node)} touches 0", float(one), "; add a small term to it")
        return found

    def _refined(self, node: Node, lower: Array, upper: Array) -> Array:
        """Return the first number past the root in each interval on which a tree is monotone, by bisection."""
        before, after = np.sign(_values(node, lower, 1)), np.sign(_values(node, upper, -1))
        ends = np.concatenate([lower[before == 0], upper[(after == 0) & (before == 0)]])
        inside = (before != 0) & (before != after)
        lower, upper, before = lower[inside], upper[inside], before[inside]
        nowhere = _NOWHERE * (self.end - self.begin)
        while True:
            middle = (lower + upper) / 2
            middle = np.where((lower < 0) & (upper > 0), 0.0, middle)
            if not np.any((middle > lower) & (middle < upper) & (upper - lower > nowhere)):
                return np.concatenate([ends, upper])
            past = np.sign(_values(node, middle)) != before
            lower, upper = np.where(past, lower, middle), np.where(past, middle, upper)

    def _refuse(self, why: str, t: float, advice: str = "") -> NoReturn:
        raise InputError(f"function: {written(self.whole)!r} {why} at t = {t:.7g}{advice}")


def _is_zero(node: Node, t: float) -> bool:
    """Return whether a tree may be 0 at one place."""
    low, high = at(node, np.array([t]))
    return bool(low[0, 0] <= 0 <= high[0, 0])


def _values(node: Node, t: Array, side: int = 0) -> Array:
    """Return values in the best precision; side: where one is undefined, of the `side`-th neighbour on the right."""
    t = np.asarray(t, dtype=np.longdouble)
    found = np.array(np.broadcast_to(value(node, t), t.shape))
    if side and not np.all(np.isfinite(found)):
        shifted = t + side * 1e-12 * (1 + np.abs(t))
        found = np.where(np.isfinite(found), found, value(node, shifted))
    return found


def _number(edges: Array, finer: Array) -> Array:
    """For every piece of the finer edges, that of the coarser it lies in."""
    return np.searchsorted(edges, finer[:-1], side="right") - 1


def _branch(operation: str, test: float, beyond: float, *arguments: Node) -> Node:
    """Return the smooth expression of an operation where the tested number has the sign of `test`, and, of ramp, that
    less 1 the sign of `beyond`.
    """
    first = arguments[0]
    if operation == "step":
        return 1.0 if test >= 0 else 0.0
    if operation == "abs":
        return first if test >= 0 else make("neg", first)
    if operation == "ramp":
        return 0.0 if test <= 0 else 1.0 if beyond >= 0 else make("rise", first)
    return first if (test <= 0) == (operation == "min") else arguments[1]


def _critical(operation: str, row: tuple[Node, ...]) -> Node:
    """The tree whose zeros are poles of an operation, or whose sign decides whether it has a value."""
    if operation == "/":
        return row[1]
    if operation == "tan":
        return make("cos", row[0])
    if operation == "**" and isinstance(row[1], float) and row[1].is_integer() and row[1] >= 0:
        return 1.0
    if operation == "**" and isinstance(row[1], float) and row[1].is_integer():
        return make("square", row[0])
    return row[0]


def _named(operation: str) -> str:
    return "a power" if operation == "**" else operation


_DECIDE = dict.fromkeys(("step", "ramp", "abs", "min", "max"), _Cutter.switch) | dict.fromkeys(
    ("/", "**", "log", "sqrt", "tan"), _Cutter.guard
)
