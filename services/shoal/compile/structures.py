"""Structures of kernels in memory, passed by reference.

A kernel that is handed a structure by value copies it, member by member. Here a structure is written once into storage
of its own, and its address is passed on.
"""

from __future__ import annotations

import hashlib
import struct
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import models, register_model

BYTES = 8192
"""Room for the largest structure, which is checked where one is written."""


def storage() -> npt.NDArray[np.float64]:
    """Return memory for one structure."""
    return np.zeros(BYTES // 8)


def write(place: npt.NDArray[np.float64], structure: tuple[Any, ...]) -> None:
    """Write a structure into its storage, with pointers in place of its arrays, which must outlive its use.

    Members in order, each at a multiple of its alignment, 8 bytes but for yes or no.
    """
    memory = place.view(np.uint8).data
    end, _ = _laid(structure, 0, memory)
    assert end <= place.nbytes


def _laid(value: Any, at: int, memory: memoryview) -> tuple[int, int]:
    """Lay a member of a structure at the next place that is aligned for it; returns where it ends, its alignment."""
    if isinstance(value, tuple):
        align = _alignment(value)
        at += -at % align
        for part in value:
            at, _ = _laid(part, at, memory)
        return at + -at % align, align
    if isinstance(value, bool | np.bool_):
        memory[at] = bool(value)
        return at + 1, 1
    at += -at % 8
    if isinstance(value, np.ndarray):
        struct.pack_into("=Q", memory, at, value.__array_interface__["data"][0])
    elif isinstance(value, int | np.integer):
        struct.pack_into("=q", memory, at, int(value))
    else:
        struct.pack_into("=d", memory, at, value)
    return at + 8, 8


def _alignment(value: Any) -> int:
    """In bytes."""
    if isinstance(value, tuple):
        return 8 if any(_alignment(part) == 8 for part in value) else 1
    return 1 if isinstance(value, bool | np.bool_) else 8


class Reference(types.Type):  # type: ignore[misc]
    """The type of a structure in memory, whose members compiled code reads where it uses them.

    A structure that is passed by value is passed member by member, to every function that a kernel calls: most of the
    code of a large kernel. Parts that are structures with names are references too. Compiled code takes for granted
    that nobody writes the structure itself while a kernel runs; the arrays it points to change.
    """

    def __init__(self, kind: Any) -> None:
        self.dtype, self.instance_class = kind, kind.instance_class
        layout = hashlib.sha256(_layout(kind).encode()).hexdigest()[:16]
        super().__init__(f"{kind.instance_class.__name__}@{layout}")


def _layout(kind: Any) -> str:
    """Return the members of a structure by name and type, and those of its parts."""
    parts = ", ".join(map(_layout, getattr(kind, "types", ())))
    own = getattr(kind, "instance_class", None)
    return f"{own.__module__}.{own.__qualname__}{kind.fields}({parts})" if own else f"{kind}({parts})"


@register_model(Reference)
class _Address(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, kind: Reference) -> None:
        super().__init__(manager, kind, manager.lookup(kind.dtype).get_value_type().as_pointer())


def _member(kind: Any) -> Any:
    return Reference(kind) if isinstance(kind, types.BaseNamedTuple) else kind


@infer_getattr
class _Members(AttributeTemplate):  # type: ignore[misc]
    key = Reference

    def generic_resolve(self, reference: Reference, name: str) -> Any:
        """Return the type of a member."""
        kind = reference.dtype
        members = dict(zip(kind.fields, kind.types, strict=True))
        return _member(members[name]) if name in members else None


@lower_getattr_generic(Reference)
def _read(context: Any, builder: Any, reference: Reference, place: Any, name: str) -> Any:
    number = reference.dtype.fields.index(name)
    at = cgutils.gep_inbounds(builder, place, 0, number)
    if isinstance(reference.dtype.types[number], types.BaseNamedTuple):
        return at
    value = builder.load(at)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value
