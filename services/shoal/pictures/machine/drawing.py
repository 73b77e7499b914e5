"""The description of a drawing that pages and stills share: lines, and how they are carried along."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from shoal.json_values import plain
from shoal.pictures.style import LOOKS
from shoal.trajectory import Array

FINE = 2.2
"""Symbols whose unit is smaller on the screen or paper are left out [pixels or 1/96 inch]: a pin has two units."""

ALWAYS = ("body", "plate", "mass", "ball", "block", "surface", "stop")
"""Looks that are drawn of any machine: they are the machine, not symbols."""


@dataclass(frozen=True)
class Carrier:
    """An affine motion: a point p of a symbol is at place + sum of p_k times axes[k].

    place [m], (frames, d); axes, (frames, k, d); one frame where it stands still. Bodies carry symbols by their axes,
    a spring by an axis that is stretched between its ends, a load by axes as long as it is large.
    """

    place: Array
    axes: Array

    def moved(self, lines: Array, frame: int | None = None) -> Array:
        """Return lines, (points, k), at every frame [m], (frames, points, d), or at one, (points, d)."""
        if frame is None:
            return np.asarray(self.place[:, None] + np.einsum("pk,fkd->fpd", lines, self.axes))
        k, n = min(frame, len(self.place) - 1), min(frame, len(self.axes) - 1)
        return np.asarray(self.place[k] + lines @ self.axes[n])

    def to_json(self, digits: int) -> dict[str, Any]:
        """Return plain numbers; in the plane the second axis only where it does not follow from the first one.

        It is at a right angle, as long as the first ("turned") or of length one ("stretched").
        """
        x = self.axes[:, 0]
        normal = np.stack([-x[:, 1], x[:, 0]], axis=1)
        length = np.linalg.norm(x, axis=1, keepdims=True)
        kinds = {"turned": normal, "stretched": normal / np.where(length > 0, length, 1.0)}
        alike = (name for name, y in kinds.items() if self.axes.shape[1:] == (2, 2) and np.allclose(self.axes[:, 1], y))
        kind = next(alike, "any")
        axes = self.axes if kind == "any" else x
        # Axes that are stretched count in metres, those of bodies are of length one.
        shown = np.round(axes, max(digits, 4)).reshape(len(axes), -1)
        return {"kind": kind, "place": plain(np.round(self.place, digits)), "axes": plain(shown)}

    def projected(self, plane: Array) -> Carrier:
        """Return it on paper; plane: see `ViewDirection`, (3, 2)."""
        return Carrier(self.place @ plane, self.axes @ plane)


@dataclass(frozen=True)
class Symbol:
    """Lines of one part of the machine.

    part: name of the joint, load or body; look: how they are drawn, of LOOKS; carrier: by its name
    lines: in the coordinates of the carrier about a place on it, (points, k), nan between lines; a look with a fill
    closes each. at: the place, (k,)
    """

    part: str
    look: str
    carrier: str
    lines: Array
    at: Array


@dataclass(frozen=True)
class Drawing:
    """Symbols in the order in which they are drawn; unit: their size [m], the radius of a pin is 0.4 of it."""

    symbols: tuple[Symbol, ...] = ()
    carriers: Mapping[str, Carrier] = field(default_factory=dict)
    unit: float = 0.0

    def path(self, symbol: Symbol, frame: int | None = None) -> Array:
        """Return the lines of a symbol [m], (frames, points, d), or at one frame, (points, d)."""
        return self.carriers[symbol.carrier].moved(symbol.lines + symbol.at, frame)

    def stands_still(self, symbol: Symbol) -> bool:
        """Return whether a symbol has one place at all times."""
        carrier = self.carriers[symbol.carrier]
        return len(carrier.place) == len(carrier.axes) == 1

    def parts(self, *looks: str) -> set[str]:
        """Return the names of parts that have a symbol of such a look, or of any."""
        return {symbol.part for symbol in self.symbols if not looks or symbol.look in looks}

    def projected(self, plane: Array) -> Drawing:
        """Return the drawing of a machine in space on paper; plane: see `ViewDirection`, (3, 2)."""
        return replace(self, carriers={name: one.projected(plane) for name, one in self.carriers.items()})

    @property
    def places(self) -> list[Array]:
        """Corners of all symbols over the motion [m], (any, d) each; of what a load carries its place."""
        return [self.path(symbol).reshape(-1, self.carriers[symbol.carrier].place.shape[1]) for symbol in self.symbols]

    def to_json(self, digits: int) -> dict[str, Any]:
        """Return plain numbers for the script of a page; digits: of places [m]."""
        used = {symbol.carrier for symbol in self.symbols}
        carriers = {name: one.to_json(digits) for name, one in self.carriers.items() if name in used}
        # Pins and feet are alike: their lines are there once.
        shapes: dict[bytes, int] = {}
        lines: list[Any] = []
        symbols = []
        for one in self.symbols:
            rounded = np.round(one.lines, digits + 1)
            number = shapes.setdefault(rounded.tobytes(), len(shapes))
            if number == len(lines):
                lines.append(plain(rounded))
            place = plain(np.round(one.at, digits + 1))
            symbols.append({"part": one.part, "look": one.look, "by": one.carrier, "shape": number, "at": place})
        looks = {look: LOOKS[look] for look in dict.fromkeys(["body", *(symbol.look for symbol in self.symbols)])}
        return {
            "unit": self.unit,
            "fine": FINE,
            "always": list(ALWAYS),
            "looks": looks,
            "carriers": carriers,
            "shapes": lines,
            "symbols": symbols,
        }
