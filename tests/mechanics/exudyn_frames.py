"""Chains of rods in floating frames by Exudyn's ObjectFFRFreducedOrder: a judge from another engine.

Masses at Gauss points of the axis stand for the rod, two beside it in depth so that it has inertia about its axis, and
two beside it across where its sections are to turn with their slope. The weight is a force on the mean of all masses:
Exudyn's own gravity (1.11) leaves the modes of a swinging rod 3e-5 m away in 0.1 s, its force on the mean 1e-10.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
from floating_frame import Array, Bar, W, X
from scipy.sparse import csr_matrix, diags

DEPTH = 0.05
"""Of the masses beside the axis, over the rod's length: it does not matter to a motion in the plane."""


def _known(bar: Bar) -> tuple[Any, Array]:
    """What Exudyn knows of a rod, and the masses of its nodes, of which the first two are its ends."""
    from exudyn.FEM import ObjectFFRFreducedOrderInterface

    across, depth = np.sqrt(bar.rotary / bar.line), DEPTH * bar.length
    spots = [(0.0, 0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0)]
    spots += [
        (x, y, z, bar.line * bar.length * w / 4)
        for x, w in zip(X, W, strict=True)
        for y in (across, -across)
        for z in (depth, -depth)
    ]
    x, y, z, mass = np.array(spots).T
    axis, slope = bar.field(x, 0), bar.field(x, 1)
    shapes = np.stack([axis.real - y * slope.imag, axis.imag, np.zeros(axis.shape)], axis=-1)
    places = np.stack([x * bar.length, y, z], axis=-1)
    given = SimpleNamespace(
        modeBasis={"matrix": shapes.reshape(len(shapes), -1).T.copy()},
        postProcessingModes={},
        GetNodePositionsAsArray=lambda: places,
        GetSurfaceTriangles=lambda: [],
        GetSurfaceTriangles6=lambda: [],
        GetStiffnessMatrix=lambda sparse: csr_matrix((places.size, places.size)),
        GetMassMatrix=lambda sparse: diags(np.repeat(mass, 3)).tocsr(),
    )
    with np.errstate(invalid="ignore"):
        found = ObjectFFRFreducedOrderInterface(given)
    found.stiffnessMatrixReduced = bar.stiffness()
    return found, mass


def motion(bars: list[Bar], start: Array, rates: Array, times: Array, gravity: float, step: float) -> Array:
    """Ends of the bars, hung on the origin and on each other, (times, bars) complex; trapezoidal rule, second order."""
    import exudyn as exu
    from exudyn import itemInterface

    system = exu.SystemContainer()
    mbs = system.AddSystem()
    last = mbs.AddMarker(itemInterface.MarkerBodyPosition(bodyNumber=mbs.AddObject(itemInterface.ObjectGround())))
    place, speed, first, sensors = 0j, 0j, 0, []
    for bar in bars:
        (frame, mass), part = _known(bar), slice(first + 1, first + bar.size)
        rate, e = rates[first], np.exp(1j * start[first])
        turn = np.array([[e.real, -e.imag, 0.0], [e.imag, e.real, 0.0], [0.0, 0.0, 1.0]])
        placed = frame.AddObjectFFRFreducedOrder(
            mbs,
            positionRef=[place.real, place.imag, 0.0],
            initialVelocity=[speed.real, speed.imag, 0.0],
            rotationMatrixRef=turn,
            initialAngularVelocity=[0.0, 0.0, rate],
            stiffnessProportionalDamping=bar.retardation,
        )
        body, node = placed["oFFRFreducedOrder"], placed["nGenericODE2"]
        mbs.SetNodeParameter(node, "initialCoordinates", list(start[part]))
        mbs.SetNodeParameter(node, "initialCoordinates_t", list(rates[part]))

        def at(nodes: Array, weights: Array, body: Any = body) -> Any:
            return mbs.AddMarker(
                itemInterface.MarkerSuperElementPosition(
                    bodyNumber=body, meshNodeNumbers=nodes.tolist(), weightingFactors=weights.tolist()
                )
            )

        weight = [0.0, -gravity * bar.line * bar.length, 0.0]
        mbs.AddLoad(
            itemInterface.LoadForceVector(
                markerNumber=at(np.arange(2, len(mass)), mass[2:] / sum(mass)), loadVector=weight
            )
        )
        here, there = (at(np.array([k]), np.ones(1)) for k in (0, 1))
        mbs.AddObject(itemInterface.SphericalJoint(markerNumbers=[last, here]))
        kind = exu.OutputVariableType.Position
        sensors.append(
            mbs.AddSensor(
                itemInterface.SensorSuperElement(
                    bodyNumber=body, meshNodeNumber=1, outputVariableType=kind, storeInternal=True
                )
            )
        )
        end = bar.field(np.ones(1), 0)[:, 0]
        way, change = bar.length + start[part] @ end, rates[part] @ end
        place, speed = place + e * way, speed + e * (change + 1j * rate * way)
        last, first = there, first + bar.size
    mbs.Assemble()
    settings = exu.SimulationSettings()
    pace = settings.timeIntegration
    pace.numberOfSteps, pace.endTime, pace.verboseMode = round(times[-1] / step), float(times[-1]), 0
    pace.newton.relativeTolerance, pace.newton.absoluteTolerance = 1e-12, 1e-13
    settings.solutionSettings.writeSolutionToFile = False
    settings.solutionSettings.sensorsWritePeriod = step
    mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.TrapezoidalIndex2)
    rows = np.rint(times / step).astype(int)
    shown = [mbs.GetSensorStoredData(sensor)[rows] for sensor in sensors]
    return np.stack([one[:, 1] + 1j * one[:, 2] for one in shown], axis=1)
