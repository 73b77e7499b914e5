"""Machines in space that tests and studies share."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation
from shoal.scene import Scene

FINE = {"integrator": "dop853", "relative_tolerance": 1e-11, "absolute_tolerance": 1e-12}
PUBLISHED = (0.5105014612, -1.6491675994, 0.1401231146)
"""P3 of Bricard's mechanism at 1 s [m], by its closed closure."""


def bricard() -> Scene:
    """Bricard's mechanism: five bars of 1 m and the ground along edges of a cube, six revolute joints.

    IFToMM's benchmark A04 (Gonzalez, Dopico, Luaces and Cuadrado).
    """
    corners = np.array([[0, 0, 0], [0, 0, 1], [0, -1, 1], [1, -1, 1], [1, -1, 0], [1, 0, 0]], dtype=float)
    bars, joints, initial = {}, {}, {}
    for k in range(1, 6):
        along = corners[(k + 1) % 6] - corners[k]
        across = np.eye(3)[int(np.argmin(np.abs(along)))]
        axes = np.column_stack([along, across, np.cross(along, across)])
        bars[f"bar{k}"] = {
            "kind": "rod", "length": 1.0, "height": 0.1, "width": 0.1, "density": 100.0, "rotary_inertia": True,
        }  # fmt: skip
        initial[f"bar{k}"] = {"rotation": Rotation.from_matrix(axes).as_rotvec().tolist()}
    for k in range(1, 7):
        first: Any = {"body": f"bar{k - 1}", "point": "end"}
        second: Any = {"body": f"bar{k}", "point": "start"}
        if k == 1:
            first = {"body": "ground", "point": corners[1].tolist()}
        if k == 6:
            second = {"body": "ground", "point": corners[0].tolist()}
        before, after = corners[k % 6] - corners[k - 1], corners[(k + 1) % 6] - corners[k % 6]
        joints[f"R{k}"] = {"first": first, "second": second, "axis": np.cross(before, after).tolist()}
    return Scene.parse(
        {
            "name": "bricard",
            "dimensions": 3,
            "gravity": [0, -9.81, 0],
            "bodies": bars,
            "joints": joints,
            "initial": initial,
            "markers": {"P3": {"body": "bar2", "point": "end"}},
            "solver": FINE,
        }
    )
