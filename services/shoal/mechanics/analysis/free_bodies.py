"""The machine taken apart: every body with coordinates of its own, no joints and contacts, and all loads on it.

Each vector of a body is affine in the machine's coordinates, so the coordinates of the free bodies are S q + s, their
rates S v and their accelerations S a; what their balance then lacks is what the joints do.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import scipy.sparse

from shoal.errors import InputError
from shoal.mechanics import plane
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import points
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.assembly.build import build
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.placement import place
from shoal.mechanics.forces import LAW
from shoal.mechanics.frames import BeamFrame
from shoal.mechanics.machine import Machine
from shoal.mechanics.modal.modes import held
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Bushing, InitialState, RigidBody, Rod, Scene, SignalFunction
from shoal.scene.formula import Measure, Node, leaves
from shoal.scene.loads import Thrust
from shoal.scene.sampled import Sampled
from shoal.scene.signals import HeldValue, StateValue, expanded


class FreeBodies:
    """The bodies of a model without its joints. horizon [s]: latest time that will be asked for.

    evaluator, placement, mass: of the free bodies. Friction in joints is not among their loads. strengths: of those
    loads that follow signals, which have to be put in at every state (`follow`).
    """

    def __init__(self, evaluator: Evaluator, horizon: float) -> None:
        whole = evaluator.model
        joined = Machine.of(whole.stated).placement
        alone, self._names = _with_strengths(whole)
        scene, added = _with_inertia(_without_joints(alone, joined))
        self.placement = place(scene)
        for name, load in scene.loads.items():
            if isinstance(load, Bushing) and load.resists_turns:
                raise InputError(
                    f"loads.{name}: forces of joints beside a bushing that resists turns are not yet found"
                )
        model = build(scene, horizon=horizon, placement=self.placement)
        # Springs at rest as they start keep the natural values of the whole machine; joint friction came before them.
        rubbing = whole.forces.size - model.forces.size
        law = whole.forces.law[LAW * rubbing :]
        angles = whole.start_angles[rubbing:]
        model = replace(model, forces=model.forces._replace(law=law), start_angles=angles, shared_tiles={})
        self.scene = whole.scene
        self.strengths: Mapping[str, float] = {}
        self.evaluator = Evaluator(model)
        self.evaluator.turns = evaluator.force_turns[rubbing:]
        self.mass = self.evaluator.mass - self._turning(added)
        self._map = _coordinates(self.placement, joined, whole.unknowns)

    def follow(self, strengths: Mapping[str, float]) -> None:
        """Let loads that follow signals be as strong as they are in the machine, by their fields."""
        self.strengths = strengths
        self.evaluator.put({self._names[field]: value for field, value in strengths.items()})

    def _turning(self, added: dict[str, float]) -> scipy.sparse.csc_array:
        """The mass matrix of inertias alone [kg m^2]."""
        diagonal = np.zeros(self.unknowns)
        for name, inertia in added.items():
            directors = self.placement.frames[name].vectors[1:]
            for row in (row for vector in directors for row in vector.own or ()):
                diagonal[row] = inertia if len(directors) == 1 else inertia / 2
        return scipy.sparse.csc_array(scipy.sparse.diags_array(diagonal))

    @property
    def unknowns(self) -> int:
        """Number of coordinates of the free bodies."""
        return self.evaluator.model.unknowns

    def state(self, q: Array, v: Array, a: Array) -> tuple[Array, Array, Array]:
        """Coordinates, rates and accelerations of the free bodies, (..., unknowns)."""
        matrix, constant = self._map
        return (matrix @ q.T).T + constant, (matrix @ v.T).T, (matrix @ a.T).T


def _with_strengths(model: Model) -> tuple[Scene, dict[str, str]]:
    """Return the scene of a model without states, whose loads follow numbers in place of signals.

    Then the names of these numbers, by the fields of the loads.
    """
    scene, loads = model.scene, dict(model.scene.loads)
    known = expanded(scene)
    signals: dict[str, Any] = {
        name: one for name, one in scene.signals.items() if not (_is_measured(known[name]) or isinstance(one, Sampled))
    }
    names = {}
    for field in (one for one in model.recorded if one.startswith("loads.")):
        names[field] = own = next(one for one in map("strength{}".format, count()) if one not in signals)
        signals[own] = SignalFunction(number=0.0)
        name, part = field.removeprefix("loads.").rsplit(".", 1)
        loads[name] = loads[name].model_copy(update={part: SignalFunction(expression=own)})
    return scene.model_copy(update={"loads": loads, "signals": signals, "states": {}}), names


def _is_measured(node: Node) -> bool:
    """Return whether a formula depends on the motion."""
    return any(isinstance(leaf, Measure | StateValue | HeldValue) for leaf in leaves(node))


def _without_joints(scene: Scene, placement: Placement) -> Scene:
    """The scene with every body flying free from where the joints placed it."""
    if scene.dimensions != plane.DIMENSIONS:
        return _without_joints_in_space(scene, placement)
    initial, bodies = {}, dict(scene.bodies)
    for name in scene.bodies:
        pose, start = placement.poses[name], placement.scene.start(name)
        axis, turning = pose.directors[0, :, 0], pose.turning[0, :, 0]
        turn = float(plane.angle(axis)) - start.angle
        initial[name] = InitialState.model_construct(
            angle=start.angle + turn - 2 * np.pi * np.rint(turn / (2 * np.pi)),
            rate=float(plane.cross(axis, turning)),
            position=tuple(pose.position[:, 0].tolist()),
            velocity=tuple(pose.velocity[:, 0].tolist()),
            modes=start.modes,
            mode_rates=start.mode_rates,
        )
        body = scene.bodies[name]
        if isinstance(body, Rod) and body.element == "modal":  # its modes are those of the machine
            bodies[name] = body.model_copy(update={"ends": held(scene, name)})
    return scene.model_copy(update=_alone(scene) | {"initial": initial, "bodies": bodies})


def _alone(scene: Scene) -> dict[str, Any]:
    """Return no joints and contacts, and loads that need none."""
    loads = {
        name: load.along(scene.joints[load.joint]) if isinstance(load, Thrust) else load
        for name, load in scene.loads.items()
    }
    return {"joints": {}, "contacts": {}, "loads": loads}


def _without_joints_in_space(scene: Scene, placement: Placement) -> Scene:
    """The same in space, with the directors that joints chose for the rods."""
    initial, bodies = {}, dict(scene.bodies)
    for name, pose in placement.poses.items():
        directors, turning = pose.directors[..., 0], pose.turning[..., 0]
        initial[name] = InitialState.model_construct(
            angle=None,
            rate=None,
            rotation=tuple(turns.vector_of(directors.T).tolist()),
            spin=tuple((0.5 * np.sum(np.cross(directors, turning), axis=0)).tolist()),
            position=tuple(pose.position[:, 0].tolist()),
            velocity=tuple(pose.velocity[:, 0].tolist()),
            guess=(),
        )
        frame = placement.frames[name]
        if isinstance(frame, BeamFrame) and frame.element.director is not None:
            bodies[name] = bodies[name].model_copy(update={"director": "xyz"[frame.element.director]})
    return scene.model_copy(update=_alone(scene) | {"initial": initial, "bodies": bodies})


def _with_inertia(scene: Scene) -> tuple[Scene, dict[str, float]]:
    """Add 1 kg m^2 to bodies without inertia about their centre, which cannot move alone."""
    lent = {name: 1.0 for name, body in scene.bodies.items() if isinstance(body, RigidBody) and body.inertia == 0.0}
    bodies = {
        name: body.model_copy(update={"inertia": lent[name]}) if name in lent else body
        for name, body in scene.bodies.items()
    }
    return scene.model_copy(update={"bodies": bodies}), lent


def _coordinates(free: Placement, joined: Placement, unknowns: int) -> tuple[scipy.sparse.csr_array, Array]:
    """Coordinates of the free bodies by those of the machine: a sparse matrix and a constant."""
    pairs = [(free.drivers[name], joined.drivers[name]) for name in free.drivers]
    for name, frame in free.frames.items():
        pairs += zip(frame.vectors, joined.frames[name].vectors, strict=True)
    found = points([there for _, there in pairs], unknowns)
    number, size = np.full(len(free.positions), -1), found.constant.shape[1]
    for k, (here, _) in enumerate(pairs):
        if here.own:
            number[list(here.own)] = size * k + np.arange(size)
    known = np.flatnonzero(number >= 0)
    chosen = scipy.sparse.csr_array((np.ones(len(known)), (known, number[known])), (len(number), found.constant.size))
    return scipy.sparse.csr_array(chosen @ found.rows), np.asarray(chosen @ found.constant.ravel())
