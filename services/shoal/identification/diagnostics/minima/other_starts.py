"""Other starts of a machine, by the parameters that make them: mirror images in space, and more turns between samples.

An isometry W of space and one B of a body, both proper or neither, take its attitude R to W R B and its spin w to
det(W) W w. Where B leaves the body what it is, and W gravity and what is seen, nothing distinguishes the two; whether
they do is left to who looks at the images.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from shoal.identification.conventions import DIFFERENCE, ROUND_OFF
from shoal.identification.diagnostics.minima.rivals import turn_of_samples
from shoal.identification.forward import ForwardModel
from shoal.mechanics.numerics.newton import newton
from shoal.mechanics.rotation import of_vector, vector_of
from shoal.scene import RigidBody, Scene
from shoal.scene.dimensions import padded
from shoal.scene.initial import InitialState
from shoal.scene.joints import GROUND, Cylindrical, Planar, Revolute, places, sides
from shoal.trajectory import Array

_TURNS = 3
"""So many times more, either way, a body may turn between two samples."""
_MOST = 256
"""Combinations of images of several bodies; of more only those in which all or all but one are of one kind."""
_STEPS = 5
"""Of Newton's method, for ties that are not linear."""
_ABOUT_Z = {"rotation": "angle", "spin": "rate"}
"""What a start may say in place of a vector."""

Wanted = Mapping[str, float]
"""Numbers of a start by their paths."""


def within_bounds(model: ForwardModel, point: Array) -> Array | None:
    """The point with whole turns taken off its angles until it is inside the bounds; None where none is."""
    turned = point.copy()
    for k in np.flatnonzero(model.parameters.turning):
        turned[k] -= 2 * np.pi * np.ceil((turned[k] - model.upper[k]) / (2 * np.pi))
    inside = np.all((turned >= model.lower) & (turned <= model.upper))
    return turned if inside and np.all(np.isfinite(turned)) else None


def turned(model: ForwardModel, point: Array) -> Iterator[Array]:
    """Starts from which a body turns once more, or once less, and so on, from each sample to the next, in the bounds.

    In the plane by its rate; in space about an axis of its hinges, its spin or a principal axis.
    """
    turn = turn_of_samples(model)
    if turn is None:
        return
    for name in model.measurement.recordings:
        start = _ReachableStart(model, point, name)
        # What turns together, and about which axis.
        together = tuple(start.turning)
        axes = [(body, axis) for body in together for axis in start.axes(body)]
        ways: list[tuple[tuple[str, ...], Array]] = [((body,), axis) for body, axis in axes]
        ways += [(together, axis) for _, axis in axes if len(together) > 1]
        for turns, (bodies, axis) in product((n * sign for n in range(1, _TURNS + 1) for sign in (1, -1)), ways):
            spun = [start.spun(body, turns * turn * axis) for body in bodies]
            if (found := start.first_within([[one] if one is not None else [] for one in spun])) is not None:
                yield found


def mirrored(model: ForwardModel, point: Array, name: str) -> Iterator[Array]:
    """Mirror images of a machine in space, and half turns of it, in a recording, within the bounds."""
    start = _ReachableStart(model, point, name)
    if start.scene.dimensions != 3:
        return
    bodies = [body for body in start.scene.initial if start.sought_of(body)]
    for isometry in _isometries(_normals(start.scene)):
        images = [start.images(body, isometry) for body in bodies]
        counts = [len(one) for one in images]
        if np.prod(counts) <= _MOST:
            choices = list(product(*map(range, counts)))
        else:
            choices = [tuple(min(k, count - 1) for count in counts) for k in range(max(counts))]
            choices += [tuple(k if n == m else 0 for n in range(len(counts))) for m in range(len(counts))
                        for k in range(counts[m])]  # fmt: skip
        for choice in choices:
            found = start.first_within([one[k] for one, k in zip(images, choice, strict=True)])
            if found is not None:
                yield found


@dataclass(frozen=True)
class _ReachableStart:
    """The start of a machine in a recording at a point (parameters,)."""

    model: ForwardModel
    point: Array
    name: str

    @cached_property
    def scene(self) -> Scene:
        """The machine at the point."""
        return self.model.scene_at(self.point, self.name)

    @cached_property
    def sought(self) -> dict[str, float]:
        """The numbers of the start that parameters make, by path."""
        values = self.model.parameters.scene_values(self.point[None], self.name)
        return {path: float(x[0]) for path, x in values.items() if path.startswith("initial.")}

    def sought_of(self, body: str, *quantities: str) -> list[str]:
        """The paths of a body among them, of all quantities or of some."""
        within = [f"initial.{body}.{quantity}" for quantity in quantities or ("",)]
        return [path for path in self.sought if path.startswith(tuple(within))]

    @cached_property
    def turning(self) -> list[str]:
        """Bodies whose rate is sought."""
        return [body for body in self.scene.initial if self.sought_of(body, "rate", "spin")]

    def axes(self, body: str) -> list[Array]:
        """Axes that a body may turn about alike at every sample, (3,) each."""
        if self.scene.dimensions == 2 or self.scene.initial[body].spin is None:
            return [np.array([0.0, 0.0, 1.0])]
        return _directions([
            *_hinges(self.scene, body),
            np.array(self.scene.initial[body].spin),
            *(_attitude(self.scene.initial[body]) @ _principal(self.scene, body)).T,
        ])  # fmt: skip

    def spun(self, body: str, more: Array) -> Wanted | None:
        """The start of a body with more spin [rad/s], (3,)."""
        return self._wanted(body, spin=_spin(self.scene.initial[body]) + more)

    def images(self, body: str, isometry: Array) -> list[list[Wanted]]:
        """A body as it is, and its images by an isometry (3, 3) of space: the ways to state each."""
        start, proper = self.scene.initial[body], np.linalg.det(isometry)
        here, spin = _attitude(start), proper * isometry @ _spin(start)
        moved: dict[str, Array] = {"spin": spin}
        if start.position is not None:
            place = np.array(padded(start.position, 3))
            moved["position"] = (fixed := _fixed(self.scene, place)) + isometry @ (place - fixed)
        if start.velocity is not None:
            moved["velocity"] = isometry @ np.array(padded(start.velocity, 3))
        found: list[list[Wanted]] = [[{}]]
        for inner in _isometries(self._normals_of(body)):
            if np.linalg.det(inner) * proper < 0.0:
                continue
            image = isometry @ here @ inner
            vector = vector_of(image)
            angle = float(np.linalg.norm(vector))
            ways = (
                [np.array(start.rotation)] if np.allclose(image, here, atol=DIFFERENCE) and start.rotation else [vector]
            )
            if angle > DIFFERENCE and ways[0] is vector:
                ways.append(vector * (1.0 - 2 * np.pi / angle))
            stated = [self._wanted(body, rotation=way, **moved) for way in ways]
            if possible := [one for one in stated if one is not None]:
                found.append(possible)
        return found

    def _normals_of(self, body: str) -> list[Array]:
        """Normals of planes that may mirror a body in its own frame: across its axes, and through what shows of it."""
        back = _attitude(self.scene.initial[body]).T
        markers = [marker for marker in self.scene.markers.values() if marker.body == body]
        shown = [np.array(self.scene.location(marker)) for marker in markers]
        solid = self.scene.bodies[body]
        if isinstance(solid, RigidBody):
            shown.append(np.array(padded(solid.centre_of_mass, 3)))
        hinges = [back @ hinge for hinge in _hinges(self.scene, body)]
        through = [np.cross(hinge, place) for hinge in hinges for place in shown]
        return _directions([*np.eye(3), *_principal(self.scene, body).T, *through])

    def _wanted(self, body: str, **vectors: Array) -> Wanted | None:
        """Parameters of a body's start with these vectors; None where they do not state it that way."""
        start, wanted = self.scene.initial[body], dict[str, float]()
        for quantity, vector in vectors.items():
            paths, known = [f"initial.{body}.{quantity}.{k}" for k in range(3)], getattr(start, quantity)
            if known is None and quantity in _ABOUT_Z:
                plain = _ABOUT_Z[quantity]
                paths, known = ["", "", f"initial.{body}.{plain}"], (0.0, 0.0, getattr(start, plain))
            if known is None or None in known:
                continue
            for path, x, old in zip(paths, vector.tolist(), padded(known, 3), strict=True):
                if path in self.sought:
                    wanted[path] = x
                elif abs(x - old) > DIFFERENCE * (1.0 + abs(old)):
                    return None
        return wanted

    def first_within(self, bodies: list[list[Wanted]]) -> Array | None:
        """The point within the bounds that makes a start of each body, by the first way to state it that does."""
        for ways in product(*bodies):
            found = self._reached({path: x for way in ways for path, x in way.items()})
            if found is not None and (inside := within_bounds(self.model, found)) is not None:
                return inside
        return None

    def _reached(self, wanted: Wanted) -> Array | None:
        """The point (parameters,) whose start has these numbers; None where there is none."""
        parameters, paths = self.model.parameters, list(wanted)
        target = np.array([wanted[path] for path in paths])

        def left(values: Array) -> Array:
            return np.asarray(target - self._made(values[None], paths)[0])

        def met(off: Array) -> bool:
            return bool(np.all(np.abs(off) <= DIFFERENCE * (1.0 + np.abs(target))))

        def correct(values: Array) -> tuple[Array, float]:
            if met(off := left(values)):
                return np.zeros_like(values), 0.0
            # In place of derivatives, which ties have none of: differences, exact where they are linear.
            steps = 1e-3 * (1.0 + np.abs(values))
            slope = (self._made(values + np.diag(steps), paths) - self._made(values[None], paths)).T / steps
            slope = np.where(self._free & np.isfinite(slope), slope, 0.0)
            move = np.asarray(np.linalg.lstsq(slope, off)[0], dtype=float)
            return move, float(np.max(np.abs(move) / steps))

        if not paths:
            return None
        values = newton(correct, parameters.to_values(self.point), close=0.0, most=_STEPS).point
        return parameters.to_vector(values) if met(left(values)) else None

    @cached_property
    def _free(self) -> Array:
        """Mask of the parameters of the start, or that stand in ties alone, (parameters,), bool."""
        parameters = self.model.parameters
        return np.asarray(parameters.initial | np.array([not path for path in parameters.paths]))

    def _made(self, values: Array, paths: list[str]) -> Array:
        """Numbers of the start at values (points, parameters), (points, paths)."""
        made = self.model.parameters.scene_values(self.model.parameters.to_vector(values), self.name)
        return np.stack([made[path] for path in paths], axis=1)


def _attitude(start: InitialState) -> Array:
    """The rotation (3, 3) of a body at the start."""
    vector = start.rotation if start.rotation is not None else (0.0, 0.0, start.angle or 0.0)
    return np.asarray(of_vector(np.array(vector)[:, None])[..., 0])


def _spin(start: InitialState) -> Array:
    """The angular velocity [rad/s] of a body at the start, (3,)."""
    return np.array(start.spin if start.spin is not None else (0.0, 0.0, start.rate or 0.0))


def _principal(scene: Scene, body: str) -> Array:
    """Principal axes of a body in its own frame, the columns of (3, 3)."""
    solid = scene.bodies[body]
    return np.linalg.eigh(solid.inertia_matrix)[1] if isinstance(solid, RigidBody) else np.eye(3)


def _hinges(scene: Scene, body: str) -> list[Array]:
    """Axes that joints let a body turn about at the start, (3,) each."""
    joints = [joint for joint in scene.joints.values() if isinstance(joint, Revolute | Cylindrical | Planar)]
    return _directions([np.array(joint.axis) for joint in joints if body in [at.body for at in places(joint)]])


def _fixed(scene: Scene, place: Array) -> Array:
    """A place (3,) that mirrors go through: where the machine is held, else where the body is."""
    ties = (*scene.joints.values(), *scene.loads.values())
    held = [at for tie in ties for at in sides(tie).values() if at.body == GROUND]
    return np.array(scene.location(held[0])) if held else place


def _normals(scene: Scene) -> list[Array]:
    """Normals of planes that may mirror a machine: across the axes and gravity, along them, and through its hinges."""
    lines = _directions([*np.eye(3), np.array(padded(scene.gravity, 3))])
    hinges = _directions([hinge for body in scene.bodies for hinge in _hinges(scene, body)])
    along = [np.cross(one, other) for one in [*hinges, lines[-1]] for other in lines]
    across = [line - (line @ hinge) * hinge for hinge in hinges for line in lines]
    return _directions([*lines, *along, *across])


def _isometries(normals: list[Array]) -> list[Array]:
    """Nothing, mirrors of these normals, half turns about them, and the mirror in a point; (3, 3) each."""
    mirrors = [np.eye(3), *(np.eye(3) - 2 * np.outer(normal, normal) for normal in normals)]
    return [sign * mirror for mirror in mirrors for sign in (1.0, -1.0)]


def _directions(vectors: list[Array]) -> list[Array]:
    """Unit vectors along vectors (3,), each once, whichever way it points; none along zero."""
    found: list[Array] = []
    for vector in vectors:
        size = float(np.linalg.norm(vector))
        if size > ROUND_OFF and all(abs(vector @ other) < (1.0 - ROUND_OFF) * size for other in found):
            found.append(vector / size)
    return found
