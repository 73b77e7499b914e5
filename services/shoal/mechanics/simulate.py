"""The main path: scene -> model -> march over tiles of lanes -> checked trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache

import numpy as np

from shoal.compile import clock, deferred, progress
from shoal.mechanics.assembly.build import build
from shoal.mechanics.dynamics import Work
from shoal.mechanics.inertia_cap import capped
from shoal.mechanics.integrators import facts, pick
from shoal.mechanics.integrators.scheme import Facts
from shoal.mechanics.kernels import Seek
from shoal.mechanics.machine import Machine
from shoal.mechanics.model import Arrays, Model
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.start import start
from shoal.scene import Scene, Solver
from shoal.trajectory import Trajectory

deferred.install()

STEP_MARGIN = 0.95
"""Of the stable step, which is that of the start and varies by a few percent along the motion."""


def machine(scene: Scene, end: float) -> Machine:
    """Return the cached machine of a scene for runs up to `end` [s]. Raises InputError if it cannot be modelled."""
    return _machine(scene.model_dump_json(), max(end, scene.solver.duration), end > 0)


def simulate(
    scene: Scene,
    times: Array,
    values: Mapping[str, Array] | None = None,
    *,
    threads: int | None = None,
    seek: Callable[[Arrays, Work], Seek] | None = None,
    machine: Callable[[Scene, float], Machine] = machine,
    whole: bool = False,
) -> Trajectory:
    """Simulate a scene, or one scene per lane, sampled at `times` [s].

    values: path in the scene -> one number per lane. Lanes are computed in tiles, tiles on threads. seek: finds the
    accelerations of a single lane in place of the native solution of Gauss's principle. machine: returns the cached
    machine of the scene. whole: whether the trajectory holds its states.
    Raises InputError if the scene cannot be modelled or its step is beyond the stability limit.
    """
    begin, end = clock.now(), float(times[-1])
    if not values:
        return machine(scene, end).run(times, threads=threads, seek=seek, begin=begin, whole=whole)
    lanes = len(next(iter(values.values())))
    found = scene.initial_from is not None
    if all(path.startswith("initial.") for path in values) and not start.gives_numbers(scene) and not found:
        kept = machine(scene, end)
        return kept.run(times, kept.starts.at(values, lanes), threads=threads, begin=begin, whole=whole)
    model = _built(scene.with_lanes(values), lanes, max(end, scene.solver.duration))
    if found:
        each = ({path: float(numbers[lane]) for path, numbers in values.items()} for lane in range(lanes))
        model = _begun(model, [scene.with_values(one) for one in each])
    choice = pick(scene.solver, model, step_limit if end > 0 else _unlimited)
    return Machine(scene, model, choice, alone=False).run(times, threads=threads, begin=begin, whole=whole)


def stable_step(scene: Scene, integrator: str) -> float:
    """Largest stable step [s] of an integrator at the start of a scene; infinite if nothing limits it.

    Raises InputError if the scene cannot be modelled.
    """
    return _limit(*_key(scene, scene.solver.duration), facts(integrator))


_PACE = (
    "step",
    "integrator",
    "samples",
    "relative_tolerance",
    "absolute_tolerance",
    "max_step",
    "max_steps",
    "spectral_radius",
    "newton_tolerance",
    "energy_tolerance",
)
"""Settings of the solver that leave the model as it is, unless it raises inertia to suit the step."""


def _key(scene: Scene, end: float) -> tuple[str, float]:
    """Return the key of a model: the scene, and the end of its functions of time [s]."""
    kept = ("step", "integrator") if scene.solver.caps_inertia else ()
    usual = {name: Solver.model_fields[name].default for name in _PACE if name not in kept}
    neutral = scene.model_copy(update={"solver": scene.solver.model_copy(update=usual)})
    return neutral.model_dump_json(), max(end, scene.solver.duration)


@lru_cache(maxsize=64)
def _model(scene_json: str, horizon: float) -> Model:
    """Repeated runs, runs by other integrators, and lanes that only start differently share the model."""
    scene = Scene.model_validate_json(scene_json)
    model = _built(scene, 1, horizon)
    return model if scene.initial_from is None else _begun(model, [scene])


def _built(scene: Scene, lanes: int, horizon: float) -> Model:
    """The model of a scene, whose friction must know the forces that it depends on."""
    progress.begin()
    model = capped(build(scene, lanes, horizon))
    if model.rubbing.size:
        from shoal.mechanics.analysis.joint_reactions import require_unique_friction

        require_unique_friction(model)
    return model


def _begun(model: Model, scenes: list[Scene]) -> Model:
    """`at_rest.begun`, which takes half a second to import."""
    from shoal.mechanics.analysis.at_rest import begun

    return begun(model, scenes)


@lru_cache(maxsize=512)
def _limit(scene_json: str, horizon: float, integrator: Facts) -> float:
    return step_limit(_model(scene_json, horizon), integrator)


@lru_cache(maxsize=32)
def _machine(scene_json: str, horizon: float, moving: bool) -> Machine:
    """The stability limit is that of the scene's own start; where nothing moves, no step is limited."""
    scene = Scene.model_validate_json(scene_json)
    key = _key(scene, horizon)
    model = _model(*key)
    return Machine(
        scene, model, pick(scene.solver, model, (lambda _, facts: _limit(*key, facts)) if moving else _unlimited)
    )


def step_limit(model: Model, integrator: Facts) -> float:
    """`stability.step_limit`, which takes a second to import, where anything can limit a step."""
    if not (model.elastic or model.forces.size):
        return np.inf
    from shoal.mechanics import stability

    return stability.step_limit(model, integrator)


def _unlimited(model: Model, integrator: Facts) -> float:
    return np.inf
