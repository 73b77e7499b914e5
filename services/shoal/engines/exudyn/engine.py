"""Exudyn behind the engine contract."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from shoal.engines.capabilities import of_kind, require
from shoal.engines.contract import Capabilities, sampling_times
from shoal.engines.exudyn.bodies import System
from shoal.engines.exudyn.build import PARTS, Beam, ExudynSystem, build, library, silence
from shoal.engines.exudyn.checks import judge
from shoal.engines.exudyn.joints import JOINTS
from shoal.engines.exudyn.loads import LOADS
from shoal.engines.exudyn.record import KeptStates, Steps, choose_steps
from shoal.engines.exudyn.space.build import build_in_space
from shoal.engines.exudyn.space.joints import SPATIAL_JOINTS
from shoal.engines.interrupts import interruptible
from shoal.engines.one_by_one import OneByOne
from shoal.engines.sections import Sections
from shoal.mechanics.halts import CROSSED
from shoal.mechanics.start.start import facts
from shoal.scene import Scene, Spring, TorsionSpring
from shoal.trajectory import Array, Trajectory

WEAK = "generalized-alpha is only weakly stable at solver.spectral_radius 1, use 0.9"
DENSE_LIMIT = 60
"""Unknowns beyond which the sparse linear solver is the faster one."""
REDUNDANT = 0.9
"""Spectral radius for machines in space whose constraints depend on each other, unless the scene says its own."""
FORCE_FLOOR = 32.0 * float(np.finfo(float).eps)
"""Of the forces of a machine, over their size; cables and beams of 4 to 16 elements end a step at 1 to 10 eps."""
SHORTEST = 1e-6
"""Shortest step over the stated one, where friction changes its sign."""
MOST = 1e5
"""Most steps that a run takes because of narrow parts of a force law."""
NAMES: dict[Beam, str] = {"ancf-cable": "exudyn", "geometrically-exact": "exudyn-ge"}
INTEGRATORS = {"trapezoidal": "TrapezoidalIndex2", "generalized-alpha": "GeneralizedAlpha"}
"""What Exudyn calls them."""
FEATURES = frozenset(
    {
        "point masses",
        "free bodies",
        "closed loops",
        "moving ground points",
        "functions of time",
        "dry friction",
        "quadratic drag",
        "nonlinear springs",
        "tapered flexible rods",
        "machines in space",
        "stops",
        "one-sided distances",
        "contacts",
        "corners of polygons",
        "play",
    }
)
OWN_FEATURES: dict[Beam, frozenset[str]] = {
    "ancf-cable": frozenset({"curved flexible rods", "damped flexible rods"}),
    "geometrically-exact": frozenset({"curved rods in space"}),
}
SPATIAL_ELEMENTS: dict[Beam, frozenset[str]] = {
    "ancf-cable": frozenset(),
    "geometrically-exact": frozenset({"director-rod"}),
}
"""Beside those of the plane."""


@dataclass(frozen=True, kw_only=True)
class ExudynEngine(OneByOne):
    """Simulates a scene with Exudyn's implicit integrators at a fixed step, file output off.

    beam: what stands for a rod whose element is `ancf-cable`: Exudyn's own ANCF cable with the
        scene's quadrature, or its three-node geometrically exact beam (with shear and rotary inertia)
    integrator: `trapezoidal` (no numerical damping, constraints on the velocities, positions drift with the
        square of the step), or `generalized-alpha` with the scene's spectral radius and constraints on the
        positions, which needs a radius below 1 on long runs: at 1 it is only weakly stable. By default
        generalized-alpha where the scene's `solver.integrator` is that, else trapezoidal: the others are the native
        solver's
    modified_newton: keep the Jacobian while the iteration contracts: three times faster; positions of the
        flexible double pendulum then differ by 1e-9 m

    The step is the scene's where all requested times are its multiples, or else the longest step
    below it that divides their common interval; failing that it divides the last time, and the
    coordinates between two steps are interpolated by cubic Hermite polynomials.
    """

    beam: Beam = "ancf-cable"
    integrator: Literal["generalized-alpha", "trapezoidal"] | None = None
    modified_newton: bool = False

    @property
    def name(self) -> str:
        """Name of the variant: `exudyn`, or `exudyn-ge` with geometrically exact beams."""
        return NAMES[self.beam]

    @property
    def capabilities(self) -> Capabilities:
        """Return what this engine can simulate."""
        return Capabilities(
            elements=frozenset(PARTS[self.beam]) | SPATIAL_ELEMENTS[self.beam],
            joints=frozenset(JOINTS) | SPATIAL_JOINTS,
            loads=frozenset(LOADS),
            features=FEATURES | OWN_FEATURES[self.beam],
            lanes=False,
        )

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        """Run one scene; a run that failed or is not believed carries its status. Raises InputError."""
        started = time.perf_counter()
        wanted = sampling_times(scene, times)
        require(self, scene)
        damped = self._integrator(scene) == "generalized-alpha"
        exu = library()
        end = float(wanted[-1])
        machine = self.machine(exu, scene, end)
        steps = choose_steps(wanted, scene.solver.step, machine.unknowns, machine.clock.halts)
        record = KeptStates(steps, machine.reference, bool(machine.penalties))
        failure = self._run(exu, machine, record)
        if (much := _too_far(machine, record)) > 1.0:
            # As the native solver does, but with all steps.
            shorter = scene.solver.step / 2 ** np.ceil(np.log2(much))
            if wanted[-1] <= MOST * shorter:
                return self.simulate(scene.with_values({"solver.step": float(shorter)}), wanted)
            failure = f"exudyn: a step leaps over a narrow part of an elastic law; solver.step needs {shorter:.3g} s"
        verdict = judge(machine, record, failure)
        weak = damped and scene.solver.spectral_radius == 1.0
        findings = [replace(one, steps=(*one.steps, WEAK)) if weak else one for one in verdict.findings]
        return Trajectory(
            engine=self.name,
            times=wanted,
            markers=tuple(scene.markers),
            points=verdict.points[..., None],
            angles=verdict.angles[..., None],
            velocities=None if verdict.velocities is None else verdict.velocities[..., None],
            rates=None if verdict.rates is None else verdict.rates[..., None],
            energy_drift=np.array([verdict.energy_drift]),
            constraint_drift=np.array([verdict.gap / machine.span]),
            steps=steps.count,
            wall_s=time.perf_counter() - started,
            lane_findings=[findings],
            model=self._model(exu, machine, steps) | facts(scene, machine.scene.initial, machine.span),
        )

    def machine(
        self, exu: Any, scene: Scene, end: float | None = None, system_of: type[System] = System
    ) -> ExudynSystem:
        """The scene as a system of Exudyn's, for runs up to `end` [s]; system_of: see `build`. Raises InputError."""
        if scene.dimensions == 3:
            return build_in_space(exu, scene, self.beam, end, system_of)
        return build(exu, scene, self.beam, end, system_of)

    def _run(self, exu: Any, machine: ExudynSystem, record: KeptStates) -> str:
        """Integrate, filling the record. Returns why it ended early, or nothing."""
        if record.steps.count == 0:
            record.take(machine.mbs, 0.0)
            return ""
        machine.mbs.SetPostStepUserFunction(record.take)
        try:
            with interruptible(), silence(exu):
                done, begin, runs = True, 0.0, record.steps.runs
                for number, (count, end) in enumerate(runs):
                    record.resumed = number > 0
                    machine.clock.until = np.nextafter(end, 0.0) if len(runs) > 1 else np.inf
                    settings = self.simulation_settings(exu, machine, record.steps)
                    integration = settings.timeIntegration
                    integration.startTime, integration.endTime, integration.numberOfSteps = begin, end, count
                    done = done and machine.mbs.SolveDynamic(
                        settings, updateInitialValues=len(runs) > 1, showHints=False, showCausingItems=False
                    )
                    begin = end
        except Exception as error:
            # Whatever the library raises is a failed run.
            reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        else:
            reason = "" if done else "the solver gave up"
        if not reason:
            return ""
        reached = record.times[max(record.filled - 1, 0)]
        return f"exudyn: {reason} at {reached:.6g} s of {record.steps.wanted[-1]:.6g} s; reduce solver.step"

    def simulation_settings(self, exu: Any, machine: ExudynSystem, steps: Steps) -> Any:
        """Return Exudyn's settings: fixed steps, no files."""
        settings = exu.SimulationSettings()
        settings.solution.file.write = False
        settings.solution.sensors.active = False
        sparse = machine.unknowns + machine.constraints > DENSE_LIMIT
        kinds = exu.LinearSolverType
        settings.linearSolver.solverType = kinds.EigenSparse if sparse else kinds.EXUdense
        if machine.dependent:
            # It alone steps over dependent rows; the checks of joints and energy judge what comes out.
            settings.linearSolver.solverType = kinds.EigenDense
            settings.linearSolver.ignoreSingularJacobian = True
        integration = settings.timeIntegration
        integration.numberOfSteps = steps.count
        integration.endTime = steps.count * steps.size
        integration.adaptiveStep = bool(machine.penalties)
        if machine.penalties:
            # Newton's iteration fails where friction changes its sign within a step: there, and there only, steps are
            # shortened. That Exudyn shortens them where contacts close as well makes results worse.
            integration.adaptiveStepRecoverySteps = 0
            integration.adaptiveStepDecrease = 0.25
            integration.minimumStepSize = SHORTEST * steps.size
            integration.discontinuous.useRecommendedStepSize = False
        integration.automaticStepSize = False
        integration.verboseMode = 0
        integration.newton.useModifiedNewton = self.modified_newton
        integration.newton.absoluteTolerance = _force_tolerance(machine)
        name, radius = self._method(machine)
        integration.solverType = getattr(exu.DynamicSolverType, INTEGRATORS[name])
        integration.generalizedAlpha.spectralRadius = radius
        return settings

    def _integrator(self, scene: Scene) -> str:
        """The integrator of a run. Raises InputError for one that Exudyn has not."""
        stated = scene.solver.integrator
        name = self.integrator or (stated if stated == "generalized-alpha" else "trapezoidal")
        of_kind(INTEGRATORS, name, "integrator")
        return name

    def _method(self, machine: ExudynSystem) -> tuple[str, float]:
        """The integrator of a machine, and its spectral radius.

        Dependent constraints agree with each other on the positions only: on the velocities, drift parts them.
        """
        name, radius = self._integrator(machine.scene), machine.scene.solver.spectral_radius
        if machine.dependent and name == "trapezoidal" and self.integrator is None:
            return "generalized-alpha", REDUNDANT
        return name, radius if name == "generalized-alpha" else 1.0

    def _model(self, exu: Any, machine: ExudynSystem, steps: Steps) -> dict[str, Any]:
        integrator, radius = self._method(machine)
        rods = machine.scene.flexible_rods.values()
        stiff = {name: one.stiffness for name, one in machine.penalties.items()}
        contacts = {"contacts": stiff} if stiff else {}
        return {
            "exudyn": exu.__version__,
            "unknowns": machine.unknowns,
            "constraints": machine.constraints,
            "elements": sum(rod.elements for rod in rods),
            "beam": self.beam,
            "integrator": integrator,
            "spectral_radius": radius,
            "newton": "modified" if self.modified_newton else "full",
            "step": steps.size,
            "dependent_constraints": machine.dependent,
            "energy_check": f"none: {machine.unfollowed}" if machine.unfollowed else "kinetic, elastic, springs, loads",
        } | contacts


def _force_tolerance(machine: ExudynSystem) -> float:
    """Unbalanced generalised force at which Newton's iteration ends [N].

    A smaller one than the round-off of the forces that balance each other is never reached: of weights, and of
    stiffnesses times coordinates. Exudyn's relative tolerance counts from the first residual of a step, which is of
    that size itself where little happens.
    """
    scene = machine.scene
    extent = machine.span + float(np.max(np.abs(machine.reference), initial=0.0))
    forces = [float(body.mass) * float(np.linalg.norm(scene.gravity)) for body in scene.bodies.values()]
    for rod in scene.flexible_rods.values():
        sections, size = Sections.of(rod), float(rod.length) / rod.elements
        stiffness = sections.axial / size + 12.0 * sections.bending / size**3
        forces.append(float(np.max(stiffness)) * extent)
    forces += [load.stiffness * extent for load in scene.loads.values() if isinstance(load, Spring)]
    forces += [one.stiffness * extent for one in machine.penalties.values()]
    forces += [load.stiffness * np.pi for load in scene.loads.values() if isinstance(load, TorsionSpring)]
    return max(float(scene.solver.newton_tolerance), FORCE_FLOOR * max(forces, default=0.0))


def _too_far(machine: ExudynSystem, record: KeptStates) -> float:
    """Return by which factor the steps are too long for narrow parts of force laws."""
    kept = record.steps.kept
    one_step = (np.diff(kept) == 1) & np.isfinite(record.q[1:]).all(axis=1)
    return float(np.max(machine.crossed(record.q, record.v)[one_step], initial=0.0)) / CROSSED
