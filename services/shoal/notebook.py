"""Public functions of `import shoal`: the main commands, with results that a notebook shows.

A scene or problem is given as an object, as a mapping of its fields, by its name, or as the path of a YAML file.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, cast

from shoal.arguments import brief
from shoal.errors import InputError
from shoal.requests.compare import Compare
from shoal.requests.design import Design as DesignRequest
from shoal.requests.export import Export
from shoal.requests.fields import At, Data, OfScene
from shoal.requests.function import function
from shoal.requests.identify import Identify
from shoal.requests.linearize import Linearize as LinearizeRequest
from shoal.requests.modes import Modes as ModesRequest
from shoal.requests.reactions import Reactions as ReactionsRequest
from shoal.requests.select import Select
from shoal.requests.simulate import Simulate
from shoal.requests.statics import Statics
from shoal.requests.sweep import Sweep as SweepRequest
from shoal.requests.uncertain import Uncertain
from shoal.scene import Scene
from shoal.scene.load import as_scene
from shoal.trajectory import Trajectory

if TYPE_CHECKING:
    from shoal.engines.compare import Comparison
    from shoal.engines.contract import Engine
    from shoal.engines.prepared import Prepared
    from shoal.engines.sweep import Sweep
    from shoal.exported import Exported
    from shoal.identification import Estimate
    from shoal.identification.design import Design
    from shoal.mechanics.analysis.campbell import Campbell
    from shoal.mechanics.analysis.equilibrium import Equilibrium
    from shoal.mechanics.analysis.joint_reactions import Reactions
    from shoal.mechanics.analysis.modes import Modes
    from shoal.mechanics.linear_model import LinearModel
    from shoal.pictures.inline import Picture
    from shoal.response import Response
    from shoal.selection import Selection


@function(Simulate)
def simulate(asked: Simulate) -> Trajectory:
    """Simulate a scene.

    Returns:
        The motion of the markers, with the estimated errors in `model["errors"]`; a rejected run has its reason in
        `message`.

    Raises:
        InputError: A field is wrong; the message names it.

    Examples:
        >>> import shoal
        >>> shoal.simulate("single-pendulum", [0.5, 1.0])
        Trajectory(A; 2 samples, gauss, ok)
    """
    return motion(asked, machine(asked))[0]


def machine(asked: OfScene, note: Callable[[str], None] = lambda _: None) -> Scene:
    """Return the scene of a request with its fields set; `note` is called for values that are doubted or left out.

    Raises InputError.
    """
    if asked.values is None:
        return asked.machine()
    from shoal.identification.carried import carried

    found = carried(asked.values)
    for one in found.notes():
        note(one)
    return found.set_in(as_scene(asked.scene), asked.set)


def motion(
    asked: Simulate, scene: Scene, tell: Callable[[str], None] = lambda _: None
) -> tuple[Trajectory, Scene, Selection | None]:
    """Return the motion of a scene, the scene that was simulated, and the choice of its model for a tolerance.

    tell: called with the steps of the search for a model. Raises InputError.
    """
    from shoal.engines import get_engine
    from shoal.engines.verification import verified

    if asked.tolerance is not None:
        from shoal.selection import select
        from shoal.selection.refine import PATIENCE

        patience = PATIENCE if asked.patience is None else asked.patience
        selection = select(scene, asked.tolerance, asked.at, tell, patience)
        return selection.trajectory, selection.chosen.scene, selection
    engine = get_engine(asked.engine)
    return (verified if asked.verify else _simulated)(engine, scene, asked.at), scene, None


def _simulated(engine: Engine, scene: Scene, times: At) -> Trajectory:
    return engine.simulate(scene, times)


@function(OfScene)
def prepare(asked: OfScene) -> Prepared:
    """Prepare a scene.

    Returns:
        What is called with values of fields and times, as often as you like. It gives what `simulate` gives without
        its second runs (`verify=False`), to the last bit, in a fraction of the time around the steps.

    Raises:
        InputError: A field is wrong; the message names it.

    Examples:
        >>> prepared = shoal.prepare("single-pendulum")
        >>> prepared({"initial.OA.angle": 0.3}, [0.5]).ok
        True
    """
    from shoal.engines.prepared import prepared

    return prepared(machine(asked))


@function(Select)
def select(asked: Select) -> Selection:
    """Find the cheapest model of a scene.

    Returns:
        The models that were tried with their estimated errors, the chosen one, and its motion.

    Raises:
        InputError: A field is wrong; the message names it.

    Examples:
        >>> shoal.select("flexible-double-pendulum", 1e-3).met
        True
    """
    from shoal.selection import select

    return select(machine(asked), asked.tolerance, asked.at)


@function(SweepRequest)
def sweep(asked: SweepRequest) -> Sweep:
    """Simulate a scene over a grid.

    Returns:
        The positions of the markers over the grid, with errors that are estimated at some of its points.

    Raises:
        InputError: A field is wrong; the message names it.

    Examples:
        >>> found = shoal.sweep("single-pendulum", {"initial.OA.angle": [0.0, 0.5]}, at=0.5)
        >>> found.positions["A"].shape
        (2, 2)
    """
    from shoal.engines import get_engine
    from shoal.engines.spot_checks import spot_checked
    from shoal.engines.sweep import sweep

    engine = get_engine(asked.engine)
    found = sweep(machine(asked), asked.vary, engine, asked.at)
    return spot_checked(found, engine) if asked.verify else found


@function(Uncertain)
def uncertain(asked: Uncertain) -> Response:
    """Bound or predict the motion of a scene.

    Returns:
        Bounds of the markers' motion or its statistics, the verdicts on the limits, and the errors of all these.

    Raises:
        InputError: A field is wrong; the message names it.
        ComputationError: Too many runs failed, or the time was over before the first.

    Examples:
        >>> found = shoal.uncertain("single-pendulum", {"initial.OA.angle": (0.1, 0.2)}, at=[0.5])
        >>> print(found.status)
        ok
    """
    from shoal.response import uncertain

    return uncertain(asked, machine(asked))


@function(Compare)
def compare(asked: Compare) -> Comparison:
    """Run a scene on several engines.

    Returns:
        The motions by engine; `differences()` returns how far apart they are.

    Raises:
        InputError: A field is wrong; the message names it.

    Examples:
        >>> list(shoal.compare("single-pendulum", ["gauss", "casadi"], at=[0.5]).trajectories)
        ['gauss', 'casadi']
    """
    from shoal.engines.compare import compare

    return compare(machine(asked), asked.engines, asked.at, asked.verify)


@function(Statics)
def statics(asked: Statics) -> Equilibrium:
    """Find the static equilibrium of a scene.

    Returns:
        The positions of the markers at rest, whether they are stable, and their estimated error.

    Raises:
        InputError: A field is wrong; the message names it.

    Examples:
        >>> shoal.statics("single-pendulum").ok
        True
    """
    from shoal.mechanics.analysis.mesh_error import of_equilibrium
    from shoal.mechanics.analysis.settled import settled
    from shoal.mechanics.analysis.statics import statics

    scene = machine(asked)
    if asked.tolerance is not None:
        return settled(scene, asked.tolerance, asked.time)
    found = statics(scene, asked.time)
    return of_equilibrium(found, scene) if asked.verify else found


@function(ModesRequest)
def modes(asked: ModesRequest) -> Modes | Campbell:
    """Find the modes of a scene.

    Returns:
        Frequencies, damping and shapes with their estimated errors; with `speeds` a Campbell diagram.

    Raises:
        InputError: A field is wrong; the message names it.

    Examples:
        >>> len(shoal.modes("single-pendulum", count=1).frequencies)
        1
    """
    from shoal.mechanics.analysis.campbell import campbell
    from shoal.mechanics.analysis.mesh_error import of_campbell, of_modes
    from shoal.mechanics.analysis.modes import modes

    scene = machine(asked)
    if asked.speeds is not None:
        diagram = campbell(scene, list(asked.speeds), about=asked.about, count=asked.count)
        return of_campbell(diagram, scene) if asked.verify else diagram
    found = modes(scene, about=asked.about, count=asked.count)
    return of_modes(found, scene) if asked.verify else found


@function(LinearizeRequest)
def linearize(asked: LinearizeRequest) -> LinearModel:
    """Find the linear model of a scene.

    Returns:
        The matrices A, B, C and D with the names of states, inputs and outputs, poles and zeros.

    Raises:
        InputError: A field is wrong; the message names it.
        ComputationError: There is no equilibrium, or the start moves.

    Examples:
        >>> shoal.linearize("andrews-squeezer", ["motor"], about="start").states
        ('angle(O)', 'rate(O)')
    """
    from shoal.mechanics.linear_model import linearize

    return linearize(
        machine(asked),
        list(asked.inputs),
        list(asked.outputs),
        about=asked.about,
        time=asked.time,
        loop=asked.loop,
        require=list(asked.require),
    )


@function(Export)
def export(asked: Export) -> Exported:
    """Write a scene as a file of another tool.

    Returns:
        The text of the file, its name, and the distance [m] between the motions where they were compared.

    Raises:
        InputError: A field is wrong, or the other tool lacks something of the scene; the message names it.
        ComputationError: A run to compare with failed.

    Examples:
        >>> shoal.export("single-pendulum", "exudyn", verify=False).name
        'single-pendulum.py'
    """
    from shoal.exported import checked, export

    path = None if asked.file is None else Path(asked.file)
    found = export(machine(asked), checked(asked.to, path), verify=asked.verify)
    if path is not None:
        found.save(path)
    return found


@function(ReactionsRequest)
def reactions(asked: ReactionsRequest) -> list[Reactions]:
    """Find the forces in the joints of a scene.

    Returns:
        One entry for each instant, with forces [N] and torques [N m] by joint as they act on the second body.

    Raises:
        InputError: A field is wrong; the message names it.
        ComputationError: The motion failed before the last of the instants.

    Examples:
        >>> len(shoal.reactions("single-pendulum", [0.1, 0.2]))
        2
    """
    from shoal.mechanics.analysis.reactions import reactions
    from shoal.mechanics.analysis.reactions_verified import verified

    scene = machine(asked)
    if max(asked.at) > (end := scene.solver.duration):
        raise InputError(f"at: {max(asked.at):g} s is after the end of the motion, solver.duration = {end:g} s")
    return (verified if asked.verify else reactions)(scene, list(asked.at))


@function(Identify)
def identify(asked: Identify) -> Estimate:
    """Find the parameters of a problem.

    Returns:
        The parameters with their standard deviations, intervals and whether they are identifiable, the verdict on
        them, and the residuals.

    Raises:
        InputError: A field is wrong; the message names it.
        ComputationError: Nothing could be fitted.

    Examples:
        >>> shoal.identify("paper-case-1", method="least-squares").verdict.trusted
        True
    """
    from shoal.identification import Estimate, identify
    from shoal.identification.carried import carried
    from shoal.identification.conclude import Options
    from shoal.identification.problem import as_problem

    shown(Estimate)
    same = ("method", "engine", "hold_out", "seed", "tolerance", "time_limit")
    with _files(asked.data) as files:
        return identify(
            as_problem(cast(Any, asked.problem)),
            data=files,
            values=asked.set,
            fitted=None if asked.values is None else carried(asked.values),
            checkpoint=None if asked.checkpoint is None else Path(asked.checkpoint),
            options=Options(asked.profiles, asked.bootstrap, asked.sample),
            progress=asked.progress or (lambda *_: None),
            **{name: getattr(asked, name) for name in same},
        )


@function(DesignRequest)
def design(asked: DesignRequest) -> Design:
    """Design an experiment.

    Returns:
        Measurements ranked by how much better they let the parameter be known.

    Raises:
        InputError: A field is wrong; the message names it.
        ComputationError: No answer can be trusted.

    Examples:
        >>> shoal.design("paper-case-1", about="start", noise=1e-3).ok
        True
    """
    return designed(asked)


def designed(asked: DesignRequest, note: Callable[[str], None] = lambda _: None) -> Design:
    """Return the design of an experiment; `note` is called for values that are doubted or left out.

    Raises InputError, ComputationError.
    """
    from shoal.identification.carried import carried
    from shoal.identification.design import about_answer, about_start, has_data
    from shoal.identification.problem import as_problem

    problem, stated = as_problem(cast(Any, asked.problem)), asked.set
    if asked.values is not None:
        problem, stated, notes = carried(asked.values).into(problem, stated)
        for one in notes:
            note(one)
    same = ("noise", "angle_noise", "sensor_noise", "duration", "rate", "parameter")
    answered = asked.about == "answer" or (asked.about is None and (asked.data is not None or has_data(problem)))
    with _files(asked.data) as files:
        how = {name: getattr(asked, name) for name in same}
        return (about_answer if answered else about_start)(problem, files, stated, **how)


def plot(result: Scene | Trajectory | Equilibrium | Estimate | Sweep | Comparison) -> Picture:
    """Draw a result.

    Args:
        result: A scene (its motion), a trajectory, an equilibrium, an estimate, a sweep or a comparison.

    Returns:
        The picture, which a notebook shows; `save` writes it.

    Raises:
        InputError: There is no picture of such an object.

    Examples:
        >>> shoal.plot(shoal.simulate("single-pendulum")).save("motion.png")
    """
    from shoal.pictures.inline import plot

    return plot(result)


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
        raise InputError(f"data: needs a file or a table (a DataFrame), by name for several, found {brief(data)}")
    data.to_csv(table, index=False)
    return str(table)


def _html(result: Any) -> str:
    """Return the HTML that a notebook shows."""
    from shoal.pictures.inline import html

    return html(result)


def shown(kind: type) -> None:
    """Let notebooks show results of a class, which itself knows nothing of pictures."""
    setattr(kind, "_repr_html_", _html)  # noqa: B010


for _kind in (Scene, Trajectory):
    shown(_kind)
