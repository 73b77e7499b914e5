"""The main path: a scene, its machine, its runs, a checked trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from shoal.compile import clock, deferred
from shoal.errors import InputError
from shoal.mechanics.assembly.build import build
from shoal.mechanics.dynamics import Work
from shoal.mechanics.inertia_cap import capped
from shoal.mechanics.integrators import facts, pick
from shoal.mechanics.integrators.scheme import Facts
from shoal.mechanics.kernels import Seek
from shoal.mechanics.machine import Machine, step_limit
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.runs import Runs
from shoal.mechanics.start import start
from shoal.scene import Scene, Solver
from shoal.trajectory import Trajectory

deferred.install()

STEP_MARGIN = 0.95
"""Of the stable step, which is that of the start and varies by a few percent along the motion."""


def simulate(
    scene: Scene,
    times: Array,
    values: Mapping[str, Array] | None = None,
    *,
    threads: int | None = None,
    seek: Callable[[Arrays, Work], Seek] | None = None,
    machine: Machine | None = None,
    whole: bool = False,
) -> Trajectory:
    """Simulate a scene, or one scene per lane, sampled at `times` [s].

    values: path in the scene -> one number per lane. Lanes are computed in tiles, tiles on threads. seek: finds the
    accelerations of a single lane in place of the native solution of Gauss's principle. machine: that of the scene, if
    it is known. whole: whether the trajectory holds its states.
    Raises InputError if the scene cannot be modelled or its step is beyond the stability limit.
    """
    begin, end = clock.now(), float(times[-1])
    if not values:
        own = runs(machine or Machine.of(scene), scene.solver, end)
        return _run(own, times, threads=threads, seek=seek, begin=begin, whole=whole)
    lanes = len(next(iter(values.values())))
    found = scene.initial_from is not None
    starting = all(path.startswith("initial.") for path in values) and not found
    if starting and not start.gives_numbers(scene):
        own = runs(machine or Machine.of(scene), scene.solver, end)
        return _run(own, times, own.starts.at(values, lanes), threads=threads, begin=begin, whole=whole)
    model = build(scene.with_lanes(values), lanes, max(end, scene.solver.duration))
    same = _runs_if_any(machine or Machine.of(scene), scene.solver, end) if starting else None
    if same is not None and model.differs_in_start_only(same.model):  # joints take nothing else from the start
        return _run(same, times, model, threads=threads, begin=begin, whole=whole)
    each = ({path: float(numbers[lane]) for path, numbers in values.items()} for lane in range(lanes))
    model = _begun(model, [scene.with_values(one) for one in each] if found else [])
    model = _as_moved(model, scene.solver)
    choice = pick(scene.solver, model, step_limit if end > 0 else _unlimited)
    own = Runs(scene, model, choice, alone=False)
    return _run(own, times, threads=threads, begin=begin, whole=whole)


def _run(own: Runs, times: Array, model: Model | None = None, *, whole: bool, **options: Any) -> Trajectory:
    """Return a motion; of machines with ropes with what is found out about these at more times."""
    if not own.model.spans or not float(times[-1]) > 0.0:
        return own.run(times, model, whole=whole, **options)
    from shoal.mechanics.rope_checks import run_watched

    return run_watched(lambda every: own.run(every, model, whole=True, **options), times, own.scene, whole)


def runs(machine: Machine, solver: Solver, end: float) -> Runs:
    """Return the runs of a machine by the settings of a solver up to `end` [s]. Raises InputError.

    The stability limit is that of the machine's own start; where nothing moves, no step is limited.
    """
    horizon, moving = max(end, solver.duration), end > 0

    def make() -> Runs:
        model = _as_moved(at_start(machine, horizon), solver)
        limit = (lambda _, facts: _step_limit(machine, solver, horizon, facts)) if moving else _unlimited
        return Runs(machine.scene.model_copy(update={"solver": solver}), model, pick(solver, model, limit))

    return machine.kept(("runs", solver, horizon, moving), make)


def _runs_if_any(machine: Machine, solver: Solver, end: float) -> Runs | None:
    """Return the same; None where the machine has no start of its own."""

    def make() -> tuple[Runs | None]:
        try:
            return (runs(machine, solver, end),)
        except InputError:
            return (None,)

    return machine.kept(("runs if any", solver, max(end, solver.duration), end > 0), make)[0]


def stable_step(scene: Scene, integrator: str) -> float:
    """Largest stable step [s] of an integrator at the start of a scene; infinite if nothing limits it.

    Raises InputError if the scene cannot be modelled.
    """
    return _step_limit(Machine.of(scene), scene.solver, scene.solver.duration, facts(integrator))


def at_start(machine: Machine, horizon: float) -> Model:
    """Return the model of a machine as its runs begin, with functions of time up to `horizon` [s].

    Raises InputError also where friction depends on a force that is not unique, or the start on an equilibrium that is
    not there.
    """
    return machine.kept(("at start", horizon), lambda: _begun(machine.model(horizon), [machine.scene]))


def _step_limit(machine: Machine, solver: Solver, horizon: float, integrator: Facts) -> float:
    """Return the stable step of a machine, which depends on the solver only where that raises inertia."""
    key = "step limit", horizon, integrator, solver.step if solver.caps_inertia else None
    return machine.kept(key, lambda: step_limit(_as_moved(at_start(machine, horizon), solver), integrator))


def _begun(model: Model, scenes: list[Scene]) -> Model:
    """The model at the start of its scenes, one a lane, if they begin where forces balance or a run has ended.

    The two analyses take half a second to import.
    """
    if model.rubbing.size or np.any(model.gaps.share):
        from shoal.mechanics.analysis.joint_reactions import require_unique_friction

        require_unique_friction(model)
    if not scenes or scenes[0].initial_from is None:
        return model
    from shoal.mechanics.analysis.at_rest import begun

    return begun(model, scenes)


def _as_moved(model: Model, solver: Solver) -> Model:
    """The model as a solver moves it: with more inertia where it says so, else as it is."""
    return capped(model, solver.step) if solver.caps_inertia else model


def _unlimited(model: Model, integrator: Facts) -> float:
    return np.inf
