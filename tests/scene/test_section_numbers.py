"""Rods whose section is stated by stiffnesses and masses per length move as those with a shape."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import ENGINES
from shoal.errors import InputError
from shoal.identification.problem import Parameter
from shoal.identification.recording.units import unit
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.simulate import simulate
from shoal.scene import Rod, Scene
from shoal.scene.sections import Rectangle
from shoal.scene.shear import slender_share, stouter

H, RHO, E, NU = 0.02, 1000.0, 1e8, 0.3
"""A soft square rod, so that it bends visibly."""
SHAPE: dict[str, Any] = {"height": H, "width": H, "density": RHO}
G = E / (2 * (1 + NU))
SQUARE = Rectangle(H, H)
MASSES = {"rho_A": RHO * SQUARE.area, "rho_I": RHO * SQUARE.bending}
STIFFNESSES = {
    **{"EA": E * SQUARE.area, "EI": E * SQUARE.bending, "GJ": G * SQUARE.torsion},
    "GA": SQUARE.shear(NU) * G * SQUARE.area,
}
NUMBERS: dict[str, Any] = {"section": "numbers", "height": H, **MASSES, **STIFFNESSES}
TIMES = np.linspace(0.0, 0.1, 6)
ELEMENTS = ["rigid", "ancf-cable", "ancf-quintic", "simo-reissner", "modal", "director-rod"]


def pendulum(element: str, section: dict[str, Any], **more: Any) -> Scene:
    rod = {"kind": "rod", "length": 1.0, "element": element, **section, **more}
    if element not in ("rigid", "modal"):
        rod["elements"] = 3
    deep = element == "director-rod"
    held: dict[str, Any] = {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "rod"}}
    return Scene.parse(
        {
            "name": "rod",
            "dimensions": 3 if deep else 2,
            "gravity": [0.0, -9.81, 1.0] if deep else [0.0, -9.81],
            "bodies": {"rod": rod},
            "joints": {"held": held | {"kind": "weld" if deep else "revolute"}},
            "markers": {"end": {"body": "rod", "point": "end"}},
            "solver": {"duration": 0.1, "step": 1e-3, "integrator": "generalized-alpha"},
        }
    )


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_rod_by_numbers_moves_as_its_shape(element: str) -> None:
    shape = SHAPE if element == "rigid" else SHAPE | {"youngs_modulus": E}
    more = {"rotary_inertia": True} if element in ("rigid", "modal") else {}
    there, here = (simulate(pendulum(element, one, **more), TIMES) for one in (shape, NUMBERS))
    assert there.ok
    np.testing.assert_allclose(here.points, there.points, rtol=0, atol=1e-13)
    assert np.ptp(there.points[:, -1]) > 0.01


def cantilever(element: str, **numbers: Any) -> Scene:
    scene = pendulum(element, NUMBERS | numbers).model_dump(mode="json")
    held = {side: scene["joints"]["held"][side] for side in ("first", "second")}
    scene["joints"]["held"] = held | {"kind": "weld"}
    scene["gravity"] = [0.0] * scene["dimensions"]
    scene["bodies"]["rod"] |= {"elements": 8}
    return Scene.parse(scene)


@pytest.mark.parametrize("element", ["ancf-cable", "director-rod"])
def test_a_composite_swings_by_its_bending_stiffness(element: str) -> None:
    """Bernoulli and Euler's cantilever, 1.87510^2 sqrt(EI/rho_A)/(2 pi L^2); no shape of one material."""
    found = modes(cantilever(element, EI=3.0, EI_side=7.0, EA=5e4, GJ=2.0, rho_A=0.7, rho_I=1e-7), count=2).modes
    closed = 1.8751040687119611**2 * np.sqrt(np.array([3.0, 7.0]) / 0.7) / (2 * np.pi)
    for one in closed[: 2 if element == "director-rod" else 1]:
        assert min(abs(mode.frequency / one - 1.0) for mode in found) < 1e-4


def test_a_composite_twists_by_its_torsional_stiffness() -> None:
    """The first frequency of a clamped shaft, sqrt(GJ/(rho_I + rho_I_side))/(4 L)."""
    numbers = {"EI": 300.0, "EA": 5e6, "GJ": 2.0, "rho_A": 0.7, "rho_I": 1e-2, "rho_I_side": 3e-2}
    found = modes(cantilever("director-rod", **numbers), count=8).modes
    closed = np.sqrt(2.0 / 4e-2) / 4
    # Linear shape functions: 8 elements are too stiff by (pi/16)^2/24.
    assert min(abs(mode.frequency / closed - 1.0) for mode in found) < 3e-3


@pytest.mark.parametrize(
    ("element", "numbers", "told"),
    [
        ("rigid", {"rho_A": None}, r"rho_A is missing; element rigid of section numbers needs it \(kg/m\)"),
        ("ancf-cable", {"EI": None}, r"EI is missing; element ancf-cable .* \(N m\^2\)"),
        ("simo-reissner", {"GA": None}, r"GA is missing; element simo-reissner .* \(N\)"),
        ("director-rod", {"GJ": None}, r"GJ is missing; element director-rod"),
        ("director-rod", {"rho_I": None}, r"rho_I is missing; element director-rod"),
        ("ancf-cable", {"width": 0.1}, "width: section numbers has none; state rho_A"),
        ("ancf-cable", {"density": 1.0}, "density: section numbers has none"),
        ("ancf-cable", {"poisson_ratio": 0.2}, "poisson_ratio: section numbers has none"),
        ("ancf-full", {}, "section: ancf-full needs a rectangle"),
        ("ancf-cable", {"EA": -1.0}, "EA: Input should be greater than 0"),
        ("ancf-cable", SHAPE | {"section": "rectangle"}, "rho_A: section rectangle has a shape and a density instead"),
    ],
)
def test_what_numbers_lack_or_do_not_have_is_one_line(element: str, numbers: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        pendulum(element, NUMBERS | numbers)
    with pytest.raises(InputError, match="density is missing"):
        pendulum("rigid", {"height": H, "width": H})


def test_numbers_are_parameters() -> None:
    """A batch over EI runs each lane as its own scene."""
    scene = pendulum("ancf-cable", NUMBERS)
    values = np.array([0.5, 2.0]) * NUMBERS["EI"]
    both = simulate(scene, TIMES, {"bodies.rod.EI": values})
    for lane, value in enumerate(values):
        alone = simulate(scene.with_values({"bodies.rod.EI": value}), TIMES)
        np.testing.assert_allclose(both.points[..., lane], alone.points[..., 0], atol=1e-10)


@pytest.mark.parametrize("element", ["ancf-cable", "director-rod"])
def test_exudyn_takes_numbers_as_it_takes_shapes_and_names_what_is_missing(element: str) -> None:
    engine = ENGINES["exudyn-ge"]()
    shape = pendulum(element, SHAPE | {"youngs_modulus": E})
    there, here = (engine.simulate(scene, TIMES) for scene in (shape, pendulum(element, NUMBERS)))
    np.testing.assert_allclose(here.points, there.points, rtol=0, atol=1e-9)
    with pytest.raises(InputError, match="exudyn-ge needs GA of every flexible rod of section numbers"):
        engine.simulate(pendulum(element, NUMBERS | {"GA": None}), TIMES)


def test_a_slender_rod_leaves_out_what_its_numbers_say() -> None:
    """Timoshenko's first-order share of a sine over the length, pi^2/L^2 (EI/GA + rho_I/rho_A)."""
    rod = pendulum("ancf-cable", NUMBERS | {"EI": 3.0, "GA": 400.0, "rho_I": 1e-3, "rho_A": 0.7}).flexible_rods["rod"]
    assert slender_share(rod) == pytest.approx(np.pi**2 * (3.0 / 400.0 + 1e-3 / 0.7), rel=1e-12)


def test_a_rigid_rod_without_rotary_inertia_needs_its_mass_only() -> None:
    rigid = pendulum("rigid", {"section": "numbers", "height": H, "rho_A": 0.7})
    rod = rigid.bodies["rod"]
    assert isinstance(rod, Rod)
    assert (rod.mass, rod.inertia) == pytest.approx((0.7, 0.7 / 12), rel=1e-14)
    stout = stouter(rigid)
    assert stout is not None
    turning = stout.bodies["rod"]
    assert isinstance(turning, Rod)
    assert turning.inertia == pytest.approx(0.7 / 12 * (1 + H**2), rel=1e-12)
    with pytest.raises(InputError, match="rho_I is missing; in space a rigid rod"):
        rigid.with_values({"dimensions": 3, "gravity": [0.0, 0.0, 0.0]})


def test_stiffnesses_have_units_and_are_fitted_by_their_order_of_magnitude() -> None:
    assert [unit(f"bodies.rod.{name}") for name in ("rho_A", "rho_I_side", "EA", "EI", "GJ", "GA")] == [
        *("kg/m", "kg m"),
        *("N", "N m²", "N m²", "N"),
    ]
    assert Parameter(path="bodies.rod.EI", lower=1.0, upper=10.0).logarithmic


def test_the_error_of_neglected_shear_is_not_known_without_its_numbers() -> None:
    import shoal

    without = {key: value for key, value in NUMBERS.items() if key not in ("GA", "rho_I")}
    found, known = (shoal.simulate(pendulum("ancf-cable", section), TIMES) for section in (without, NUMBERS))
    assert found.errors.estimates["theory"] is None
    assert "error-not-estimated" in found.codes
    assert "bodies.rod.GA, bodies.rod.rho_I" in found.message
    assert known.errors.estimates["theory"] is not None
