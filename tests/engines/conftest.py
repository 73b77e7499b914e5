"""Small scenes, one feature each, on which engines are compared; and what of them each engine can do."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.capabilities import needs
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

Data = dict[str, Any]


@dataclass(frozen=True)
class Case:
    """A scene and how closely engines must agree on its markers [m].

    steps: of Exudyn's coarse run, of the native run [s]; times: when the markers are compared [s]
    """

    scene: Scene
    tolerance: float
    step: float = 1e-3
    native: float = 2e-4
    duration: float = 0.5

    @property
    def times(self) -> Array:
        return np.linspace(0, self.duration, 6)[1:]


def at(body: str, point: Any = "start") -> Data:
    return {"body": body, "point": point}


def joint(first: Data, second: Data, kind: str = "revolute", **more: Any) -> Data:
    return {"kind": kind, "first": first, "second": second, **more}


def scene(name: str, bodies: Data, joints: Data, markers: Data, **more: Any) -> Scene:
    return Scene.parse({"name": name, "bodies": bodies, "joints": joints, "markers": markers, **more})


def between(kind: str, first: Data, second: Data, **more: Any) -> Data:
    return {"S": {"kind": kind, "first": first, "second": second, **more}}


def force(place: Data, x: float, y: float, **more: Any) -> Data:
    return {"F": {"kind": "force", "at": place, "force": [x, y], **more}}


def torque(place: Data, value: Any, **more: Any) -> Data:
    return {"M": {"kind": "torque", "at": place, "torque": value, **more}}


def spread(body: str, x: float, y: float, **more: Any) -> Data:
    return {"W": {"kind": "distributed-force", "body": body, "force": [x, y], **more}}


def starts(**angles: float) -> Data:
    return {name: {"angle": angle} for name, angle in angles.items()}


def cables(scene: Scene, duration: float = 0.2, native: float = 1e-4) -> Case:
    """Steps that resolve the axial waves of the cables, 2000 rad/s and more."""
    return Case(scene, 3e-8, 5e-5, native, duration)


GROUND = at("ground", [0.0, 0.0])
ROD = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.04, "density": 1000.0}
CABLE = ROD | {"youngs_modulus": 2e7, "element": "ancf-cable", "elements": 2}
BLOCK = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.1, "centre_of_mass": [0.2, 0.1]}
BALL = {"kind": "point-mass", "mass": 0.5}
THROWN = {"element": "rigid", "vectors": [[0.3, -0.4]], "rates": [[0.8, 0.6]]}
TIP = {"tip": at("A", "end")}
CLAMP = {"O": joint(GROUND, at("A"), "weld")}
PIN = {"O": joint(GROUND, at("A"))}


def pendulum(name: str, rod: Data = ROD, joints: Data = PIN, start: Data | None = None, **more: Any) -> Scene:
    return scene(name, {"A": rod}, joints, TIP, initial={"A": start or {"angle": 0.3, "rate": 1.0}}, **more)


def pair(name: str, joints: Data, other: Data = BLOCK, start: Data | None = None, **more: Any) -> Scene:
    """A rod on the ground and a second body B on it."""
    start = {"A": {"angle": 0.3, "rate": 1.0}, "B": start if start is not None else {"angle": -0.4, "rate": -2.0}}
    start = {name: value for name, value in start.items() if value}
    return scene(name, {"A": ROD, "B": other}, PIN | joints, TIP | {"B": at("B")}, initial=start, **more)


HANG = joint(at("A", "end"), at("B"))
RIGID = 1e-8

CASES = [
    Case(load_scene("equal-slider-crank"), RIGID, duration=0.1),
    Case(load_scene("parallelogram"), RIGID, duration=0.4),
    Case(load_scene("n-four-bar-2"), RIGID, duration=0.4),
    Case(load_scene("andrews-squeezer"), RIGID, step=2e-6, native=5e-6, duration=0.01),
    Case(
        pair("weld", {"A": joint(at("A", "end"), at("B", [0.1, 0.0]), "weld")}, start={"angle": 1.0, "rate": 1.0}),
        RIGID,
    ),
    Case(pair("weld-angle", {"A": joint(at("A", "end"), at("B"), "weld", angle=0.5)}, start={}), RIGID),
    cables(pendulum("clamp", CABLE, CLAMP, {"angle": 0.4})),
    cables(
        scene(
            "rod-on-body",
            {"A": BLOCK, "C": CABLE},
            {"O": joint(GROUND, at("A")), "W": joint(at("A", [0.5, 0.2]), at("C"), "weld")},
            {"end": at("C", "end")},
            initial=starts(A=0.2, C=0.9),
        ),
    ),
    cables(
        scene(
            "clamped-tip-mass", {"A": CABLE, "B": BALL}, CLAMP | {"E": HANG}, TIP, loads=force(at("A", "end"), 1.0, 4.0)
        ),
    ),
    cables(
        pendulum(
            "follower",
            CABLE,
            CLAMP,
            {"angle": 0.0},
            gravity=[0, 0],
            loads=force(at("A", "end"), 0.0, 5.0, follows=True),
        ),
    ),
    cables(
        pendulum("torque-on-cable", CABLE, CLAMP, {"angle": 0.0}, loads=torque(at("A", "end"), "2*t")),
    ),
    cables(
        pendulum("distributed", CABLE, CLAMP, {"angle": 0.0}, loads=spread("A", 1.0, 12.0, scale="sin(20*t)")),
    ),
    Case(
        pendulum(
            "distributed-rigid", ROD | {"curvature": [1.0, 0.5], "end_height": 0.01}, loads=spread("A", 1.0, 12.0)
        ),
        RIGID,
    ),
    cables(
        pendulum(
            "tapered-cable", CABLE | {"end_height": 0.01, "end_width": 0.03, "elements": 3}, CLAMP, {"angle": 0.4}
        ),
        native=5e-5,
    ),
    cables(
        pendulum("curved-cable", CABLE | {"curvature": [1.0, 0.5], "elements": 8}, CLAMP, {"angle": 0.1}),
        duration=0.1,
        native=2e-5,
    ),
    cables(pendulum("damped-cable", CABLE | {"retardation": 2e-3}, CLAMP, {"angle": 0.0}), native=5e-5),
    Case(
        scene(
            "coupled-pendulums",
            {"A": ROD, "B": ROD},
            PIN | {"P": joint(at("ground", [0.5, 0.0]), at("B"))},
            TIP | {"B": at("B", "end")},
            initial=starts(A=-2.0, B=-1.0),
            loads=between("spring", at("A", "end"), at("B", "centre"), stiffness=30.0, cubic=20.0, damping=0.4),
        ),
        RIGID,
    ),
    Case(
        pendulum(
            "elastic-table",
            loads=between("spring", at("ground", [1.0, 1.0]), at("A", "end"), elastic="20*sin(t) + 5*t**2", length=0.3),
        ),
        RIGID,
    ),
    Case(
        pair(
            "torsion",
            {"E": HANG},
            loads=between("torsion-spring", at("A", "end"), at("B"), stiffness=20.0, cubic=3.0, damping=0.1, angle=0.2),
        ),
        RIGID,
    ),
    Case(
        pendulum(
            "wound-up",
            start={"angle": 0.3, "rate": 15.0},
            gravity=[0, 0],
            loads=between("torsion-spring", GROUND, at("A"), stiffness=1.0, angle=7.0),
        ),
        RIGID,
    ),
    cables(
        pendulum(
            "torsion-on-cable",
            CABLE,
            loads=between("torsion-spring", GROUND, at("A"), stiffness=20.0, damping=0.1, angle=0.0),
        ),
    ),
    Case(
        pair(
            "motor",
            {"E": HANG},
            loads=torque(at("B"), {"table": [[0, 0], [0.2, 3], [0.6, -2], [1.0, 0]]}, reaction=at("A")),
        ),
        RIGID,
    ),
    Case(
        pair(
            "geared",
            {"E": joint(at("ground", [1.0, 0.0]), at("B")), "G": joint(at("A"), at("B"), "gear", ratio="-3/7")},
            start={"angle": -0.4},
        ),
        RIGID,
    ),
    Case(pendulum("force-in-time", loads=force(at("A", "end"), 3.0, 9.0, scale="sin(8*t)")), RIGID),
    Case(
        pendulum(
            "driven-crank",
            joints=PIN | {"D": joint(GROUND, at("A"), "driven-angle", angle="0.3 + t + 0.5*sin(4*t)")},
            start={"angle": 0.3, "rate": 3.0},
        ),
        RIGID,
    ),
    Case(
        pair("driven-pair", {"E": HANG, "D": joint(at("A"), at("B"), "driven-angle", angle="-0.7 - 3*t + 2*t**2")}),
        RIGID,
    ),
    Case(
        pendulum(
            "moving-support",
            joints={"O": joint(at("ground", "cart"), at("A"))},
            ground_points={"cart": {"x": "0.1*sin(6*t)", "y": "0.05*sin(9*t)"}},
        ),
        RIGID,
    ),
    Case(
        pendulum(
            "coulomb",
            joints={"O": joint(GROUND, at("A"), coulomb=1.0, coulomb_speed=0.2, friction=0.1, drag=0.02)},
            start={"rate": 8.0},
        ),
        RIGID,
    ),
    Case(
        scene(
            "slider-friction",
            {"A": BLOCK},
            {
                "S": joint(
                    GROUND,
                    at("A"),
                    "slider",
                    direction=0.5,
                    rotation="locked",
                    friction=0.3,
                    coulomb=2.0,
                    coulomb_speed=0.2,
                )
            },
            {"A": at("A")},
            initial={"A": {"position": [0.0, 0.0], "velocity": [0.4 * np.cos(0.5), 0.4 * np.sin(0.5)], "angle": 0.3}},
        ),
        RIGID,
    ),
    Case(
        pair(
            "slider-on-rod",
            {"S": joint(at("A", "centre"), at("B"), "slider", direction=0.2)},
            start={
                "angle": -0.4,
                "rate": -2.0,
                "position": list(0.5 * np.array([np.cos(0.3), np.sin(0.3)])),
                "velocity": list(0.5 * np.array([-np.sin(0.3), np.cos(0.3)])),
            },
        ),
        RIGID,
    ),
    Case(
        scene(
            "swinging-mass",
            {"A": BALL},
            {"D": joint(GROUND, at("A"), "distance")},
            {"A": at("A")},
            initial={"A": {"position": [0.8, 0.6], "velocity": [0.6, -0.8]}},
        ),
        RIGID,
    ),
    Case(
        pair(
            "distance",
            {"D": joint(at("A", "end"), at("B"), "distance")},
            start={"position": [1.2, 0.8], "rate": 1.0, "velocity": [-np.sin(0.3), np.cos(0.3)]},
        ),
        RIGID,
    ),
    Case(pair("parallel", {"E": HANG, "P": joint(GROUND, at("B"), "parallel")}, start={"angle": 0.0}), RIGID),
    Case(
        pair(
            "perpendicular",
            {"E": HANG, "P": joint(at("A"), at("B"), "perpendicular")},
            start={"angle": 0.3 + np.pi / 2, "rate": 1.0},
        ),
        RIGID,
    ),
    Case(
        pair(
            "repelling-ball",
            {"E": joint(at("A", "centre"), at("B"))},
            BALL,
            {},
            loads=between("spring", at("ground", [2.0, 1.0]), at("B"), stiffness=-10.0, cubic=5.0)
            | force(at("A", [0.3, 0.1]), 2.0, 1.0, follows=True)
            | torque(at("A"), 1.5),
        ),
        RIGID,
    ),
    cables(
        scene(
            "two-cables",
            {"A": CABLE, "B": CABLE | {"end_height": 0.015}},
            {
                "O": joint(GROUND, at("A"), coulomb=0.2, coulomb_speed=0.5),
                "E": joint(at("A", "end"), at("B", [0.5, 0.0]), friction=0.1),
            },
            {"end": at("B", "end")},
            initial=starts(A=0.2, B=2.0),
            loads=spread("B", 1.0, 2.0),
        ),
        duration=0.1,
    ),
    cables(
        scene(
            "slider-on-cable",
            {"A": CABLE, "B": BLOCK},
            PIN | {"S": joint(at("A", [0.7, 0.0]), at("B"), "slider", rotation="locked", friction=0.3)},
            TIP | {"B": at("B")},
            initial=starts(A=0.2, B=1.1),
        ),
    ),
    cables(
        scene(
            "clamp-that-moves",
            {"A": CABLE},
            {"O": joint(at("ground", "base"), at("A"), "weld")},
            TIP,
            ground_points={"base": {"y": "0.2*t*sin(5*t)"}},
            initial=starts(A=0.5),
        ),
        duration=0.1,
    ),
    Case(
        scene(
            "free-bodies",
            {"A": BLOCK, "B": BALL},
            {},
            {"A": at("A"), "B": at("B")},
            initial={"A": {"position": [0.0, 0.0], "rate": 3.0}, "B": {"position": [1.0, 0.2], "velocity": [0.0, 2.0]}},
            loads=between("spring", at("A"), at("B"), stiffness=50.0, damping=0.2, length=0.7),
        ),
        RIGID,
    ),
]

SPATIAL = Scene.parse({
    "name": "spatial", "dimensions": 3, "gravity": [0.0, 0.0, -9.81],
    "bodies": {name: {"kind": "rigid-body", "mass": 1.0, "inertia": [0.1, 0.2, 0.25],
                      "named_points": {"e": [0.3, 0.1, 0.2]}} for name in "ABCD"},
    "joints": {
        "S": {"kind": "spherical", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "A"}},
        "U": {"kind": "universal", "first": {"body": "A", "point": "e"}, "second": {"body": "B"}, "axis": [1, 0, 0],
              "second_axis": [0, 1, 0]},
        "C": {"kind": "cylindrical", "first": {"body": "B", "point": "e"}, "second": {"body": "C"}, "axis": [1, 1, 0]},
        "P": {"kind": "planar", "first": {"body": "C", "point": "e"}, "second": {"body": "D"}, "axis": [0, 1, 1]},
    },
    "markers": {"d": {"body": "D", "point": "e"}},
})  # fmt: skip
DIRECTOR = Scene.parse({
    "name": "director", "dimensions": 3, "gravity": [0.0, 0.0, -9.81],
    "bodies": {"A": {"kind": "rod", "length": 1.0, "height": 0.03, "width": 0.02, "density": 5540.0,
                     "youngs_modulus": 2e8, "element": "director-rod", "elements": 2}},
    "joints": {"W": {"kind": "weld", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "A"}}},
    "markers": {"e": {"body": "A", "point": "end"}},
})  # fmt: skip
CURVED = DIRECTOR.with_values({"bodies.A.side_curvature": [1.0]})
DAMPED = DIRECTOR.with_values({"bodies.A.retardation": 1e-4})
TREE = Scene.parse({
    "name": "tree", "dimensions": 3, "gravity": [0.0, 0.0, -9.81],
    "bodies": {name: {"kind": "rigid-body", "mass": 1.0, "inertia": [0.1, 0.2, 0.25]} for name in "AB"},
    "joints": {
        "S": {"kind": "spherical", "first": {"body": "ground", "point": [0, 0, 0]}, "second": {"body": "A"}},
        "P": {"kind": "slider", "first": {"body": "A", "point": [0.1, 0, 0]}, "second": {"body": "B"},
              "axis": [1, 1, 0], "rotation": "locked"},
    },
    "markers": {"b": {"body": "B", "point": [0.3, 0.1, 0.2]}},
})  # fmt: skip
LOADED = Scene.parse(TREE.model_dump(mode="json", exclude_unset=True) | {
    "loads": {"F": {"kind": "force", "at": {"body": "B"}, "force": [1, 2, 3]},
              "T": {"kind": "torque", "at": {"body": "B"}, "torque": 2.0, "axis": [0, 1, 1]}},
})  # fmt: skip
ONLY_NATIVE = [
    TREE,
    LOADED,
    SPATIAL,
    DIRECTOR,
    CURVED,
    DAMPED,
    pendulum("quintic", CABLE | {"element": "ancf-quintic"}),
    pendulum("full", CABLE | {"element": "ancf-full"}),
    pendulum("dry-pin", joints={"O": PIN["O"] | {"mu": 0.1, "radius": 0.01}}),
    scene(
        "roped",
        {"A": {"kind": "point-mass", "mass": 1.0}},
        {"rope": {"kind": "distance", "keeps": "at-most", "first": GROUND, "second": at("A")}},
        {"A": at("A")},
        initial={"A": {"position": [0.6, -0.8], "velocity": [0.0, 0.0]}},
    ),
    pendulum("stopped", joints={"O": PIN["O"] | {"stops": {"min": -4.0, "restitution": 0.5}}}),
    pendulum("loose", joints={"O": PIN["O"] | {"play": 0.01, "radius": 0.01}}),
    pair(
        "loose-gears",
        {"E": joint(at("ground", [1.0, 0.0]), at("B")), "G": joint(at("A"), at("B"), "gear", ratio=-2, backlash=0.01)},
    ),
    pendulum("sticking", joints={"O": PIN["O"] | {"coulomb": 0.1, "stick": "exact"}}),
    scene(
        "bouncing",
        {"A": {"kind": "point-mass", "mass": 1.0}},
        {},
        {"A": at("A")},
        contacts={"floor": {"first": at("A"), "second": GROUND | {"line": 0.0}, "restitution": 0.5, "mu": 0.3}},
        initial={"A": {"position": [0.0, 0.8], "velocity": [1.0, 0.0]}},
    ),
    scene(
        "tumbling",
        {"A": BLOCK},
        {},
        {"A": at("A", [0.0, 0.0])},
        contacts={
            "floor": {
                "first": at("A", [0.0, 0.0]) | {"polygon": [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]]},
                "second": GROUND | {"line": 0.0},
            }
        },
        initial={"A": {"position": [0.0, 0.8], "velocity": [1.0, 0.0]}},
    ),
    scene(
        "rolling",
        {"A": BLOCK},
        {},
        {"A": at("A", [0.0, 0.0])},
        contacts={
            "floor": {
                "first": at("A", [0.0, 0.0]) | {"radius": 0.1},
                "second": GROUND | {"polygon": [[-1.0, -1.0], [1.0, -1.0], [1.0, 0.0], [-1.0, 0.0]]},
            }
        },
        initial={"A": {"position": [0.0, 0.8], "velocity": [1.0, 0.0]}},
    ),
    scene(
        "lifted",
        {"A": BLOCK},
        {},
        {"A": at("A", [0.0, 0.0])},
        contacts={
            "cam": {
                "first": at("A", [0.0, 0.0]) | {"radius": 0.1},
                "second": GROUND | {"cam": {"table": [[0.0, 0.3], [2.0, 0.32], [4.0, 0.31]], "period": 2.0 * np.pi}},
            }
        },
        initial={"A": {"position": [0.0, 0.8], "velocity": [0.0, 0.0]}},
    ),
    scene("motor-rotor", {"A": BLOCK}, {"O": joint(GROUND, at("A")) | {"armature": 0.1}}, {"A": at("A")}),
    Scene.parse(
        {
            "name": "mounted",
            "dimensions": 3,
            "bodies": {"A": BLOCK | {"inertia": [0.1, 0.2, 0.2]}},
            "loads": {"mount": {"kind": "bushing", "first": GROUND, "second": at("A"), "stiffness": [1e3, 1e3, 1e3]}},
            "markers": {"A": at("A")},
            "initial": {"A": {"position": [0.0, 0.0, 0.0]}},
        }
    ),
    scene(
        "hoist",
        {"A": {"kind": "point-mass", "mass": 1.0}},
        {
            "R": joint(
                GROUND | {"point": [-0.3, -0.5]},
                at("A"),
                "rope",
                over=[GROUND | {"point": [0.0, 0.0], "radius": 0.1, "side": "left"}],
            )
        },
        {"A": at("A")},
        initial={"A": {"position": [0.1, -0.8], "velocity": [0.0, 0.0]}},
    ),
    scene(
        "hose",
        {"A": {"kind": "point-mass", "mass": 1.0}},
        {"D": joint(GROUND, at("A"), "distance", length=0.5)},
        {"A": at("A")},
        initial={"A": {"position": [0.5, 0.0]}},
        loads={
            "S": {"kind": "torsion-spring", "first": GROUND, "second": GROUND, "second_to": at("A"), "stiffness": 2.0}
        },
    ),
    pendulum("shear", CABLE | {"element": "simo-reissner"}),
    pendulum("floating", CABLE | {"element": "modal", "elements": 1}),
    scene(
        "ring",
        {"A": CABLE | {"curvature": [2 * np.pi / CABLE["length"]], "elements": 6}},
        {"W": joint(at("A"), at("A", "end"), "weld")},
        {"half": at("A", "centre")},
        initial={"A": {"position": [0.0, 0.0]}},
    ),
    pair(
        "fed-back",
        {"E": HANG},
    ).with_values({"loads": {"M": {"kind": "torque", "at": at("A"), "torque": "1 - 0.1*angle(A)"}}}),
    pair(
        "delayed",
        {"E": HANG},
    ).with_values({"states": {"x": {"rate": "1 - x"}}}),
    scene(
        "sampled",
        {"A": BALL},
        {"O": joint(GROUND, at("A"), "slider")},
        {"A": at("A")},
        loads={"push": {"kind": "thrust", "joint": "O", "force": "u"}},
        signals={"u": {"sample": "1 - slide(O)", "period": 0.01}},
    ),
    pendulum("at-rest", CABLE, CLAMP).with_values({"initial.from": "statics", "initial.A.rate": 0.0}),
    scene(
        "going-on",
        {"A": BALL},
        {"D": joint(GROUND, at("A"), "distance", length=0.5)},
        {"A": at("A")},
        initial={"A": {"position": [0.5, 0.0]}, "from": {"t": 1.0, "bodies": {"A": THROWN}}},
    ),
    pair(
        "coupled",
        {
            "E": HANG,
            "C": {
                "kind": "coupling",
                "terms": [{"at": at("B"), "axis": "x"}, {"at": at("A", "centre"), "axis": "x", "factor": -2.0}],
            },
        },
    ),
    pair(
        "pulled",
        {"D": joint(GROUND, at("B"), "distance", length="0.5 - 0.1*t**2")},
        BALL,
        {"position": [0.3, 0.4]},
    ),
]
SCENES = [*(case.scene for case in CASES), *ONLY_NATIVE]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test with `exudyn_case` or `casadi_case` runs for every case that the engine can do, by day for a few."""
    for engine in ("exudyn", "casadi"):
        if f"{engine}_case" in metafunc.fixturenames:
            able = [
                case for case in CASES if {need for _, need in needs(case.scene)} <= get_engine(engine).capabilities.all
            ]
            daily = covering(able)
            marked = [pytest.param(case, marks=[pytest.mark.slow] * (case.scene.name not in daily)) for case in able]
            metafunc.parametrize(f"{engine}_case", marked, ids=[case.scene.name for case in able])


def covering(cases: Sequence[Case]) -> set[str]:
    """Names of a few scenes in which every capability occurs that any of these asks for: enough by day."""
    wanted = {case.scene.name: {need for _, need in needs(case.scene)} for case in cases}
    left, chosen = set().union(*wanted.values()), set[str]()
    while left:
        best = max(wanted, key=lambda name: len(wanted[name] & left))
        chosen.add(best)
        left -= wanted[best]
    return chosen


@pytest.fixture
def scenes() -> list[Scene]:
    """All scenes, those included that only the native solver can do."""
    return [*(case.scene for case in CASES), *ONLY_NATIVE, load_scene("single-pendulum")]


@pytest.fixture
def cases() -> dict[str, Case]:
    """The cases by the names of their scenes."""
    return {case.scene.name: case for case in CASES}


@pytest.fixture
def run() -> Callable[..., Array]:
    """Marker positions [m], (samples, markers, 2), of a run that may be believed."""

    def run(engine: Any, scene: Scene, times: Array, **solver: Any) -> Array:
        settings = {f"solver.{key}": value for key, value in solver.items()}
        trajectory = engine.simulate(scene.with_values(settings), times)
        assert trajectory.ok, trajectory.message
        return trajectory.points[..., 0]

    return run


@pytest.fixture
def native(run: Callable[..., Array]) -> Callable[[Case], Array]:
    """Marker positions [m] of a case, by the native solver's Runge-Kutta method."""

    def native(case: Case) -> Array:
        step = {"step": case.native, "integrator": "rk4", "duration": case.duration}
        return run(get_engine("gauss"), case.scene, case.times, **step)

    return native
