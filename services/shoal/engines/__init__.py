"""The engines: one list, one contract. Each is imported when it is first asked for; reading the names costs nothing."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shoal.engines.known import ENGINES
from shoal.errors import InputError, needs_extra

if TYPE_CHECKING:
    from shoal.engines.contract import Engine


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


def _tree() -> Engine:
    from shoal.engines.tree import TreeEngine

    return TreeEngine()


def _mujoco() -> Engine:
    from shoal.engines.mujoco import MujocoEngine

    return MujocoEngine()


ENGINES |= {
    "gauss": _gauss,
    "exudyn": _exudyn,
    "exudyn-ge": _exudyn_ge,
    "casadi": _casadi,
    "tree": _tree,
    "mujoco": _mujoco,
}


def _remote(url: str) -> Engine:
    with needs_extra("services"):
        from shoal.engines.remote import RemoteEngine
    return RemoteEngine(url)


def get_engine(name: str) -> Engine:
    """The engine of that name, or the one that a service at an http(s) address runs. Raises InputError."""
    if name in ENGINES:
        return ENGINES[name]()
    if str(name).startswith(("http://", "https://")):
        return _remote(name)
    raise InputError(f"engine: no engine {name!r}; there are {', '.join(ENGINES)}, or the address of a service")


__all__ = ["ENGINES", "get_engine"]
