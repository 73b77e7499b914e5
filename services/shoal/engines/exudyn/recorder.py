"""Recorder of the items of an Exudyn system, as statements of a script that makes the same system."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from types import ModuleType
from typing import Any

import numpy as np

from shoal.engines.course import PiecewiseFunction
from shoal.engines.exudyn import formulas
from shoal.engines.exudyn.bodies import System
from shoal.scene import Function
from shoal.scene.formula import written

Key = tuple[str, int]
"""Kind of number and number of an item of Exudyn's."""


@dataclass
class RecordedItem:
    """One item: what it is of (a field of the scene), its class, its options and its number."""

    where: str
    kind: str
    options: dict[str, Any]
    key: Key
    name: str = ""
    """The variable that holds its number in the script."""

    @property
    def family(self) -> str:
        """Node, Object, Marker or Load."""
        return next(family for family in ("Node", "Object", "Marker", "Load") if self.kind.startswith(family))


@dataclass
class Recorder(System):
    """A system that remembers what is entered, and the functions that Exudyn calls."""

    entries: list[RecordedItem] = field(default_factory=list)
    where: str = ""
    fields: dict[int, tuple[PiecewiseFunction, str]] = field(default_factory=dict)
    made: dict[int, tuple[Any, Callable[..., Any], tuple[Any, ...]]] = field(default_factory=dict)

    def enter(self, what: str) -> None:
        """See System."""
        self.where = what

    def add(self, kind: str, **options: Any) -> Any:
        """See System."""
        number = super().add(kind, **options)
        self.entries.append(RecordedItem(self.where, kind, options, key_of(number)))
        return number

    def function(self, make: Callable[..., Any], *given: Any) -> Any:
        """See System."""
        found = super().function(make, *given)
        self.made[id(found)] = found, make, given
        return found

    def course(self, f: Function, field: str, *, held: bool = False) -> PiecewiseFunction:
        """See System."""
        course = super().course(f, field, held=held)
        self.fields[id(course)] = course, field
        return course


def key_of(number: Any) -> Key:
    """Return the key of an item's number: its kind and its value."""
    return type(number).__name__, number.GetIndex()


def is_number_of_item(value: Any) -> bool:
    """Return whether a value is such a number of Exudyn's."""
    return type(value).__name__ in ("NodeIndex", "ObjectIndex", "MarkerIndex", "LoadIndex")


def identifier(text: str) -> str:
    """A name that Python takes for a variable, if something follows it."""
    name = re.sub(r"\W", "_", text, flags=re.ASCII)
    return f"_{name}" if not name or name[0].isdigit() else name


@dataclass
class Texts:
    """Values as Python text, and the functions that it needs: their definitions, and what they are made by."""

    recorder: Recorder
    exu: Any
    functions: dict[str, list[str]] = field(default_factory=dict)
    """Definitions by the name of the variable, each with a comment before it."""
    used: set[Callable[..., Any]] = field(default_factory=set)
    names: dict[int, str] = field(default_factory=dict)

    def of(self, value: Any, items: Callable[[Key], str] | None = None) -> str:
        """A value; items: what stands for the number of an item."""
        if is_number_of_item(value):
            assert items is not None
            return items(key_of(value))
        if isinstance(value, np.ndarray):
            return f"np.array({self.of(value.tolist(), items)})"
        if type(value).__name__ == "Vector3DList":
            return f"exu.Vector3DList({self.of([value[k].tolist() for k in range(len(value))], items)})"
        if isinstance(value, bool | np.bool_ | str | None):
            return repr(value.item() if isinstance(value, np.bool_) else value)
        if isinstance(value, int | np.integer):
            return repr(int(value))
        if isinstance(value, float):
            return repr(float(value) + 0.0)  # no negative zeros
        if isinstance(value, list | tuple):
            return f"[{', '.join(self.of(one, items) for one in value)}]"
        if isinstance(value, dict):
            return f"{{{', '.join(f'{key!r}: {self.of(one, items)}' for key, one in value.items())}}}"
        return self._function(value)

    def _function(self, value: Any) -> str:
        if value is self.exu or isinstance(value, ModuleType):
            return "exu"
        if id(value) in self.recorder.made:
            _, make, given = self.recorder.made[id(value)]
            self.used.add(make)
            return f"{make.__name__}({', '.join(self.of(one) for one in given)})"
        if isinstance(value, Function):
            return self._law(value)
        course = value.__self__
        assert isinstance(course, PiecewiseFunction)
        return self._of_time(course, value.__name__)

    def _law(self, law: Function) -> str:
        """A force as a function of its elongation."""
        if law.formula is not None:
            return f"lambda x: {formulas.text(law.formula, 'x')}"
        return f"polynomials({{'until': np.inf}}, {self._table(law)})"

    def _of_time(self, course: PiecewiseFunction, which: str) -> str:
        """The variable that holds a function of time or its slope, which is defined with the first use."""
        where = self.recorder.fields[id(course)][1]
        key = hash((id(course), which))
        if key not in self.names:
            stem = identifier("_".join([*where.split(".")[1:], *(["rate"] if which == "slope" else [])]))
            name, number = stem, 2
            while name in self.functions:
                name, number = f"{stem}_{number}", number + 1
            self.names[key] = name
            self.functions[name] = [f"# {where}: {_said(course)}", f"{name} = {self._definition(course, which)}"]
        return self.names[key]

    def _definition(self, course: PiecewiseFunction, which: str) -> str:
        if course.pieces is None:
            more = ", derivative=True" if which == "slope" else ""
            return f"polynomials(clock, {self._table(course.function)}{more})"
        nodes = [formulas.slope(node) if which == "slope" else node for node in course.pieces.nodes]
        texts = [f"lambda t: {formulas.text(node)}" for node in nodes]
        different = list(dict.fromkeys(texts))
        repeated = len(different) < len(texts)
        more = f", {[different.index(one) for one in texts]}" if repeated else ""
        return f"in_pieces(clock, {self.of(course.pieces.edges.tolist())}, [{', '.join(different)}]{more})"

    def _table(self, f: Function) -> str:
        """Knots and coefficients."""
        from scipy.interpolate import CubicSpline

        times, values = np.array(f.table).T
        if f.smooth:
            coefficients = CubicSpline(times, values).c.T
        else:
            coefficients = np.stack([np.diff(values) / np.diff(times), values[:-1]], axis=1)
        return f"{self.of(times.tolist())}, {self.of(coefficients.tolist())}"


def _said(course: PiecewiseFunction) -> str:
    f = course.function
    if f.table is not None:
        return f"{'a spline' if f.smooth else 'straight lines'} through {len(f.table)} rows"
    return written(f.formula) if f.expression is None else f.expression


def source(functions: set[Callable[..., Any]], *modules: ModuleType) -> list[str]:
    """The text of functions, and of those of the same modules that they call, without annotations."""
    known = {name: one for module in modules for name, one in inspect.getmembers(module, inspect.isfunction)}
    wanted, waiting = set(), {one.__name__ for one in functions}
    while waiting:
        name = waiting.pop()
        wanted.add(name)
        waiting |= (_called(known[name].__code__) & known.keys()) - wanted
    order = sorted(wanted, key=lambda name: (known[name].__module__, known[name].__code__.co_firstlineno))
    return [_bare(inspect.getsource(known[name])) for name in order]


def _called(code: Any) -> set[str]:
    inner = (_called(one) for one in code.co_consts if inspect.iscode(one))
    return set(code.co_names).union(*inner)


def _bare(text: str) -> str:
    """A definition without the annotations of its arguments and its result, which none of ours nests brackets in."""
    import ast

    lines = text.splitlines()
    for node in sorted(ast.walk(ast.parse(text)), key=lambda node: -getattr(node, "lineno", 0)):
        if not isinstance(node, ast.FunctionDef):
            continue
        for argument in node.args.args + node.args.kwonlyargs + [node.args.vararg]:
            if argument is not None:
                argument.annotation = None
        row, last = node.lineno - 1, node.body[0].lineno - 1
        lines[row:last] = [f"{' ' * node.col_offset}def {node.name}({ast.unparse(node.args)}):"]
    return "\n".join(lines)
