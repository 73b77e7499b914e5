"""Rigid rods that bend. A rod that is let go vibrates: its modulus is told by the phase, so that many are tried."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.errors import InputError
from shoal.identification.diagnostics.suspects.candidate import FaultHypothesis
from shoal.identification.diagnostics.suspects.size import size_of
from shoal.identification.forward import ForwardModel
from shoal.identification.problem import Parameter
from shoal.scene import Rod

_SAG = 1e-2
"""Deflection over length, by its weight, of the rod in the middle of those that are tried."""
_STIFFER, _WAYS = 6.0, 48
"""By how much softer and stiffer rods are tried, and how many."""
_ELEMENTS, _FOR_ANGLES = 2, 3
"""The direction of a rod's end converges more slowly than its place."""


def bending(model: ForwardModel) -> Iterator[FaultHypothesis]:
    """Young's modulus of each rigid rod that may bend."""
    scene = model.scene
    size = size_of(scene)
    channels = [c for run in model.measurement.recordings.values() for c in run.channels]
    if any(channel.is_dynamic for channel in channels):
        return  # what they show is told of rigid machines only
    angles = any(not channel.is_position for channel in channels)
    for name, body in scene.bodies.items():
        if not isinstance(body, Rod) or body.element != "rigid":
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
