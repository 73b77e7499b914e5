"""Recordings of machines with a fault that the model does not know: computed by Exudyn, which shares no code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem
from shoal.identification.diagnostics.suspects.candidate import Size, size_of
from shoal.identification.recording.observation import STRAIGHT, Camera, observe
from shoal.scene import Scene
from shoal.trajectory import Array

from shoal_validation.suspects.machines import FREE, MACHINES

SAMPLES = 100
_NOISE = 5e-4
"""Of the machine's length, or in radians; that of right models is a third to seven times as large."""
_BENT = 0.1
"""Of the right models, how many have a rod that bends, of two elements where the recorded machine has four."""


@dataclass(frozen=True)
class Case:
    """A problem, the recording of a machine with one fault, its kind and the name that the fault should be given."""

    problem: Problem
    measurement: Measurement
    scene: Scene
    kind: str
    cause: str
    truth: dict[str, float]


@dataclass
class _Fault:
    """A fault on its way into data: the machine's fields and how it is recorded."""

    fields: dict[str, Any]
    cause: str
    clock: float = 1.0
    late: float = 0.0
    held: float = 0.0
    camera: Camera = STRAIGHT
    factors: dict[str, float] | None = None
    exchanged: bool = False
    meshed: bool = False


MEASURED = ("clock", "scale", "tilt", "shift", "late", "held", "gravity")
MACHINE = ("friction", "dry", "mass", "length", "heavier", "pivot", "place", "bending", "rate", "moving")
READ = ("metres", "degrees", "time", "mirrored", "exchanged")
KINDS = (*MEASURED, *MACHINE, *READ)


def case(seed: int, kind: str | None = None) -> Case:
    """The case of a seed; kind: of its fault, drawn if None; `right` for none."""
    rng = np.random.default_rng(seed)
    while True:
        data, sought, seen = MACHINES[int(rng.integers(len(MACHINES)))](rng)
        drawn = kind or KINDS[int(rng.integers(len(KINDS)))]
        scene = Scene.parse(data, "machine")
        fault = _fault(drawn, scene, seen, size_of(scene), rng)
        if fault is None:
            continue
        if fault.meshed:
            scene = _machine(data, {path: 2 if path.endswith("elements") else x for path, x in fault.fields.items()})
        problem = _problem(scene, sought, seen, drawn, rng)
        measurement = _recorded(problem, data, scene, fault, rng)
        if measurement is not None:
            truth = {f"theta_{body}": scene.start(body).angle for body in sought}
            return Case(problem, measurement, scene, drawn, fault.cause, truth)


def _signed(rng: np.random.Generator, low: float, high: float) -> float:
    return float(rng.choice([-1.0, 1.0]) * np.exp(rng.uniform(np.log(low), np.log(high))))


def _ratio(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(_signed(rng, np.log(low), np.log(high))))


def _fault(kind: str, scene: Scene, seen: list[tuple[str, str]], size: Size, rng: np.random.Generator) -> _Fault | None:
    """A fault of a kind, of random place and size; None where the machine or what is seen of it has none."""
    positions = seen[0][1] == "x"
    body, joint = str(rng.choice(list(scene.bodies))), str(rng.choice(list(scene.joints)))
    torque = size.mass * size.gravity * size.length
    match kind:
        case "right":
            return _Fault(_bent(scene, body, size, rng), "", meshed=True) if rng.random() < _BENT else _Fault({}, "")
        case "clock":
            return _Fault({}, "clock", clock=_ratio(rng, 1.02, 1.3))
        case "scale" if positions:
            return _Fault({}, "scale", camera=Camera(scale=_ratio(rng, 1.02, 1.3)))
        case "tilt":
            return _Fault({}, "tilt", camera=Camera(tilt=_signed(rng, 0.02, 0.3)))
        case "shift" if positions:
            axis = str(rng.choice(["x", "y"]))
            return _Fault({}, axis, camera=Camera(**{axis: _signed(rng, 0.02, 0.2) * size.length}))
        case "late":
            return _Fault({}, "delay", late=float(rng.uniform(0.1, 0.4)) / size.rate)
        case "held":
            return _Fault({}, "delay", held=float(rng.uniform(0.05, 0.4)) * scene.solver.duration)
        case "gravity":
            return _Fault({"gravity.1": -9.81 * _ratio(rng, 1.03, 1.3)}, "gravity")
        case "friction":
            amount = float(rng.uniform(0.01, 0.2)) * torque / size.rate
            return _Fault({f"joints.{joint}.friction": amount}, f"friction of {joint}")
        case "dry":
            return _Fault(
                {f"joints.{joint}.coulomb": float(rng.uniform(0.01, 0.08)) * torque}, f"dry friction of {joint}"
            )
        case "mass":
            marker = str(rng.choice(list(scene.markers)))
            return _Fault({"further": (marker, float(rng.uniform(0.05, 0.5)) * size.mass)}, f"mass at {marker}")
        case "length":
            length = scene.value(f"bodies.{body}.length") * _ratio(rng, 1.03, 1.2)
            return _Fault({f"bodies.{body}.length": float(length)}, f"length of {body}")
        case "heavier" if len(scene.bodies) > 1:
            density = scene.value(f"bodies.{body}.density") * _ratio(rng, 1.2, 1.8)
            return _Fault({f"bodies.{body}.density": float(density)}, f"mass of {body}")
        case "pivot" if scene.name == "four-bar":
            number = int(rng.integers(2))
            path = f"joints.C.first.point.{number}"
            place = float(scene.value(path) + _signed(rng, 0.01, 0.05))
            return _Fault({path: place}, f"{'xy'[number]} of the pivot C")
        case "place" if len(scene.bodies) > 1:
            on, side = (joint, "second") if joint in ("O", "C") else (joint, str(rng.choice(["first", "second"])))
            attachment = getattr(scene.joints[on], side)
            place, length = scene.location(attachment)[0], scene.bodies[attachment.body].length  # type: ignore[union-attr]
            shifted = place + float(rng.uniform(0.01, 0.05)) * length * (1.0 if place == 0.0 else -1.0)
            return _Fault({f"joints.{on}.{side}.point": [shifted, 0.0]}, f"place of {on} on {attachment.body}")
        case "bending":
            return _Fault(_bent(scene, body, size, rng), f"bending of {body}")
        case "rate" if scene.name != "four-bar":
            return _Fault({f"initial.{body}.rate": _signed(rng, 0.1, 1.0) * size.rate}, f"rate of {body} at the start")
        case "moving":
            axis = str(rng.choice(["x", "y"]))
            # In a closed loop a pivot that is at once under way leaves open how fast the others turn.
            phase = np.pi / 2 if scene.name == "four-bar" else float(rng.uniform(0.0, 2 * np.pi))
            wave = f"{_signed(rng, 0.01, 0.05) * size.length}*sin({rng.uniform(0.5, 3.0) * size.rate}*t + {phase})"
            return _Fault({"moving": (axis, wave)}, f"motion of the pivot O along {axis}")
        case "metres" if positions:
            factor = float(rng.choice([1e3, 1e2, 25.4, 1e-3, 1e-2, 1 / 25.4]))
            return _Fault({}, "unit of the positions", factors={"x": factor, "y": factor})
        case "degrees" if not positions:
            return _Fault({}, "unit of the angles", factors={"angle": 57.29577951308232})
        case "time":
            return _Fault({}, "unit of the time", clock=1e-3)
        case "mirrored":
            axis = str(rng.choice(["x", "y"]))
            name = f"{axis} axis" if positions else "sense of the angles"
            return _Fault({}, name, factors={axis: -1.0} if positions else {"angle": -1.0})
        case "exchanged" if positions:
            return _Fault({}, "x and y axes", exchanged=True)
    return None


def _bent(scene: Scene, body: str, size: Size, rng: np.random.Generator) -> dict[str, Any]:
    """Fields of a rod that bends."""
    rod = scene.bodies[body]
    sag = float(rng.uniform(0.005, 0.03))
    modulus = rod.mass * size.gravity * rod.length**2 / (8 * rod.section_at(0.0).bending * sag)  # type: ignore[union-attr]
    fields = {"youngs_modulus": float(modulus), "element": "ancf-cable", "elements": 4}
    return {f"bodies.{body}.{field}": value for field, value in fields.items()}


def _problem(
    scene: Scene, sought: list[str], seen: list[tuple[str, str]], kind: str, rng: np.random.Generator
) -> Problem:
    size = size_of(scene).length if seen[0][1] == "x" else 1.0
    noise = _NOISE * size * (1.0 if kind != "right" else float(np.exp(rng.uniform(-1.0, 2.0))))
    data = {
        "name": scene.name,
        "scene": "single-pendulum",
        "parameters": {f"theta_{body}": {"path": f"initial.{body}.angle", **FREE} for body in sought},
        "channels": [{"marker": marker, "quantity": quantity} for marker, quantity in seen],
        "noise": noise if rng.random() < 0.5 else None,
        "source": {"kind": "engine", "stop": 1.0, "count": SAMPLES, "noise": noise},
    }
    return Problem.parse(data, scene.name)


def _recorded(
    problem: Problem, data: dict[str, Any], scene: Scene, fault: _Fault, rng: np.random.Generator
) -> Measurement | None:
    """The recording by Exudyn; None where the faulty machine cannot be assembled."""
    times = np.arange(1, SAMPLES + 1) * scene.solver.duration / SAMPLES
    truth = _machine(data, dict(fault.fields))
    moments = times / (fault.clock if 0.1 < fault.clock < 10 else 1.0) + fault.late - fault.held
    going = moments > 0
    try:
        run = get_engine("exudyn").simulate(truth, moments[going])
    except Exception:
        return None
    if not run.ok:
        return None
    channels = tuple(problem.channels)
    values = observe(run, channels, fault.camera)[0]
    start = observe(get_engine("gauss").simulate(truth, np.zeros(1)), channels, fault.camera)[0]
    values = np.concatenate([np.repeat(start, int(np.sum(~going)), axis=0), values])
    assert isinstance(problem.source.noise, float)  # type: ignore[union-attr]
    values = values + problem.source.noise * rng.standard_normal(values.shape)  # type: ignore[union-attr]
    stated = problem.noise
    if fault.factors:
        values = values * [fault.factors.get(channel.quantity, 1.0) for channel in channels]
        stated = None if stated is None else stated * abs(next(iter(fault.factors.values())))
    if fault.exchanged:
        values = _exchanged(values)
    if not 0.1 < fault.clock < 10:
        times = times * fault.clock
    return Measurement.single(times, channels, values, "exudyn", None, stated)


def _exchanged(values: Array) -> Array:
    pairs = values.reshape(len(values), -1, 2)
    return np.asarray(pairs[:, :, ::-1].reshape(values.shape))


def _machine(data: dict[str, Any], fields: dict[str, Any]) -> Scene:
    """The machine with a fault."""
    parsed = Scene.parse(data, "machine").model_dump(mode="json")
    if further := fields.pop("further", None):
        marker, mass = further
        parsed["bodies"]["load"] = {"kind": "point-mass", "mass": mass}
        parsed["joints"]["load"] = {"first": parsed["markers"][marker], "second": {"body": "load"}}
    if moving := fields.pop("moving", None):
        axis, wave = moving
        parsed["ground_points"] = {"G": {axis: wave}}
        parsed["joints"]["O"]["first"]["point"] = "G"
    return Scene.parse(parsed, "machine").with_values(fields)
