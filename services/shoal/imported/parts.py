"""What is made: a scene as it grows, and what is left out of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from shoal.imported.composite import SMALL


@dataclass
class Parts:
    """Bodies, starts, joints and loads by their names, as a scene's data has them."""

    bodies: dict[str, Any] = field(default_factory=dict)
    initial: dict[str, Any] = field(default_factory=dict)
    joints: dict[str, Any] = field(default_factory=dict)
    loads: dict[str, Any] = field(default_factory=dict)
    contacts: dict[str, Any] = field(default_factory=dict)
    origin: dict[str, str] = field(default_factory=dict)
    """The element of the file of what has another name in the scene, by its path there (of bodies their name)."""
    left_out: list[str] = field(default_factory=list)
    """A line for everything that has no counterpart."""
    missing: list[str] = field(default_factory=list)
    """Those of them that hold bodies: without them the machine has other degrees of freedom."""
    notes: list[str] = field(default_factory=list)
    """A line for each assumption."""
    kept: set[int] = field(default_factory=set)
    """Equalities that joints stand for already, as MuJoCo counts them."""
    small: float = SMALL
    """Mass of a body without one, per mass that it carries."""
    between: set[str] = field(default_factory=set)
    """Bodies between joints of one body of the file."""
    away: dict[str, float] = field(default_factory=dict)
    """Of torsion springs that do not rest at the start, the angle [rad] from there to where they do."""

    def miss(self, line: str) -> None:
        """Note a constraint that has no counterpart."""
        self.missing.append(line)
        self.left_out.append(line)
