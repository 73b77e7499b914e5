"""A static equilibrium, and the evidence for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from shoal.error_budget import ErrorBudget, Grade
from shoal.findings import Concluded, Finding
from shoal.json_values import plain
from shoal.mechanics.analysis.findings import EquilibriumStatus, status_of
from shoal.mechanics.analysis.joint_reactions import Reactions
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.scene import Rod, Scene


@dataclass(frozen=True, eq=False)
class Equilibrium(Concluded):
    """A state of rest, and the evidence for it.

    scene: as it was given. findings: about the search and the state. balanced: whether the forces balance, stably or
    not. q: coordinates; multipliers: lambda, Q = C_q' lambda.
    markers: names; points [m], (markers, d); angles [rad], counted over full turns from the start, in
    space of the direction's shadow in the plane z = 0, (markers,).
    energy: strain, gravity, applied [J]; strain_energy: of every flexible body [J]. residual: unbalanced force
    relative to all forces; gap: worst violation of a joint; correction: the last one, relative to the machine's size.
    eigenvalues: of the reduced stiffness in the metric of the mass [rad^2/s^2], lowest first; all positive means
    stable, but where forces follow the motion; levels: below these each is zero to working accuracy. steps: load steps.
    contacts: the one-sided constraints that are closed, by name, and the forces with which they press [N or N m].
    reactions: in joints and contacts, None where the forces do not balance or where not asked for.
    turns: angles [rad] that force elements have counted, by joint or load; gap_angles: those of contacts, (gaps,),
    signal_angles: and of signals, (measures,).
    estimates: errors of the markers [m] by source, of the mesh and of the theory of slender rods, None where one is not
    known; None where none were looked for.
    """

    scene: Scene
    time: float
    findings: list[Finding]
    balanced: bool
    q: Array
    multipliers: Array
    markers: tuple[str, ...]
    points: Array
    angles: Array
    energy: dict[str, float]
    strain_energy: dict[str, float]
    residual: float
    gap: float
    correction: float
    eigenvalues: Array
    levels: Array
    iterations: int
    steps: int
    contacts: Mapping[str, float]
    reactions: Reactions | None = field(repr=False)
    turns: Mapping[str, Sequence[float]] = field(repr=False)
    gap_angles: Array = field(repr=False)
    signal_angles: Array = field(repr=False)
    estimates: Mapping[str, float | None] | None = None

    @property
    def status(self) -> EquilibriumStatus:
        """The worst status that the findings imply."""
        return status_of(self.findings)

    @property
    def errors(self) -> ErrorBudget:
        """Known errors of the markers [m]; that of the solver is its last correction."""
        if self.estimates is None:
            return ErrorBudget()
        solver = {"solver": float(self.correction) * span(self.scene)} if np.isfinite(self.correction) else {}
        return ErrorBudget({**self.estimates, **solver})

    @property
    def grade(self) -> Grade:
        """The colour of the answer."""
        return self.errors.grade(self.ok, span(self.scene))

    @property
    def ok(self) -> bool:
        """Return whether this is a stable equilibrium."""
        return self.status is EquilibriumStatus.OK

    @property
    def stable(self) -> bool:
        """Return whether every small displacement is pulled back."""
        held = bool(np.all(np.real(self.eigenvalues) > self.levels))
        return self.ok or (self.status is EquilibriumStatus.FAILED and held)

    def marker(self, name: str) -> Array:
        """Position of a marker [m], (d,)."""
        return np.asarray(self.points[self.markers.index(name)])

    def angle(self, name: str) -> float:
        """Direction at a marker [rad]."""
        return float(self.angles[self.markers.index(name)])

    def to_json(self) -> dict[str, Any]:
        """Plain data, which `shoal statics --json` prints."""
        return {
            "status": str(self.status),
            "message": self.message,
            "advice": self.advice,
            "findings": [one.to_json() for one in self.findings],
            "time": self.time,
            "stable": self.stable,
            "markers": {
                name: {
                    **dict(zip("xyz", plain(self.marker(name)), strict=False)),
                    "angle": self.angle(name),
                }
                for name in self.markers
            },
            "elements": {
                name: sum(body.mesh.values())
                for name, body in self.scene.bodies.items()
                if isinstance(body, Rod) and body.mesh
            },
            "models": {name: body.element for name, body in self.scene.bodies.items()},
            "energy": self.energy,
            "strain_energy": self.strain_energy,
            "residual": self.residual,
            "mesh_error": self.errors.estimates.get("mesh"),
            "theory_error": self.errors.estimates.get("theory"),
            "error": plain(self.errors.total),
            "errors": plain(self.errors.to_json()),
            "constraint_gap": self.gap,
            "correction": plain(self.correction),
            "eigenvalues": plain(np.real(self.eigenvalues)[:6]),
            "contacts": plain(dict(self.contacts)),
            "iterations": self.iterations,
            "load_steps": self.steps,
            "reactions": self.reactions.to_json() if self.reactions else {},
        }
