"""Compiled kernels of the mechanics, which the integrators call through a table of function pointers.

Forces, constraints and each family of elements are compiled once, and not into every integrator. Each public function
calls the kernel of the same name by its address; the kernel follows it, with an underscore. `ready` compiles the
kernels that a model calls, or takes them from the cache: constraints where there are some, and the families of elements
that it has.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import numpy as np
from numba import njit, typeof, types

from shoal.compile import function_pointers, locks
from shoal.compile.function_pointers import call
from shoal.compile.pointers import raw_type
from shoal.compile.structures import Reference, storage
from shoal.mechanics import dynamics, signals
from shoal.mechanics.contact import decision, motion, response
from shoal.mechanics.dynamics import ACCELERATION, ALL, ELASTIC, SIMPLE, Work, instant
from shoal.mechanics.elements import families
from shoal.mechanics.elements.families import KERNELS
from shoal.mechanics.least import drift, principle
from shoal.mechanics.least.principle import PROJECTION
from shoal.mechanics.model import Arrays, FunctionTable, seen
from shoal.mechanics.numerics.tile import SINGLE, Array, Index, Tile, index

Kernel = tuple[Any, tuple[Any, ...]]
"""A function that is compiled, and the types of its arguments."""
Seek = Callable[[float, Array], None]
"""Finds the acceleration of a single lane in place of the kernels: (time [s], the forces Q (unknowns,), which it
replaces by the acceleration). The state, C_q and eta are in the work space, where it leaves the multipliers."""

_CALLED = ctypes.CFUNCTYPE(None, ctypes.c_double, ctypes.POINTER(ctypes.c_double))


@njit(cache=True, error_model="numpy", forceinline=True)
def force(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, f: Array) -> None:
    """All of `dynamics.force`."""
    t = instant(w, t)
    call(m.table.motion, (tile, m, w, t, z, zdot, 0.0, f, ALL))


@njit(cache=True, error_model="numpy", forceinline=True)
def elastic_force(tile: Tile, m: Arrays, w: Work, z: Array, f: Array, exact: bool) -> None:
    """The elastic part of `dynamics.force`; exact: without the elements of `dynamics.add_mean_force`."""
    part = SIMPLE if exact else ELASTIC
    call(m.table.motion, (tile, m, w, 0.0, z, z, 0.0, f, part))


@njit(cache=True, error_model="numpy", forceinline=True)
def acceleration(tile: Tile, m: Arrays, w: Work, t: float, z: Array, zdot: Array, tolerance: float, a: Array) -> None:
    """All of `dynamics.force`, then `dynamics.accelerate`; z, zdot, a: (rows, lanes)."""
    t = instant(w, t)
    arguments = (m, w, t, z, zdot, tolerance, a, ACCELERATION)
    call(m.table.motion, (tile, *arguments))


@njit(cache=True, error_model="numpy")
def _motion(tile, m, w, t, z, zdot, tolerance, a, part):  # type: ignore[no-untyped-def]
    if part == ACCELERATION and dynamics.free(m):
        dynamics.free_acceleration(tile, m, w, z, zdot, a)
        return
    dynamics.force(tile, m, w, t, z, zdot, a, part)
    if part == ACCELERATION:
        dynamics.accelerate(tile, m, w, t, z, zdot, tolerance, a)


@njit(cache=True, error_model="numpy", forceinline=True)
def settle(
    tile: Tile, m: Arrays, w: Work, t: float, tolerance: float, iterations: int = 3, found: bool = False
) -> None:
    """Remove the drift of a constrained model (nothing to do where sharing expressed every joint).

    found: whether the last accelerations that were found are of this state, or as near as those of a stage at its time
    """
    if m.constraints.size > 0 and m.projects:
        t = instant(w, t)
        ready = found and m.table.sought == 0 and m.method == PROJECTION
        arguments = (m, w, t, tolerance, iterations, ready)
        call(m.table.settle, (tile, *arguments))
    if m.gaps.size > 0 and len(tile) == 1:
        call(m.table.hold, (tile, m, w, t, tolerance))


@njit(cache=True, error_model="numpy", forceinline=True)
def meet(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float) -> None:
    """Let driven constraints take up their new rates at once: a plastic impact, the least change in the mass metric."""
    call(m.table.settle, (tile, m, w, t, tolerance, 3, False))


@njit(cache=True, error_model="numpy", forceinline=True)
def project_rates(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float) -> None:
    """`drift.project_rates`: the same without the change of the coordinates."""
    call(m.table.settle, (tile, m, w, t, tolerance, 0, False))


@njit(cache=True, error_model="numpy")
def _settle(tile, m, w, t, tolerance, iterations, ready):  # type: ignore[no-untyped-def]
    drift.project(tile, m, w.gauss, t, w.z, w.zdot, tolerance, iterations, ready)


@njit(cache=True, error_model="numpy", forceinline=True)
def energies(tile: Tile, m: Arrays, w: Work) -> None:
    """`dynamics.energies`."""
    call(m.table.energies, (tile, m, w))


@njit(cache=True, error_model="numpy")
def _energies(tile, m, w):  # type: ignore[no-untyped-def]
    dynamics.energies(tile, m, w)


@njit(cache=True, error_model="numpy")
def _constrain(tile, m, w, t, z, zdot, tolerance, a):  # type: ignore[no-untyped-def]
    dynamics.constrain(tile, m, w, t, z, zdot, tolerance, a)


@njit(cache=True, error_model="numpy")
def _least(tile, m, w, t, z, zdot, tolerance, a):  # type: ignore[no-untyped-def]
    principle.constrain(tile, m, w.gauss, t, z, zdot, a, tolerance)


@njit(cache=True, error_model="numpy", forceinline=True)
def look(
    tile: Tile, m: Arrays, w: Work, z: Array, zdot: Array, every: bool = True, whole: bool = False
) -> None:  # fmt: skip
    """`response.look`."""
    call(m.table.look, (tile, m, w, z, zdot, every, whole))


@njit(cache=True, error_model="numpy", forceinline=True)
def decide(tile: Tile, m: Arrays, w: Work, t: float, tolerance: float) -> None:
    """`decision.decide`."""
    call(m.table.decide, (tile, m, w, t, tolerance))


@njit(cache=True, error_model="numpy")
def _look(tile, m, w, z, zdot, every, whole):  # type: ignore[no-untyped-def]
    response.look(tile, m, w, z, zdot, every, whole)


@njit(cache=True, error_model="numpy")
def _contact(tile, m, w, t, z, zdot, tolerance, a):  # type: ignore[no-untyped-def]
    motion.accelerate(tile, m, w, t, z, zdot, tolerance, a)


@njit(cache=True, error_model="numpy")
def _hold(tile, m, w, t, tolerance):  # type: ignore[no-untyped-def]
    motion.settle(tile, m, w, t, tolerance)


@njit(cache=True, error_model="numpy")
def _decide(tile, m, w, t, tolerance):  # type: ignore[no-untyped-def]
    decision.decide(tile, m, w, t, tolerance)


@njit(cache=True, error_model="numpy")
def _force(tile, family, z, zdot, f, w, power, moving):  # type: ignore[no-untyped-def]
    families.add_force(tile, family, z, zdot, f, w, power, moving)


@njit(cache=True, error_model="numpy")
def _energy(tile, family, z, w, energy, row):  # type: ignore[no-untyped-def]
    families.add_energy(tile, family, z, w, energy, row)


@njit(cache=True, error_model="numpy")
def _mean(tile, family, before, after, f, w):  # type: ignore[no-untyped-def]
    families.add_mean_force(tile, family, before, after, f, w)


@njit(cache=True, error_model="numpy")
def _stiffness(tile, family, z, w, out, first, viscous):  # type: ignore[no-untyped-def]
    families.tangent(tile, family, z, w, out, first, viscous)


_NUMBER, _COUNT, _FLAG, _ROWS = types.float64, types.int64, types.boolean, types.CPointer(types.float64)
_STATE_KERNELS: dict[str, Kernel] = {
    "motion": (_motion, (_NUMBER, _ROWS, _ROWS, _NUMBER, _ROWS, _COUNT)),
    "energies": (_energies, ()),
    "constrain": (_constrain, (_NUMBER, _ROWS, _ROWS, _NUMBER, _ROWS)),
    "least": (_least, (_NUMBER, _ROWS, _ROWS, _NUMBER, _ROWS)),
    "settle": (_settle, (_NUMBER, _NUMBER, _COUNT, _FLAG)),
    "look": (_look, (_ROWS, _ROWS, _FLAG, _FLAG)),
    "contact": (_contact, (_NUMBER, _ROWS, _ROWS, _NUMBER, _ROWS)),
    "hold": (_hold, (_NUMBER, _NUMBER)),
    "decide": (_decide, (_NUMBER, _NUMBER)),
}
"""Kernels of a whole state in the order of `FunctionTable`, and the types of their arguments after the tile and the two
structures."""
_FREE, _CONSTRAINED = ("motion", "energies"), ("constrain", "least", "settle")
_CONTACTS = ("look", "contact", "hold", "decide")
_USUAL = (*_FREE, *_CONSTRAINED)
"""Those of all machines, of those with constraints, and of those with gaps; the first two are compiled beforehand."""
_FAMILY_KERNELS: dict[str, Kernel] = {
    "force": (_force, (_ROWS, _ROWS, _ROWS, _ROWS, _ROWS, _FLAG)),
    "energy": (_energy, (_ROWS, _ROWS, _ROWS, _COUNT)),
    "mean": (_mean, (_ROWS, _ROWS, _ROWS, _ROWS)),
    "stiffness": (_stiffness, (_ROWS, _ROWS, _ROWS, _COUNT, _FLAG)),
}
"""Kernels of one family of elements, and the types of their arguments after the tile and the family."""

locks.install()
_FOUND: dict[tuple[Any, ...], int] = {}
_READY: dict[tuple[Any, ...], FunctionTable] = {}


def ready(tile: Tile, arrays: Arrays, room: Work) -> Arrays:
    """Return the same arrays with storage of their own and pointers to the kernels that they call."""
    acting = tuple(type(family) if family.size > 0 else None for family in arrays.elements)
    key = len(tile), arrays.constraints.size > 0, arrays.gaps.size > 0, bool(arrays.followed), acting
    if key not in _READY:
        wanted = _wanted(tile, arrays)
        state = [_address(name, tile, arrays, room) if name in wanted else 0 for name in _STATE_KERNELS]
        state.append(signals_address(tile, arrays, room))
        pointers = (family_pointers(name, tile, arrays.elements) for name in ("force", "energy", "mean"))
        _READY[key] = FunctionTable._make([*state, len(acting), *pointers, 0])
    return arrays._replace(storage=storage(), table=_READY[key])


def signals_address(tile: Tile, arrays: Arrays, room: Work) -> int:
    """Return where the kernel of signals is, 0 of a machine without any."""
    if not arrays.followed:
        return 0
    return address(("signals", len(tile)), lambda: signals.kernel(tile, arrays.followed, seen(arrays), room))


def family_pointers(name: str, tile: Tile, elements: tuple[Any, ...]) -> Index:
    """Addresses of "force", "energy", "mean" or "stiffness" by family; 0 for a family that has none of it."""
    return index([_address(name, tile, one) if one.size > 0 and _has(name, one) else 0 for one in elements])


def _has(name: str, family: Any) -> bool:
    return name != "mean" or KERNELS[type(family)].exact


def signatures(tile: Tile, arrays: Arrays, room: Work, *, every: bool = False) -> list[Kernel]:
    """Return the kernels that `ready` compiles, and the stiffness, for limits of stability and implicit steps.

    every: the kernels of any model
    """
    found = [_kernel(name, tile, arrays, room) for name in (_USUAL if every else _wanted(tile, arrays))]
    found += [signals.kernel(tile, arrays.followed, seen(arrays), room)] if arrays.followed else []
    elements = [family for family in arrays.elements if every or family.size > 0]
    return found + [_kernel(name, tile, one) for name in _FAMILY_KERNELS for one in elements if _has(name, one)]


def _wanted(tile: Tile, arrays: Arrays) -> tuple[str, ...]:
    constrained = _CONSTRAINED if arrays.constraints.size > 0 else ()
    contacts = _CONTACTS if tile == SINGLE else _CONTACTS[:1]  # lanes meet their events alone
    return *_FREE, *constrained, *(contacts if arrays.gaps.size > 0 else ())


def _kernel(name: str, tile: Tile, *parts: Any) -> Kernel:
    """Return the kernel for these structures, those of a state or a family, with its argument types."""
    if name in _FAMILY_KERNELS:
        (family,) = parts
        kernel, own = _FAMILY_KERNELS[name]
        kind: Any = (KERNELS[type(family)].tangent if name == "stiffness" else None) or type(family)
        return kernel, (typeof(tile), Reference(raw_type(typeof(kind._make(family)))), *own)
    arrays, room = parts
    kernel, own = _STATE_KERNELS[name]
    return kernel, (typeof(tile), *(Reference(raw_type(typeof(part))) for part in (seen(arrays), room)), *own)


_planning = ContextVar("planning", default=False)


@contextmanager
def planned() -> Iterator[None]:
    """Lay out structures whose types alone are needed: addresses of kernels are zero, and none is compiled."""
    token = _planning.set(True)
    try:
        yield
    finally:
        _planning.reset(token)


def _address(name: str, tile: Tile, *parts: Any) -> int:
    key = name, len(tile), type(parts[0])
    return address(key, lambda: _kernel(name, tile, *parts))


def address(key: tuple[Any, ...], kernel: Callable[[], Kernel]) -> int:
    """Return where a kernel is, found by a key that is quicker to make than its types; 0 while planning."""
    if _planning.get():
        return 0
    if key not in _FOUND:
        _FOUND[key] = function_pointers.address(*kernel())
    return _FOUND[key]


class Sought:
    """A `Seek` behind an address that compiled code can call; it must outlive the calls."""

    def __init__(self, seek: Seek, unknowns: int) -> None:
        self._seek, self._unknowns = seek, unknowns
        self._called = _CALLED(self._call)
        self.error: Exception | None = None

    def joined(self, arrays: Arrays, room: Work) -> Arrays:
        """The arrays of a single lane with accelerations that are sought."""
        where = ctypes.cast(self._called, ctypes.c_void_p).value or 0
        table = arrays.table._replace(constrain=_address("constrain", SINGLE, arrays, room), sought=where)
        return arrays._replace(table=table)

    def _call(self, t: float, place: Any) -> None:
        a = np.ctypeslib.as_array(place, (self._unknowns,))
        try:
            self._seek(t, a)
        except Exception as error:  # no exception passes through compiled code
            self.error = error
            a[:] = np.nan
