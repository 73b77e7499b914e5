"""What `import shoal` offers: the main commands as functions, with answers that a notebook shows.

A scene or problem is given as an object, as the name of a built-in one, or as the path of a YAML file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from shoal.engines import COMPARED
from shoal.errors import InputError
from shoal.scene import Scene, load_scene
from shoal.trajectory import Trajectory

if TYPE_CHECKING:
    import pandas as pd

    from shoal.engines.compare import Comparison
    from shoal.engines.prepared import Prepared
    from shoal.engines.sweep import Sweep
    from shoal.identification import Estimate, Problem
    from shoal.pictures.inline import Picture
    from shoal.selection import Selection

Values = Mapping[str, Any]
Times = Sequence[float] | npt.NDArray[np.float64]


def simulate(
    scene: Scene | str,
    times: Times | None = None,
    *,
    values: Values | None = None,
    engine: str = "gauss",
    tolerance: float | None = None,
    verify: bool = True,
) -> Trajectory:
    """Simulate a scene; its `status` says whether the motion can be trusted.

    times: sampling instants [s], else the scene's own; values: fields of the scene to set, by dotted path;
    engine: gauss, exudyn, exudyn-ge, casadi or the address of a service; tolerance: error [m] that the markers may
    have, for which the cheapest model is found (see `select`); verify: estimate the error by a second run.
    Raises InputError.
    """
    from shoal.engines import get_engine
    from shoal.engines.verification import verified

    wanted = _scene(scene, values)
    if tolerance is not None:
        if engine != "gauss":
            raise InputError(f"tolerance: models are chosen for engine gauss only, found engine {engine!r}")
        return select(wanted, tolerance, times).trajectory
    chosen = get_engine(engine)
    return verified(chosen, wanted, times) if verify else chosen.simulate(wanted, times)


def prepare(scene: Scene | str, *, values: Values | None = None) -> Prepared:
    """A scene for a loop of your own: call what comes back with values and times, as often as you like.

    It gives what `simulate` gives without its second runs (`verify=False`), to the last bit, in a fraction of the time
    around the steps. values: fields of the scene to set, by dotted path. Raises InputError.
    """
    from shoal.engines.prepared import Prepared

    return Prepared(_scene(scene, values))


def select(
    scene: Scene | str, tolerance: float, times: Times | None = None, *, values: Values | None = None
) -> Selection:
    """The cheapest model whose estimated error at the markers is below a tolerance [m]. Raises InputError."""
    from shoal.selection import select

    return select(_scene(scene, values), tolerance, times)


def sweep(
    scene: Scene | str,
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

    grid = {path: np.asarray(lanes, dtype=float) for path, lanes in vary.items()}
    found = sweep(_scene(scene, values), grid, get_engine(engine), time)
    return spot_checked(found, get_engine(engine)) if verify else found


def compare(
    scene: Scene | str, engines: Sequence[str] = COMPARED, times: Times | None = None, *, values: Values | None = None
) -> Comparison:
    """Run a scene on several engines; `differences()` tells how far apart they come out. Raises InputError."""
    from shoal.engines.compare import compare

    return compare(_scene(scene, values), list(engines), times)


def identify(
    problem: Problem | str, data: str | Path | pd.DataFrame | Mapping[str, str] | None = None, **options: Any
) -> Estimate:
    """Find the parameters of a problem from measured motion.

    data: a file, or a table whose columns are those that the problem's channels name, instead of the problem's own
    recording; for several recordings a mapping from their names to files. options: those of
    `shoal.identification.identify` (method, values, seed, tolerance, engine, time_limit, measurement, wishes, ...).
    Raises InputError, ComputationError.
    """
    from shoal.identification import Estimate, identify, load_problem

    setattr(Estimate, _HTML, _html)
    wanted = load_problem(problem) if isinstance(problem, str) else problem
    if data is None or isinstance(data, Mapping):
        return identify(wanted, data=data, **options)
    if isinstance(data, str | Path):
        return identify(wanted, data=str(data), **options)
    with TemporaryDirectory(prefix="shoal-") as folder:
        table = Path(folder) / "table.csv"
        data.to_csv(table, index=False)
        return identify(wanted, data=str(table), **options)


def plot(result: Scene | Trajectory | Estimate | Sweep | Comparison) -> Picture:
    """The picture of a scene (its motion), a trajectory, an estimate, a sweep or a comparison. Raises InputError."""
    from shoal.pictures.inline import plot

    return plot(result)


def _scene(given: Scene | str, values: Values | None) -> Scene:
    scene = load_scene(given) if isinstance(given, str) else given
    return scene.with_values(values) if values else scene


def _html(result: Any) -> str:
    """What a notebook shows."""
    from shoal.pictures.inline import html

    return html(result)


_HTML = "_repr_html_"
# The classes themselves know nothing of pictures and notebooks.
for _kind in (Scene, Trajectory):
    setattr(_kind, _HTML, _html)
