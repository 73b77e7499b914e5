"""Machines that start elsewhere than stated: where their forces balance, bent or prestressed, or where a run ended."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shoal.errors import InputError
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.going_on import moving, resting, taken_up
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.ended import start_angles
from shoal.mechanics.machine import Machine
from shoal.mechanics.model import Model
from shoal.scene import Scene
from shoal.scene.ended import End


def begun(model: Model, scenes: Sequence[Scene] | None = None) -> Model:
    """The model at rest in its equilibrium, or at the end of a run, where its scene wants to start there.

    Else the model as it is. scenes: of every lane, else the one of the model. Raises InputError where a scene has no
    stable equilibrium, and where the end of the run does not fit.
    """
    if isinstance(model.stated.initial_from, End):
        return taken_up(model, model.stated.initial_from)
    if not model.stated.starts_at_rest:
        return model
    found = [_equilibrium(scene) for scene in scenes or [model.stated]]
    places = np.stack([one.q for one in found], axis=1)
    angles = start_angles(model, [one.turns for one in found])
    markers = np.stack([one.angles for one in found], axis=1)
    gaps = np.stack([one.gap_angles for one in found], axis=1)
    model = replace(model, q0=places, v0=np.zeros_like(places), shared_tiles={})
    turned = np.stack([one.signal_angles for one in found], axis=1)
    return moving(replace(model, start_angles=angles, marker_angles=markers, gap_angles=gaps, signal_angles=turned))


def at_start(scene: Scene, *, horizon: float = 0.0) -> Evaluator:
    """Return an evaluator of a scene where its motion begins; horizon [s]: latest time that will be asked for.

    Raises InputError if the scene cannot be modelled, or its start as `begun` does.
    """
    return Evaluator(resting(begun(Machine.of(scene).model(horizon))), one_sided=True)


def _equilibrium(scene: Scene) -> Equilibrium:
    found = statics(scene, reactions=False)
    if not found.ok:
        raise InputError(f"initial.from: statics finds no stable place of rest: {found.message}")
    return found
