"""Commands for static equilibrium, modes and joint reactions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shoal.commands import options
from shoal.commands.command import command
from shoal.commands.options import Out
from shoal.errors import check_trusted

if TYPE_CHECKING:
    from shoal.requests.linearize import Linearize
    from shoal.requests.modes import Modes
    from shoal.requests.reactions import Reactions
    from shoal.requests.statics import Statics


@command("statics")
@options.as_json
@options.out(".json", ".png")
def statics(asked: Statics, as_json: bool, out: Out) -> None:
    """Find where SCENE comes to rest without dry friction, drives standing still, and if it is stable there."""
    from shoal.notebook import machine, statics
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    scene = machine(asked, options.note)
    with screen.working(f"balancing {scene.name}"):
        equilibrium = statics.answer(asked.of(scene))
    options.finish(equilibrium, as_json, out, files.equilibrium, tables.equilibrium_table)


@command("modes")
@options.as_json
@options.out(".json", ".png", ".html")
def modes(asked: Modes, as_json: bool, out: Out) -> None:
    """Eigenfrequencies [Hz], damping and mode shapes of SCENE, about its equilibrium or its start.

    Where the start moves they are those about its steady motion, with gyroscopic and centrifugal terms.
    """
    from shoal.notebook import machine, modes
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    scene = machine(asked, options.note)
    with screen.working(f"modes of {scene.name}"):
        found = modes.answer(asked.of(scene))
    options.finish(found, as_json, out, files.modes, tables.modes_table)


@command("linearize")
@options.as_json
@options.out(".json", ".npz", ".mat", ".png")
def linearize(asked: Linearize, as_json: bool, out: Out) -> None:
    """The linear model x' = A x + B u, y = C x + D u of SCENE: matrices, poles and zeros.

    With --out a file for other tools, or Bode's diagram.
    """
    from shoal.notebook import linearize, machine
    from shoal.pictures import files
    from shoal.terminal import screen, tables

    scene = machine(asked, options.note)
    with screen.working(f"linear model of {scene.name}"):
        found = linearize.answer(asked.of(scene))
    options.finish(found, as_json, out, files.linear_model, tables.linear_table)


@command("reactions")
@options.as_json
def reactions(asked: Reactions, as_json: bool) -> None:
    """Forces [N] and torques [N m] in the joints of SCENE while it moves, as they act on the second body."""
    from shoal.mechanics.analysis.joint_reactions import to_json
    from shoal.notebook import machine, reactions
    from shoal.terminal import screen, tables

    scene = machine(asked, options.note)
    with screen.working(f"reactions of {scene.name}"):
        found = reactions.answer(asked.of(scene))
    report = to_json(found)
    screen.show(report, as_json, lambda: tables.reactions_table(found))
    check_trusted(report["status"] == "ok", report["message"])
