"""Functions of time as a user writes them: a number, an expression in `t`, or a table."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt
from pydantic import field_validator, model_serializer, model_validator

from shoal.errors import InputError
from shoal.scene import expression as arithmetic
from shoal.scene import formula
from shoal.scene.record import NonNegative, Record
from shoal.scene.smoothing import smooth

Array = npt.NDArray[Any]
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
MOST_ROWS = 20_000
"""Of a table."""


class Function(Record):
    """A function of time t [s]: written `0.5`, `"0.1*sin(3*t)"`, `{expression: ...}` or `{table: [[t, value], ...]}`.

    Identification carries the noise of a table to the intervals.
    """

    number: float | None = None
    """A constant [the unit of the field]."""
    expression: str | None = None
    """Expression in `t` with `+ - * / **`, sin cos tan tanh sqrt exp log abs sign step ramp min max, pi
    and e.
    """
    table: tuple[tuple[float, float], ...] | None = None
    """Rows of time and value [s, the unit of the field] with increasing times. Outside its times a table keeps its end
    values.
    """
    smooth: bool = True
    """Whether a table is interpolated by a cubic spline (not-a-knot), else by straight lines."""
    noise: NonNegative | None = None
    """Standard deviation of the measured values of a table, if it is known [the unit of the field]."""
    smoothing: NonNegative = 0.0
    """Strength of the smoothing after the measurement, 0 for none (`smoothing.smooth`) [1]."""

    @model_validator(mode="before")
    @classmethod
    def _short_forms(cls, data: Any) -> Any:
        if isinstance(data, Function) and not isinstance(data, cls):
            data = data.model_dump()
        if isinstance(data, str):
            # What `--set` gives is text.
            return {"number": float(data)} if _NUMBER.fullmatch(data.strip()) else {"expression": data}
        if isinstance(data, int | float) and not isinstance(data, bool):
            return {"number": data}
        if isinstance(data, dict) and "path" in data:
            raise ValueError(
                f"{str(data['path'])[:80]!r} is read from beside the YAML file of a scene; here state its table"
            )
        if not isinstance(data, dict | Function):
            raise ValueError(f'{cls._what} is a number, an expression such as "{cls._such}", or a table')
        return data

    _what: ClassVar[str] = "a function of time"
    _such: ClassVar[str] = "0.1*sin(3*t)"

    @field_validator("expression")
    @classmethod
    def _in_time(cls, text: str | None) -> str | None:
        if text is not None:
            try:
                unknown = cls._unknown(text)
            except InputError as error:
                raise ValueError(str(error).removeprefix("expression: ")) from None
            if unknown:
                raise ValueError(f"{text!r} has {sorted(unknown)[0]!r}, which is not known; the time is `t`")
        return text

    @classmethod
    def _unknown(cls, text: str) -> set[str]:
        return arithmetic.names(text) - {"t"}

    @field_validator("table")
    @classmethod
    def _in_order(cls, table: tuple[tuple[float, float], ...] | None) -> tuple[tuple[float, float], ...] | None:
        if table is not None:
            if not 2 <= len(table) <= MOST_ROWS:
                raise ValueError(f"a table has 2 to {MOST_ROWS} rows [t, value], found {len(table)}")
            for row, ((before, _), (after, _)) in enumerate(pairwise(table)):
                if after <= before:
                    raise ValueError(f"times must increase, found {after:g} after {before:g} in row {row + 1}")
        return table

    @model_validator(mode="after")
    def _one_of_three(self) -> Self:
        given = [name for name in ("number", "expression", "table") if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"give one of number, expression and table, found {' and '.join(given) or 'none'}")
        for name in ("smooth", "noise", "smoothing"):
            if name in self.model_fields_set and self.table is None:
                raise ValueError(f"{name}: belongs to a table")
        return self

    @model_serializer
    def _as_written(self) -> Any:
        if self.table is not None:
            noise = {} if self.noise is None else {"noise": self.noise}
            smoothing = {"smoothing": self.smoothing} if self.smoothing else {}
            return {"table": self.table, "smooth": self.smooth, **noise, **smoothing}
        return self.number if self.number is not None else self.expression

    @property
    def formula(self) -> formula.Node | None:
        """The function as a tree; None for a table. Raises InputError for constants without a finite value."""
        if self.table is not None:
            return None
        return float(self.number) if self.number is not None else formula.tree(str(self.expression))

    @property
    def knots(self) -> tuple[float, ...]:
        """Times between which a table is one polynomial [s]; none for an expression."""
        return tuple(time for time, _ in self.table or ())

    def __float__(self) -> float:
        """The number that it is. Raises TypeError of expressions and tables."""
        if self.number is None:
            raise TypeError("a function of time is no number")
        return float(self.number)

    def through(self, *operations: str) -> Composed:
        """Operations of `formula` on the function's value, in their order."""
        return Composed(self, operations)

    def __call__(self, t: Array) -> Array:
        """Values at the times t [s], of the shape and precision of t; nan where there is none."""
        t = np.asarray(t)
        if self.expression is not None:
            value = arithmetic.evaluate_array(self.expression, {"t": t})
            return np.array(np.broadcast_to(value, t.shape))
        if self.table is None:
            assert self.number is not None
            return np.full(t.shape, self.number)
        times, values = np.array(self.table).T
        if not self.smooth:
            return np.asarray(np.interp(t.astype(float), times, values))
        # In the precision of t: between uneven rows the terms of a spline cancel.
        t = np.clip(t.astype(np.result_type(t, float)), times[0], times[-1])
        row = np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 2)
        value, since = np.zeros_like(t), t - times[row]
        for power in self._spline().c:
            value = value * since + power[row]
        return np.asarray(value)

    def begins_like(self, other: Any, *, slope: bool) -> bool:
        """Return whether another function, as a user may write it, has the same value at time zero; slope: that as
        well.
        """
        try:
            other = Function.model_validate(other)
            alike = bool(self(np.zeros(1))[0] == other(np.zeros(1))[0])
        except (ValueError, InputError):
            return False
        return alike and (not slope or self._first_slope() == other._first_slope())

    def _first_slope(self) -> float:
        """At time zero, to its right; nan for an expression."""
        if self.table is not None:
            return self.table_slope(0.0, left=False)
        return 0.0 if self.number is not None else math.nan

    def perturbed(self, noise: float, rng: np.random.Generator) -> Function:
        """A table measured with noise once more, and smoothed again: what smoothing bends is bent once more too."""
        assert self.table is not None
        times, values = np.array(self.table).T
        values = values + noise * rng.standard_normal(len(times))
        values = smooth(times, values, self.smoothing) if self.smoothing else values
        return self.model_copy(update={"table": tuple(zip(times.tolist(), values.tolist(), strict=True))})

    def table_slope(self, t: float, left: bool) -> float:
        """The derivative of a table at one time [s], on its left or right side."""
        assert self.table is not None
        times, values = np.array(self.table).T
        row = int(np.searchsorted(times, t, side="left" if left else "right")) - 1
        if not 0 <= row < len(times) - 1:
            return 0.0
        if self.smooth:
            return float(self._spline()(t, 1))
        return float((values[row + 1] - values[row]) / (times[row + 1] - times[row]))

    def table_bend(self, t: float) -> float:
        """The second derivative of a table at one time [s]; 0 of one that is not smooth, and outside."""
        assert self.table is not None
        return float(self._spline()(t, 2)) if self.smooth and self.table[0][0] <= t <= self.table[-1][0] else 0.0

    def _spline(self) -> Any:
        # Importing scipy takes longer than reading a scene.
        from scipy.interpolate import CubicSpline

        return CubicSpline(*np.array(self.table).T)


class SignalFunction(Function):
    """A function of time t [s], of signals by their names and of measures of the machine such as `angle(hinge)`.

    Written as a function of time is. Its names are looked up by the scene (`signals.check_signals`).
    """

    _what: ClassVar[str] = "a function of time, measures and signals"
    _such: ClassVar[str] = "20*error - 2*rate(hinge)"

    @classmethod
    def _unknown(cls, text: str) -> set[str]:
        arithmetic.names(text, formula.MEASURES)
        return set()

    @property
    def of_time(self) -> bool:
        """Return whether it is a function of time alone, as it is written."""
        return all(leaf == "t" for leaf in formula.leaves(self.formula)) if self.expression is not None else True


@dataclass(frozen=True)
class Composed:
    """A function of time and what is done to its value."""

    function: Function
    operations: tuple[str, ...] = ()

    @property
    def formula(self) -> formula.Node | None:
        """See `Function`."""
        node = self.function.formula
        for operation in self.operations if node is not None else ():
            node = formula.make(operation, node)
        return node

    @property
    def knots(self) -> tuple[float, ...]:
        """See `Function`."""
        return self.function.knots

    def __call__(self, t: Array) -> Array:
        """See `Function`."""
        value = self.function(t)
        for operation in self.operations:
            value = formula.OPERATIONS[operation](value)
        return value


@dataclass(frozen=True)
class Formula:
    """A function of time by its tree."""

    formula: formula.Node
    knots: tuple[float, ...] = ()

    def __call__(self, t: Array) -> Array:
        """See `Function`."""
        return np.array(np.broadcast_to(formula.value(self.formula, t), np.shape(t)))
