"""Results as files: what `--out FILE` of the command line writes. Imports wait: each form needs few of them."""

from __future__ import annotations

import csv
from collections.abc import Callable
from io import BytesIO, StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.atomic_write import atomic_write
from shoal.errors import InputError
from shoal.json_values import json_text

if TYPE_CHECKING:
    from shoal.engines.compare import Comparison
    from shoal.engines.sweep import Sweep
    from shoal.identification import Estimate, Problem
    from shoal.identification.design import Design
    from shoal.mechanics.analysis.campbell import Campbell
    from shoal.mechanics.analysis.equilibrium import Equilibrium
    from shoal.mechanics.analysis.modes import Modes
    from shoal.mechanics.linear_model import LinearModel
    from shoal.pictures.answer import Answer
    from shoal.response import Response
    from shoal.scene import Scene
    from shoal.selection import Selection
    from shoal.trajectory import Trajectory


Forms = dict[str, Callable[[], str | bytes]]
"""What makes the content of a file, by the ending of its name."""


def save(path: Path, forms: Forms) -> None:
    """Write a file in the form of its ending, all of it or nothing. Raises ComputationError."""
    content = forms[path.suffix]()
    with atomic_write(path) as part:
        part.write_bytes(content if isinstance(content, bytes) else content.encode())


DRAWN = (".html", ".gif", ".png")
"""Forms of a motion that are pictures."""


def trajectory(
    motion: Trajectory,
    scene: Scene,
    path: Path,
    selection: Selection | None = None,
    *,
    magnify: float = 1.0,
    stress: bool = False,
) -> None:
    """One lane: a page that moves, a moving picture, the machine at a few instants, tables, or all there is.

    selection: how the model was chosen, for the page; magnify: factor of the deflection of rods in pictures; stress:
    whether they are coloured by it. Raises InputError, ComputationError.
    """
    from shoal.pictures.emphasis import Emphasis

    emphasis = Emphasis(magnify, stress)

    def page() -> str:
        from shoal.pictures.simulation import simulation

        return simulation(motion, scene, selection, emphasis)

    def drawn(moves: bool) -> bytes:
        from shoal.pictures.gif import gif
        from shoal.pictures.poses import poses
        from shoal.pictures.simulation import moved
        from shoal.pictures.style import png
        from shoal.pictures.titles import ends, rejected

        moving = moved(motion, scene, emphasis)
        title = ends(scene.name, moving, motion.errors) if motion.ok else rejected(scene.name, motion)
        return gif(moving, title) if moves else png(poses(moving, title))

    def kept() -> bytes:
        from shoal.pictures.columns import about_motion, of_motion, parquet

        return parquet(of_motion(motion), about_motion(motion, scene))

    def netcdf() -> bytes:
        from shoal.pictures.columns import motion_to_netcdf

        return motion_to_netcdf(motion, scene)

    drawings: Forms = {".html": page, ".gif": lambda: drawn(moves=True), ".png": lambda: drawn(moves=False)}
    drawings |= {".parquet": kept, ".nc": netcdf}
    save(path, {**drawings, ".csv": lambda: columns(motion, "{:.12g}".format), ".json": _json(motion)})


def columns(motion: Trajectory, digits: Callable[[float], str]) -> str:
    """Time [s], place [m] and angle [rad] of every marker of one lane, separated by commas; digits: a number's."""
    names, table = ["t"], [motion.times]
    for name in motion.markers:
        names += [*(f"{name}.{axis}" for axis in motion.axes), f"{name}.angle"]
        table += [*motion.marker(name).T, motion.angle(name)]
    rows = (",".join(map(digits, row)) for row in np.column_stack(table).tolist())
    return "\n".join([",".join(names), *rows, ""])


def estimate(found: Estimate, problem: Problem, path: Path) -> None:
    """A page with everything, the model over the data, the motion of the first recording, or all for `shoal report`."""
    from shoal.pictures.answer import Answer

    def page() -> str:
        from shoal.pictures.report import report

        return report(Answer(problem, found))

    def kept() -> str:
        from shoal.pictures.archive import archived

        return json_text(archived(Answer(problem, found)), indent=1)

    def drawn() -> bytes:
        if found.posterior is None:
            raise InputError(f"out: no posterior was drawn, so {path} has nothing to hold")
        return draws(found)

    moves = {".gif": lambda: moving_picture(Answer(problem, found))}
    save(path, {".html": page, ".png": lambda: _plotted(found), **moves, ".json": kept, ".nc": drawn})


def draws(found: Estimate) -> bytes:
    """The draws from the posterior as NetCDF in ArviZ's form, where there are any."""
    if found.posterior is None:
        return b""
    about = {"left_out": json_text(found.left_out), "joint": json_text(found.joint)}
    return bytes(found.posterior.to_xarray().assign_attrs(about).to_netcdf(engine="scipy"))


def moving_picture(answer: Answer) -> bytes:
    """The identified motion of the first recording as GIF."""
    from shoal.pictures.gif import gif
    from shoal.pictures.motion import motion
    from shoal.pictures.overlay import follows

    found = answer.estimate
    title = f"{found.problem}, {found.verdict}: {follows(found)}"
    return gif(motion(answer, next(iter(found.measurement.recordings))), title)


def design(found: Design, path: Path) -> None:
    """The candidates, and what duration does."""

    def drawn() -> bytes:
        from shoal.pictures.design import design
        from shoal.pictures.style import png

        return png(design(found))

    def page() -> bytes:
        from shoal.pictures.designed import designed

        return designed(found).encode()

    save(path, {".json": _json(found), ".png": drawn, ".html": page})


def sweep(result: Sweep, path: Path) -> None:
    """Every point, or the displacement of the last marker."""

    def kept() -> bytes:
        from shoal.pictures.columns import about_sweep, of_sweep, parquet

        return parquet(of_sweep(result), about_sweep(result))

    def netcdf() -> bytes:
        from shoal.pictures.columns import sweep_to_netcdf

        return sweep_to_netcdf(result)

    tables: Forms = {".csv": lambda: rows(result), ".parquet": kept, ".nc": netcdf}
    save(path, {**tables, ".json": _json(result), ".png": lambda: _plotted(result)})


def rows(result: Sweep) -> str:
    """Every point, separated by commas."""
    found, stream = result.rows(), StringIO()
    writer = csv.DictWriter(stream, list(found[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(found)
    return stream.getvalue()


def response(found: Response, path: Path) -> None:
    """A page, bounds or statistics of every marker over time, or those of the last marker as a picture."""

    def table() -> str:
        header, rows = found.table()
        return "\n".join([",".join(header), *(",".join(f"{x:.12g}" for x in row) for row in rows), ""])

    def drawn() -> bytes:
        from shoal.pictures.response import response
        from shoal.pictures.style import png

        return png(response(found, found.markers[-1]))

    def page() -> str:
        from shoal.pictures.uncertainty import uncertainty

        return uncertainty(found)

    def netcdf() -> bytes:
        return bytes(found.to_xarray().to_netcdf(engine="scipy"))

    save(path, {".csv": table, ".json": _json(found), ".png": drawn, ".html": page, ".nc": netcdf})


def comparison(result: Comparison, path: Path) -> None:
    """All distances, or the engines over each other at the last marker."""
    save(path, {".json": _json(result), ".png": lambda: _plotted(result)})


def equilibrium(found: Equilibrium, path: Path) -> None:
    """The place of rest, or the machine there and where it was placed."""
    save(path, {".json": _json(found), ".png": lambda: _plotted(found)})


def modes(found: Modes | Campbell, path: Path) -> None:
    """The modes, or a Campbell diagram as a picture or a page. Raises InputError for a picture of one speed."""
    from shoal.mechanics.analysis.campbell import Campbell

    if path.suffix == ".json":
        save(path, {".json": _json(found)})
    elif isinstance(found, Campbell):
        from shoal.pictures.campbell import page

        save(path, {".png": lambda: _plotted(found), ".html": lambda: page(found)})
    else:
        raise InputError(f"out: {path} holds a Campbell diagram; add --speeds LOW:HIGH:COUNT, or write a .json")


def linear_model(found: LinearModel, path: Path) -> None:
    """The matrices for other tools, or Bode's diagram."""
    matrices = {name: getattr(found, name.lower()) for name in "ABCD"}
    names = {name: getattr(found, name) for name in ("states", "inputs", "outputs")}

    def numpy_archive() -> bytes:
        file = BytesIO()
        arrays: dict[str, Any] = {**matrices, **{key: np.array(value) for key, value in names.items()}}
        np.savez(file, **arrays)
        return file.getvalue()

    def matlab() -> bytes:
        from scipy.io import savemat

        file: Any = BytesIO()
        savemat(file, {**matrices, **{key: np.array(value, dtype=object) for key, value in names.items()}})
        return bytes(file.getvalue())

    save(path, {".json": _json(found), ".npz": numpy_archive, ".mat": matlab, ".png": lambda: _plotted(found)})


def _plotted(result: Estimate | Sweep | Comparison | Equilibrium | Campbell | LinearModel) -> bytes:
    """The picture that a notebook shows."""
    from shoal.pictures.inline import plot
    from shoal.pictures.style import png

    return png(plot(result).figure)


def _json(
    result: Trajectory | Design | Sweep | Comparison | Response | Equilibrium | Modes | Campbell | LinearModel,
) -> Callable[[], str]:
    """Return the writer of the JSON of `--json`, one number a line."""
    return lambda: json_text(result.to_json(), indent=1)
