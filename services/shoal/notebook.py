"""Public functions of `import shoal`: the main commands, with results that a notebook shows.

A scene or problem is given as an object, as a mapping of its fields, by its name, or as the path of a YAML file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from shoal.arguments import check_apart, check_estimated, numbers, one_of, told
from shoal.errors import InputError
from shoal.scene import Scene
from shoal.scene.load import as_scene
from shoal.trajectory import Trajectory

if TYPE_CHECKING:
    import pandas as pd

    from shoal.engines.compare import Comparison
    from shoal.engines.prepared import Prepared
    from shoal.engines.sweep import Sweep
    from shoal.exported import Exported
    from shoal.identification import Estimate, Problem
    from shoal.identification.carried import Carried
    from shoal.identification.design import Design
    from shoal.mechanics.analysis.campbell import Campbell
    from shoal.mechanics.analysis.equilibrium import Equilibrium
    from shoal.mechanics.analysis.joint_reactions import Reactions
    from shoal.mechanics.analysis.modes import Modes
    from shoal.pictures.inline import Picture
    from shoal.response import Response
    from shoal.selection import Selection

Stated: TypeAlias = Scene | Mapping[str, Any] | str | Path
"""A scene, its fields as a mapping, the name of one, or a YAML file."""
StatedProblem: TypeAlias = "Problem | Mapping[str, Any] | str | Path"
"""A problem likewise."""
Values: TypeAlias = "Mapping[str, Any] | Estimate | str | Path"
"""Fields of a scene by dotted path, or what was found before: an estimate, or the JSON file of one."""
Times = Sequence[float] | npt.NDArray[np.float64]
Data: TypeAlias = "str | Path | pd.DataFrame | Mapping[str, str | Path | pd.DataFrame] | None"


def simulate(
    scene: Stated,
    times: Times | None = None,
    *,
    values: Values | None = None,
    engine: str = "gauss",
    tolerance: float | None = None,
    verify: bool = True,
) -> Trajectory:
    """Simulate a scene; its `status` says whether the motion can be trusted.

    times: sampling instants [s], else the scene's own; values: fields of the scene to set, by dotted path;
    engine: gauss, exudyn, exudyn-ge, casadi, tree, mujoco or the address of a service; tolerance: error [m] that the
    markers may have, for which the cheapest model is found (see `select`); verify: estimate the error by a second run,
    which a tolerance cannot do without. Raises InputError.
    """
    from shoal.engines import get_engine
    from shoal.engines.verification import verified

    check_estimated(tolerance, verify)
    wanted = _scene(scene, values)
    if tolerance is not None:
        if engine != "gauss":
            raise InputError(f"tolerance: models are chosen for engine gauss only, found engine {engine!r}")
        return select(wanted, tolerance, times).trajectory
    chosen = get_engine(engine)
    return verified(chosen, wanted, times) if verify else chosen.simulate(wanted, times)


def prepare(scene: Stated, *, values: Values | None = None) -> Prepared:
    """A scene for a loop of your own: call what comes back with values and times, as often as you like.

    It gives what `simulate` gives without its second runs (`verify=False`), to the last bit, in a fraction of the time
    around the steps. values: fields of the scene to set, by dotted path. Raises InputError.
    """
    from shoal.engines.prepared import Prepared

    return Prepared(_scene(scene, values).model_copy(deep=True))


def select(scene: Stated, tolerance: float, times: Times | None = None, *, values: Values | None = None) -> Selection:
    """The cheapest model whose estimated error at the markers is below a tolerance [m]. Raises InputError."""
    from shoal.selection import select

    return select(_scene(scene, values), tolerance, times)


def sweep(
    scene: Stated,
    vary: Mapping[str, Times],
    time: float | None = None,
    *,
    values: Values | None = None,
    engine: str = "gauss",
    verify: bool = True,
) -> Sweep:
    """Marker positions at one instant [s] over the full grid of `vary` (path -> values). Raises InputError.

    verify: whether errors are estimated at some of its points by more careful runs
    """
    from shoal.engines import get_engine
    from shoal.engines.spot_checks import spot_checked
    from shoal.engines.sweep import sweep

    check_apart(values, vary)
    found = sweep(_scene(scene, values), vary, get_engine(engine), time)
    return spot_checked(found, get_engine(engine)) if verify else found


def uncertain(
    scene: Stated,
    vary: Mapping[str, Any] | Sequence[str],
    times: Times | None = None,
    *,
    values: Values | None = None,
    engine: str = "gauss",
    method: str = "auto",
    gap: float | None = None,
    tolerance: float | None = None,
    correlations: Mapping[tuple[str, str], float] | None = None,
    degree: int | None = None,
    count: int | None = None,
    most: int = 20_000,
    limits: Sequence[str] = (),
    requirements: Sequence[str] = (),
    limit_method: str = "auto",
    limit_runs: int = 5_000,
    allocate: bool = False,
    costs: Mapping[str, float] | None = None,
    target: float | None = None,
    checkpoint: Path | str | None = None,
    time_limit: float | None = None,
    verify: bool = True,
    seed: int = 0,
    progress: Callable[[int], None] | None = None,
) -> Response:
    """Bound or predict the motion of the markers if fields of the scene are intervals or distributions.

    vary: path -> (low, high), a text such as "normal(1, 0.01)" or a frozen distribution of scipy, or a list of texts of
    `--vary`; times: instants [s], else the scene's own; gap: between outer and attained bounds, as a share of the
    largest width, that must be reached; tolerance: error [m] of the model; correlations: of pairs of random parameters;
    degree, count: of a method that has one; most: runs that may be made; verify: estimate mesh and step errors of
    extremal runs; limits: what must not happen, such as "B.y < -1.2"; requirements: what must hold, such as
    "B.y > -1.2"; limit_method: auto, form, importance, subset or monte-carlo; limit_runs: for each of their
    probabilities; allocate: look for the widest tolerances that keep the limit, with `costs` (by path, else 1) of
    tightening each; target: probability of passing it that is allowed, else 0.001; checkpoint: file that keeps the
    runs, from which the same study goes on; time_limit [s]: after which it ends with what is known; progress: called
    with the number of runs. Raises InputError, ComputationError.
    """
    from shoal.response import uncertain

    return uncertain(
        _scene(scene, values),
        vary,
        times,
        engine=engine,
        method=method,
        gap=gap,
        tolerance=tolerance,
        correlations=correlations,
        degree=degree,
        count=count,
        most=most,
        limits=limits,
        requirements=requirements,
        limit_method=limit_method,
        limit_runs=limit_runs,
        allocate=allocate,
        costs=costs,
        target=target,
        checkpoint=checkpoint,
        time_limit=time_limit,
        verify=verify,
        seed=seed,
        progress=progress,
    )


def compare(
    scene: Stated,
    engines: Sequence[str] | None = None,
    times: Times | None = None,
    *,
    values: Values | None = None,
    verify: bool = True,
) -> Comparison:
    """Run a scene on several engines; `differences()` returns the distances of their results.

    engines: by name; else our solver and at most two that can run the scene; verify: estimate the errors that they may
    share, of the mesh and of the theory, by more careful runs of one. Raises InputError.
    """
    from shoal.engines.compare import compare

    return compare(_scene(scene, values), engines, times, verify)


def statics(
    scene: Stated,
    time: float = 0.0,
    *,
    values: Values | None = None,
    verify: bool = True,
    tolerance: float | None = None,
) -> Equilibrium:
    """Where a scene comes to rest, and whether it is stable there. Raises InputError.

    time: what is applied stands as it is then [s]; values: fields of the scene to set, by dotted path; verify: estimate
    the error of the mesh by a second run on twice as many elements, which a tolerance cannot do without; tolerance:
    double the elements of the rods until the error at the markers is below [m]
    """
    from shoal.mechanics.analysis.mesh_error import of_equilibrium
    from shoal.mechanics.analysis.settled import settled
    from shoal.mechanics.analysis.statics import statics

    check_estimated(tolerance, verify)
    wanted = _scene(scene, values)
    if tolerance is not None:
        return settled(wanted, tolerance, time)
    found = statics(wanted, time)
    return of_equilibrium(found, wanted) if verify else found


def modes(
    scene: Stated,
    *,
    count: int = 10,
    about: Literal["equilibrium", "start"] = "equilibrium",
    speeds: Times | None = None,
    values: Values | None = None,
    verify: bool = True,
) -> Modes | Campbell:
    """The `count` lowest eigenfrequencies of a scene with their shapes, about its equilibrium or its start.

    Where the start moves they are those about its steady motion. speeds: of the body that turns fastest [rad/s], for a
    Campbell diagram; at 0 the machine is at rest. values: fields of the scene to set, by dotted path; verify: estimate
    the error of the mesh by a second run on twice as many elements. Raises InputError.
    """
    from shoal.mechanics.analysis.campbell import campbell
    from shoal.mechanics.analysis.mesh_error import of_campbell, of_modes
    from shoal.mechanics.analysis.modes import modes

    wanted = _scene(scene, values)
    if speeds is not None:
        diagram = campbell(wanted, list(speeds), about=about, count=count)
        return of_campbell(diagram, wanted) if verify else diagram
    found = modes(wanted, about=about, count=count)
    return of_modes(found, wanted) if verify else found


def export(
    scene: Stated,
    to: Literal["exudyn", "mjcf"],
    file: str | Path | None = None,
    *,
    values: Values | None = None,
    verify: bool = True,
) -> Exported:
    """A scene for another tool: a script for Exudyn that runs by itself, or MuJoCo's MJCF.

    file: written where it is given, .py or .xml; values: fields of the scene to set, by dotted path; verify: run it
    there and here, and tell how far apart the motions are [m]. Raises InputError that names what the tool has not,
    ComputationError where a run fails.
    """
    from shoal.exported import checked, export

    path = None if file is None else Path(file)
    found = export(_scene(scene, values), checked(to, path), verify=verify)
    if path is not None:
        found.save(path)
    return found


def reactions(scene: Stated, times: Times, *, values: Values | None = None, verify: bool = True) -> list[Reactions]:
    """Forces and torques in the joints of a scene at times [s] of its motion. Raises InputError, ComputationError.

    values: fields of the scene to set, by dotted path; verify: estimate their errors by runs with other steps
    """
    from shoal.mechanics.analysis.reactions import reactions
    from shoal.mechanics.analysis.reactions_verified import verified

    return (verified if verify else reactions)(_scene(scene, values), numbers("times", times, "times in s").tolist())


def identify(
    problem: StatedProblem,
    data: Data = None,
    *,
    method: str | None = None,
    values: Values | None = None,
    seed: int = 0,
    engine: str = "gauss",
    tolerance: float | None = None,
    time_limit: float | None = None,
    profiles: bool = False,
    bootstrap: int = 0,
    sample: int = 0,
    **options: Any,
) -> Estimate:
    """Find the parameters of a problem from measured motion.

    data: a file, or a table whose columns are those that the problem's channels name, instead of the problem's own
    recording; for several recordings a mapping from their names to these; method: one of `METHODS`, else the problem's;
    values: fields of the scene to set, or an estimate or its JSON file: what is sought starts from there, what else it
    found is set; tolerance: error [m] that the model may have, for which it is chosen;
    time_limit: of all of it [s]; profiles: the profile likelihood of every parameter; bootstrap: how many draws;
    sample: how many effective draws from the posterior;
    options: further ones of `shoal.identification.identify` (hold_out, progress, measurement, checkpoint, wishes).
    Raises InputError, ComputationError.
    """
    from shoal.identification import Estimate, identify
    from shoal.identification.conclude import Wishes

    shown(Estimate)
    options = {"wishes": Wishes(profiles=profiles, bootstrap=bootstrap, sample=sample), **options}
    stated, carried = _values(values)
    if carried is not None:
        options["fitted"] = carried
    options |= {"method": method, "values": stated, "seed": seed, "engine": engine, "tolerance": tolerance}
    with _files(data) as files:
        return identify(_problem(problem), data=files, time_limit=time_limit, **options)


def design(
    problem: StatedProblem,
    data: Data = None,
    *,
    about: Literal["answer", "start"] | None = None,
    values: Values | None = None,
    noise: float | None = None,
    angle_noise: float | None = None,
    sensor_noise: Mapping[str, float] | None = None,
    duration: float | None = None,
    rate: float | None = None,
    parameter: str | None = None,
) -> Design:
    """What to measure to know the parameters of a problem best: which sensor where, how long and how often.

    data: as for `identify`; about: the answer from the data, where there are any, or the start; noise [m], angle_noise
    [rad]: standard deviations, sensor_noise: of acceleration, rate, force, torque and strain, by name, in SI units,
    which are weighed where it is known; duration [s] and rate [1/s] of the measurement, else those of the problem and
    its data; parameter: to be sharpened, else the weakest. Raises InputError, ComputationError where no answer can be
    trusted.
    """
    from shoal.identification.design import ABOUT, about_answer, about_start, has_data

    if about is not None:
        one_of("about", about, ABOUT)
    (stated, carried), wanted = _values(values), _problem(problem)
    if carried is not None:
        wanted, stated, _ = carried.into(wanted)
    how = dict[str, Any](noise=noise, angle_noise=angle_noise, sensor_noise=sensor_noise, duration=duration, rate=rate)
    answered = about == "answer" or (about is None and (data is not None or has_data(wanted)))
    with _files(data) as files:
        return (about_answer if answered else about_start)(wanted, files, stated, parameter=parameter, **how)


def plot(result: Scene | Trajectory | Equilibrium | Estimate | Sweep | Comparison) -> Picture:
    """The picture of a scene (its motion), a trajectory, a place of rest, an estimate, a sweep or a comparison.

    Raises InputError.
    """
    from shoal.pictures.inline import plot

    return plot(result)


def _scene(given: Stated, values: Values | None) -> Scene:
    scene = as_scene(given)
    stated, carried = _values(values)
    if carried is not None:
        return carried.set_in(scene)
    return scene.with_values(stated) if stated else scene


def _values(given: Values | None) -> tuple[Mapping[str, Any] | None, Carried | None]:
    """Fields to set as they are stated, or what was found before."""
    if given is None or isinstance(given, Mapping):
        return given, None
    from shoal.identification.carried import carried

    return None, carried(given)


def _problem(given: StatedProblem) -> Problem:
    from shoal.identification.problem import as_problem

    return as_problem(given)


@contextmanager
def _files(data: Data) -> Iterator[str | Mapping[str, str] | None]:
    """Recordings as files, those of tables for as long as the block lasts. Raises InputError."""
    with TemporaryDirectory(prefix="shoal-") as folder:
        if isinstance(data, Mapping):
            yield {name: _file(one, Path(folder) / f"{k}.csv") for k, (name, one) in enumerate(data.items())}
        else:
            yield None if data is None else _file(data, Path(folder) / "table.csv")


def _file(data: Any, table: Path) -> str:
    """The file of a recording; that of a table is written. Raises InputError."""
    if isinstance(data, str | Path):
        return str(data)
    if not hasattr(data, "to_csv"):
        raise InputError(f"data: needs a file or a table (a DataFrame), by name for several, found {told(data)}")
    data.to_csv(table, index=False)
    return str(table)


def _html(result: Any) -> str:
    """What a notebook shows."""
    from shoal.pictures.inline import html

    return html(result)


def shown(kind: type) -> None:
    """Let notebooks show results of a class, which itself knows nothing of pictures."""
    setattr(kind, "_repr_html_", _html)  # noqa: B010


for _kind in (Scene, Trajectory):
    shown(_kind)
