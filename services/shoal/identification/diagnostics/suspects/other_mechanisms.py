"""Pivots that move: one that the scene fixes to the ground swings along x or y, at any frequency.

The pivot stands on a block so heavy that the machine does not stir it, on a slider and a spring: its amplitude,
phase and frequency are then numbers of the scene (where it starts, how fast, and the stiffness).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from shoal.errors import InputError
from shoal.identification.diagnostics.suspects.candidate import PROBE, FaultHypothesis, Size, size_of
from shoal.identification.forward import ForwardModel
from shoal.identification.problem import Parameter
from shoal.scene import Rod, Scene
from shoal.scene.joints import GROUND, Revolute
from shoal.trajectory import Array

_HEAVY = 1e6
"""Times the machine."""
_FAR = 100.0
"""Times the machine's length: how far away the spring is held, so that it is never short."""
_SLOWEST, _FASTEST, _MOST_WAYS = 0.3, 5.0, 48
"""Of the rate of a swing: the frequencies that are tried, and how many at most."""
_APART = np.pi / 2
"""Of the phase at the end of the record, between neighbouring frequencies [rad]."""
_MOST = 0.2
"""Of the machine's length: the effect that is measured, and the largest motion that is looked for."""
_BLOCK = "shaken-block"


def shaken(model: ForwardModel) -> Iterator[FaultHypothesis]:
    """The motion along either axis of each pivot on the ground."""
    scene = model.scene
    size = size_of(scene)
    for name, joint in scene.joints.items():
        if not isinstance(joint, Revolute):
            continue
        for side in ("first", "second"):
            place = getattr(joint, side).point
            if getattr(joint, side).body != GROUND or isinstance(place, str):
                continue
            for axis in (0, 1):
                try:
                    on_a_block = _on_a_block(scene, name, side, axis, size)
                    yield _candidate(name, axis, place, on_a_block, size, model.measurement.end)
                except InputError:
                    continue


def _on_a_block(scene: Scene, joint: str, side: str, axis: int, size: Size) -> Scene:
    """The scene with a pivot on a heavy block that slides along an axis. Raises InputError."""
    data = scene.model_dump(mode="json")
    place, mass = data["joints"][joint][side]["point"], _HEAVY * size.mass
    held = list(place)
    held[axis] -= _FAR * size.length
    data["bodies"][_BLOCK] = {"kind": "point-mass", "mass": mass}
    data["joints"][joint][side] = {"body": _BLOCK}
    ground, block = {"body": GROUND, "point": place}, {"body": _BLOCK}
    data["joints"][_BLOCK] = {"kind": "slider", "first": ground, "second": block, "direction": axis * np.pi / 2}
    data["loads"][_BLOCK] = {
        "kind": "spring",
        "first": {"body": GROUND, "point": held},
        "second": block,
        "stiffness": mass * size.rate**2,
        "length": _FAR * size.length,
    }
    weight = [-mass * pull for pull in scene.gravity]
    data["loads"]["weight-of-the-block"] = {"kind": "force", "at": block, "force": weight}
    data["initial"][_BLOCK] = {"position": place, "velocity": [0.0, 0.0]}
    return Scene.parse(data, scene.name)


def _candidate(
    joint: str, axis: int, place: tuple[float, float], scene: Scene, size: Size, end: float
) -> FaultHypothesis:
    mass, stated, most = _HEAVY * size.mass, place[axis], _MOST * size.length
    count = 2 + int((_FASTEST - _SLOWEST) * size.rate * end / _APART)
    rates = size.rate * np.linspace(_SLOWEST, _FASTEST, min(count, _MOST_WAYS))
    stiffness = mass * rates**2
    fastest = most * float(rates[-1])
    parameters = (
        Parameter(path=f"initial.{_BLOCK}.position.{axis}", lower=stated - most, upper=stated + most, scale="linear"),
        Parameter(path=f"initial.{_BLOCK}.velocity.{axis}", lower=-fastest, upper=fastest, scale="linear"),
        Parameter(path=f"loads.{_BLOCK}.stiffness", lower=stiffness[0] / 4, upper=stiffness[-1] * 4, scale="log"),
    )
    bases = np.array([[stated, 0.0, k] for k in stiffness])
    step = PROBE * size.length
    ways = zip(stiffness, rates, strict=True)
    probes = np.array([[[stated + step, 0.0, k], [stated, step * rate, k]] for k, rate in ways])
    name, values = f"motion of the pivot {joint} along {'xy'[axis]}", (stated, 0.0, float(stiffness[0]))
    describe = partial(_motion_in_words, stated, mass)
    return FaultHypothesis(name, "machine", parameters, values, probes, bases, scene=scene, describe=describe)


def _motion_in_words(stated: float, mass: float, values: Array) -> tuple[float, str]:
    rate = float(np.sqrt(values[2] / mass))
    amplitude = float(np.hypot(values[0] - stated, values[1] / rate))
    return amplitude, f"a motion of {amplitude:.2g} m at {rate / (2 * np.pi):.3g} Hz"


_SAG = 1e-2
"""Deflection over length, by its weight, of the rod in the middle of those that are tried."""
_STIFFER, _WAYS = 6.0, 48
"""By how much softer and stiffer rods are tried, and how many."""
_ELEMENTS, _FOR_ANGLES = 2, 3
"""The direction of a rod's end converges more slowly than its place."""


def bending(model: ForwardModel) -> Iterator[FaultHypothesis]:
    """Young's modulus of each rigid rod that may bend and has a shape."""
    scene = model.scene
    size = size_of(scene)
    channels = [c for run in model.measurement.recordings.values() for c in run.channels]
    if any(channel.is_dynamic for channel in channels):
        return  # sensor channels are computed by rigid bodies only
    angles = any(not channel.is_position for channel in channels)
    for name, body in scene.bodies.items():
        if not isinstance(body, Rod) or body.element != "rigid" or body.section == "numbers":
            continue
        middle = body.mass * size.gravity * body.length**2 / (8 * body.section_at(0.0).bending * _SAG)
        probes = middle * np.geomspace(1 / _STIFFER, _STIFFER, _WAYS)
        free = Parameter(path=f"bodies.{name}.youngs_modulus", lower=probes[0] / 2, upper=probes[-1] * 2, scale="log")
        fields = {"youngs_modulus": middle, "element": "ancf-cable", "elements": _FOR_ANGLES if angles else _ELEMENTS}
        try:
            bent = scene.with_values({f"bodies.{name}.{field}": value for field, value in fields.items()})
        except InputError:
            continue  # a place beside its axis, say, is one of a rigid rod only
        ways = np.reshape(probes, (-1, 1, 1))
        bases = np.full((len(probes), 1), np.inf)
        yield FaultHypothesis(f"bending of {name}", "machine", (free,), (np.inf,), ways, bases, "inverse", bent)
