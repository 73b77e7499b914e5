"""Runs of one model by one integrator: tiles of lanes on threads, in memory that later runs use again."""

from __future__ import annotations

import os
import pickle
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache, cached_property
from threading import Event
from typing import Any

import numpy as np

from shoal.compile import clock
from shoal.errors import InputError, UnstableStepError
from shoal.json_values import plain
from shoal.mechanics import plane
from shoal.mechanics import reach as reaches
from shoal.mechanics.assembly.groups import start_angle
from shoal.mechanics.assembly.redundancy import redundant_joints
from shoal.mechanics.assembly.starts import Starts
from shoal.mechanics.dynamics import Work
from shoal.mechanics.ended import Ended
from shoal.mechanics.event_record import letter
from shoal.mechanics.gaps import DRY
from shoal.mechanics.halts import Halts
from shoal.mechanics.integrators import Choice, halting
from shoal.mechanics.integrators import facts as facts_of
from shoal.mechanics.kernels import Seek
from shoal.mechanics.march import March
from shoal.mechanics.marched import (
    CLOSENESS,
    CONSTRAINT_DRIFT,
    ENERGY_DRIFT,
    EVALUATIONS,
    NUMBERS,
    STEPS,
    TURN,
    reduce_record,
)
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import SINGLE, WIDE, Array, Tile, stacked, tiles
from shoal.mechanics.start import start
from shoal.mechanics.states import States, split
from shoal.mechanics.still import Still
from shoal.mechanics.verdict import Limits
from shoal.mechanics.workspace import Workspace
from shoal.scene import Rod, Scene
from shoal.scene.held_drives import held_drives
from shoal.trajectory import Trajectory

INSTANTS = 8
"""The workspaces of so many lists of sampling times and kinds of tiles are kept."""
ALONE = 5
"""So many lanes are marched one after the other sooner than in a tile: a single one's elements fill the vectors too."""
FEW = 4
"""The same where a tile may be used by half, at two thirds of its cost."""
HALF = len(WIDE) // 2
LARGEST = 2**16
"""No workspace of more numbers is kept: beside its march the time to make it does not count."""


class Runs:
    """Motions of a model by one choice of an integrator, from its own start or from others.

    Its methods may be called from several threads at once: each march takes a workspace that is idle, or makes one.
    """

    def __init__(self, scene: Scene, model: Model, choice: Choice, *, alone: bool = True) -> None:
        """alone: whether the model is that of the scene as it is, with no lanes."""
        self.scene, self.model, self.choice = scene, model, choice
        self._alone = alone
        self._limits = Limits(scene, model)
        self._turns = _turns(scene, model)
        self._idle: dict[tuple[bytes, int, int, bool, int], tuple[Halts, list[Workspace]]] = {}
        self._found: dict[bool, bytes] = {}
        self._alike = not model.varies

    def run(
        self,
        times: Array,
        model: Model | None = None,
        *,
        threads: int | None = None,
        seek: Callable[[Arrays, Work], Seek] | None = None,
        begin: float | None = None,
        whole: bool = False,
    ) -> Trajectory:
        """Return the motion at `times` [s]; model: one that starts differently; begin: start of the run by the clock.

        whole: whether the trajectory holds its states.

        For threads and seek see `simulate`. Raises UnstableStepError if the step is beyond the stability limit.
        """
        begin = clock.now() if begin is None else begin
        end = float(times[-1])
        if end > 0:
            check_step(self.scene, self.choice, self.model)
        single = self._alone and model is None
        turns = self._turns if model is None else _turns(self.scene, model)
        moved = self.model if model is None else model
        parts = self._parts(moved.lanes)
        workers = 1 if len(parts) == 1 else min(threads or os.cpu_count() or 1, len(parts))
        d = moved.dimensions
        motion = np.empty((len(times), len(self.scene.markers), 2 * d + 2, moved.lanes))
        numbers = np.empty((NUMBERS, moved.lanes))
        limits, floor = self._limits, self._limits.energy_floor(end)
        left: list[tuple[Array, Array, Array]] = []
        happened: list[dict[str, Any]] = []
        recorded: dict[str, list[float]] = {}
        tie: dict[str, Any] = {}
        closed: list[str] = []
        unclear: list[str] = []
        words: list[list[tuple[float, str]]] = [[] for _ in range(moved.lanes)]
        states = States.room(moved, len(times)) if whole else None
        stop = Event() if workers > 1 else None

        def take(part: slice) -> tuple[Workspace, list[Workspace]]:
            """Return a workspace for some lanes, and where to put it afterwards."""
            count = part.stop - part.start
            tile = SINGLE if count == 1 else WIDE
            spare = HALF if self._halves and 1 < count <= HALF else 0
            halts, idle = self._workspaces(times, tile, spare, whole, count if self.model.gaps.size else 0)
            space = None if seek is not None or not idle else _taken(idle)
            if space is None:
                space = Workspace(self.scene.solver, moved, self.choice, tile, part, times, halts, seek, spare, whole)
            return space, idle if seek is None and self._alike and space.size <= LARGEST else []

        def march(part: slice) -> None:
            count, tile = part.stop - part.start, SINGLE if part.stop - part.start == 1 else WIDE
            space, idle = take(part)
            own: dict[int, tuple[Workspace, list[Workspace]]] = {}

            def own_march(lane: int) -> March:
                own[lane] = take(slice(part.start + lane, part.start + lane + 1))
                own[lane][0].clear()
                return own[lane][0].march

            space.march.own_march = own_march
            record = space.run(moved, part, stop)
            space.march.own_march = None
            record = record if states is None else split(record, states, len(tile), part)
            reduce_record(record, len(tile), part.start, turns, limits.anchors, floor, limits.span, motion, numbers)
            if count == 1 and self.model.gaps.size:
                words[part.start] = [letter(event) for event in space.events]
            if single:
                left.append(space.left)
                happened.extend(space.events)
                if moved.recorded:
                    recorded.update(space.recorded)
                    tie.update(space.nearest_tie)
                closed.extend(space.closed)
                unclear.extend(space.unclear)
            if single not in self._found:
                self._found[single] = pickle.dumps(self._facts(record.begin if single else None))
            for lane, (one, _) in own.items():
                words[part.start + lane] = [letter(event) for event in one.events]
            for one, others in ((space, idle), *own.values()):
                others.append(one)

        free = not (self.model.constraints.size or self.model.gaps.size)
        if end == 0.0 and seek is None and self._alike and free:
            self._still.fill(moved, turns, limits.anchors, motion, numbers)
            states = None if states is None else states._replace(q=moved.q0[None].copy(), v=moved.v0[None].copy())
            if single not in self._found:
                start = np.concatenate([moved.q0[:, 0], moved.v0[:, 0]])
                self._found[single] = pickle.dumps(self._facts(start if single else None))
        elif workers == 1:
            for part in parts:
                march(part)
        else:
            try:
                list(_pool(workers).map(march, parts))
            except BaseException:
                assert stop is not None
                stop.set()
                raise
        findings = limits.check(numbers, self.choice, moved.failed)
        largest = np.maximum.reduce(numbers, axis=1)
        facts = pickle.loads(self._found[single])
        facts["evaluations"] = int(largest[EVALUATIONS])
        facts |= ({"signals": recorded} if recorded else {}) | ({"nearest_tie": tie} if tie else {})
        if self.model.gaps.size and single:
            facts["events"], facts["closed_contacts"] = happened, closed
            facts |= {"unclear_contacts": unclear} if unclear else {}
        if largest[CLOSENESS] > 0.0:
            facts["distance_from_singular"] = float(largest[CLOSENESS] ** -0.5)
        ended = Ended(moved, end, *left[0], motion[-1, :, d, 0].copy()) if left and not any(findings) else None
        return Trajectory(
            engine="gauss",
            times=times,
            markers=tuple(self.scene.markers),
            points=motion[:, :, :d],
            angles=motion[:, :, d],
            velocities=motion[:, :, d + 1 : 2 * d + 1],
            rates=motion[:, :, 2 * d + 1],
            energy_drift=numbers[ENERGY_DRIFT],
            constraint_drift=numbers[CONSTRAINT_DRIFT],
            steps=int(largest[STEPS]),
            wall_s=clock.now() - begin,
            lane_findings=findings,
            model=facts,
            end=ended,
            words=words if self.model.gaps.size else (),
            states=states,
            changes=() if single else Changes(moved),
        )

    @cached_property
    def starts(self) -> Starts:
        """The models of the scene that start in other ways."""
        return Starts(self.scene, self.model)

    @cached_property
    def _still(self) -> Still:
        return Still(self.model)

    def _parts(self, lanes: int) -> list[slice]:
        """Split lanes into tiles: whole ones, and the rest in one more or, if that is faster, one by one.

        Lanes of adaptive integrators stay together, so that neighbours take equal steps. The number of threads has no
        influence.
        """
        switching = self.model.signals and (self.model.signals.switches > 0 or self.model.gaps.size > 0)
        if switching or np.any(self.model.gaps.kind == DRY):  # whose contacts are closed from the start
            return [slice(k, k + 1) for k in range(lanes)]
        _, parts = tiles(lanes)
        rest = lanes % len(WIDE)
        if lanes == 1 or facts_of(self.choice.name).adaptive or not self._alike:
            return parts
        # Half a tile costs hardly more, and computes what is left over as its neighbours: differences are exact.
        alone = (lanes <= FEW) * lanes if self._halves else (rest <= ALONE) * rest
        if alone:
            parts = parts[: lanes // len(WIDE)] + [slice(k, k + 1) for k in range(lanes - alone, lanes)]
        return parts

    @cached_property
    def _halves(self) -> bool:
        """Return whether a tile may be used by half: explicit steps of elastic elements, which then act on that half
        only.
        """
        explicit = facts_of(self.choice.name).explicit and not facts_of(self.choice.name).adaptive
        return explicit and self._alike and self.model.flexible > 0 and not self.model.constraints.size

    def _workspaces(
        self, times: Array, tile: Tile, spare: int, whole: bool, lanes: int
    ) -> tuple[Halts, list[Workspace]]:
        """Return the breakpoints of a run, and idle workspaces for it; lanes: 0 where it does not matter."""
        key = times.tobytes(), len(tile), spare, whole, lanes
        found = self._idle.get(key)
        if found is None:
            halts = halting(self.scene.solver, self.model, self.choice.name, float(times[-1]))
            found = self._idle.setdefault(key, (halts, []))
            for old in list(self._idle)[:-INSTANTS]:
                self._idle.pop(old, None)
        return found

    def _facts(self, begun: Array | None) -> dict[str, Any]:
        """Return the record of the computation; begun: coordinates and rates at the start, of a scene without lanes."""
        scene, model, choice = self.scene, self.model, self.choice
        return {
            "unknowns": model.unknowns,
            "elements": model.flexible,
            "constraints": len(model.constraint_names),
            "integrator": choice.name,
            "integrator_reason": choice.reason,
            "step": scene.solver.step,
            "stability_limit": choice.limit if np.isfinite(choice.limit) else None,
            "evaluations": 0,
            **({"slowed_modes": model.slowed} if model.slowed else {}),
            **({} if begun is None else self._started(begun)),
            **({"held_drives": held} if (held := held_drives(scene)) else {}),
            "bodies": {
                name: {"element": body.element, **(body.mesh if isinstance(body, Rod) else {})}
                for name, body in scene.bodies.items()
            },
        }

    def _started(self, begun: Array) -> dict[str, Any]:
        """The start as it is used, what of it was stated otherwise, and joints whose forces are not unique."""
        scene, model = self.scene, self.model
        used = start.body_states(model.frames, model.scene, *np.split(begun, 2))
        redundant = () if start.is_direct(scene) else redundant_joints(scene, used)
        told = start.facts(scene, used, float(reaches.size(scene))) | {"redundant_joints": list(redundant)}
        return dict(plain(told))


@dataclass(frozen=True, eq=False, repr=False)
class Changes(Sequence[Mapping[str, Any]]):
    """Values that lanes of a model use in place of stated ones (`start.changes`), computed on demand.

    A lane that has no start changes nothing.
    """

    model: Model

    def __getitem__(self, lane: Any) -> Any:
        return self._found[lane]

    def __len__(self) -> int:
        return self.model.lanes

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Sequence) and self._found == list(other)

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        return repr(self._found)

    @cached_property
    def _found(self) -> list[dict[str, Any]]:
        model, lanes = self.model, self.model.lanes
        stated = model.stated
        if not stated.starts_at_rest and start.is_direct(stated):
            return [{} for _ in range(lanes)]
        q, v = (np.broadcast_to(x, (len(x), lanes)) for x in (model.q0, model.v0))
        found = start.changes(stated, start.body_states(model.frames, model.scene, q, v), reaches.size(stated), lanes)
        failed = np.broadcast_to(model.failed, lanes)
        return [{} if none else one for one, none in zip(found, failed, strict=True)]

    def __reduce__(self) -> tuple[Any, ...]:
        # A model holds addresses of this process.
        return list, (self._found,)


def check_step(scene: Scene, choice: Choice, model: Model) -> None:
    """Raises UnstableStepError if the step is beyond the stability limit, InputError if no step is stable."""
    implicit = "" if model.gaps.size else " or solver.integrator=generalized-alpha"  # knows no contacts
    if choice.limit == 0.0:
        raise InputError(
            f"solver.integrator: {choice.name} is stable at no step for this scene, which can vibrate; use another one "
            "such as generalized-alpha"
        )
    if scene.solver.step > choice.limit:
        raise UnstableStepError(
            f"solver.step: {scene.solver.step:g} s is beyond the stability limit {choice.limit:.3e} s of "
            f"{choice.name} for this scene; use a smaller step{implicit}"
        )


@cache
def _pool(workers: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(workers, thread_name_prefix="shoal-tiles")


# A forked process has the pool of its parent without the threads, and would wait for them forever.
os.register_at_fork(after_in_child=_pool.cache_clear)


def _taken(idle: list[Workspace]) -> Workspace | None:
    """One of the idle workspaces, if another thread has not taken the last."""
    try:
        return idle.pop()
    except IndexError:
        return None


def _turns(scene: Scene, model: Model) -> Array:
    """Whole turns in the stated directions of the markers [rad], (markers, lanes) or (markers, 1)."""
    begins = model.marker_angles
    if begins is None:
        begins = stacked([start_angle(model.scene, marker) for marker in scene.markers.values()])
    return np.asarray(TURN * np.rint((begins - plane.angle(plane.unit(begins))) / TURN))
