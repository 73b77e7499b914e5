"""Limits of all rod theories: torques and motions that strain a section beyond 100 %, so that sections overlap."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import numpy as np

from shoal.mechanics.affine import Affine
from shoal.mechanics.frames import BeamFrame
from shoal.mechanics.states import States
from shoal.scene import Rod, Scene, Torque, TorsionSpring
from shoal.scene.joints import places, sides
from shoal.scene.loads import Load
from shoal.trajectory import Array

BEYOND = 1.0
"""Strain of bending at the surface of a rod at which its compressed fibres have no length left; and of shear."""


def excessive_torques(scene: Scene, rods: Collection[str]) -> str:
    """Return which torques fold the end of a rod that moves in the plane, or nothing.

    Where only torques M act on an end, its curvature is M/(E I) and the strain at its surface M h/(2 E I). Ends with a
    joint, a torsion spring or a torque that changes with time are not examined.
    """
    if scene.dimensions == 3:
        return ""
    for body in rods:
        rod = scene.bodies[body]
        for end in ("start", "end"):
            names = _alone(scene, body, end)
            if not isinstance(rod, Rod) or not names:
                continue
            section = rod.section_at(float(end == "end"))
            moment = sum(_at(scene.loads[name], body, end) for name in names)
            strain = float(abs(moment) * section.height / (2 * rod.modulus * section.bending))
            if strain > BEYOND:
                said = f"the torque {names[0]} bends" if len(names) == 1 else f"the torques {', '.join(names)} bend"
                return (
                    f"{said} {body} to a strain of {strain:.2g} at its surface, where no theory of rods holds beyond "
                    f"{BEYOND:g}"
                )
    return ""


def _alone(scene: Scene, body: str, end: str) -> list[str]:
    """Return the constant torques at an end of a rod where nothing else holds its direction."""
    place = (body, end)
    if any(place == (side.body, side.point) for joint in scene.joints.values() for side in places(joint)):
        return []
    found = []
    for name, load in scene.loads.items():
        if not any(place == (side.body, side.point) for side in sides(load).values()):
            continue
        if isinstance(load, TorsionSpring) or (isinstance(load, Torque) and load.torque.number is None):
            return []
        if isinstance(load, Torque):
            found.append(name)
    return found


def _at(load: Load, body: str, end: str) -> float:
    """Return the moment of a constant torque on an end of a rod [N m]."""
    assert isinstance(load, Torque)
    assert load.torque.number is not None
    here = [(load.at, 1.0), (load.reaction, -1.0)]
    return load.torque.number * sum(sign for side, sign in here if side and (side.body, side.point) == (body, end))


def excessive_strain(
    scene: Scene, states: States, times: Array, believed: Callable[[float], bool] = lambda _: True
) -> str:
    """Return which rod with shear a motion strains too much, and when first, or nothing.

    Examined are the strain of bending at the surface of each element and the shear at its nodes, not of curved rods.
    times: of the states [s], (samples,); believed: whether the motion is accepted up to a time [s]
    """
    worst: tuple[float, str, str] | None = None
    for name, frame in states.model.frames.items():
        rod = scene.bodies[name]
        if isinstance(rod, Rod) and rod.element == "simo-reissner" and rod.straight and isinstance(frame, BeamFrame):
            for what, strain in _strains(frame, states.q[..., 0], rod).items():
                late = np.flatnonzero(strain > BEYOND)
                if len(late) and (worst is None or times[late[0]] < worst[0]):
                    first = late[0]
                    worst = float(times[first]), name, f"{what} of {strain[first]:.2g}"
    if worst is None or not believed(worst[0]):
        return ""
    when, name, what = worst
    return f"{name} has a {what} after {when:.3g} s, and no theory of rods holds beyond {BEYOND:g}"


def _strains(frame: BeamFrame, q: Array, rod: Rod) -> Mapping[str, Array]:
    """Return the largest strains along a rod, (samples,) each; q: (samples, unknowns)."""
    slopes, normals = (
        np.stack([_along(node[k], q) for node in frame.nodes], axis=1) for k in (1, 2)
    )  # (samples, nodes, 2) each
    normals = normals / np.linalg.norm(normals, axis=2, keepdims=True)
    shear = normals[..., 0] * slopes[..., 1] - normals[..., 1] * slopes[..., 0]
    before, after = normals[:, :-1], normals[:, 1:]
    turned = np.arctan2(before[..., 0] * after[..., 1] - before[..., 1] * after[..., 0], np.sum(before * after, axis=2))
    heights = [rod.section_at((k + 0.5) / rod.elements).height for k in range(rod.elements)]
    bending = np.abs(turned) * rod.elements / rod.length * np.array(heights) / 2
    found = {"strain of bending at its surface": bending, "strain of shear": np.abs(shear)}
    return {what: np.asarray(np.nan_to_num(strain, nan=0.0).max(axis=1)) for what, strain in found.items()}


def _along(vector: Affine, q: Array) -> Array:
    """Return a vector along a motion, (samples, d)."""
    parts = (np.outer(q[:, unknown], coefficient[:, 0]) for unknown, coefficient in vector.terms.items())
    return sum(parts, np.tile(vector.constant[:, 0], (len(q), 1)))
