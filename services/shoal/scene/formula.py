"""An expression in the time t as a small tree: numbers, the string "t", and tuples (operation, argument, ...).

Trees are hashable, so that equal parts are seen to be equal; what holds no t is one number. Leaves of formulas that are
no functions of time alone are names of signals and measures of the machine.
"""

from __future__ import annotations

import ast
import keyword
import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache, reduce
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.scene import expression

Node = Any
"""A float, "t", or a tuple of an operation of OPERATIONS and its arguments; a name or a `Measure`."""

MEASURES = {
    **dict.fromkeys(("angle", "rate", "slide", "slide_rate"), 1),
    **dict.fromkeys(("distance", "distance_rate", "position", "velocity", "acceleration"), 2),
}
"""Measures of the machine that a formula may call, with the number of names that they take."""


@dataclass(frozen=True)
class Measure:
    """A measure of the machine: its kind, of MEASURES, and the names of parts that it takes."""

    kind: str
    names: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.kind}({', '.join(self.names)})"

    @property
    def text(self) -> str:
        """Return it as a scene has it: names that read like something else stand in quotes."""
        plain = (name if name.isidentifier() and not keyword.iskeyword(name) else repr(name) for name in self.names)
        return f"{self.kind}({', '.join(plain)})"


_SIGNS: dict[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
_CONSTANTS = {"pi": math.pi, "e": math.e}
OPERATIONS: dict[str, Any] = {
    **expression.ONE,
    **expression.MANY,
    **{sign: expression.BINARY[kind] for kind, sign in _SIGNS.items()},
    "neg": np.negative,
    "square": np.square,
    "rise": lambda x: x * x * x * (10.0 + x * (6.0 * x - 15.0)),
}
"""What a user may write, and: neg, square, and rise, which is ramp between 0 and 1."""


@lru_cache(maxsize=256)
def tree(text: str) -> Node:
    """The tree of an expression in t, signals and measures. Raises InputError."""
    return _tree(expression.parse(text, MEASURES).body)


def leaves(node: Node) -> Iterator[Any]:
    """Yield the names and measures of a tree, "t" among them."""
    if isinstance(node, tuple):
        for argument in node[1:]:
            yield from leaves(argument)
    elif not isinstance(node, float):
        yield node


def _tree(node: Any) -> Node:
    if isinstance(node, ast.Constant):
        return float(node.value)  # type: ignore[arg-type]
    if isinstance(node, ast.Name):
        return _CONSTANTS.get(node.id, node.id)
    if isinstance(node, ast.UnaryOp):
        inner = _tree(node.operand)
        return make("neg", inner) if isinstance(node.op, ast.USub) else inner
    if isinstance(node, ast.BinOp):
        return make(_SIGNS[type(node.op)], _tree(node.left), _tree(node.right))
    if measured := expression.measured(node, MEASURES):
        return Measure(measured[0], measured[1:])
    name, arguments = node.func.id, [_tree(argument) for argument in node.args]
    if name == "sign":  # which switches as two steps do
        return make("-", make("step", *arguments), make("step", make("neg", *arguments)))
    return make(name, *arguments) if name in expression.ONE else reduce(lambda a, b: make(name, a, b), arguments)


def make(operation: str, *arguments: Node) -> Node:
    """A tree, as short as it is without thought. Raises InputError for constants without a finite value."""
    if all(isinstance(argument, float) for argument in arguments):
        with np.errstate(all="ignore"):
            number = float(OPERATIONS[operation](*arguments))
        if not math.isfinite(number):
            raise InputError(f"function: {written((operation, *arguments))} has no finite value")
        return number
    first, last = arguments[0], arguments[-1]
    if operation == "*" and 0.0 in (first, last):
        return 0.0
    if operation == "*" and 1.0 in (first, last):
        return last if first == 1.0 else first
    if operation in ("+", "-") and last == 0.0:
        return first
    if operation == "+" and first == 0.0:
        return last
    if operation == "-" and first == last:
        return 0.0
    if operation in ("min", "max") and first == last:
        return first
    if operation == "**" and last in (1.0, 2.0):
        return first if last == 1.0 else ("square", first)
    return (operation, *arguments)


def value(node: Node, t: Any) -> Any:
    """Values at the times t, of their shape (or one number) and precision; not finite where arithmetic has none."""
    with np.errstate(all="ignore"):
        return _value(node, t)


def _value(node: Node, t: Any) -> Any:
    if isinstance(node, tuple):
        return OPERATIONS[node[0]](*(_value(argument, t) for argument in node[1:]))
    return t if node == "t" else node


def written(node: Node) -> str:
    """A tree as a user would write it."""
    if not isinstance(node, tuple):
        return f"{node:g}" if isinstance(node, float) else str(node)
    operation, *arguments = node
    if operation in _SIGNS.values():
        closed = [isinstance(argument, tuple) and argument[0] in ("+", "-", "neg") for argument in arguments]
        first, last = (
            f"({written(argument)})" if brackets and operation != "+" else written(argument)
            for argument, brackets in zip(arguments, closed, strict=True)
        )
        return f"{first} {operation} {last}" if operation in "+-" else f"{first}{operation}{last}"
    inner = ", ".join(written(argument) for argument in arguments)
    return {"neg": f"-({inner})", "square": f"({inner})**2"}.get(operation, f"{operation}({inner})")
