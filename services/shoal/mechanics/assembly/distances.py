"""Constraints that are alike in the plane and in space: distances between two places, and sums of coordinates."""

from __future__ import annotations

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.affine import fixed
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.joints import Apart, Sum
from shoal.mechanics.reach import span
from shoal.scene import Scene

NOTHING = 1e-9
"""A distance that is none, as a part of the machine's size."""


def keep_distance(scene: Scene, name: str, condition: Apart, result: Placement) -> None:
    """Between two places: that of the start, or one that is stated."""
    gap = result.gap(scene, condition)
    if condition.length is None:
        if np.any(sum(result.start_of(gap)[0] ** 2) < (NOTHING * span(scene)) ** 2):
            raise InputError(
                f"joints.{name}.length: not stated, so it is that of the start, 0 m, which has no direction; "
                "let the two places start apart, state the length, or join them by a revolute joint"
            )
        result.terms.dot(name, gap, gap, 2, -sum(result.start_of(gap)[0] ** 2))
    else:
        result.terms.dot(name, gap, gap, 2, drive=condition.length.through("square", "neg"))


def keep_sum(scene: Scene, name: str, condition: Sum, result: Placement) -> None:
    """Of coordinates of places, times their factors."""
    axes = np.eye(scene.dimensions)
    total = fixed(0.0 * axes[0][:, None])
    for term in condition.terms:
        onto_first = np.outer(axes[0], term.factor * axes["xyz".index(term.axis)])
        total = total + result.point(scene, term.at).turned(onto_first)
    result.terms.dot(name, fixed(axes[0][:, None]), total, 1, drive=condition.value.through("neg"))
