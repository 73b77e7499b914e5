"""Random trees that tests of the spatial package share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shoal.engines.tree.description import FREEDOMS, SpatialChain


def _tree(kinds: list[str], seed: int, **more: Any) -> SpatialChain:
    """A random tree with one joint of each kind in the list, in that order, at a random state."""
    draw = np.random.default_rng(seed)
    bodies: dict[str, Any] = {}
    joints: dict[str, Any] = {}
    initial: dict[str, Any] = {}

    def vector() -> list[float]:
        return draw.normal(size=3).tolist()

    for k, kind in enumerate(kinds):
        a, b = draw.uniform(0.5, 1.0, 2)
        turn = Rotation.from_rotvec(vector()).as_matrix()
        inertia = turn @ np.diag([a, b, draw.uniform(abs(a - b) + 0.05, a + b - 0.05)]) @ turn.T
        bodies[f"B{k}"] = {
            "mass": draw.uniform(0.5, 2.0),
            "inertia": ((inertia + inertia.T) / 2).tolist(),
            "centre_of_mass": vector(),
        }
        freedoms = FREEDOMS[kind]
        joints[f"J{k}"] = {
            "kind": kind,
            "body": f"B{k}",
            "parent": "ground" if k == 0 else f"B{draw.integers(max(0, k - 3), k)}",
            "on_parent": {"position": vector(), "rotation": vector()},
            "on_body": {"position": vector(), "rotation": vector()},
            "load": draw.normal(size=freedoms).tolist(),
            **({"damping": draw.uniform(0.0, 0.5)} if freedoms else {}),
            **({"axis": vector()} if freedoms == 1 else {}),
        }
        initial[f"J{k}"] = {
            "coordinate": draw.normal(size=freedoms).tolist(),
            "rate": draw.normal(size=freedoms).tolist(),
        }
    loads = {f"L{k}": {"body": f"B{k}", "position": vector(), "force": vector(), "torque": vector()} for k in (0, 1)}
    points = {f"P{k}": {"body": f"B{k}", "position": vector()} for k in range(len(kinds))}
    return SpatialChain.model_validate(
        {
            "name": "tree",
            "gravity": vector(),
            "bodies": bodies,
            "joints": joints,
            "initial": initial,
            "loads": loads,
            "points": points,
            **more,
        }
    )


@pytest.fixture(scope="session")
def random_tree() -> Callable[..., SpatialChain]:
    """Makes a random tree."""
    return _tree


@pytest.fixture(scope="session")
def mixes() -> dict[str, list[str]]:
    """Lists of joints, by name."""
    return {
        "revolute": ["revolute"] * 12,
        "prismatic": ["prismatic"] * 6,
        "spherical": ["spherical"] * 8,
        "fixed": ["fixed", "revolute", "fixed", "fixed", "spherical", "fixed"],
        "mixed": ["revolute", "prismatic", "spherical", "fixed"] * 4,
        "mixed-again": ["spherical", "revolute", "revolute", "prismatic"] * 5,
    }
