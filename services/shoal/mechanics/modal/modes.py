"""Numbers of a body that bends by modes: of a rod by its own, of a modal-body by given ones.

In a floating frame a material point lies at r + (x + u) e + (y + v) e_perp, with (u, v) the sum of q_i (u_i, v_i). As
complex numbers, r + (x + iy) e + sum of s_i w_i, s_i = u_i + i v_i and w_i = q_i e: linear in vectors, so the mass is
constant, of the integrals of conj(f_a) f_b dm over the fields 1, x + iy and s_i. That w_i is along e is a quadratic
constraint; q_i = w_i . e, and the strain energy is 1/2 q'Kq.

A rod stretches without any more vectors: evenly where |e| is free, and by its shapes across the axis, taken along it,
where w_i is: w_i = v e - u e_perp.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import joints
from shoal.mechanics.joints import Turned
from shoal.mechanics.modal import beams
from shoal.mechanics.modal.beams import Ends
from shoal.mechanics.numerics.tile import Array, Number
from shoal.mechanics.ropes import Reeved
from shoal.mechanics.sums import Sum
from shoal.scene import ModalBody, Rod, Scene

_POINTS = 24
"""Points of Gauss's rule along a rod, and so many more a mode."""
_NOTHING = 1e-12
"""An integral below this, of the size it could have, is zero."""
Shapes = Callable[[tuple[Number, ...]], tuple[list[Any], list[Any]]]


@dataclass(frozen=True)
class ModalIntegrals:
    """across: how many have a vector of their own; along: how many of a rod stretch it, first evenly.

    moments: Hermitian, (2 + across, 2 + across, lanes), the first two of the frame; stiffness, damping: (modes, modes,
    lanes), first those across; shapes: place -> complex displacement and slope (that of the body's x direction) of
    every mode there; length [m]: of a rod.
    """

    across: int
    along: int
    length: Number
    moments: Array
    stiffness: Array
    damping: Array
    shapes: Shapes


def modes_of(scene: Scene, name: str) -> ModalIntegrals:
    """The modes of a modal rod or body."""
    body = scene.bodies[name]
    if isinstance(body, ModalBody):
        stiffness, damping = body.matrix("modal_stiffness"), body.matrix("modal_damping")
        return ModalIntegrals(len(body.modes), 0, 1.0, body.moments, stiffness, damping, _shapes_of_body(name, body))
    assert isinstance(body, Rod)
    return _of_rod(body, held(scene, name))


def shapes_of(scene: Scene, name: str) -> Shapes:
    """Their shapes alone."""
    body = scene.bodies[name]
    if isinstance(body, ModalBody):
        return _shapes_of_body(name, body)
    assert isinstance(body, Rod)
    return _shapes_of_rod(body, held(scene, name))


def held(scene: Scene, name: str) -> Ends:
    """Return how the ends of a rod are held in its frame: tangent where a joint keeps its direction.

    Otherwise joints hold points of it, and the frame goes through them.
    """
    rod = scene.bodies[name]
    assert isinstance(rod, Rod)
    if rod.ends is not None:
        return rod.ends
    places: dict[str, bool] = {}
    for _, condition in joints.of_scene(scene):
        if isinstance(condition, Sum | Reeved):
            continue
        for side in (condition.first, condition.second):
            if side.body == name:
                where = scene.location(side)[0] / rod.length
                for end, at in (("start", 0.0), ("end", 1.0)):
                    if np.all(np.abs(where - at) < 1e-9):
                        places[end] = places.get(end, False) or isinstance(condition, Turned)
    if places.get("start"):
        return "clamped", "free"
    if places.get("end"):
        return "free", "clamped"
    first, second = ("pinned" if end in places else "free" for end in ("start", "end"))
    return first, second


def bent(scene: Scene, name: str, place: tuple[Number, ...]) -> tuple[Number, Number, Number, Number]:
    """Return a point x + iy [m] of a body at the start, its rate [m/s] in its frame, its rotation [rad] and rate."""
    where, start = place[0] + 1j * place[1], scene.initial.get(name)
    if start is None or not (len(start.modes) or len(start.mode_rates)):
        return where, 0.0, 0.0, 0.0
    shapes, slopes = shapes_of(scene, name)(place)
    along, rate, way, turning = where, 0.0, 1.0 + 0.0j, 0.0
    for q, shape, slope in zip(start.modes, shapes, slopes, strict=False):
        along, way = along + q * shape, way + q * slope
    for q, shape, slope in zip(start.mode_rates, shapes, slopes, strict=False):
        rate, turning = rate + q * shape, turning + q * slope
    return along, rate, np.angle(way), np.imag(turning / way)


def _of_rod(rod: Rod, ends: Ends) -> ModalIntegrals:
    """The integrals of the shapes of a uniform beam over a rod, which may be tapered."""
    x, weight = np.polynomial.legendre.leggauss(_POINTS + 8 * (rod.modes + rod.axial_modes))
    x, weight = (x[:, None] + 1) / 2, weight[:, None] / 2
    length, section, young = np.atleast_1d(rod.length), rod.section_at(x), rod.modulus
    density, heavy = rod.masses_at(x)
    line, turning = (density * part * length * weight for part in (heavy.area, heavy.bending))
    stretching, bending = (young * part * length * weight for part in (section.area, section.bending))
    across = [1j * beams.shapes(ends, rod.modes, x, k) / length**k for k in range(3)]
    none, one = np.zeros_like(x), np.ones_like(x)
    moments = _products(_laned([one + 0j, x * length + 0j, *across[0]]), line)
    if rod.rotary_inertia:  # of sections, which turn with the frame and with the slope
        moments = moments + _products(_laned([none, one, *across[1]]), turning)
    curving = [*np.imag(across[2]), *(none for _ in range(rod.axial_modes))]
    strains = [*(none for _ in range(rod.modes)), *([one / length, *np.imag(across[1])][: rod.axial_modes])]
    stiffness = _products(_laned(strains), stretching) + _products(_laned(curving), bending)
    stiffness = _cleaned(stiffness)
    damping = np.asarray(rod.retardation) * stiffness
    shapes = _shapes_of_rod(rod, ends)
    return ModalIntegrals(rod.modes, rod.axial_modes, rod.length, _cleaned(moments), stiffness, damping, shapes)


def _laned(fields: Any) -> Array:
    """Fields at all points, (fields, points, lanes)."""
    return np.stack(np.broadcast_arrays(*fields))


def _products(fields: Array, weights: Array) -> Array:
    """Integrals of conj(f_a) f_b, (fields, fields, lanes)."""
    fields, weights = np.broadcast_arrays(fields, weights[None])
    return np.asarray(np.einsum("apl,pl,bpl->abl", np.conj(fields), weights[0], fields))


def _cleaned(matrix: Array) -> Array:
    """Without what is round-off, so that what does not depend on each other is not joined."""
    size = np.sqrt(np.abs(np.einsum("aal->al", matrix)))
    limit = _NOTHING * size[:, None] * size[None, :]
    real, imaginary = (np.where(np.abs(part) > limit, part, 0.0) for part in (np.real(matrix), np.imag(matrix)))
    return np.asarray(real + 1j * imaginary if np.iscomplexobj(matrix) else real)


def _shapes_of_rod(rod: Rod, ends: Ends) -> Shapes:
    def shapes(place: tuple[Number, ...]) -> tuple[list[Any], list[Any]]:
        x = np.asarray(place[0] / rod.length, dtype=float)
        found = []
        for k, even in enumerate((x, 1.0 / rod.length)):
            across = list(beams.shapes(ends, rod.modes, x, k) / rod.length**k)
            found.append([*(1j * one for one in across), *[even, *across][: rod.axial_modes]])
        return found[0], found[1]

    return shapes


def _shapes_of_body(name: str, body: ModalBody) -> Shapes:
    def shapes(place: tuple[Number, ...]) -> tuple[list[Any], list[Any]]:
        for point, where in body.points.items():
            if all(np.all(np.abs(np.subtract(a, b)) < 1e-12) for a, b in zip(place, where, strict=True)):
                found = [(*mode.points.get(point, (0.0, 0.0)), 0.0)[:3] for mode in body.modes]
                return [u + 1j * v for u, v, _ in found], [1j * turn for *_, turn in found]
        x, y = (float(np.ravel(part)[0]) for part in place[:2])
        raise InputError(f"bodies.{name}: its modes are known at named points, and [{x:g}, {y:g}] is none of them")

    return shapes
