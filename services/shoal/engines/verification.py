"""Verification: a run is not believed before a more careful one agrees.

Energy and drift cannot see everything: an energy-conserving step may be far too long, a chaotic motion loses every
digit in time, a coarse mesh of a thin rod locks. So a run is made, made more carefully for every source of error that
its scene has (`sources`), compared, and rejected where the two are too far apart. A more careful run that fails says
nothing about the first one: others are made until one can be believed (`ways`). A service of the native solver makes
these runs too; those of other engines' are local.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.deviation import Deviation
from shoal.engines.gauss import GaussEngine
from shoal.engines.sources import SOURCES, WRONG, Examined, Rejected
from shoal.engines.ways import as_run
from shoal.error_budget import ErrorBudget
from shoal.mechanics.reach import span
from shoal.scene import GROUND, Scene
from shoal.scene.joints import places
from shoal.trajectory import Array, Status, Trajectory, plain

_NO_PATH = 1e-9
"""Of the machine's size: markers that stay nearer to a pin go nowhere."""
WORTH = 0.01
"""What the model leaves out is worth a warning beyond this fraction of the scale."""
SMALLER = "a smaller solver.step, or solver.relative_tolerance and solver.absolute_tolerance"
"""What cures a time error; the absolute tolerance is that of a motion of nanometres."""


@dataclass(frozen=True)
class Verification:
    """Estimated errors of a run at its markers [m], None where they were not estimated and `note` says why.

    time_error: against a more careful run of the same mesh; mesh_error: against twice as many elements, a third more
    than the two differ by, as the finer mesh has an error too (`LEFT`);
    theory_error: what the rods' theory leaves out, friction_error: how far what should stick creeps, as dry friction is
    smoothed, bending_error: of modal rods, against cables that may bend far, each None where there is nothing of the
    kind; scale: how far the markers get from the ground [m];
    rejected: why the more careful run is itself not to be trusted; engine: that made the run, if it is not the native
    one, from which that of time is then how far it is off, whichever of them is wrong; not_estimated: sources whose
    error is of interest and not known; deviations: the second runs, which estimate the error of any other quantity too
    """

    time_error: float | None
    mesh_error: float | None
    scale: float
    note: str = ""
    rejected: str = ""
    theory_error: float | None = None
    friction_error: float | None = None
    bending_error: float | None = None
    angle_error: float | None = None
    engine: str = ""
    not_estimated: tuple[str, ...] = ()
    deviations: tuple[Deviation, ...] = field(default=(), repr=False, compare=False)

    @property
    def errors(self) -> ErrorBudget:
        """All that is known of how far the markers are off [m]: numerical errors, and what the model leaves out."""
        known = {source.name: getattr(self, f"{source.name}_error") for source in SOURCES}
        return ErrorBudget(
            {source: error for source, error in known.items() if error is not None or source in self.not_estimated}
        )

    def to_json(self) -> dict[str, Any]:
        """Return plain data, for `model["verification"]`."""
        return dict(plain({one.name: getattr(self, one.name) for one in fields(self) if one.compare}))

    @property
    def complaint(self) -> str:
        """Return the reason for rejecting the run; empty if it is accepted."""
        if self.rejected:
            return f"a more careful run is rejected ({self.rejected}); use {SMALLER}"
        found = (self.time_error or 0.0, WRONG * self.scale, "m"), (self.angle_error or 0.0, WRONG, "rad")
        for error, allowed, unit in found:
            if error > allowed and self.engine:
                return (
                    f"{self.engine} differs from the native solver by about {error:.2g} {unit}: its model or its steps "
                    "are others; see that it means the same by this scene, and use a smaller solver.step if it heeds "
                    "that, or a shorter solver.duration if the motion is chaotic"
                )
            if error > allowed:
                return (
                    f"the time error is about {error:.2g} {unit}: use {SMALLER}, "
                    "or a shorter solver.duration if the motion is chaotic"
                )
        if self.mesh_error is not None and self.mesh_error > WRONG * self.scale:
            return f"the mesh error is about {self.mesh_error:.2g} m: use more elements, or --tolerance to find them"
        if (self.bending_error or 0.0) > WRONG * self.scale:
            return (
                f"modal rods bend too far: cables, which may, end about {self.bending_error:.2g} m away; "
                "use element: ancf-cable"
            )
        return ""

    @property
    def warning(self) -> str:
        """Return a remark on errors that are large and do not reject the run; empty if there are none."""
        found = [self.note] if self.time_error is None and self.note else []
        if (self.theory_error or 0.0) > WORTH * self.scale:
            found.append(f"shear and rotary inertia that slender rods leave out are worth {self.theory_error:.2g} m")
        if (self.bending_error or 0.0) > WORTH * self.scale:
            found.append(f"that modal rods bend more than a little is worth {self.bending_error:.2g} m")
        if (self.friction_error or 0.0) > WORTH * self.scale:
            found.append(f"what dry friction should hold creeps by {self.friction_error:.2g} m; lower coulomb_speed")
        return "; ".join(found)


def verified(engine: Engine, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
    """Run a scene and verify it; `errors` and `model["verification"]` hold the estimates. Raises InputError."""
    return run_verified(engine, scene, times)[0]


def run_verified(
    engine: Engine, scene: Scene, times: Sequence[float] | Array | None = None
) -> tuple[Trajectory, Verification | None]:
    """Run a scene and verify it, with the second runs; None of a run that failed. Raises InputError."""
    trajectory = engine.simulate(scene, times)
    if not trajectory.ok:
        return trajectory, None
    verification = verify(trajectory, scene, engine if trajectory.engine == GaussEngine().name else None)
    return with_errors(trajectory, verification), verification


def with_errors(trajectory: Trajectory, verification: Verification) -> Trajectory:
    """Return a run with the errors that were estimated of it, failed where they are too large."""
    found = {"errors": verification.errors.to_json(), "verification": verification.to_json()}
    model = {**trajectory.model, **found}
    if verification.complaint:
        return replace(trajectory, model=model, status=(Status.FAILED,), message=verification.complaint)
    return replace(trajectory, model=model, message=verification.warning)


def verify(trajectory: Trajectory, scene: Scene, native: Engine | None = None) -> Verification:
    """Estimate the errors of a run of a scene by more careful ones. native: the native solver, else the one here."""
    scene = as_run(scene, trajectory)
    scale = _scale(trajectory, scene)
    concerned = [source for source in SOURCES if source.concerns(scene)]
    if "unknowns" not in trajectory.model:
        note = f"errors not estimated: {trajectory.engine} does not tell its unknowns"
        missing = tuple(source.name for source in concerned if source.name in ("time", "mesh"))
        return Verification(None, None, scale, note, not_estimated=missing)
    seen = Examined(trajectory, scene, scale, native or GaussEngine())
    found: dict[str, list[Deviation] | None] = {}
    notes = []
    for source in concerned:
        try:
            found[source.name], note = source.look(seen)
        except Rejected as rejected:
            return Verification(None, None, scale, rejected=str(rejected), not_estimated=(source.name,))
        notes.append(note)
    errors = {name: sum(one.distance for one in each) if each else None for name, each in found.items()}
    in_time = found["time"]
    return Verification(
        errors["time"],
        errors.get("mesh"),
        scale,
        "; ".join(filter(None, notes)),
        theory_error=errors.get("theory"),
        friction_error=errors.get("friction"),
        bending_error=errors.get("bending"),
        angle_error=in_time[0].angle if in_time else None,
        engine="" if trajectory.engine == GaussEngine().name else trajectory.engine,
        not_estimated=tuple(name for name, each in found.items() if each is None),
        deviations=tuple(one for each in found.values() for one in each or ()),
    )


def _scale(trajectory: Trajectory, scene: Scene) -> float:
    """Return the scale of errors: the largest distance of a marker from the nearest ground joint [m].

    Without such joints, the extent of the markers' paths, and of the machine where there is a single instant.
    """
    points = trajectory.points[..., 0]
    sides = (side for joint in scene.joints.values() for side in places(joint))
    anchors = [scene.location(side) for side in sides if side.body == GROUND]
    least = _NO_PATH * span(scene)
    if not anchors:
        # One instant is no path.
        return max(float(np.max(np.ptp(points, axis=0))), least) if len(points) > 1 else span(scene)
    away = np.min([np.linalg.norm(points - np.array(anchor), axis=2) for anchor in anchors], axis=0)
    return max(float(np.max(away)), least)
