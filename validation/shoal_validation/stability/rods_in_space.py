"""Maps of flexible rods in space: steps as they get thinner, and meshes as they are twisted."""

from __future__ import annotations

from functools import cache

import numpy as np
from shoal.engines.exudyn import ExudynEngine
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

from shoal_validation.stability.contract import Axis, Method, StabilityMap, Watched
from shoal_validation.stability.methods import AUTO, CAPPED, EXUDYN, FIXED_STEP, GAUSS, both, unchecked
from shoal_validation.stability.steps import SIZE, TIMES

FINE = 2e-5
"""Step of the references [s]."""


def _thin(slenderness: float) -> dict[str, object]:
    """Square sections of both rods."""
    return {f"bodies.{rod}.{side}": 2.0 / slenderness for rod in ("OA", "AB") for side in ("height", "width")}


@cache
def _reference(slenderness: float) -> Array:
    """Path of B on the very mesh [m], (times, 3), by Exudyn's cables and its trapezoidal rule."""
    scene = load_scene("flexible-spherical-double-pendulum").with_values({**_thin(slenderness), "solver.step": FINE})
    return _path(ExudynEngine(modified_newton=True), scene, "B", TIMES)


def _pendulum(_: float, slenderness: float) -> Watched:
    scene = load_scene("flexible-spherical-double-pendulum")
    return Watched(scene, _thin(slenderness), "B", TIMES, _reference(slenderness), SIZE)


SLENDERNESS = StabilityMap(
    "space-slenderness",
    "How long may the steps of each method be as rods in space get thinner?",
    "As in the plane the stretching of the cables sets the explicit limit, at every thickness. Implicit methods, ours "
    "and Exudyn's alike, hold up to 0.01 s.",
    Axis("step", "s", (1e-4, 2e-4, 5e-4, 1e-3, 3e-3, 1e-2)),
    Axis("length over thickness of AB", "", (20.0, 100.0, 500.0, 2000.0)),
    (*FIXED_STEP, CAPPED, AUTO, *both(*EXUDYN)),
    _pendulum,
    lambda step, _: {"solver.step": step},
)

BEAM_TIMES = np.linspace(0.02, 0.2, 10)
LENGTH = 0.5
"""Of the strip [m]."""
BEAM_FINE = 16, 32
"""Elements of its reference, which is extrapolated from both."""
BEAMS = ExudynEngine(beam="geometrically-exact", modified_newton=True)


def _strip(twist: float, elements: int) -> dict[str, object]:
    shape = {"side_curvature": [], "twist": [twist / LENGTH] if twist else []}
    rod = {"youngs_modulus": 2e8, "elements": elements} | shape
    return {f"bodies.strip.{name}": value for name, value in rod.items()}


@cache
def _swing(twist: float) -> Array:
    """End of a strip that is twisted so far at rest [m], (times, 3), by Exudyn's geometrically exact beams."""
    rest = load_scene("swinging-strip").with_values({"solver.step": 5e-4})
    scenes = (rest.with_values(_strip(twist, count)) for count in BEAM_FINE)
    coarse, fine = (_path(BEAMS, scene, "E", BEAM_TIMES) for scene in scenes)
    return np.asarray((4 * fine - coarse) / 3)


def _twisted(elements: int, twist: float) -> Watched:
    return Watched(load_scene("swinging-strip"), _strip(twist, elements), "E", BEAM_TIMES, _swing(twist), LENGTH)


def _path(engine: ExudynEngine, scene: Scene, marker: str, times: Array) -> Array:
    run = engine.simulate(scene, times)
    if not run.ok:
        raise RuntimeError(f"no reference for {scene.name}: {run.message}")
    return run.marker(marker)


_IMPLICIT = ("generalized-alpha", "energy-momentum")
_BEAM = Method("exudyn, geometrically exact", BEAMS)
TWIST = StabilityMap(
    "space-twist",
    "Which mesh does a rod need that is twisted at rest?",
    "From four elements on, and with a radian or so of twist in each, a director rod is within a thousandth; Exudyn's "
    "pairs of beams need twice as many. Beyond half a turn in an element the direction of its twist is ambiguous. "
    "A rod of one element and 24 rad was off by a fifth of its length and said ok, so that such meshes are refused.",
    Axis("elements", "", (1, 2, 4, 8)),
    Axis("twist from end to end", "rad", (0.0, 3.0, 6.0, 12.0, 24.0)),
    (
        *(Method(f"director rod, {name}", GAUSS, {"solver.integrator": name}) for name in _IMPLICIT),
        _BEAM,
        unchecked(_BEAM),
    ),
    _twisted,
    lambda *_: {"solver.step": 5e-4},
)
