"""Ropes over pulleys, drums and eyes of the plane: straight spans that touch their circles."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.mechanics.rope_path import spans
from shoal.pictures.machine import shapes
from shoal.pictures.machine.marks import Marks, between
from shoal.pictures.machine.sheet import Part, Sheet
from shoal.scene.ropes import Rope


def ropes(marks: Marks) -> Iterator[Part]:
    """Yield what draws the ropes of a scene."""
    for name, joint in marks.scene.joints.items():
        if isinstance(joint, Rope):
            yield _rope(marks, name, joint)


def _rope(marks: Marks, name: str, joint: Rope) -> Part:
    stations = [joint.first, *joint.over, joint.second]
    paths, frames = [marks.point(one) for one in stations], [marks.frame(one) for one in stations]
    radii = [float(one.signed_radius) for one in stations]

    def draw(sheet: Sheet) -> None:
        count = len(sheet.times)
        centres = [np.broadcast_to(path(sheet.at, sheet.times), (count, 2)) for path in paths]
        for k, (radius, frame) in enumerate(zip(radii, frames, strict=True)):
            if radius:
                sheet.carried(name, "gear", shapes.circle(abs(radius), count=40), frame)
                sheet.carried(name, "spoke", np.array([(-abs(radius), 0.0), (abs(radius), 0.0)]), frame)
            elif 0 < k < len(radii) - 1:
                sheet.carried(name, "pin", shapes.circle(shapes.PIN * sheet.unit), frame)
        line = np.array([(0.0, 0.0), (1.0, 0.0)])
        begin, end = spans(np.stack(centres, axis=1), radii)
        for k in range(len(radii) - 1):
            sheet.add(name, "rope", line, f"{name} span {k}", between(begin[:, k], end[:, k]))

    return draw
