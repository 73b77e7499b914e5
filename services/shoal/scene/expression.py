"""Arithmetic expressions in named numbers, read without `eval`: what a user may write in a scene or a problem.

There are numbers, names, + - * / **, the constants `pi` and `e` and the functions below; of these, step(x) is
0 below 0 and 1 from 0 on, sign(x) is -1, 0 or 1, and ramp(x) goes from 0 at x = 0 to 1 at x = 1 with two continuous
derivatives.
"""

from __future__ import annotations

import ast
import math
import re
import warnings
from collections.abc import Callable, Mapping
from difflib import get_close_matches
from functools import lru_cache, reduce
from types import MappingProxyType
from typing import Any

import numpy as np

from shoal.errors import InputError

Number = Any
"""A float, or a numpy array of any shape and precision."""


def _ramp(x: Number) -> Number:
    x = np.clip(x, 0.0, 1.0)
    return x * x * x * (10.0 + x * (6.0 * x - 15.0))


ONE: dict[str, Callable[[Number], Number]] = {
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "tanh": np.tanh,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "log": np.log,
    "abs": np.abs,
    "sign": np.sign,
    "step": lambda x: np.heaviside(x, 1.0),
    "ramp": _ramp,
}
MANY: dict[str, Callable[[Number, Number], Number]] = {"min": np.minimum, "max": np.maximum}
_CONSTANTS = {"pi": math.pi, "e": math.e}
BINARY: dict[type[ast.operator], Callable[[Number, Number], Number]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
}
_PLAIN = (ast.Expression, ast.Name, ast.BinOp, ast.UnaryOp, ast.UAdd, ast.USub, ast.Load, *BINARY)
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_-]*")
_SUCH = {1: "hinge", 2: "tip, x"}
_LONGEST = 500
_DEEPEST = 100


AT_ONCE = ("force", "energy")
"""Measures that no formula knows."""
NONE: Mapping[str, int] = MappingProxyType({})


def names(text: str, measures: Mapping[str, int] = NONE) -> set[str]:
    """Names an expression needs a value for (not `pi`, `e`, functions). Raises InputError if it is not arithmetic.

    measures: further functions, whose arguments are names of parts and no values, with the number of these
    """
    used: set[str] = set()
    ahead: list[ast.AST] = [parse(text, measures)]
    while ahead:
        node = ahead.pop()
        if isinstance(node, ast.Name):
            used.add(node.id)
        ahead += () if measured(node, measures) else ast.iter_child_nodes(node)
    return used - {*ONE, *MANY, *_CONSTANTS}


def measured(node: ast.AST, measures: Mapping[str, int]) -> tuple[str, ...]:
    """Return the name and the arguments of a measure; nothing for any other part of an expression."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in measures:
        return node.func.id, *(_part(argument) for argument in node.args)
    return ()


def _part(node: ast.AST) -> str:
    """Return the name of a part of a scene, in quotes or not (left-hinge reads like a difference); else nothing."""
    pieces: list[ast.AST] = []
    while isinstance(node, ast.BinOp) and isinstance(node.op, ast.Sub):
        pieces.append(node.right)
        node = node.left
    pieces.append(node)
    names = [getattr(piece, "id", getattr(piece, "value", "")) for piece in reversed(pieces)]
    return "-".join(str(name) if isinstance(name, str | int) else "" for name in names)


def evaluate(text: str, values: Mapping[str, float]) -> float:
    """The value of an expression; nan where arithmetic has none (a division by zero). Raises InputError."""
    return float(evaluate_array(text, values))


def evaluate_array(text: str, values: Mapping[str, Number]) -> Number:
    """Evaluate an expression entry by entry for arrays that broadcast, in the precision of the arrays."""
    with np.errstate(all="ignore"):
        value = np.asarray(_value(parse(text).body, {**_CONSTANTS, **values}))
    return np.where(np.isfinite(value), value, np.nan)


def parse(text: str, measures: Mapping[str, int] = NONE) -> ast.Expression:
    """The syntax tree of an expression. Raises InputError if it is not arithmetic; measures: see `names`."""
    return _parsed(text, tuple(measures.items()))


@lru_cache(maxsize=256)
def _parsed(text: str, measures: tuple[tuple[str, int], ...]) -> ast.Expression:
    if len(text) > _LONGEST:
        raise InputError(f"expression: longer than {_LONGEST} characters")
    try:
        with warnings.catch_warnings(action="ignore"):
            tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise InputError(f"expression: {text!r} is not arithmetic") from None
    _check(tree, text, dict(measures))
    return tree


def _check(tree: ast.Expression, text: str, measures: Mapping[str, int]) -> None:
    """Refuse all but arithmetic, level by level, so that the rest is shallow enough for recursion."""
    level: list[ast.AST] = [tree]
    for _ in range(_DEEPEST):
        inner: list[ast.AST] = []
        for node in level:
            if (found := measured(node, measures)) and isinstance(node, ast.Call):
                _check_measure(found, node, measures[found[0]])
            elif isinstance(node, ast.Call):
                _check_call(node, text, measures)
                inner += node.args
            else:
                _check_plain(node, text)
                inner += ast.iter_child_nodes(node)
        level = inner
    if level:
        raise InputError(f"expression: nested deeper than {_DEEPEST}")


def _check_plain(node: ast.AST, text: str) -> None:
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        try:
            if math.isfinite(node.value):  # type: ignore[arg-type]
                return
        except OverflowError:  # an integer beyond the floats
            pass
        raise InputError(f"expression: {text!r} has a number beyond 1e308")
    if not isinstance(node, _PLAIN):
        found = "^, but a power is **" if isinstance(node, ast.BitXor) else type(node).__name__
        raise InputError(f"expression: {text!r} has {found}; use numbers, names, + - * / ** and functions")


def _check_call(node: ast.Call, text: str, measures: Mapping[str, int]) -> None:
    name = node.func.id if isinstance(node.func, ast.Name) else None
    if name in AT_ONCE:
        raise InputError(
            f"expression: {name} depends on the forces of the same instant, which formulas would decide on; it is not "
            "known in formulas. Take rates, or what a state or a sample keeps of them"
        )
    if name not in ONE and name not in MANY:
        known = [*ONE, *MANY, *measures]
        near = get_close_matches(name or "", known, 1)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise InputError(f"expression: {text!r} calls what is none of {', '.join(known)}{hint}")
    if node.keywords or (len(node.args) != 1 if name in ONE else len(node.args) < 2):
        raise InputError(f"expression: {name} takes {'one number' if name in ONE else 'two numbers or more'}")


def _check_measure(found: tuple[str, ...], node: ast.Call, count: int) -> None:
    name, *parts = found
    # A name in quotes may hold anything, as those of files of others do.
    named = [_NAME.fullmatch(part) or (part and isinstance(argument, ast.Constant) and part == argument.value)
             for part, argument in zip(parts, node.args, strict=True)]  # fmt: skip
    if node.keywords or len(parts) != count or not all(named):
        wanted = "the name of a part" if count == 1 else "two names"
        raise InputError(
            f"expression: {name}({', '.join(parts)}): {name} takes {wanted}, such as {name}({_SUCH[count]})"
        )


def _value(node: Any, values: Mapping[str, Number]) -> Number:
    if isinstance(node, ast.Constant):
        return float(node.value)  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        if node.id not in values:
            raise InputError(f"expression: {node.id!r} is not known; there are {', '.join(sorted(values))}")
        return values[node.id]
    if isinstance(node, ast.UnaryOp):
        inner = _value(node.operand, values)
        return -inner if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.BinOp):
        return BINARY[type(node.op)](_value(node.left, values), _value(node.right, values))
    arguments = [_value(argument, values) for argument in node.args]
    return ONE[node.func.id](*arguments) if node.func.id in ONE else reduce(MANY[node.func.id], arguments)
