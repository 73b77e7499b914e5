"""Scenes with fields replaced, by one value or by one per lane; derived properties by their formulas."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from shoal.errors import InputError
from shoal.scene import RigidBody, Rod, Scene, load_scene

SCENE = load_scene("flexible-double-pendulum")


def test_with_values_replaces_and_leaves_the_original_alone() -> None:
    before = SCENE.fingerprint
    changed = SCENE.with_values(
        {"bodies.OA.length": 1.5, "gravity": [0.0, -1.62], "initial.AB.rate": 2, "joints.A.friction": 0.1}
    )
    assert changed.bodies["OA"].length == 1.5
    assert changed.gravity == (0.0, -1.62)
    assert changed.start("AB").rate == 2.0
    assert changed.start("AB").angle == SCENE.start("AB").angle
    assert changed.joints["A"].friction == 0.1
    assert SCENE.fingerprint == before


def test_with_no_values_is_the_same_scene() -> None:
    assert SCENE.with_values({}) == SCENE


def test_with_values_starts_a_body_of_which_the_scene_says_nothing() -> None:
    data = SCENE.model_dump()
    del data["initial"]
    scene = Scene.parse(data)
    assert (scene.start("AB").angle, scene.start("AB").rate) == (0.0, 0.0)
    moved = scene.with_values({"initial.AB.rate": 1.25})
    assert (moved.start("AB").angle, moved.start("AB").rate) == (0.0, 1.25)
    assert moved.start("OA").rate == 0.0


@pytest.mark.parametrize(
    ("path", "expected"),
    [
        ("bodies.AB.length", 2.0),
        ("solver.integrator", "leapfrog"),
        ("gravity", (0.0, -9.81)),
        ("initial.OA.angle", np.pi / 4),
        ("joints.O.first.body", "ground"),
    ],
)
def test_value_reads_what_with_values_writes(path: str, expected: object) -> None:
    assert SCENE.value(path) == expected
    assert SCENE.with_values({path: expected}) == SCENE


def test_what_is_set_last_makes_guesses_of_the_rest_that_it_may_move() -> None:
    scene = SCENE.with_values({"initial.OA.angle": 0.5})
    assert scene.initial["OA"].guess == ()
    assert scene.initial["AB"].guess == ("angle",)
    later = scene.with_values({"initial.AB.rate": 1.0, "gravity": [0.0, 0.0]})
    assert later.initial["AB"].guess == ("angle",)
    assert later.with_values({"bodies.OA.length": 1.1}).initial["OA"].guess == ("angle",)
    assert Scene.parse(later.model_dump(mode="json")) == later


@pytest.mark.parametrize("states", [True, False])
def test_a_whole_start_is_set_as_its_quantities_are(states: bool) -> None:
    """Whether or not the scene states one of that body; what it states is kept, and makes guesses of the rest."""
    scene = SCENE.with_values({"initial": {"OA": {"angle": 0.5}, **({"AB": {"angle": 0.1}} if states else {})}})
    assert scene.with_values({"initial.AB": {"angle": 0.7}}) == scene.with_values({"initial.AB.angle": 0.7})
    guess = scene.with_values({"initial.AB": {"angle": 0.7, "guess": ["angle"]}})
    assert (guess.initial["AB"].guess, guess.initial["OA"].guess) == (("angle",), ())
    with pytest.raises(InputError, match=r"initial\.AC: no such field"):
        scene.with_values({"initial.AC": {"angle": 0.7}})


def test_statements_of_the_start_are_known_after_other_values_were_set() -> None:
    """What setting a value turns into a guess is still one; what was stated or set as a guess is none."""
    stated = {"OA": {"angle": 0.5, "rate": 1.0, "guess": ["rate"]}, "AB": {"angle": 0.1}}
    scene = SCENE.with_values({"initial": stated})
    assert scene.statements() == (("OA", "angle"), ("AB", "angle"))
    later = scene.with_values({"bodies.OA.length": 1.2}).with_values({"gravity": [0.0, 0.0]})
    assert later.initial["AB"].guess == ("angle",)
    assert later.statements() == scene.statements()
    assert later.statements(["initial.OA.rate", "initial.AB.velocity.0"])[1:] == (
        ("OA", "rate"),
        ("AB", "angle"),
        ("AB", "velocity"),
    )
    assert later.with_values({"initial.AB": {"angle": 0.2, "guess": ["angle"]}}).statements() == (("OA", "angle"),)


def test_a_drive_that_begins_as_before_makes_no_guesses() -> None:
    """What it does later moves no start; another slope at the start moves rates alone, another value poses as well."""
    data = SCENE.model_dump(mode="json")
    data["ground_points"] = {"P": {"x": 0.5, "y": 0.0}}
    data["initial"]["OA"]["rate"] = 1.0
    scene = Scene.parse(data)
    for value, guess in {
        "0.5": (),
        "0.5 + 0.1*t**2": ("rate",),
        "0.5 + 0.1*t": ("rate",),
        "0.6": ("angle", "rate"),
        "0.6 + t": ("angle", "rate"),
    }.items():
        assert scene.with_values({"ground_points.P.x": value}).initial["OA"].guess == guess, value
    for rows, guess in (
        ([[0, 0.5], [1, 0.5], [2, 3]], ()),
        ([[0, 0.5], [1, 0.7]], ("rate",)),
        ([[0, 0.4], [1, 0.4]], ("angle", "rate")),
    ):
        table = {"table": rows, "smooth": False}
        assert scene.with_values({"ground_points.P.x": table}).initial["OA"].guess == guess, rows
    with pytest.raises(InputError, match="ground_points"):
        scene.with_values({"ground_points.Q.x": 0.5})


def test_zero_is_a_statement() -> None:
    assert SCENE.initial["OA"].rate is None
    assert SCENE.start("OA").rate == 0.0
    assert SCENE.with_values({"initial.OA.rate": 0.0}).initial["OA"].rate == 0.0


def test_lanes_broadcast_through_the_derived_properties() -> None:
    lengths, heights = np.array([1.0, 1.5, 2.0]), np.array([0.01, 0.02, 0.03])
    scene = SCENE.with_lanes({"bodies.OA.length": lengths, "bodies.OA.height": heights})
    rod = scene.bodies["OA"]
    assert isinstance(rod, Rod)
    np.testing.assert_allclose(rod.mass, 5540 * 0.04 * heights * lengths, rtol=1e-15)
    np.testing.assert_allclose(rod.inertia, rod.mass * lengths**2 / 12, rtol=1e-15)
    np.testing.assert_allclose(rod.bending_stiffness, 2e8 * 0.04 * heights**3 / 12, rtol=1e-15)
    np.testing.assert_array_equal(rod.points["end"][0], lengths)
    assert scene.bodies["AB"] == SCENE.bodies["AB"]
    assert SCENE.bodies["OA"].length == 1.0


def test_lanes_reach_the_initial_state_even_where_the_scene_says_nothing() -> None:
    data = SCENE.model_dump()
    del data["initial"]["AB"]
    lanes = np.array([0.1, 0.2])
    scene = Scene.parse(data).with_lanes({"initial.AB.angle": lanes, "initial.OA.rate": lanes})
    np.testing.assert_array_equal(scene.start("AB").angle, lanes)
    np.testing.assert_array_equal(scene.start("OA").rate, lanes)
    assert scene.start("AB").rate == 0.0


def test_records_are_frozen() -> None:
    with pytest.raises(ValidationError, match="frozen"):
        SCENE.bodies["OA"].length = 2.0  # type: ignore[misc]


numbers = st.floats(min_value=1e-6, max_value=1e6, allow_nan=False)
fractions = st.floats(min_value=1e-6, max_value=1.0)


@given(length=numbers, height=fractions, width=fractions, density=numbers, modulus=numbers)
def test_every_slender_rod_is_accepted_and_weighs_what_its_prism_does(
    length: float, height: float, width: float, density: float, modulus: float
) -> None:
    height, width = height * length, width * length
    rod = Rod(length=length, height=height, width=width, density=density, youngs_modulus=modulus, element="ancf-cable")
    volume = length * height * width
    assert rod.section_at(0.5).area == pytest.approx(height * width, rel=1e-14)
    assert rod.mass == pytest.approx(density * volume, rel=1e-14)
    # A slender rod about its middle: m L^2 / 12; about an end (Steiner): m L^2 / 3.
    assert rod.inertia == pytest.approx(density * volume * length**2 / 12, rel=1e-14)
    assert rod.inertia + rod.mass * rod.centre_of_mass[0] ** 2 == pytest.approx(rod.mass * length**2 / 3, rel=1e-13)
    assert rod.axial_stiffness == pytest.approx(modulus * height * width, rel=1e-14)
    # Second moment of area of a rectangle bent across its height: b h^3 / 12.
    assert rod.bending_stiffness == pytest.approx(modulus * width * height**3 / 12, rel=1e-14)
    assert rod.points == {"start": (0.0, 0.0), "centre": (length / 2, 0.0), "end": (length, 0.0)}
    assert Rod.model_validate_json(rod.model_dump_json()) == rod


@given(mass=numbers, inertia=st.one_of(st.just(0.0), numbers), x=st.floats(-1e3, 1e3), y=st.floats(-1e3, 1e3))
def test_every_rigid_body_is_accepted(mass: float, inertia: float, x: float, y: float) -> None:
    body = RigidBody(mass=mass, inertia=inertia, centre_of_mass=(x, y), named_points={"tip": (y, x)})
    assert body.points == {"start": (0.0, 0.0), "tip": (y, x)}
    assert RigidBody.model_validate_json(body.model_dump_json()) == body


def test_an_element_that_nobody_stated_stays_unstated() -> None:
    data = load_scene("rigid-double-pendulum").model_dump()
    del data["bodies"]["OA"]["element"]
    scene = Scene.parse(data)
    assert scene.with_values({"bodies.OA.height": 0.03}).bodies["OA"].element == "rigid"
    with pytest.raises(InputError, match=r"bodies\.OA: element is missing, and a rigid rod has no elements"):
        scene.with_values({"bodies.OA.elements": 8})
    flexible = {"bodies.OA.elements": 8, "bodies.OA.youngs_modulus": 2e9, "bodies.OA.element": "ancf-cable"}
    assert scene.with_values(flexible).bodies["OA"].element == "ancf-cable"


def test_a_rigid_rod_may_count_its_height() -> None:
    rod = Rod(length=1.0, height=0.3, width=0.1, density=1000.0, rotary_inertia=True)
    assert rod.inertia == pytest.approx(rod.mass * (1.0**2 + 0.3**2) / 12, rel=1e-14)
    tapered = Rod(length=1.0, height=0.2, end_height=0.1, width=0.1, density=1000.0, rotary_inertia=True)
    slender = tapered.model_copy(update={"rotary_inertia": False})
    # The integral of rho w h^3 / 12 over the length, with h = 0.2 - 0.1 x: a mean cube of (0.2^4 - 0.1^4) / 0.4.
    assert tapered.inertia - slender.inertia == pytest.approx(1000 * 0.1 / 12 * (0.2**4 - 0.1**4) / 0.4, rel=1e-13)


def test_ground_needs_no_point_where_only_a_direction_matters() -> None:
    place = {"body": "ground", "point": [0.0, 0.0]}
    rods = {name: {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.03, "density": 7850.0} for name in "AB"}
    pins = {name: {"kind": "revolute", "first": place, "second": {"body": name}} for name in "AB"}

    def scene(ground: dict[str, Any]) -> Scene:
        return Scene.parse(
            {
                "name": "gears",
                "bodies": rods,
                "markers": {"tip": {"body": "B", "point": "end"}},
                "joints": pins
                | {
                    "motor": {"kind": "driven-angle", "first": ground, "second": {"body": "A"}, "angle": "t"},
                    "mesh": {
                        "kind": "gear",
                        "first": {"body": "A"},
                        "second": {"body": "B"},
                        "carrier": ground,
                        "ratio": 2,
                    },
                },
                "loads": {"brake": {"kind": "torque", "at": {"body": "B"}, "torque": 1.0, "reaction": ground}},
            }
        )

    assert scene({"body": "ground"}) == scene(place)


@pytest.mark.parametrize(
    ("path", "why"),
    [
        ("controllers.pid.kp", "controllers are read as signals and states: set signals.pid_kp"),
        ("controllers", "set signals.NAME_kp and the like"),
        ("signals.new", "signals has kp; a new one is stated in the file of the scene"),
        ("states.x", "states has none; a new one is stated in the file of the scene"),
    ],
)
def test_what_cannot_be_set_says_what_can(path: str, why: str) -> None:
    scene = load_scene("single-pendulum").with_values({})
    scene = Scene.parse({**scene.model_dump(mode="json"), "signals": {"kp": 3.0}})
    with pytest.raises(InputError, match=why):
        scene.with_values({path: 1.0})
