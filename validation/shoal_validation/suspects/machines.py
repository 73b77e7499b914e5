"""Machines drawn at random, with what is measured of them: pendulum, double pendulum, four-bar linkage."""

from __future__ import annotations

from typing import Any

import numpy as np

FREE = {"lower": -np.pi, "upper": np.pi}


def rod(rng: np.random.Generator, low: float, high: float) -> dict[str, Any]:
    """A rigid rod with a length between the two [m]."""
    length = float(rng.uniform(low, high))
    return {
        "kind": "rod",
        "length": length,
        "height": 0.02 * length,
        "width": 0.04,
        "density": float(rng.uniform(800.0, 3000.0)),
    }


def _joint(first: str, point: Any, second: str, there: str = "start") -> dict[str, Any]:
    return {"first": {"body": first, "point": point}, "second": {"body": second, "point": there}}


def _solver(duration: float) -> dict[str, Any]:
    return {"duration": duration, "step": 1e-3, "samples": 100}


def pendulum(rng: np.random.Generator) -> tuple[dict[str, Any], list[str], list[tuple[str, str]]]:
    """Scene, bodies whose initial angles are sought, and what is measured: (marker, quantity)."""
    body = rod(rng, 0.3, 1.5)
    scene = {
        "name": "pendulum",
        "bodies": {"OA": body},
        "joints": {"O": _joint("ground", [0.0, 0.0], "OA")},
        "markers": {"A": {"body": "OA", "point": "end"}},
        "initial": {"OA": {"angle": float(rng.uniform(-1.2, 0.6))}},
        "solver": _solver(float(rng.uniform(2.0, 5.0))),
    }
    seen = [("A", "angle")] if rng.random() < 0.3 else [("A", "x"), ("A", "y")]
    return scene, ["OA"], seen


def double_pendulum(rng: np.random.Generator) -> tuple[dict[str, Any], list[str], list[tuple[str, str]]]:
    """Like `pendulum`, with another machine."""
    scene = {
        "name": "double-pendulum",
        "bodies": {"OA": rod(rng, 0.5, 1.2), "AB": rod(rng, 0.5, 1.2)},
        "joints": {"O": _joint("ground", [0.0, 0.0], "OA"), "A": _joint("OA", "end", "AB")},
        "markers": {"A": {"body": "OA", "point": "end"}, "B": {"body": "AB", "point": "end"}},
        "initial": {
            "OA": {"angle": float(rng.uniform(-1.2, 0.4))},
            "AB": {"angle": float(rng.uniform(-1.2, 0.8))},
        },
        "solver": _solver(float(rng.uniform(1.5, 2.5))),
    }
    tip = [("B", "x"), ("B", "y")]
    both = [("A", "x"), ("A", "y"), *tip]
    angles = [("A", "angle"), ("B", "angle")]
    return scene, ["OA", "AB"], [tip, both, angles][int(rng.integers(3))]


def four_bar(rng: np.random.Generator) -> tuple[dict[str, Any], list[str], list[tuple[str, str]]]:
    """Like `pendulum`: a crank that falls, its coupler and rocker."""
    crank, rocker = rod(rng, 0.3, 0.5), rod(rng, 0.6, 0.9)
    angle, base = float(rng.uniform(0.5, 1.2)), float(rng.uniform(0.9, 1.1))
    elbow = crank["length"] * np.exp(1j * angle)
    far = base + rocker["length"] * np.exp(1j * float(rng.uniform(1.0, 1.4)))
    coupler = rod(rng, 0.5, 1.0) | {"length": float(abs(far - elbow))}
    coupler["height"] = 0.02 * coupler["length"]
    scene = {
        "name": "four-bar",
        "bodies": {"crank": crank, "coupler": coupler, "rocker": rocker},
        "joints": {
            "O": _joint("ground", [0.0, 0.0], "crank"),
            "A": _joint("crank", "end", "coupler"),
            "B": _joint("coupler", "end", "rocker", "end"),
            "C": _joint("ground", [base, 0.0], "rocker"),
        },
        "markers": {"A": {"body": "crank", "point": "end"}, "B": {"body": "coupler", "point": "end"}},
        "initial": {
            "crank": {"angle": angle},
            "coupler": {"angle": float(np.angle(far - elbow))},
            "rocker": {"angle": float(np.angle(far - base))},
        },
        "solver": _solver(float(rng.uniform(0.8, 1.5))),
    }
    return scene, ["crank"], [("B", "x"), ("B", "y")]


MACHINES = (*3 * (pendulum,), *4 * (double_pendulum,), four_bar)
