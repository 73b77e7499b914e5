"""What dry friction should hold creeps, as it is smoothed: how far is told, for blocks on inclines and for arms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.scene import Scene

GRAVITY = 9.81
Place = tuple[Scene, np.ndarray[Any, Any]]


def scene(body: dict[str, Any], joint: dict[str, Any], initial: dict[str, Any], duration: float, at: str) -> Scene:
    return Scene.parse(
        {
            "name": "held",
            "gravity": [0.0, -GRAVITY],
            "bodies": {"b": body},
            "joints": {"J": {"first": {"body": "ground", "point": [0.0, 0.0]}} | joint},
            "markers": {"m": {"body": "b", "point": at}},
            "initial": {"b": initial},
            "solver": {"duration": duration, "samples": 20},
        }
    )


def dry(draw: np.random.Generator, load: float, coarse: bool) -> dict[str, float]:
    """Friction of which a load [N or N m] takes 10 to 99 %, smoothed over little, or over more than one should."""
    speed = draw.uniform(-2, 0.5) if coarse else draw.uniform(-4, -2)
    return {"coulomb": load / float(draw.uniform(0.1, 0.99)), "coulomb_speed": float(10**speed)}


def block(draw: np.random.Generator, coarse: bool) -> Place:
    """A block on an incline, at rest or sliding down until friction stops it; where it ends [m]."""
    slope, mass, duration = draw.uniform(0.05, 1.2), float(10 ** draw.uniform(-1, 2)), float(draw.choice([3.0, 10.0]))
    along = np.array([np.cos(slope), -np.sin(slope)])
    pull = mass * GRAVITY * float(np.sin(slope))
    friction = dry(draw, pull, coarse)
    slow_down = (friction["coulomb"] - pull) / mass
    speed = float(draw.choice([0.0, min(1.0, 0.5 * slow_down * duration)]))
    joint = {"kind": "slider", "second": {"body": "b"}, "direction": -float(slope), **friction}
    body = {"kind": "rigid-body", "mass": mass, "inertia": 0.01 * mass, "named_points": {"p": [0.1, 0.0]}}
    initial = {"position": [0.0, 0.0], "velocity": (speed * along).tolist()}
    made = scene(body, joint | {"rotation": "locked"}, initial, duration, "start")
    return made, speed**2 / (2 * slow_down) * along


def arm(draw: np.random.Generator, coarse: bool) -> Place:
    """An arm that the friction of its joint holds up."""
    length, angle, duration = (
        float(draw.uniform(0.3, 2)),
        float(draw.uniform(-1.3, 1.3)),
        float(draw.choice([3.0, 10.0])),
    )
    rod = {"kind": "rod", "length": length, "height": 0.02, "width": 0.02, "density": 2700.0}
    weight = 2700 * 0.02**2 * length * GRAVITY
    joint = {"second": {"body": "b", "point": "start"}, **dry(draw, weight * length / 2 * np.cos(angle), coarse)}
    return scene(rod, joint, {"angle": angle}, duration, "end"), length * np.array([np.cos(angle), np.sin(angle)])


def told(seed: int, coarse: bool = False) -> float:
    """The creep that is told, over the true one."""
    draw = np.random.default_rng(seed)
    made, place = (arm if seed % 2 else block)(draw, coarse)
    run = verified(get_engine("gauss"), made)
    assert run.ok, run.message
    creep = float(np.linalg.norm(run.marker("m")[-1] - place))
    # The way that a block slides is longer or shorter, too, as its friction is smoothed.
    found: float = run.model["verification"]["friction_error"]
    return found / creep


def test_the_creep_of_what_should_stick_is_told() -> None:
    assert [told(seed) for seed in range(6)] == pytest.approx(6 * [1.0], rel=0.01)
    assert [told(seed, coarse=True) for seed in range(4)] == pytest.approx(4 * [1.0], rel=0.1)


@pytest.mark.slow
def test_the_creep_of_many_machines_is_told() -> None:
    assert [told(seed) for seed in range(100, 160)] == pytest.approx(60 * [1.0], rel=0.01)
    assert [told(seed, coarse=True) for seed in range(100, 160)] == pytest.approx(60 * [1.0], rel=0.1)
