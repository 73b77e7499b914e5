"""The model's own error at an answer: what a finer mesh, shorter steps and a fuller theory would change of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from shoal.engines.gauss import GaussEngine
from shoal.engines.theory import WITH_SHEAR
from shoal.engines.ways import CLOSE
from shoal.errors import InputError
from shoal.identification.conventions import NOTICED
from shoal.identification.forward import ForwardModel
from shoal.mechanics.integrators import facts
from shoal.mechanics.simulate import stable_step
from shoal.scene import Rod, Scene
from shoal.scene.refined import refined
from shoal.scene.shear import slender_share, with_shear
from shoal.trajectory import Array

_STABLE = 0.9
"""Of the stable step at the start: it varies by a few percent along the motion."""


@dataclass(frozen=True)
class Corrections:
    """Corrections of a point by either error, (parameters,), None where there is none."""

    mesh: Array | None
    theory: Array | None

    def of(self, function: Callable[[Array], float], point: Array) -> tuple[float | None, float | None]:
        """Corrections of a function of the parameters."""
        mesh, theory = (
            None if shift is None else function(point + shift) - function(point) for shift in (self.mesh, self.theory)
        )
        return mesh, theory


@dataclass(frozen=True)
class ModelError:
    """Motion of a better model minus that of the one that was fitted, (rows,), with zeros for priors.

    mesh: by twice as many elements and shorter steps, of rigid machines by steps that follow them closely; theory: by
    shear and rotary inertia, beyond what the mesh does. None for scenes without any of it, and where the better model
    cannot be run.
    """

    mesh: Array | None
    theory: Array | None

    def corrections(self, pseudo_inverse: Array) -> Corrections:
        """To first order, by the pseudo-inverse (parameters, rows) of the Jacobian."""
        mesh, theory = (None if part is None else -pseudo_inverse @ part for part in (self.mesh, self.theory))
        return Corrections(mesh, theory)

    def refined(self, residual: Array, jacobian: Array, pseudo_inverse: Array) -> Array | None:
        """Residuals (rows,) that the better model would leave when it is fitted, to first order."""
        parts = [part for part in (self.mesh, self.theory) if part is not None]
        if not parts:
            return None
        changed = np.sum(parts, axis=0)
        return np.asarray(residual + changed - jacobian @ (pseudo_inverse @ changed))


def model_error(model: ForwardModel, point: Array, predicted: Mapping[str, Array], residual: Array) -> ModelError:
    """At a point whose channels by recording, and residuals (rows,), are known."""
    flexible = model.scene.flexible_rods
    if not flexible:
        closer = _closer(model)
        return ModelError(None if closer is None else difference(_natively(model), point, predicted, closer), None)
    finer = _finer(model.scene)
    mesh = None if finer is None else difference(model, point, predicted, finer)
    slender = {name: rod for name, rod in flexible.items() if not rod.shears}
    if not slender or model.engine.name in WITH_SHEAR:
        return ModelError(mesh, None)
    theory = _softened(model, point, predicted, slender)
    uncertain = rms_of(residual) / np.sqrt(len(residual))
    matters = theory is None or rms_of(theory) > NOTICED * max(uncertain, 0.0 if mesh is None else rms_of(mesh))
    if finer is not None and mesh is not None and matters:
        sheared = _sheared(model, point, predicted)
        theory = theory if sheared is None else sheared - mesh
    return ModelError(mesh, theory)


def _softened(
    model: ForwardModel, point: Array, predicted: Mapping[str, Array], slender: Mapping[str, Rod]
) -> Array | None:
    """By order of magnitude: in bending a rod with shear moves like one of a lower Young's modulus."""
    softer = {
        f"bodies.{name}.{field}": 1.0 / (1.0 + slender_share(rod))
        for name, rod in slender.items()
        for field in rod.bending_fields
    }
    return difference(model, point, predicted, model.scene, softer)


def _sheared(model: ForwardModel, point: Array, predicted: Mapping[str, Array]) -> Array | None:
    """By twice as many rods with shear and rotary inertia; None where they cannot be had."""
    stout = with_shear(model.scene)
    finer = None if stout is None else _finer(stout)
    return None if finer is None else difference(_natively(model), point, predicted, finer)


def _natively(model: ForwardModel) -> ForwardModel:
    return model if model.engine.name == GaussEngine().name else replace(model, engine=GaussEngine())


def _closer(model: ForwardModel) -> Scene | None:
    """The scene of a rigid machine, followed closely in time; None where it already is."""
    solver = model.scene.solver
    chooses = solver.integrator == "auto" or facts(solver.integrator).adaptive
    close = _close(model.scene)
    if chooses and not close and model.engine.name == GaussEngine().name:
        return None
    return model.scene.with_values({**close, "solver.integrator": solver.integrator if chooses else "auto"})


def _close(scene: Scene) -> dict[str, float]:
    """Tolerances of adaptive integrators that are too loose for a second run, by their paths."""
    return {path: most for path, most in CLOSE.items() if scene.value(path) > most}


def _finer(scene: Scene) -> Scene | None:
    """Twice as many elements, and half the step: that takes away three quarters of a time error of second order.

    Inertia is not capped there, so that what capping costs counts in full.
    """
    try:
        finer = scene.with_values({**refined(scene, 2), **_close(scene), "solver.inertia_cap": False})
        integrator = scene.solver.integrator
        limit = np.inf if integrator == "auto" else stable_step(finer, integrator)
        return finer.with_values({"solver.step": min(scene.solver.step / 2, _STABLE * limit)})
    except InputError:
        return None


def difference(
    model: ForwardModel,
    point: Array,
    predicted: Mapping[str, Array],
    scene: Scene,
    factors: Mapping[str, float] | None = None,
) -> Array | None:
    """Change of the residuals by another scene, or fields times factors, (rows,); None where it cannot be run."""
    columns = []
    for name, recording in model.measurement.recordings.items():
        try:
            error = model.observe(point[None], name, scene=scene, factors=factors)[0] - predicted[name]
        except InputError:
            return None
        columns.append(error[np.isfinite(recording.values)])
    rows = np.concatenate(columns) * model.rows.weight
    return np.append(rows, np.zeros(len(model.parameters.priors))) if np.all(np.isfinite(rows)) else None


def rms_of(rows: Array) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(rows**2)))
