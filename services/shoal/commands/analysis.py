"""Commands for static equilibrium, modes and joint reactions."""

from __future__ import annotations

from typing import Literal

import click

from shoal.commands import options
from shoal.commands.options import Out, Values
from shoal.errors import check_trusted


@click.command()
@click.argument("scene")
@click.option("--time", default=0.0, show_default=True, metavar="T", help="Loads and drives as they are at T [s].")
@click.option("--tolerance", type=float, metavar="METRES", help="Refine the mesh until its error stays below.")
@options.values
@options.verify
@options.as_json
@options.out(".json", ".png")
def statics(
    scene: str, time: float, tolerance: float | None, values: Values, verify: bool, as_json: bool, out: Out
) -> None:
    """Find where SCENE comes to rest without dry friction, drives standing still, and if it is stable there."""
    from shoal.notebook import statics
    from shoal.pictures import files
    from shoal.scene import load_scene
    from shoal.terminal import screen, tables

    wanted = load_scene(scene).with_values(values)
    with screen.working(f"balancing {wanted.name}"):
        equilibrium = statics(wanted, time, verify=verify, tolerance=tolerance)
    if out is not None:
        files.equilibrium(equilibrium, out)
    screen.show(equilibrium.to_json(), as_json, lambda: tables.equilibrium_table(equilibrium))
    check_trusted(equilibrium.ok, equilibrium.message)


@click.command()
@click.argument("scene")
@click.option("--count", default=10, show_default=True, type=options.limited("count"), help="How many, lowest first.")
@click.option("--about", default="equilibrium", show_default=True, type=click.Choice(["equilibrium", "start"]))
@click.option(
    "--speeds",
    cls=options.Once,
    metavar="LOW:HIGH:COUNT",
    callback=options.speeds,
    help="Campbell diagram: the modes at speeds [rad/s] of the body that turns fastest at the start; 0 is at rest.",
)
@options.values
@options.verify
@options.as_json
@options.out(".json", ".png", ".html")
def modes(
    scene: str,
    count: int,
    about: Literal["equilibrium", "start"],
    speeds: list[float] | None,
    values: Values,
    verify: bool,
    as_json: bool,
    out: Out,
) -> None:
    """Eigenfrequencies [Hz], damping and mode shapes of SCENE, about its equilibrium or its start.

    Where the start moves they are those about its steady motion, with gyroscopic and centrifugal terms.
    """
    from shoal.notebook import modes
    from shoal.pictures import files
    from shoal.scene import load_scene
    from shoal.terminal import screen, tables

    wanted = load_scene(scene).with_values(values)
    with screen.working(f"modes of {wanted.name}"):
        found = modes(wanted, about=about, count=count, speeds=speeds, verify=verify)
    if out is not None:
        files.modes(found, out)
    screen.show(found.to_json(), as_json, lambda: tables.modes_table(found))
    check_trusted(found.ok, found.verdict[1])


@click.command()
@click.argument("scene")
@click.option(
    "--at",
    "times",
    cls=options.Once,
    required=True,
    metavar="T,T,...",
    callback=options.times_list,
    help="Times of the motion [s].",
)
@options.values
@options.verify
@options.as_json
def reactions(scene: str, times: list[float], values: Values, verify: bool, as_json: bool) -> None:
    """Forces [N] and torques [N m] in the joints of SCENE while it moves, as they act on the second body."""
    from shoal.mechanics.analysis.joint_reactions import to_json
    from shoal.notebook import reactions
    from shoal.scene import load_scene
    from shoal.terminal import screen, tables

    wanted = load_scene(scene).with_values(values)
    with screen.working(f"reactions of {wanted.name}"):
        found = reactions(wanted, times, verify=verify)
    report = to_json(found)
    screen.show(report, as_json, lambda: tables.reactions_table(found))
    check_trusted(report["status"] == "ok", report["message"])
