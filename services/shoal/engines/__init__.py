"""The engines: one list, one contract. Each is imported when it is first asked for."""

from __future__ import annotations

from collections.abc import Callable

from shoal.engines.contract import Capabilities, Engine
from shoal.errors import InputError


def _gauss() -> Engine:
    from shoal.engines.gauss import GaussEngine

    return GaussEngine()


def _exudyn() -> Engine:
    from shoal.engines.exudyn import ExudynEngine

    return ExudynEngine()


def _exudyn_ge() -> Engine:
    from shoal.engines.exudyn import ExudynEngine

    return ExudynEngine(beam="geometrically-exact")


def _casadi() -> Engine:
    from shoal.engines.casadi import CasadiEngine

    return CasadiEngine()


ENGINES: dict[str, Callable[[], Engine]] = {
    "gauss": _gauss,
    "exudyn": _exudyn,
    "exudyn-ge": _exudyn_ge,
    "casadi": _casadi,
}


def get_engine(name: str) -> Engine:
    """The engine of that name. Raises InputError."""
    if name not in ENGINES:
        raise InputError(f"engine: no engine {name!r}; there are {', '.join(ENGINES)}")
    return ENGINES[name]()


__all__ = ["ENGINES", "Capabilities", "Engine", "get_engine"]
