"""Both angles of the double pendulum by scipy around others' solvers, as a careful user writes it.

The system is built once and put back to its start for every run; nothing of Python is called within a run; derivatives
are the solver's own (CasADi) or kept from long steps to short ones (Exudyn); no tolerance is tighter than it has to be
for angles to ACCURACY. To build is not counted, the standard deviations are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import optimize
from shoal.engines.casadi.shooting import shot
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import build, library
from shoal.engines.exudyn.record import choose_steps
from shoal.scene import Rod, Scene
from shoal.trajectory import Array

ACCURACY = 1e-8
"""Of the angles, as far as the data tell them [rad]."""
LONG, SHORT = 500, 16_000
"""Steps of Exudyn's trapezoidal rule over the record: to come near, and for ACCURACY."""
_DIFFERENCE = 1e-5
"""Of an angle [rad]: far above what a modified Newton iteration leaves open."""


@dataclass(frozen=True)
class Found:
    """Angles [rad] with their standard deviations, (angles,), mean squared distance [m^2], runs of the motion."""

    angles: Array
    deviations: Array
    fitness: float
    runs: int


Identify = Callable[[Array], Found]
"""From a start [rad], (angles,)."""


class Kept:
    """An Exudyn system of flexible rods in a row from the origin, started from other angles without being rebuilt."""

    def __init__(self, scene: Scene, times: Array, steps: int) -> None:
        """times: evenly spaced [s], the last of which is the end."""
        end = float(times[-1])
        exu = self._library = library()
        self._machine = build(exu, scene, "ancf-cable", end)
        self._rods = [body for body in scene.bodies.values() if isinstance(body, Rod)]
        last: Any = list(self._machine.parts.values())[-1]
        position = exu.OutputVariableType.Position
        from exudyn.itemInterface import SensorBody

        tip = SensorBody(
            bodyNumber=last.elements[-1],
            localPosition=[last.size, 0, 0],
            storeInternal=True,
            outputVariableType=position,
        )
        self._tip = self._machine.mbs.AddSensor(tip)
        self._machine.mbs.Assemble()
        settings = self._settings = ExudynEngine(modified_newton=True).simulation_settings(
            exu, self._machine, choose_steps(times, end / steps, self._machine.unknowns)
        )
        settings.solution.sensors.active = True
        settings.solution.sensors.writePeriod = end / len(times)
        self.runs = 0

    def __call__(self, angles: Array) -> Array:
        """Positions of the tip at the times [m], (times, 2)."""
        self.runs += 1
        mbs, exu = self._machine.mbs, self._library
        start = self._coordinates(angles) - self._machine.reference
        mbs.systemData.SetODE2Coordinates(start, configuration=exu.ConfigurationType.Initial)
        spoke, exu.config.printToConsole = exu.config.printToConsole, False
        try:
            mbs.SolveDynamic(self._settings, showHints=False, showCausingItems=False)
        finally:
            exu.config.printToConsole = spoke
        return np.asarray(mbs.GetSensorStoredData(self._tip)[1:, 1:3])

    def _coordinates(self, angles: Array) -> Array:
        """Place and slope of every node of straight rods."""
        nodes, base = [], np.zeros(2)
        for rod, angle in zip(self._rods, angles, strict=True):
            along = np.array([np.cos(angle), np.sin(angle)])
            nodes += [[*(base + s * along), *along] for s in np.linspace(0.0, rod.length, rod.elements + 1)]
            base = base + rod.length * along
        return np.concatenate(nodes)


def around_exudyn(scene: Scene, times: Array, measured: Array) -> Identify:
    """Trust-region least squares with forward differences on long steps, then on short ones with that Jacobian."""
    long, short = Kept(scene, times, LONG), Kept(scene, times, SHORT)

    def residual(angles: Array, run: Kept) -> Array:
        return np.asarray((run(angles) - measured).ravel())

    def identify(start: Array) -> Found:
        before = long.runs + short.runs
        near = optimize.least_squares(
            residual, start, args=(long,), diff_step=[_DIFFERENCE] * len(start), xtol=1e-5, ftol=1e-5
        )
        slopes = np.asarray(near.jac)

        def kept(angles: Array, run: Kept) -> Array:
            return slopes

        found = optimize.least_squares(
            residual, near.x, args=(short,), jac=kept, xtol=ACCURACY / 10, ftol=None, gtol=None, max_nfev=8
        )
        return _found(found.x, found.fun, slopes, long.runs + short.runs - before)

    return identify


def around_casadi(scene: Scene, paths: list[str], marker: str, times: Array, measured: Array, step: float) -> Identify:
    """Gauss-Newton (trust-region) with the exact derivatives of Runge-Kutta steps, of one function of both."""
    path, count = shot(scene, paths, times, marker, step, len(paths)), len(paths)

    def identify(start: Array) -> Found:
        seen: dict[bytes, Array] = {}

        def run(angles: Array) -> Array:
            key = angles.tobytes()
            if key not in seen:
                seen[key] = path(angles).full()
            return seen[key]

        def jacobian(angles: Array) -> Array:
            table = run(angles)
            return np.stack([table[2 + 2 * k : 4 + 2 * k].T.ravel() for k in range(count)], axis=1)

        def residual(angles: Array) -> Array:
            return np.asarray((run(angles)[:2].T - measured).ravel())

        found = optimize.least_squares(residual, start, jac=jacobian, xtol=ACCURACY / 10, ftol=1e-15, gtol=None)
        return _found(found.x, found.fun, np.asarray(found.jac), (1 + count) * len(seen))

    return identify


def _found(angles: Array, residual: Array, jacobian: Array, runs: int) -> Found:
    """With standard deviations by linear theory, for independent residuals."""
    variance = float(residual @ residual) / (residual.size - angles.size)
    deviations = np.sqrt(variance * np.diag(np.linalg.inv(jacobian.T @ jacobian)))
    return Found(angles, deviations, 2 * float(residual @ residual) / residual.size, runs)
