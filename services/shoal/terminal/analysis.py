"""Tables of what a scene is like: at rest, in its joints, in small motions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.mechanics.analysis.modes import Modes
    from shoal.mechanics.analysis.reactions import Reactions
    from shoal.mechanics.analysis.statics import Equilibrium

_NOTHING = 1e-12
"""Of the largest force: a force below it is the rounding of the arithmetic, and shown as zero."""


def equilibrium_table(equilibrium: Equilibrium) -> None:
    """Where the markers rest, what the joints bear, and the evidence."""
    table = screen.table(f"{equilibrium.scene.name} at rest", "marker", "x [m]", "y [m]", "angle [rad]")
    for name in equilibrium.markers:
        x, y = equilibrium.marker(name)
        table.add_row(name, f"{x:z.9f}", f"{y:z.9f}", f"{equilibrium.angle(name):z.9f}")
    screen.put(table)
    if equilibrium.reactions is not None:
        reactions_table([equilibrium.reactions])
    lowest = equilibrium.eigenvalues[:1].real
    screen.say(
        f"status {equilibrium.status}{f' ({equilibrium.message})' if equilibrium.message else ''}; "
        f"unbalanced {equilibrium.residual:.1e} of all forces, joints gape by {equilibrium.gap:.1e}"
        + "".join(f"; lowest eigenvalue {value:.4g} rad^2/s^2" for value in lowest)
        + f"; {equilibrium.iterations} iterations"
    )


def reactions_table(found: list[Reactions]) -> None:
    """What every joint exerts on its second body."""
    for reactions in found:
        title = f"joint forces on the second body at t = {reactions.time:g} s"
        table = screen.table(title, "joint", "kind", "fx [N]", "fy [N]", "torque [N m]", "unique")
        every = [(*joint.force, joint.torque) for joint in reactions.joints.values()]
        rounding = _NOTHING * float(np.max(np.abs(every), initial=0.0))
        for (name, joint), values in zip(reactions.joints.items(), every, strict=True):
            numbers = (f"{0.0 if abs(value) < rounding else value:.6g}" for value in values)
            table.add_row(name, joint.kind, *numbers, "yes" if joint.unique else "no")
        screen.put(table)
        if reactions.redundancy:
            screen.say(
                f"{reactions.redundancy} more than needed: least forces are shown; "
                f"redundant: {', '.join(reactions.constraints) or 'none away from this position'}"
            )


def modes_table(modes: Modes) -> None:
    """Frequencies, slowest first."""
    headings = ("mode", "frequency [Hz]", "[rad/s]", "damping ratio", "growth [1/s]", "kind")
    table = screen.table(f"{modes.scene.name}: small motions about the {modes.about}", *headings)
    for number, mode in enumerate(modes.modes, 1):
        numbers = (mode.frequency, mode.angular_frequency, mode.damping_ratio, mode.eigenvalue.real)
        table.add_row(str(number), *(f"{value:.6g}" for value in numbers), mode.kind)
    screen.put(table)
    if not modes.balanced:
        screen.say("the forces do not balance there; these are motions relative to its fall")
