"""Functions of time as Python expressions, and their symbolic derivatives by the chain rule."""

from __future__ import annotations

from collections.abc import Callable

from shoal.scene.formula import Node, make

_PLAIN = 5
_SIGNS = {"+": (1, 1, 2), "-": (1, 1, 2), "*": (2, 2, 3), "/": (2, 2, 3), "**": (4, 5, 3)}
"""Precedence of an operator, and the least precedence of its left and right operand without brackets."""
_NAMES = {"min": "np.minimum", "max": "np.maximum", "ramp": "ramp", "rise": "ramp"}


def text(node: Node, variable: str = "t") -> str:
    """Return a tree as an expression of Python with numpy, and `ramp` of `timed`."""
    return _text(node, variable)[0]


def _text(node: Node, variable: str) -> tuple[str, int]:
    if not isinstance(node, tuple):
        return (variable, _PLAIN) if node == "t" else (repr(float(node)), 3 if node < 0 else _PLAIN)
    operation, *arguments = node
    parts = [_text(argument, variable) for argument in arguments]
    if operation in _SIGNS:
        binds, left, right = _SIGNS[operation]
        first, last = (_closed(part, least) for part, least in zip(parts, (left, right), strict=True))
        return f"{first} {operation} {last}" if binds == 1 else f"{first}{operation}{last}", binds
    if operation == "neg":
        return f"-{_closed(parts[0], 3)}", 3
    if operation == "square":
        return f"{_closed(parts[0], _PLAIN)}**2", 4
    inner = ", ".join(part for part, _ in parts)
    if operation == "step":
        return f"np.heaviside({inner}, 1.0)", _PLAIN
    return f"{_NAMES.get(operation, f'np.{operation}')}({inner})", _PLAIN


def _closed(part: tuple[str, int], least: int) -> str:
    written, binds = part
    return written if binds >= least else f"({written})"


def slope(node: Node) -> Node:
    """Return the derivative of a smooth tree by t."""
    if not isinstance(node, tuple):
        return 1.0 if node == "t" else 0.0
    operation, *arguments = node
    return _SLOPES[operation](*arguments)


def _power(u: Node, n: Node) -> Node:
    if isinstance(n, float):
        return make("*", make("*", n, make("**", u, n - 1.0)), slope(u))
    exponent = make("*", n, make("log", u))
    return make("*", make("**", u, n), slope(exponent))


def _chain(outer: Callable[[Node], Node]) -> Callable[[Node], Node]:
    return lambda u: make("*", outer(u), slope(u))


_SLOPES: dict[str, Callable[..., Node]] = {
    "+": lambda u, w: make("+", slope(u), slope(w)),
    "-": lambda u, w: make("-", slope(u), slope(w)),
    "*": lambda u, w: make("+", make("*", slope(u), w), make("*", u, slope(w))),
    "/": lambda u, w: make("/", make("-", make("*", slope(u), w), make("*", u, slope(w))), make("**", w, 2.0)),
    "**": _power,
    "neg": lambda u: make("neg", slope(u)),
    "square": _chain(lambda u: make("*", 2.0, u)),
    "sin": _chain(lambda u: make("cos", u)),
    "cos": _chain(lambda u: make("neg", make("sin", u))),
    "tan": _chain(lambda u: make("/", 1.0, make("**", make("cos", u), 2.0))),
    "tanh": _chain(lambda u: make("-", 1.0, make("**", make("tanh", u), 2.0))),
    "sqrt": _chain(lambda u: make("/", 0.5, make("sqrt", u))),
    "exp": _chain(lambda u: make("exp", u)),
    "log": _chain(lambda u: make("/", 1.0, u)),
    "rise": _chain(lambda u: make("*", 30.0, make("**", make("*", u, make("-", 1.0, u)), 2.0))),
}
"""Derivatives of the operations in a tree between its breakpoints, of their arguments."""
