"""Stability maps: where each method holds, where it is inaccurate, where it fails and how. One list of maps."""

from __future__ import annotations

from shoal_validation.stability import (
    contacts,
    in_space,
    long_runs,
    quadrature,
    rank_tolerance,
    rods_in_space,
    singular,
    step_machine,
    step_slenderness,
    step_stiffness,
)

MAPS = {
    answered.name: answered
    for answered in (
        step_stiffness.STEP,
        step_stiffness.TOLERANCE,
        step_slenderness.STEP,
        step_slenderness.TOLERANCE,
        step_machine.STEP,
        step_machine.TOLERANCE,
        singular.ACCELERATION,
        rank_tolerance.MAP,
        quadrature.MAP,
        long_runs.LONG,
        long_runs.CHAOTIC,
        long_runs.FLEXIBLE,
        in_space.SINGULAR,
        in_space.STEP,
        in_space.SPIN,
        rods_in_space.SLENDERNESS,
        rods_in_space.TWIST,
        *contacts.MAPS,
    )
}

__all__ = ["MAPS"]
