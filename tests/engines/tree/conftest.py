"""Random trees that tests of the spatial package share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shoal.engines.tree.march import TreeRun, march
from shoal.engines.tree.tableau import DOPRI853, RK4
from shoal.engines.tree.tree import COORDINATES, FIXED, PRISMATIC, RATES, REVOLUTE, SPHERICAL, Tree, room

KINDS = {"fixed": FIXED, "revolute": REVOLUTE, "prismatic": PRISMATIC, "spherical": SPHERICAL}


class RandomTree(NamedTuple):
    """A tree and a state."""

    tree: Tree
    q: Any
    v: Any

    def run(self, times: Any, step: float | None = None, tolerance: float = 0.0) -> TreeRun:
        """Its motion from this state, by a fixed step or to a tolerance."""
        state, method = np.concatenate([self.q, self.v, [0.0]]), RK4 if step else DOPRI853
        found: TreeRun = march(
            self.tree, room(self.tree), method, state, np.array(times, dtype=float), step or 0.0, tolerance
        )
        return found


def _tree(kinds: list[str], seed: int) -> RandomTree:
    """A random tree with one joint of each kind in the list, in that order, at a random state."""
    draw, count = np.random.default_rng(seed), 1 + len(kinds)
    number = np.array([FIXED, *(KINDS[kind] for kind in kinds)])
    mass, lever, inertia = np.zeros(count), np.zeros((count, 3)), np.zeros((count, 6))
    parents, q, v, damping = np.zeros(count, dtype=np.int64), [], [], []
    for k in range(1, count):
        parents[k] = draw.integers(max(0, k - 3), k)
        mass[k], lever[k] = draw.uniform(0.5, 2.0), draw.normal(size=3)
        a, b = draw.uniform(0.5, 1.0, 2)
        turn = Rotation.random(rng=draw).as_matrix()
        about = turn @ np.diag([a, b, draw.uniform(abs(a - b) + 0.05, a + b - 0.05)]) @ turn.T
        about += mass[k] * (lever[k] @ lever[k] * np.eye(3) - np.outer(lever[k], lever[k]))
        inertia[k] = about[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]]
        rates = RATES[number[k]]
        damping.append(np.full(rates, draw.uniform(0.0, 0.5) if rates == 1 else 0.0))
        v.append(draw.normal(size=rates))
        q.append(Rotation.random(rng=draw).as_quat(scalar_first=True) if rates == 3 else draw.normal(size=rates))
    first_q, first_v = (np.cumsum([0, *(size[kind] for kind in number)])[:-1] for size in (COORDINATES, RATES))
    turns = np.stack([np.eye(3), *Rotation.random(count - 1, rng=draw).as_matrix()]).reshape(count, 9)
    tree = Tree(
        parents, number, first_q, first_v, draw.normal(size=(count, 3)), turns, mass, lever, inertia,
        np.concatenate(damping), draw.normal(size=3), np.array([1, count - 1]), *draw.normal(size=(3, 2, 3)),
    )  # fmt: skip
    return RandomTree(tree, np.concatenate(q), np.concatenate(v))


@pytest.fixture(scope="session")
def random_tree() -> Callable[..., RandomTree]:
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
