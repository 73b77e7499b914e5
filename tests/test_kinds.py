"""A kind that somebody forgot is refused by its name, wherever one of the lists of kinds is asked."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar, Literal, get_args

import numpy as np
import pytest
from shoal.engines import ENGINES, get_engine
from shoal.engines.capabilities import needs, require
from shoal.engines.casadi import CasadiEngine
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import build, library
from shoal.engines.exudyn.joints import add_friction, add_joint
from shoal.engines.exudyn.loads import add_load
from shoal.engines.mujoco.refused import require_counterparts
from shoal.engines.theory import left_out
from shoal.errors import InputError
from shoal.identification.methods import get_method
from shoal.mechanics import elements
from shoal.mechanics.assembly.build import build as build_model
from shoal.mechanics.assembly.loads import LOADS
from shoal.mechanics.integrators import INTEGRATORS, facts
from shoal.mechanics.joints import CONDITIONS, SPATIAL, conditions
from shoal.scene import JOINT_KINDS, LOAD_KINDS, Attachment, Resisted, Scene, load_scene
from shoal.scene.bodies import Element
from shoal.scene.dimensions import SPATIAL_KINDS
from shoal.scene.joints import sides
from shoal.scene.record import Record
from shoal.scene.solver import IntegratorName
from shoal.selection.levels import open_rods

NAME = "invented"
SCENE = load_scene("single-pendulum")
CABLES = load_scene("flexible-double-pendulum")
OTHERS = [name for name in ENGINES if name != "gauss"]


class Joint(Resisted):
    """Like no other."""

    kind: Literal["invented"] = "invented"
    turned: ClassVar[tuple[str, ...]] = ()
    first: Attachment = Attachment(body="ground", point=(0.0, 0.0))
    second: Attachment = Attachment(body="OA")
    friction: float = 1.0


class Load(Record):
    """Like no other."""

    kind: Literal["invented"] = "invented"
    at: Attachment = Attachment(body="OA")


JOINT = SCENE.model_copy(update={"joints": {"J": Joint()}})
LOAD = SCENE.model_copy(update={"loads": {"L": Load()}})
ROD = CABLES.bodies["OA"].model_copy(update={"element": NAME})
ELEMENT = CABLES.model_copy(update={"bodies": {**CABLES.bodies, "OA": ROD}})


def data(**fields: Any) -> dict[str, Any]:
    return SCENE.model_dump(mode="json") | fields


def casadi_forces(scene: Scene) -> Any:
    from shoal.engines.casadi.loads import applied
    from shoal.engines.casadi.tree import build_tree

    return applied(scene, build_tree(scene), None)


PLACES: dict[str, Callable[[], Any]] = {
    "joint, mechanics": lambda: build_model(JOINT),
    "load, mechanics": lambda: build_model(LOAD),
    "element, mechanics": lambda: build_model(ELEMENT),
    "way to the acceleration, mechanics": lambda: build_model(SCENE.with_values({"solver.acceleration": NAME})),
    "joint, scene": lambda: Scene.parse(data(joints={"J": Joint().model_dump()})),
    **{f"joint, {name}": lambda name=name: require(get_engine(name), JOINT) for name in OTHERS},
    "joint, exudyn's table": lambda: add_joint(None, "J", Joint()),  # type: ignore[arg-type]
    "joint, exudyn's friction": lambda: add_friction(None, "J", Joint()),  # type: ignore[arg-type]
    "joint, MJCF": lambda: require_counterparts(JOINT),
    "joint, casadi's tree": lambda: casadi_forces(JOINT),
    "load, scene": lambda: Scene.parse(data(loads={"L": {"kind": NAME}})),
    **{f"load, {name}": lambda name=name: require(get_engine(name), LOAD) for name in OTHERS},
    "load, exudyn's table": lambda: add_load(None, "L", Load()),  # type: ignore[arg-type]
    "load, MJCF": lambda: require_counterparts(LOAD),
    "load, casadi's table": lambda: casadi_forces(LOAD),
    "element, scene": lambda: CABLES.with_values({"bodies.OA.element": NAME}),
    **{f"element, {name}": lambda name=name: require(get_engine(name), ELEMENT) for name in OTHERS},
    "element, selection": lambda: open_rods(ELEMENT),
    "element, exudyn's table": lambda: build(library(), ELEMENT, "ancf-cable"),
    "element, casadi's table": lambda: casadi_forces(ELEMENT),
    "element, what its theory leaves out": lambda: left_out(
        get_engine("gauss").simulate(SCENE, [0.1]), ELEMENT, get_engine("gauss")
    ),
    "engine": lambda: get_engine(NAME),
    "integrator, scene": lambda: SCENE.with_values({"solver.integrator": NAME}),
    "integrator, gauss": lambda: facts(NAME),
    "integrator, exudyn": lambda: ExudynEngine(integrator=NAME).simulate(SCENE, [0.1]),  # type: ignore[arg-type]
    "integrator, casadi": lambda: CasadiEngine(integrator=NAME).simulate(SCENE, [0.1]),  # type: ignore[arg-type]
    "beam": lambda: ExudynEngine(beam=NAME).simulate(SCENE, [0.1]),  # type: ignore[arg-type]
    "method": lambda: get_method(NAME),
    **{
        f"swarm, {name}": lambda name=name: get_engine(name).simulate(
            SCENE.with_values({"solver.acceleration": NAME}), [0.1]
        )
        for name in OTHERS
    },
    "swarm, one run": lambda: get_engine("gauss").simulate(SCENE.with_values({"solver.acceleration": NAME})),
    "swarm, lanes": lambda: get_engine("gauss").simulate_many(
        SCENE.with_values({"solver.acceleration": NAME}), {"initial.OA.angle": np.zeros(2)}
    ),
}


@pytest.mark.parametrize("place", PLACES)
def test_an_invented_kind_is_refused_by_its_name(place: str) -> None:
    for package in ("exudyn", "casadi"):
        if package in place:
            pytest.importorskip(package)
    with pytest.raises((InputError, KeyError, NotImplementedError), match=NAME) as refusal:
        PLACES[place]()
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("scene", [JOINT, LOAD, ELEMENT], ids=["joint", "load", "element"])
def test_a_scene_needs_the_kind(scene: Scene) -> None:
    assert NAME in {need for _, need in needs(scene)}


def test_the_places_of_a_newcomer_are_found_among_its_fields() -> None:
    assert list(sides(Joint())) == ["first", "second"]
    assert list(sides(Load())) == ["at"]


def test_lists_of_the_scene_and_of_the_mechanics_name_the_same() -> None:
    assert set(get_args(IntegratorName)) == {"auto", *INTEGRATORS}
    assert set(get_args(Element)) == {"rigid", "modal", *elements.ELEMENTS, *elements.SPATIAL}


@pytest.mark.parametrize("element", get_args(Element))
def test_of_every_element_it_is_known_whether_it_shears(element: str) -> None:
    assert ROD.model_copy(update={"element": element}).shears == (element in ("ancf-full", "simo-reissner"))


def test_the_mechanics_knows_every_joint_and_load_of_the_scene() -> None:
    assert {kind.model_fields["kind"].default for kind in SPATIAL} == set(JOINT_KINDS)
    assert {kind.model_fields["kind"].default for kind in CONDITIONS} == set(JOINT_KINDS) - set(SPATIAL_KINDS)
    assert {kind.model_fields["kind"].default for kind in LOADS} == set(LOAD_KINDS)


def test_a_condition_that_nobody_told_of_is_refused_by_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    class Invented:
        first, second = Attachment(body="ground", point=(0.0, 0.0)), Attachment(body="OA")

    monkeypatch.setitem(CONDITIONS, Joint, lambda joint: [Invented()])
    with pytest.raises(NotImplementedError, match="Invented"):
        build_model(JOINT)


def test_a_joint_that_is_known_in_the_plane_alone_is_refused_in_space(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(CONDITIONS, Joint, lambda joint: [])
    with pytest.raises(InputError, match="'invented' is no joint of scenes with 3 dimensions"):
        conditions(Joint(), 3)


def test_what_casadi_says_is_what_its_tables_hold() -> None:
    pytest.importorskip("casadi")
    from shoal.engines.casadi.loads import ELONGATIONS, FORCES
    from shoal.engines.casadi.tree import ELEMENTS

    able = CasadiEngine().capabilities
    assert able.loads == {*ELONGATIONS, *FORCES}
    assert able.elements == set(ELEMENTS)
