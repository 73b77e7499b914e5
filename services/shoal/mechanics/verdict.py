"""Whether a run of the native solver can be believed: finite, within reach, its energy balanced, its joints closed."""

from __future__ import annotations

import numpy as np

from shoal.mechanics import reach as reaches
from shoal.mechanics.integrators import Choice, facts
from shoal.mechanics.marched import Marched
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import Array
from shoal.scene import Scene
from shoal.trajectory import Status

DRIFT_TOLERANCE = 1e-6
SINKING = 3000.0
"""A weight that nothing holds yet falls for as long as the error of its rate is below the absolute tolerance; by then
it is 14 times as fast as that. Twice as much is no error by the default tolerance of energies, a hundredth."""


def energy_error(record: Marched, scene: Scene, model: Model, end: float) -> Array:
    """Energy error of a run up to `end` [s] over the largest kinetic + elastic energy, (lanes,).

    A machine that never moves has none: then its weight lifted by its span and the energy of stretching its
    rods set the scale, as far as round-off goes. Nor is it an error if the weight sinks at a rate that the tolerance of
    rates allows: between two bars in one line, which hold it to the second order only, it does until they feel it.
    """
    stiff = max(np.max(family.coefficients, initial=0.0) for family in model.elements)
    weight = float(np.max(np.abs(model.weight), initial=0.0))
    sunk = SINKING * scene.solver.absolute_tolerance * end
    floor = weight * (1e-9 * reaches.span(scene) + sunk) + 1e-12 * float(stiff)
    relative: Array = record.energy_error[0] / np.maximum(record.energy_scale[0], floor + 1e-300)
    return relative


def of_the_size(drift: Array, scene: Scene) -> Array:
    """The largest of the violations of constraints (POWERS, lanes), relative to the machine's size; (lanes,)."""
    relative: Array = np.max(drift / reaches.span(scene) ** np.arange(len(drift))[:, None], axis=0)
    return relative


def verdict(
    scene: Scene,
    model: Model,
    record: Marched,
    choice: Choice,
    points: Array,
    energy_drift: Array,
    constraint_drift: Array,
) -> tuple[tuple[Status, ...], str]:
    """Status of every lane, and the reason for the first that is not ok."""
    # Lanes may be machines of different lengths.
    reach = reaches.MARGIN * reaches.reach(model.scene, record.energy_scale[0])
    farthest = np.max(reaches.distance_to_ground(model.scene, points), axis=(0, 1))
    adaptive = facts(choice.name).adaptive
    steps, reached = record.steps[0], record.reached[0]
    statuses, message = [], ""
    failed = np.broadcast_to(model.failed, model.lanes)
    for lane in range(model.lanes):
        finite = np.isfinite(farthest[lane]) and np.isfinite(energy_drift[lane])
        if failed[lane]:
            status, reason = Status.FAILED, "no start agrees with the joints and with what is stated"
        elif not finite and np.isfinite(energy_drift[lane]) and adaptive and steps[lane] >= scene.solver.max_steps:
            status = Status.FAILED
            reason = (
                f"{steps[lane]:.0f} steps of {choice.name} led to {reached[lane]:.4g} s only; "
                "raise solver.max_steps or solver.relative_tolerance"
            )
        elif not finite:
            status = Status.DIVERGED
            advice = "no step is short enough for it" if adaptive else "use a smaller step"
            reason = f"the motion is not finite; {advice}"
        elif farthest[lane] > reach[lane]:
            status = Status.OUT_OF_REACH
            reason = f"a marker is {farthest[lane]:.3g} m away, the reach is {reach[lane]:.3g} m"
        elif energy_drift[lane] > scene.solver.energy_tolerance:
            status = Status.ENERGY
            reason = f"energy is off by {energy_drift[lane]:.2g}, allowed {scene.solver.energy_tolerance:g} (relative)"
        elif not constraint_drift[lane] <= DRIFT_TOLERANCE:
            status = Status.DRIFTED
            reason = f"constraints are violated by {constraint_drift[lane]:.2g} of the machine's size"
        else:
            status, reason = Status.OK, ""
        statuses.append(status)
        message = message or reason
    return tuple(statuses), message
