"""The coordinates of a body in a floating frame: its origin, its direction e, and a vector along e for every mode."""

from __future__ import annotations

import numpy as np

from shoal.mechanics import plane
from shoal.mechanics.affine import fixed
from shoal.mechanics.assembly.coordinates import Placement, Pose
from shoal.mechanics.assembly.groups import JointPoint
from shoal.mechanics.frames import ModalFrame
from shoal.mechanics.modal.modes import modes_of
from shoal.scene import InitialState, Scene


def place_modal(scene: Scene, name: str, mine: list[JointPoint], pose: Pose, result: Placement) -> None:
    """Give a body its frame and its modes, hold the modes along the frame, and hang it on its joints."""
    modes, start = modes_of(scene, name), scene.initial.get(name, InitialState())
    none = np.zeros(len(modes.stiffness))
    q, q_rate = (list(part) or list(none) for part in (start.modes, start.mode_rates))
    across, even, along = modes.across, modes.across, slice(modes.across + 1, None)
    length, length_rate = 1.0, 0.0
    if modes.along:
        length, length_rate = 1.0 + q[even] / modes.length, q_rate[even] / modes.length
    axis, turning = pose.directors[0], pose.turning[0]
    e = result.new_vector(length * axis, length * turning + length_rate * axis)
    if not modes.along:
        result.terms.dot(name, e, e, 0, -1.0)
    amplitudes = []
    for k, (v, v_rate) in enumerate(zip(q[:across], q_rate[:across], strict=True)):
        u, u_rate = (part[along][k] if k < modes.along - 1 else 0.0 for part in (q, q_rate))
        vector, rate = v * axis - u * plane.quarter(axis), v_rate * axis - u_rate * plane.quarter(axis)
        rate = rate + v * turning - u * plane.quarter(turning)
        amplitudes.append(result.new_vector(vector, rate))
        if k >= modes.along - 1:
            result.terms.cross(name, amplitudes[-1], e, 1)
    nowhere = fixed(0.0 * axis)
    frame = ModalFrame(nowhere, (e, e.turned(plane.QUARTER)), modes, tuple(amplitudes))
    ranked = sorted(mine, key=lambda point: (point.where is None, point.line is None))
    for point in ranked[:1]:
        arm = frame.point(point.local(name))
        if point.where is None:
            way, rate = result.start_of(arm)
            result.make(point, pose.position + way, pose.velocity + rate)
        assert point.where is not None
        origin = point.where - arm
    if not mine:
        origin = result.new_vector(pose.position, pose.velocity)
    frame = ModalFrame(origin, frame.directors, modes, tuple(amplitudes))
    result.frames[name] = frame
    for point in ranked[1:]:
        result.share(point, frame.point(point.local(name)))
