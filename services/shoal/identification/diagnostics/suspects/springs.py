"""Torsion springs that a scene leaves out: a cable, a seal or a flexure at a joint pulls towards some angle."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.identification.diagnostics.suspects.candidate import FaultHypothesis
from shoal.identification.diagnostics.suspects.size import Size
from shoal.identification.problem import Parameter
from shoal.scene import GROUND, PointMass, Revolute, Scene
from shoal.trajectory import Array

_STEP = 1e-3
"""Of the largest stiffness and torque that are looked for: the change by which an effect is measured."""
_CONSTANT = 100.0
"""Radians: a spring at rest farther away pulls alike all along a motion."""
_LARGEST = 10.0
"""Times the torque of the machine's weight, for each radian."""


def springs(scene: Scene, size: Size) -> Iterator[FaultHypothesis]:
    """A spring in each hinge that has none: its stiffness, and its torque where both directions are the same."""
    sprung, hinges = scene.model_dump(mode="json"), list[str]()
    held = {
        frozenset({load.first.body, load.second.body}) for load in scene.loads.values() if load.kind == "torsion-spring"
    }
    for name, joint in scene.joints.items():
        bodies = {joint.first.body, joint.second.body} if isinstance(joint, Revolute) else set()
        if bodies and bodies not in held and not any(isinstance(scene.bodies.get(b), PointMass) for b in bodies):
            hinges.append(name)
            sprung["loads"] = {**sprung.get("loads", {}), **_loads(name, sprung["joints"][name])}
    with suppress(InputError):
        with_springs = Scene.parse(sprung)
        for name in hinges:
            yield _candidate(name, size, with_springs)


def _loads(name: str, joint: dict[str, Any]) -> dict[str, Any]:
    """Of a hinge: a spring that is at rest where the directions of its bodies agree, and a constant torque."""
    first, second = joint["first"], joint["second"]
    axis = {"axis": joint["axis"]} if joint.get("axis") is not None else {}
    # On the ground a direction does not depend on the place.
    taken = {} if first["body"] == GROUND else {"reaction": first}
    spring = {"kind": "torsion-spring", "first": first, "second": second, "stiffness": 0.0, "angle": 0.0, **axis}
    return {
        f"further-spring-{name}": spring,
        f"further-torque-{name}": {"kind": "torque", "at": second, "torque": 0.0, **taken, **axis},
    }


def _candidate(name: str, size: Size, scene: Scene) -> FaultHypothesis:
    most = _LARGEST * size.mass * size.gravity * size.length
    numbers = (
        Parameter(path=f"loads.further-spring-{name}.stiffness", lower=0.0, upper=most),
        Parameter(path=f"loads.further-torque-{name}.torque", lower=-np.pi * most, upper=np.pi * most),
    )
    probes = np.array([[[_STEP * most, 0.0], [0.0, _STEP * most]]])

    def tell(values: Array) -> tuple[float, str]:
        stiffness, torque = values.tolist()
        if abs(torque) >= _CONSTANT * stiffness:  # none at all is one too
            return torque, f"a constant torque of {torque:.3g} N m"
        return stiffness, f"a stiffness of {stiffness:.3g} N m/rad, at rest at {torque / stiffness:.3g} rad"

    words = f"torsion spring in {name}"
    return FaultHypothesis(words, "machine", numbers, (0.0, 0.0), probes, np.zeros((1, 2)), scene=scene, tell=tell)
