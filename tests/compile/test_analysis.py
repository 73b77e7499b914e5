"""The lists of variables that replace Numba's own."""

from __future__ import annotations

from typing import Any

from numba.core import ir
from numba.core.compiler import run_frontend
from shoal.compile.analysis import variables


def _listed(value: Any) -> list[Any]:
    """Variables by the definition: of statements and expressions, all members; of containers, all parts."""
    if isinstance(value, ir.Var):
        return [value]
    if isinstance(value, ir.Expr):
        return _listed(value._kws)
    if isinstance(value, ir.Inst):
        return _listed(vars(value))
    if isinstance(value, dict):
        return _listed([*value.values()])
    return [found for part in value for found in _listed(part)] if isinstance(value, list | tuple) else []


def _function(x: Any, y: Any, rows: Any) -> Any:
    total = {"a": x[0] + y}
    for k in range(len(rows)):
        rows[k], z = max(x[k], y, key=None), (x, (y, k))
        total["a"] += z[1][0] if k % 2 else -rows[k]
    return total, [y * one for one in x]


def test_variables_of_all_statements_are_listed_in_order() -> None:
    statements = [one for block in run_frontend(_function).blocks.values() for one in block.body]
    assert sum(map(len, map(_listed, statements))) > 100
    for statement in statements:
        assert variables(statement) == _listed(statement), statement
