"""Verification: a run is not believed before a more careful one agrees.

Energy and drift cannot see everything: an energy-conserving step may be far too long, a chaotic motion loses every
digit in time, a coarse mesh of a thin rod locks. So a run is made, made more carefully for every source of error that
its scene has (`sources`), compared, and rejected where the two are too far apart. A more careful run that fails says
nothing about the first one: others are made until one can be believed (`ways`). A service of the native solver makes
these runs too; those of other engines' are local.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.deviation import Deviation
from shoal.engines.event_comparison import Event, EventComparison
from shoal.engines.gauss import GaussEngine
from shoal.engines.roundings import sensitive
from shoal.engines.sources import SOURCES, WRONG, Examined, Outcome, Rejected
from shoal.engines.undecided import GRAZING, ORDER
from shoal.engines.ways import as_run
from shoal.error_budget import ErrorBudget
from shoal.findings import Finding
from shoal.json_values import plain
from shoal.mechanics import findings as kinds
from shoal.mechanics.event_record import place_of
from shoal.mechanics.reach import span
from shoal.scene import GROUND, Scene
from shoal.scene.joints import places
from shoal.trajectory import Array, Trajectory

_NO_PATH = 1e-9
"""Of the machine's size: markers that stay nearer to a pin go nowhere."""
WORTH = 0.01
"""What the model leaves out is worth a warning beyond this fraction of the scale."""


@dataclass(frozen=True)
class Verification:
    """Estimated errors of a run at its markers.

    errors: numerical errors, and what the model leaves out [m], by the names of `SOURCES`; unknown where a source could
    not be estimated, and `note` says why; angle_error: of the time step [rad]; scale: how far the markers get from the
    ground [m]; rejected: why the more careful run is itself not to be trusted; engine: that made the run, if it is not
    the native one, from which that of time is then how far it is off, whichever of them is wrong; deviations: the
    second runs, which estimate the error of any other quantity too; events: their comparison in time; undecided:
    decisions on contacts that the time error leaves open, and the other outcome of each; roundings: of measured values
    that the time error leaves open; unclear: contacts whose forces are a choice that moves the machine; shared: impacts
    of several contacts at one instant whose order matters
    """

    errors: ErrorBudget
    scale: float
    note: str = ""
    rejected: str = ""
    angle_error: float | None = None
    engine: str = ""
    deviations: tuple[Deviation, ...] = field(default=(), repr=False, compare=False)
    events: EventComparison | None = None
    undecided: tuple[Outcome, ...] = ()
    roundings: tuple[Finding, ...] = ()
    unclear: tuple[str, ...] = ()
    shared: tuple[Event, ...] = ()

    def error(self, source: str) -> float:
        """Return the known error of a source [m]; 0 where none is known."""
        return self.errors.known.get(source, 0.0)

    def to_json(self) -> dict[str, Any]:
        """Return plain data, for `model["verification"]`."""
        names = ("scale", "note", "rejected", "angle_error", "engine")
        found = {f"{source.name}_error": self.errors.estimates.get(source.name) for source in SOURCES}
        found |= {name: getattr(self, name) for name in names} | {"not_estimated": self.errors.unknown}
        contacts: dict[str, Any] = {}
        if self.events is not None:
            contacts["events"] = self.events.to_json()
            contacts["undecided"] = [
                {**one.decision.to_json(), "distance": one.away.distance, "matters": one.matters}
                for one in self.undecided
            ]
        return dict(plain(found | contacts))

    @property
    def findings(self) -> list[Finding]:
        """Return the reason for rejecting the run, or remarks on errors that are large and do not reject it."""
        rejection = self._rejection()
        return [*(self._remarks() if rejection is None else [rejection]), *self._contacts(), *self.roundings]

    def _rejection(self) -> Finding | None:
        if self.rejected:
            return kinds.CAREFUL_REJECTED.found(f"a more careful run is rejected ({self.rejected})")
        found = (self.error("time"), WRONG * self.scale, "m"), (self.angle_error or 0.0, WRONG, "rad")
        for error, allowed, unit in found:
            if error > allowed and self.engine:
                text = f"{self.engine} differs from the native solver by about {error:.2g} {unit}"
                return kinds.DIFFERS.found(f"{text}: its model or its steps are others", error=error, allowed=allowed)
            if error > allowed:
                text = f"the time error is about {error:.2g} {unit}"
                return kinds.TIME_ERROR.found(text, error=error, allowed=allowed)
        for source, kind, text in (
            ("contacts", kinds.CONTACTS_OPEN, "what the time error leaves open of contacts moves a marker by {:.2g} m"),
            ("mesh", kinds.MESH_ERROR, "the mesh error is about {:.2g} m"),
            ("bending", kinds.BENDING_ERROR, "modal rods bend too far: cables, which may, end about {:.2g} m away"),
        ):
            if (error := self.error(source)) > WRONG * self.scale:
                return kind.found(text.format(error), error=error, allowed=WRONG * self.scale)
        return None

    def _contacts(self) -> list[Finding]:
        """Return open decisions on contacts that matter, and the first event that a more careful run does not have."""
        named = {GRAZING: kinds.NEAR_GRAZING, ORDER: kinds.ORDER_OPEN}
        found = [
            named[one.what].found(
                f"{one.text}: the other outcome moves a marker by {away:.2g} m",
                time=one.time, margin=one.margin, error=one.error, distance=away,
            )
            for one, away in ((each.decision, each.away.distance) for each in self.undecided if each.matters)
        ]  # fmt: skip
        if not found and self.events is not None and self.events.differs:
            text = f"a more careful run has other events: {self.events.text}"
            found = [kinds.EVENTS_DIFFER.found(text, time=self.events.until)]
        if self.shared:
            first, *_ = self.shared
            times = sorted({event["time"] for event in self.shared})
            names = " and ".join(dict.fromkeys(place_of(event) for event in self.shared if event["time"] == times[0]))
            later = f" (and at {len(times) - 1} later instants)" if times[1:] else ""
            text = (
                f"the impact of {names} at t = {times[0]:.6g} s{later} is shared with contacts that touch: "
                f"one after the other they would have impulses that differ by {first['order']:.2g} of their size"
            )
            found.append(kinds.SIMULTANEOUS.found(text, time=times[0], instants=len(times), difference=first["order"]))
        if self.unclear:
            text = (
                f"{', '.join(self.unclear)} bear a load together with different friction: how they share it is a choice"
            )
            found.append(kinds.UNCLEAR_CONTACTS.found(text))
        return found

    def _remarks(self) -> list[Finding]:
        found = [kinds.NOT_ESTIMATED.found(self.note)] if self.note else []
        for source, kind, remark in (
            ("theory", kinds.SHEAR_LEFT_OUT, "shear and rotary inertia that slender rods leave out are worth {:.2g} m"),
            ("bending", kinds.BENDS_FAR, "that modal rods bend more than a little is worth {:.2g} m"),
            ("friction", kinds.CREEPS, "what dry friction should hold creeps by {:.2g} m"),
        ):
            if self.error(source) > WORTH * self.scale:
                found.append(kind.found(remark.format(self.error(source)), error=self.error(source)))
        return found


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
    """Return a run of one lane with the errors that were estimated of it, rejected where they are too large."""
    found = {"errors": verification.errors.to_json(), "verification": verification.to_json()}
    model = {**trajectory.model, **found}
    return replace(trajectory, model=model, lane_findings=[verification.findings])


def verify(trajectory: Trajectory, scene: Scene, native: Engine | None = None) -> Verification:
    """Estimate the errors of a run of a scene by more careful ones. native: the native solver, else the one here."""
    scene = as_run(scene, trajectory)
    scale = _scale(trajectory, scene)
    concerned = [source for source in SOURCES if source.concerns(scene)]
    if "unknowns" not in trajectory.model:
        note = f"errors not estimated: {trajectory.engine} does not tell its unknowns"
        unknown = {source.name: None for source in concerned if source.name in ("time", "mesh")}
        return Verification(ErrorBudget(unknown), scale, note)
    seen = Examined(trajectory, scene, scale, native or GaussEngine())
    found = seen.found
    notes = []
    for source in concerned:
        try:
            found[source.name], note = source.look(seen)
        except Rejected as rejected:
            return Verification(ErrorBudget({source.name: None}), scale, rejected=str(rejected))
        notes.append(note)
    # A source of no second runs, as of theory in a machine without slender rods, has no error.
    errors = {
        name: None if each is None else sum(one.distance for one in each) for name, each in found.items() if each != []
    }
    in_time = found["time"]
    return Verification(
        ErrorBudget(errors),
        scale,
        "; ".join(filter(None, notes)),
        angle_error=in_time[0].angle if in_time else None,
        engine="" if trajectory.engine == GaussEngine().name else trajectory.engine,
        deviations=tuple(one for each in found.values() for one in each or ()),
        events=in_time[0].events if in_time and "events" in trajectory.model else None,
        undecided=tuple(seen.outcomes),
        roundings=tuple(filter(None, (sensitive(one.one, one.other, one.factor) for one in (in_time or ())[:1]))),
        unclear=tuple(trajectory.model.get("unclear_contacts", ())),
        shared=tuple(event for event in trajectory.model.get("events", ()) if "order" in event),
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
