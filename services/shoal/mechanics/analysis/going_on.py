"""Machines that start in the state in which a run has left them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
from scipy.interpolate import BPoly

from shoal.errors import InputError
from shoal.mechanics.affine import Affine
from shoal.mechanics.analysis import triads
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.assembly.groups import start_angle
from shoal.mechanics.ended import measured, start_angles
from shoal.mechanics.frames import BeamFrame
from shoal.mechanics.machine import Machine
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array, stacked
from shoal.mechanics.reach import span
from shoal.scene import Scene
from shoal.scene.ended import End, mesh_of
from shoal.scene.signals import continuous_states, refuse_sampled

FITS = 1e-6
"""A state may miss the joints by so much, relative to the machine's size and speed: what a run may drift at most."""


def taken_up(model: Model, state: End) -> Model:
    """The model in that state, in all lanes. Raises InputError where it is that of another machine."""
    try:
        state.check(model.stated.bodies)
    except ValueError as error:
        raise InputError(str(error)) from None
    state = _finer(state, model.stated)
    vectors = [(name, vector) for name, frame in model.frames.items() for vector in frame.vectors]
    _check_count(model, state)
    differ = any(part.shape[1] > 1 for _, one in vectors for part in (one.constant, *one.terms.values()))
    found = [_coordinates(model, state, vectors, lane) for lane in range(model.lanes if differ else 1)]
    q, v = (np.stack(columns, axis=1) for columns in zip(*found, strict=True))
    q, v = (np.broadcast_to(part, (model.unknowns, model.lanes)).copy() for part in (q, v))
    scene = model.stated
    refuse_sampled(scene, "what it holds at the end of a run is not kept; start anew")
    if missing := sorted(set(scene.states) ^ set(state.states)):
        whose = "the run has" if missing[0] in state.states else "the scene has"
        raise InputError(f"initial.from: states.{missing[0]}: only {whose} such a state")
    states = continuous_states(scene)
    for k, (name, one) in enumerate(states.items()):
        v[model.unknowns - len(states) + k] = state.states[name] / one.size
    turned = model.signal_angles.copy()
    for k, name in enumerate(measured(model)):
        turned[k] = state.measures.get(name, turned[k])
    angles = start_angles(model, [state.turns] * model.start_angles.shape[1])
    known, stated = state.angles, model.scene.markers.items()
    markers = stacked([known.get(name, start_angle(model.scene, marker)) for name, marker in stated])
    model = replace(
        model, q0=q, v0=v, start_angles=angles, marker_angles=markers, signal_angles=turned, shared_tiles={}
    )
    for lane in range(model.lanes if model.varies else 1):
        _check_joints(model, lane)
    return model


def as_stated(scene: Scene, *, horizon: float = 0.0) -> Evaluator:
    """Return an evaluator of a scene where it states its start, be that the end of a run, but before any statics.

    horizon [s]: latest time that will be asked for. Raises InputError if the scene cannot be modelled, or its start as
    `taken_up` does.
    """
    model = Machine.of(scene).model(horizon)
    if isinstance(scene.initial_from, End):
        model = taken_up(model, scene.initial_from)
    return Evaluator(resting(model), one_sided=True)


def resting(model: Model) -> Model:
    """Return a model at whose start states of the user stand in place of their unknowns, as `evaluate` has them."""
    law = "equilibria and modes are of laws in continuous time: state that one, as a signal without a period"
    refuse_sampled(model.scene, law)
    states = slice(model.unknowns - len(model.scene.states), None)
    q, v = model.q0.copy(), np.broadcast_to(model.v0, model.q0.shape).copy()
    q[states], v[states] = v[states], 0.0
    return replace(model, q0=q, v0=v, shared_tiles={}) if model.scene.states else model


def moving(model: Model) -> Model:
    """Return the model of which `resting` returns another."""
    states = slice(model.unknowns - len(model.scene.states), None)
    q, v = model.q0.copy(), np.broadcast_to(model.v0, model.q0.shape).copy()
    q[states], v[states] = 0.0, q[states].copy()
    return replace(model, q0=q, v0=v, shared_tiles={}) if model.scene.states else model


def _finer(state: End, scene: Scene) -> End:
    """The state with nodes for the elements of the scene, which may be a multiple of those of the run."""
    bodies = {}
    for name, one in state.bodies.items():
        mine, there = mesh_of(scene.bodies[name]).get("elements", 0), one.mesh.get("elements", 0)
        if mine != there:
            both = {field: _divided(getattr(one, field), there, mine, one.length) for field in ("vectors", "rates")}
            bodies[name] = one.model_copy(update=both)
    return state.model_copy(update={"bodies": {**state.bodies, **bodies}}) if bodies else state


def _divided(vectors: Sequence[Sequence[float]], there: int, mine: int, length: float | None) -> list[list[float]]:
    """Places and derivatives by arc length at more nodes of a rod, on the polynomials of its elements."""
    try:
        nodes = np.array(vectors, dtype=float).reshape(there + 1, len(vectors) // (there + 1), -1)
    except ValueError:
        return []  # the count of vectors is refused
    curve = BPoly.from_derivatives(np.linspace(0.0, length or 1.0, there + 1), nodes)
    at = np.linspace(0.0, length or 1.0, mine + 1)
    found = np.stack([curve.derivative(k)(at) if k else curve(at) for k in range(nodes.shape[1])], axis=1)
    every = mine // there
    found[::every] = nodes
    return [list(map(float, vector)) for vector in found.reshape(len(at) * nodes.shape[1], -1)]


def _check_count(model: Model, state: End) -> None:
    for name, frame in model.frames.items():
        one = state.bodies[name]
        for field in ("vectors", "rates"):
            given = getattr(one, field)
            if len(given) != len(frame.vectors) or any(len(vector) != model.dimensions for vector in given):
                raise InputError(
                    f"initial.from: bodies.{name}.{field}: a body of this kind has {len(frame.vectors)} of "
                    f"{model.dimensions} components, found {len(given)}"
                )


def _coordinates(model: Model, state: End, vectors: list[tuple[str, Affine]], lane: int) -> tuple[Array, Array]:
    """Coordinates and rates at which the vectors of the bodies are those of the state.

    Moving points of the ground that no body is joined to stay where their motion begins.
    """
    d = model.dimensions
    stated = [[one for name in model.frames for one in getattr(state.bodies[name], f)] for f in ("vectors", "rates")]
    places, rates = (np.array(one, dtype=float).ravel() for one in stated)
    base = np.concatenate([one.constant[:, lane % one.constant.shape[1]] for _, one in vectors])
    rows, columns, entries = (np.array(part) for part in zip(*_entries(vectors, d, lane), strict=True))
    matrix = scipy.sparse.csc_array((entries, (rows, columns)), shape=(base.size, model.unknowns))
    used = np.unique(columns)
    part = matrix[:, used]
    solve = scipy.sparse.linalg.factorized(scipy.sparse.csc_array(part.T @ part))
    q, v = (part[:, lane % part.shape[1]].copy() for part in (model.q0, model.v0))
    for _ in range(2):  # the second time takes what the first one rounded off
        q[used] += solve(part.T @ (places - base - matrix @ q))
        v[used] += solve(part.T @ (rates - matrix @ v))
    size, speed = _scales(model, rates)
    for wanted, off, unit in ((size, matrix @ q + base - places, "m"), (speed, matrix @ v - rates, "m/s")):
        worst = int(np.argmax(np.abs(off)))
        if not abs(off[worst]) <= FITS * wanted:
            name = vectors[worst // d][0]
            raise InputError(
                f"initial.from: the joints hold {name} {abs(off[worst]):.3g} {unit} away from where the run left it; "
                "joints and lengths have to be those of the run"
            )
    _turn_axes(model, q, v, lane)
    return q, v


def _turn_axes(model: Model, q: Array, v: Array, lane: int) -> None:
    """Turn the further axes of sections, which no body has, by slopes and directors."""
    for frame in (one for one in model.frames.values() if isinstance(one, BeamFrame)):
        for (node, number), vector in frame.axes.items():
            place = (node * frame.element_length, 0.0, 0.0)
            axes, rates = triads.along(frame, place, q[None], v[None], lane)
            own = list(vector.own or ())
            q[own], v[own] = axes[0, number], rates[0, number]


def _entries(vectors: list[tuple[str, Affine]], d: int, lane: int) -> Iterator[tuple[int, int, float]]:
    for k, (_, one) in enumerate(vectors):
        for unknown, coefficient in one.terms.items():
            for axis in np.flatnonzero(coefficient[:, lane % coefficient.shape[1]]):
                yield d * k + int(axis), unknown, float(coefficient[axis, lane % coefficient.shape[1]])


def _scales(model: Model, rates: Array) -> tuple[float, float]:
    """Return the scales of a gap and of a rate; directors have the length one."""
    size = min(1.0, span(model.stated))
    return size, max(float(np.max(np.abs(rates), initial=0.0)), size / max(model.stated.solver.duration, 1.0))


def _check_joints(model: Model, lane: int) -> None:
    """Raises InputError where a joint is open at time 0, or parts."""
    q, v = (part[:, lane % part.shape[1]] for part in (model.q0, model.v0))
    seen = Evaluator(model, lane).at(q, v)
    if not seen.gap.size:
        return
    slope = seen.jacobian.toarray()
    size, speed = _scales(model, v)
    for gap, wanted, unit in ((seen.gap, size, "m"), (slope @ v + seen.rate, speed, "m/s")):
        away = float(np.max(np.abs(np.linalg.lstsq(slope, gap, rcond=None)[0])))
        if not away <= FITS * wanted:
            name = model.constraint_names[int(np.argmax(np.abs(gap)))]
            raise InputError(
                f"initial.from: {name} is off by {away:.3g} {unit} where the run ended; joints, and drives at time 0, "
                "have to be those of its end"
            )
