"""Tables of motions: one, over a grid of values, on several engines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from shoal.pictures.choice import rows
from shoal.pictures.estimates import estimates
from shoal.pictures.start import remarks
from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.engines.compare import Comparison
    from shoal.engines.sweep import Sweep
    from shoal.scene import Scene
    from shoal.selection import Selection
    from shoal.trajectory import Trajectory


def trajectory_table(trajectory: Trajectory, scene: Scene, selection: Selection | None = None) -> None:
    """Where the markers end, and the evidence."""
    if selection is not None:
        selection_table(selection)
    table = screen.table(
        f"{scene.name}, {trajectory.engine}, at t = {trajectory.times[-1]:g} s", "marker", "x [m]", "y [m]"
    )
    for name in trajectory.markers:
        x, y = trajectory.marker(name)[-1]
        table.add_row(name, f"{x:z.9f}", f"{y:z.9f}")
    screen.put(table)
    verification = trajectory.model.get("verification")
    unknown = verification is not None and trajectory.ok and verification["time_error"] is None
    screen.say(
        f"status {trajectory.status[0]}{', but its time error is not known' if unknown else ''}; energy off by "
        f"{trajectory.energy_drift[0]:.1e}, constraints by {trajectory.constraint_drift[0]:.1e}"
    )
    screen.say(f"{trajectory.steps} steps in {trajectory.wall_s * 1e3:.1f} ms")
    for remark in remarks(trajectory.model):
        screen.say(remark)
    if verification is not None:
        for sentence in estimates(verification):
            screen.say(sentence)


def selection_table(selection: Selection) -> None:
    """The ladder: what was tried, at what cost, how far off, and why it stopped."""
    chosen = selection.chosen
    title = (
        f"models for {selection.tolerance:g} m at the markers: {len(selection.rungs)} runs, {selection.wall_s:.2f} s"
    )
    table = screen.table(title, "model", "unknowns", "steps", "ms", "error [m]", "")
    for row in rows(selection):
        table.add_row(*row)
    screen.put(table)
    for rod, reason in selection.rigid.items():
        screen.say(f"{rod} stays rigid: {reason}")
    verdict = "met" if selection.met else "not met"
    screen.say(f"{verdict}: {chosen.name}, estimated error {chosen.error:.1e} m; {selection.reason}")
    if selection.shear > selection.tolerance:
        screen.say(f"beyond the beams' theory: shear and rotary inertia, about {selection.shear:.0e} m")
    screen.put()


def sweep_table(sweep: Sweep) -> None:
    """Displacements of every marker over the grid."""
    markers = list(sweep.positions)
    last = markers[-1]
    table = screen.table(
        f"{sweep.scene.name}: displacement of {last} after {sweep.time:g} s",
        *_short(list(sweep.grid)),
        f"{last}.dx [m]",
        f"{last}.dy [m]",
        "status",
    )
    for row in sweep.rows():
        numbers = [f"{row[path]:.6g}" for path in sweep.grid]
        moved = [row[f"{last}.dx"], row[f"{last}.dy"]]
        table.add_row(*numbers, *("-" if m is None else f"{m:.6f}" for m in moved), row["status"])
    screen.put(table)
    if sweep.check is not None:
        screen.say(str(sweep.check))


def _short(paths: list[str]) -> list[str]:
    """Paths with their units, by their last two names where those tell them apart: OA.angle [rad]."""
    from shoal.identification.units import unit

    ends = [".".join(path.split(".")[-2:]) for path in paths]
    names = ends if len(set(ends)) == len(ends) else paths
    return [f"{name} [{unit(path)}]" if unit(path) else name for name, path in zip(names, paths, strict=True)]


def comparison_table(comparison: Comparison) -> None:
    """Ends by engine, then differences by pair."""
    last = list(comparison.scene.markers)[-1]
    table = screen.table(
        f"{comparison.scene.name}: {last} at the end", "engine", "x [m]", "y [m]", "energy", "time", "status"
    )
    for name, trajectory in comparison.trajectories.items():
        x, y = trajectory.marker(last)[-1]
        time = f"{trajectory.wall_s * 1e3:.0f} ms"
        table.add_row(
            name, f"{x:.7f}", f"{y:.7f}", f"{trajectory.energy_drift[0]:.0e}", time, str(trajectory.status[0])
        )
    screen.put(table)
    for name, reason in comparison.refused.items():
        screen.say(f"{name} refused: {reason}")
    table = screen.table("distances over all samples", "engines", "marker", "largest [m]", "final [m]")
    for row in comparison.differences():
        distances = ("-" if row[key] is None else f"{row[key]:.2e}" for key in ("largest", "final"))
        table.add_row(" - ".join(row["engines"]), row["marker"], *distances)
    screen.put(table)
