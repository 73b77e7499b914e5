"""Arithmetic expressions in named numbers, read without `eval`: what a user may write in a problem."""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping
from typing import Any

from shoal.errors import InputError

_FUNCTIONS: dict[str, Callable[..., float]] = {
    "sin": math.sin,
    "cos": math.cos,
    "sqrt": math.sqrt,
    "exp": math.exp,
    "log": math.log,
}
_BINARY: dict[type[ast.operator], Callable[[float, float], float]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: float(a**b),
}
_LONGEST = 500


def names(text: str) -> set[str]:
    """Names an expression uses, functions left out. Raises InputError if it is not arithmetic."""
    return {node.id for node in ast.walk(_parse(text)) if isinstance(node, ast.Name)} - set(_FUNCTIONS)


def evaluate(text: str, values: Mapping[str, float]) -> float:
    """The value of an expression; nan where arithmetic has none (a division by zero). Raises InputError."""
    try:
        return _value(_parse(text).body, values)
    except (ZeroDivisionError, OverflowError, ValueError):
        return math.nan


def _parse(text: str) -> ast.Expression:
    if len(text) > _LONGEST:
        raise InputError(f"expression: longer than {_LONGEST} characters")
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError):
        raise InputError(f"expression: {text!r} is not arithmetic") from None
    for node in ast.walk(tree):
        _check(node, text)
    return tree


def _check(node: ast.AST, text: str) -> None:
    plain = (ast.Expression, ast.Name, ast.BinOp, ast.UnaryOp, ast.UAdd, ast.USub, ast.Load, *_BINARY)
    number = isinstance(node, ast.Constant) and isinstance(node.value, int | float)
    call = isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in _FUNCTIONS
    if not (isinstance(node, plain) or number or call):
        raise InputError(
            f"expression: {text!r} has {type(node).__name__}; use numbers, names, + - * / ** and functions"
        )


def _value(node: Any, values: Mapping[str, float]) -> float:
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
        return _BINARY[type(node.op)](_value(node.left, values), _value(node.right, values))
    return _FUNCTIONS[node.func.id](*(_value(argument, values) for argument in node.args))
