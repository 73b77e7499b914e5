"""Kinds of findings about an import: what is not in the scene, and what that changes."""

from __future__ import annotations

import re
from collections.abc import Iterable

from shoal.findings import Finding, Kind, Severity

CONSTRAINTS = Kind(
    "file-constraints-left-out", Severity.CAUTION,
    "Constraints of the file are not in the scene, which has more degrees of freedom: it is another machine.",
    "state them as joints of the scene",
)  # fmt: skip
FORCES = Kind(
    "file-forces-left-out", Severity.CAUTION,
    "Actuators, springs, dampers or rotors of the file are not in the scene: what they hold or drive moves freely.",
    "state them as loads, or as fields of joints",
)  # fmt: skip
CONTACTS = Kind(
    "file-contacts-left-out", Severity.CAUTION,
    "Shapes of the file that touch are no contacts of the scene: bodies pass through each other and through the floor.",
    "state `contacts` where bodies touch",
)  # fmt: skip
LIMITS = Kind(
    "file-limits-left-out", Severity.CAUTION,
    "Limits of the file are not in the scene: motion beyond them is not that of the machine.",
    "state `stops`, or a start within the limits",
)  # fmt: skip
UNMOVING = Kind(
    "file-parts-without-motion", Severity.NOTE,
    "Parts of the file that do not change the motion are not in the scene: sensors, pictures, numerics of MuJoCo.",
)  # fmt: skip
ASSUMED = Kind(
    "file-leaves-open", Severity.NOTE, "What the file leaves open, or states as no body can have it, was assumed.",
)  # fmt: skip
_WORDS = (
    (re.compile(r"touch others|<collision>|contact pairs"), CONTACTS),
    (re.compile(r"its limits|<safety_controller>"), LIMITS),
    (re.compile(r"^actuators|damping|its spring|<spring_stiffness>|the part|armature|frictionloss|yield"), FORCES),
    (re.compile(r"gravity compensation|the medium|plugins|<transmission>|wind"), FORCES),
)
"""Words of lines on what is left out, and what they change; others change no motion."""


def findings(left_out: Iterable[str], missing: Iterable[str], notes: Iterable[str]) -> list[Finding]:
    """Return a finding of each kind that there is, with the number of lines and the first of them."""
    missing = list(missing)
    lines: dict[Kind, list[str]] = {}
    for line in left_out:
        kind = next((kind for words, kind in _WORDS if words.search(line)), UNMOVING)
        lines.setdefault(CONSTRAINTS if line in missing else kind, []).append(line)
    if told := list(notes):
        lines[ASSUMED] = told
    order = (CONSTRAINTS, FORCES, CONTACTS, LIMITS, UNMOVING, ASSUMED)
    return [_of(kind, lines[kind]) for kind in order if kind in lines]


def _of(kind: Kind, lines: list[str]) -> Finding:
    more = f", and {len(lines) - 1} more" if len(lines) > 1 else ""
    return kind.found(f"{lines[0]}{more}", lines=float(len(lines)))
