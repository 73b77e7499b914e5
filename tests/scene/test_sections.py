"""Sections of rods by name, against their integrals, published tables, and the frequencies of rods that have them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.scene import Scene
from shoal.scene.sections import SECTIONS, IBeam, Rectangle, Round, Section, Tube

EXAMPLES = [Rectangle(0.03, 0.05), Round.of(0.04, None, None, None, None), Tube(0.04, 0.04, 0.006),
            IBeam(0.2, 0.1, 0.0056, 0.0085)]  # fmt: skip


def inside(section: Section, y: Any, z: Any) -> Any:
    """Whether a place lies in the section, by its shape."""
    if isinstance(section, Tube):
        radius = np.hypot(y, z)
        return (radius <= section.height / 2) & (radius >= section.height / 2 - section.wall)
    whole = (np.abs(y) <= section.height / 2) & (np.abs(z) <= section.width / 2)
    if isinstance(section, IBeam):
        return whole & ((np.abs(z) <= section.web / 2) | (np.abs(y) >= section.height / 2 - section.flange))
    return whole


@pytest.mark.parametrize("section", EXAMPLES, ids=lambda one: type(one).__name__)
def test_area_and_moments_are_the_integrals_of_the_shape(section: Section) -> None:
    y, z = ((np.arange(2000) + 0.5) / 2000 - 0.5 for _ in range(2))
    y, z = np.meshgrid(y * section.height, z * section.width)
    cell = section.height * section.width / y.size
    within = inside(section, y, z)
    assert section.area == pytest.approx(cell * within.sum(), rel=2e-3)
    assert section.bending == pytest.approx(cell * np.sum(y**2 * within), rel=2e-3)
    assert section.side == pytest.approx(cell * np.sum(z**2 * within), rel=2e-3)


def test_every_name_has_an_example() -> None:
    assert {type(one) for one in EXAMPLES} == {*SECTIONS.values()}


def test_torsion_constants_are_those_of_the_tables() -> None:
    """J/(a b^3) of Timoshenko and Goodier's table, and a thin strip's third of the cube of its thickness."""
    for ratio, tabled in ((1.0, 0.1406), (1.5, 0.196), (2.0, 0.229), (3.0, 0.263), (5.0, 0.291), (10.0, 0.312)):
        assert Rectangle(2.0 * ratio, 2.0).torsion == pytest.approx(16.0 * ratio * tabled, rel=3e-3)
    assert Rectangle(1.0, 1e-3).torsion == pytest.approx(1e-9 / 3 * (1 - 0.63025e-3), rel=1e-6)
    # A circle's is its polar moment, pi d^4/32; a thin tube's 2 pi r^3 t (Bredt).
    assert Round.of(0.02, None, None, None, None).torsion == pytest.approx(np.pi * 0.02**4 / 32, rel=1e-14)
    assert Tube(2.001, 2.001, 0.001).torsion == pytest.approx(2 * np.pi * 1e-3, rel=1e-3)


def test_coefficients_of_shear_are_cowpers() -> None:
    """At nu = 0.3: rectangle 0.850, circle 0.886, thin tube 0.531; an I without flanges is a rectangle."""
    for section, tabled in ((EXAMPLES[0], 0.850), (EXAMPLES[1], 0.886), (Tube(1.0, 1.0, 1e-4), 0.531)):
        assert section.shear(0.3) == pytest.approx(tabled, abs=1e-3)
    assert IBeam(0.2, 0.1, 0.005, 1e-9).shear(0.3) == pytest.approx(EXAMPLES[0].shear(0.3), rel=1e-5)


def test_a_section_may_lie_and_may_vary_by_lane() -> None:
    heights, widths = np.array([0.02, 0.04, 0.03]), np.array([0.04, 0.02, 0.03])
    found = Rectangle(heights, widths).torsion
    assert found[0] == found[1]
    singles = [Rectangle(height, width).torsion for height, width in zip(heights, widths, strict=True)]
    np.testing.assert_allclose(found, singles, rtol=1e-14)


def cantilever(element: str, **section: Any) -> Scene:
    rod = {"kind": "rod", "length": 1.0, "density": 7800.0, "youngs_modulus": 2.1e11, "element": element, "elements": 8}
    return Scene.parse(
        {
            "name": "cantilever",
            "dimensions": 3 if element == "director-rod" else 2,
            "gravity": [0.0, 0.0],
            "bodies": {"rod": rod | section},
            "joints": {"clamp": {"kind": "weld", "first": {"body": "ground", "point": [0.0, 0.0]},
                                 "second": {"body": "rod"}}},
            "markers": {"end": {"body": "rod", "point": "end"}},
        }
    )  # fmt: skip


SAID = {
    "round": ({"height": 0.02}, np.pi / 64 * 0.02**4, np.pi / 4 * 0.02**2),
    "tube": ({"height": 0.02, "wall": 0.002}, np.pi / 64 * (0.02**4 - 0.016**4), np.pi / 4 * (0.02**2 - 0.016**2)),
    "i-beam": (
        {"height": 0.02, "width": 0.01, "web": 0.001, "flange": 0.002},
        (0.01 * 0.02**3 - 0.009 * 0.016**3) / 12,
        2 * 0.01 * 0.002 + 0.016 * 0.001,
    ),
}


@pytest.mark.parametrize(
    "element", ["ancf-cable", "ancf-quintic", pytest.param("director-rod", marks=pytest.mark.slow)]
)
@pytest.mark.parametrize("name", list(SAID))
def test_a_cantilever_swings_as_its_section_tells(name: str, element: str) -> None:
    """The first frequency of Bernoulli and Euler's cantilever, 1.87510^2 sqrt(EI/(rho A))/(2 pi L^2)."""
    fields, moment, area = SAID[name]
    found = modes(cantilever(element, section=name, **fields), count=2).modes
    closed = 1.8751040687119611**2 * np.sqrt(2.1e11 * moment / (7800.0 * area)) / (2 * np.pi)
    # A director rod's sections have rotary inertia, an error of the order (height / length)^2.
    slack = 2e-5 if element != "director-rod" else 2e-3
    assert min(np.abs([mode.frequency / closed - 1.0 for mode in found])) < slack


def test_a_rigid_tube_has_its_mass_and_its_inertia_about_its_axis() -> None:
    machine = cantilever("rigid", section="tube", height=0.02, wall=0.002, youngs_modulus=None, elements=1)
    assert machine.bodies["rod"].mass == pytest.approx(7800.0 * SAID["tube"][2], rel=1e-14)


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ({"height": 0.02}, "width is missing; section rectangle needs it"),
        ({"height": 0.02, "section": "tube"}, "wall is missing; section tube needs it"),
        ({"height": 0.02, "width": 0.02, "section": "round"}, "width: section round has none"),
        ({"height": 0.02, "section": "tube", "wall": 0.011}, "wall 0.011 m is more than half the diameter"),
        ({"height": 0.02, "section": "tube", "wall": 0.009, "end_height": 0.01}, "wall 0.009 m is more than half"),
        ({"height": 0.02, "section": "round", "end_width": 0.01}, "end_width: section round has no width"),
        ({"height": 0.02, "section": "i-beam", "width": 0.01, "web": 0.001, "flange": 0.01}, "leave nothing"),
        ({"height": 0.02, "section": "i-beam", "width": 0.01, "web": 0.02, "flange": 0.001}, "thicker than the width"),
        (
            {"height": 0.02, "section": "pipe"},
            "section: Input should be 'rectangle', 'round', 'tube', 'i-beam' or 'numbers'",
        ),
    ],
)
def test_what_no_section_can_be_is_one_line(fields: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        cantilever("ancf-cable", **fields)


def test_ancf_full_knows_rectangles_only() -> None:
    with pytest.raises(InputError, match="that of ancf-full is a rectangle, found round; use simo-reissner"):
        cantilever("ancf-full", height=0.02, section="round")
