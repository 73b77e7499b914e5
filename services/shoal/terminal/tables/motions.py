"""Motions and what a scene is like: ends with their evidence, sweeps, equilibria, what joints bear, frequencies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.error_budget import worst
from shoal.pictures.choice import rows, tells_places
from shoal.pictures.estimates import estimates, grade
from shoal.pictures.start import reasons, remarks
from shoal.terminal import screen

if TYPE_CHECKING:
    from shoal.engines.compare import Comparison
    from shoal.engines.sweep import Sweep
    from shoal.mechanics.analysis.campbell import Campbell
    from shoal.mechanics.analysis.equilibrium import Equilibrium
    from shoal.mechanics.analysis.joint_reactions import Reactions
    from shoal.mechanics.analysis.modes import Modes
    from shoal.mechanics.linear_model import LinearModel
    from shoal.scene import Scene
    from shoal.selection import Selection
    from shoal.trajectory import Array, Trajectory

_NOTHING = 1e-12
"""Of the largest force: a force below it is the rounding of the arithmetic, and shown as zero."""


def trajectory_table(trajectory: Trajectory, scene: Scene, selection: Selection | None = None) -> None:
    """Print the final positions of the markers, the checks and the errors."""
    if selection is not None:
        selection_table(selection)
    title = f"{scene.name}, {trajectory.engine}, at t = {trajectory.times[-1]:g} s"
    if tells_places(trajectory, selection):
        table = screen.table(title, "marker", *(f"{axis} [m]" for axis in trajectory.axes))
        for name in trajectory.markers:
            table.add_row(name, *(f"{part:z.9f}" for part in trajectory.marker(name)[-1]))
        screen.out.print(table)
    else:
        screen.say(f"{title}: no places are shown, as the run is rejected")
    screen.say(
        f"status {trajectory.status[0]}, {trajectory.errors.brief}; energy off by {trajectory.energy_drift[0]:.1e}, "
        f"constraints by {trajectory.constraint_drift[0]:.1e}",
        style=screen.COLOURS[grade(trajectory, selection)],
    )
    slowed = trajectory.model.get("slowed_modes")
    raised = f"; the inertia of {slowed} axial modes is raised to suit the step" if slowed else ""
    screen.say(f"{trajectory.steps} steps in {trajectory.wall_s * 1e3:.1f} ms{raised}")
    screen.say(*remarks(trajectory.model, trajectory.ok))
    screen.findings(trajectory)
    screen.say(*estimates(trajectory))


def selection_table(selection: Selection) -> None:
    """The ladder: what was tried, at what cost, how far off, and why it stopped."""
    chosen = selection.chosen
    runs = f"{len(selection.candidates)} runs, {selection.wall_s:.2f} s"
    title = f"models for {selection.tolerance:g} m at the markers: {runs}"
    table = screen.table(title, "model", "unknowns", "steps", "ms", "error [m]", "")
    table.columns[-1].no_wrap = True
    for row in rows(selection):
        table.add_row(*row)
    screen.out.print(table)
    screen.say(*(f"{rod} stays rigid: {reason}" for rod, reason in selection.rigid.items()))
    verdict = "met" if selection.met else "not met"
    known = f"{chosen.name}, estimated error {selection.errors}; " if np.isfinite(chosen.error) else ""
    screen.say(f"{verdict}: {known}{selection.reason}")
    screen.out.print()


def sweep_table(sweep: Sweep) -> None:
    """Displacements of every marker over the grid."""
    markers = list(sweep.positions)
    last = markers[-1]
    axes = "xyz"[: sweep.scene.dimensions]
    table = screen.table(
        f"{sweep.scene.name}: displacement of {last} after {sweep.time:g} s",
        *_short(list(sweep.grid)),
        *(f"{last}.d{axis} [m]" for axis in axes),
        "status",
    )
    for row in sweep.rows():
        numbers = [f"{row[path]:.6g}" for path in sweep.grid]
        moved = (row[f"{last}.d{axis}"] for axis in axes)
        table.add_row(*numbers, *("-" if m is None else f"{m:.6f}" for m in moved), row["status"])
    screen.out.print(table)
    screen.say(*reasons(sweep))
    if sweep.elsewhere:
        screen.say(sweep.elsewhere.describe("points"))
    if sweep.check is not None:
        screen.say(str(sweep.check))


def _short(paths: list[str]) -> list[str]:
    """Paths with their units, by their last two names where those are unique: OA.angle [rad]."""
    from shoal.pictures.units import labelled

    ends = [".".join(path.split(".")[-2:]) for path in paths]
    names = ends if len(set(ends)) == len(ends) else paths
    return [labelled(path, name) for path, name in zip(paths, names, strict=True)]


def comparison_table(comparison: Comparison) -> None:
    """Ends by engine, then differences by pair."""
    last = list(comparison.scene.markers)[-1]
    axes = "xyz"[: comparison.scene.dimensions]
    columns = ("engine", *(f"{axis} [m]" for axis in axes), "energy", "time", "status")
    table = screen.table(f"{comparison.scene.name}: {last} at the end", *columns)
    for name, trajectory in comparison.trajectories.items():
        place = (f"{part:.7f}" if trajectory.ok else "-" for part in trajectory.marker(last)[-1])
        time = f"{trajectory.wall_s * 1e3:.0f} ms"
        table.add_row(name, *place, f"{trajectory.energy_drift[0]:.0e}", time, str(trajectory.status[0]))
    screen.out.print(table)
    screen.say(*(f"{name} refused: {reason}" for name, reason in comparison.refused.items()))
    screen.say(*next(filter(None, (remarks(one.model, one.ok) for one in comparison.trajectories.values())), []))
    if comparison.errors.estimates:
        screen.say(
            f"known error of the model that engines share (more careful runs of {comparison.verified}): "
            f"{comparison.errors}",
            style=screen.COLOURS[grade(comparison.trajectories[comparison.verified])],
        )
    if len(comparison.trajectories) < 2:
        return
    table = screen.table("distances over all samples", "engines", "marker", "largest [m]", "final [m]")
    for row in comparison.differences():
        distances = ("-" if row[key] is None else f"{row[key]:.2e}" for key in ("largest", "final"))
        table.add_row(" - ".join(row["engines"]), row["marker"], *distances)
    screen.out.print(table)
    screen.say(*(_compliance(name, row, comparison.verified) for name, row in comparison.compliance().items()))


def _compliance(name: str, row: dict[str, Any], verified: str) -> str:
    """Return what of an engine's distance is due to its contacts that give way."""
    if row["rigid"] is None:
        return f"{name}: contacts give way; a run with stiffer ones failed, so that their error is not known"
    distances = ", ".join(f"{one:.2g}" for one in row["distances"])
    what = "the engines disagree" if row["disagrees"] else "contacts that give way explain it"
    return (
        f"{name}: contacts give way; with 1, 4 and 16 times their stiffness it is {distances} m from {verified} "
        f"(root mean square), extrapolated to rigid ones {row['rigid']:.2g} m, known to {row['uncertainty']:.2g} m: "
        + what
    )


def equilibrium_table(equilibrium: Equilibrium) -> None:
    """Print the markers at rest, the joint reactions, the checks and the errors."""
    axes = [f"{axis} [m]" for axis in "xyz"[: equilibrium.scene.dimensions]]
    table = screen.table(f"{equilibrium.scene.name} at rest", "marker", *axes, "angle [rad]")
    for name in equilibrium.markers:
        place = (f"{part:z.9f}" for part in equilibrium.marker(name))
        table.add_row(name, *place, f"{equilibrium.angle(name):z.9f}")
    screen.out.print(table)
    if equilibrium.reactions is not None:
        reactions_table([equilibrium.reactions])
    for name, force in equilibrium.contacts.items():
        screen.say(f"closed: {name}, pressed with {force:.6g} N (or N m)")
    lowest = equilibrium.eigenvalues[:1].real
    screen.say(
        f"status {equilibrium.status}, "
        f"{equilibrium.errors.brief}; "
        f"unbalanced {equilibrium.residual:.1e} of all forces, joints gape by {equilibrium.gap:.1e}"
        + "".join(f"; lowest eigenvalue {value:.4g} rad^2/s^2" for value in lowest)
        + f"; {equilibrium.iterations} iterations",
        style=screen.COLOURS[equilibrium.grade],
    )
    screen.findings(equilibrium)
    if equilibrium.errors.estimates:
        screen.say(f"estimated error at the markers: {equilibrium.errors}")


def reactions_table(found: list[Reactions]) -> None:
    """Print the reactions of every joint on its second body; in space the forces, then the torques."""
    for reactions in found:
        if reactions.contacts:
            _contacts(reactions)
        joints = reactions.joints
        if not joints:
            continue
        when = f"on the second body at t = {reactions.time:g} s"
        forces = np.array([joint.force for joint in joints.values()])
        torques = np.array([np.atleast_1d(joint.torque) for joint in joints.values()])
        rounding = _NOTHING * float(np.max(np.abs(np.hstack([forces, torques])), initial=0.0))
        forces[abs(forces) < rounding], torques[abs(torques) < rounding] = 0.0, 0.0
        if torques.shape[-1] == 3:
            _exerted(f"joint forces {when}", ["fx [N]", "fy [N]", "fz [N]"], reactions, forces, ["force"])
            _exerted(f"joint torques {when}", ["mx [N m]", "my [N m]", "mz [N m]"], reactions, torques, ["torque"])
        else:
            both = np.hstack([forces, torques])
            _exerted(f"joint forces {when}", ["fx [N]", "fy [N]", "torque [N m]"], reactions, both, list(_ERRORS))
        if reactions.redundancy:
            # Constraints of bodies, such as the unit length of a director, are no joints to a user.
            among = ", ".join(dict.fromkeys(name for name in reactions.constraints if name in joints))
            told = f"; among {among}" if among else ""
            told = told if reactions.constraints else "; none away from this position"
            screen.say(f"{reactions.redundancy} more than needed: least forces are shown{told}")
    screen.findings(next((one for one in found if not one.ok), found[0]))
    if found[0].errors.estimates:
        screen.say(f"estimated error of the forces, largest of all joints: {found[0].errors}")


def _contacts(reactions: Reactions) -> None:
    """Print where contacts touch, and their forces on the first body."""
    known = all(one.force_error is not None for one in reactions.contacts.values())
    errors = [_ERRORS["force"]] if known else []
    axes = [f"{axis} [m]" for axis in "xyz"[: len(next(iter(reactions.contacts.values())).at)]]
    title = f"contact forces on the first body at t = {reactions.time:g} s"
    table = screen.table(title, "contact", "state", *axes, "normal [N]", "friction [N]", *errors, "unique")
    for name, one in reactions.contacts.items():
        numbers = (f"{value:.6g}" for value in (*one.at, one.normal, one.friction))
        error = [] if one.force_error is None else [f"{one.force_error:.1e}"]
        table.add_row(name, one.state, *numbers, *error, "yes" if one.unique else "no")
    screen.out.print(table)


_ERRORS = {"force": "error [N]", "torque": "error [N m]"}


def _exerted(title: str, headings: list[str], reactions: Reactions, values: Array, parts: list[str]) -> None:
    """A row for every joint; `values` in the order of the joints, with the errors of these parts if they are known."""
    known = all(joint.force_error is not None for joint in reactions.joints.values())
    parts = parts if known else []
    table = screen.table(title, "joint", "kind", *headings, *(_ERRORS[part] for part in parts), "unique")
    for (name, joint), row in zip(reactions.joints.items(), values, strict=True):
        errors = (f"{getattr(joint, f'{part}_error'):.1e}" for part in parts)
        table.add_row(name, joint.kind, *(f"{value:.6g}" for value in row), *errors, "yes" if joint.unique else "no")
    screen.out.print(table)


def linear_table(found: LinearModel) -> None:
    """Poles, slowest first, with the names of states, inputs and outputs; --json and --out have the matrices."""
    title = f"{found.scene.name}: linear model about the {found.about}"
    table = screen.table(title, "pole [1/s]", "frequency [Hz]", "damping ratio", "kind")
    for pole in (one for one in found.poles.tolist() if one.imag >= 0.0):
        size = abs(pole)
        kind = "integrates" if not size else "grows" if pole.real > 0.0 else "oscillates" if pole.imag else "decays"
        ratio = f"{-pole.real / size + 0.0:.6g}" if size else "-"
        table.add_row(_complex(pole), f"{abs(pole.imag) / (2 * np.pi):.6g}", ratio, kind)
    screen.out.print(table)
    for what in ("states", "inputs", "outputs"):
        screen.say(f"{what}: {', '.join(getattr(found, what))}")
    if found.zeros is not None:
        screen.say(
            f"zeros [1/s]: {', '.join(_complex(one) for one in found.zeros.tolist() if one.imag >= 0.0) or 'none'}"
        )
    if (margins := found.margins) is not None and margins.stable:
        screen.say(
            f"margins of the loop at {found.loop}: gain {margins.gain_margin:.6g}, phase {margins.phase_margin:.6g} "
            f"degrees, delay {margins.delay_margin:.6g} s; the gain may fall to {margins.gain_reduction:.6g}"
        )
    screen.findings(found)


def _complex(value: complex) -> str:
    return f"{value.real:.6g}" + (f" +- {value.imag:.6g}j" if value.imag else "")


def modes_table(modes: Modes | Campbell) -> None:
    """Frequencies, slowest first; of a Campbell diagram at each speed."""
    from shoal.mechanics.analysis.campbell import Campbell

    if isinstance(modes, Campbell):
        from shoal.pictures.campbell import HEADINGS, rows, says

        table = screen.table(f"{modes.scene.name}: small motions about the {modes.about} by speed", *HEADINGS)
        for row in rows(modes):
            table.add_row(*row)
        screen.out.print(table)
        screen.say(says(modes))
        screen.say(*(f"next: {step}" for step in modes.advice))
        errors = [error for one in modes.modes if one for error in one.errors]
        if any(error.total is not None for error in errors):
            screen.say(f"estimated error of the eigenvalues, at most: {worst(errors)}")
        return
    turning = ("whirl", "frame") if modes.speed is not None else ()
    known = any(error.total is not None for error in modes.errors)
    # All of them do not fit on a line; --json has the others.
    figures = ("frequency [Hz]", *(() if turning else ("[rad/s]", "damping ratio")), "growth [1/s]")
    headings = ("mode", *figures, "kind", *turning, *(("error",) if known else ()))
    table = screen.table(f"{modes.scene.name}: small motions about the {modes.about}", *headings)
    table.columns[headings.index("kind")].no_wrap = True
    for number, mode in enumerate(modes.modes, 1):
        also = () if turning else (mode.angular_frequency, mode.damping_ratio)
        numbers = (mode.frequency, *also, mode.eigenvalue.real)
        seen = (mode.whirl or "-", mode.frame) if turning else ()
        error = [] if not known else ["-" if (off := modes.errors[number - 1].total) is None else f"{off:.1e}"]
        table.add_row(str(number), *(f"{value:.6g}" for value in numbers), mode.kind, *seen, *error)
    screen.out.print(table)
    screen.findings(modes)
    if known:
        screen.say(f"estimated error of the eigenvalues, at most: {worst(modes.errors)}")
    if not modes.balanced:
        screen.say("the forces do not balance there; these are motions relative to its fall")
