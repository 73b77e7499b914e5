"""The section of a rod in space."""

from __future__ import annotations

import numpy as np
import pytest
from shoal.mechanics.elements.section import torsion_constant


def test_torsion_constants_are_those_of_the_tables() -> None:
    """J/(a b^3) of Timoshenko and Goodier's table, and a thin strip's third of the cube of its thickness."""
    for ratio, tabled in ((1.0, 0.1406), (1.5, 0.196), (2.0, 0.229), (3.0, 0.263), (5.0, 0.291), (10.0, 0.312)):
        assert torsion_constant(2.0 * ratio, 2.0) == pytest.approx(16.0 * ratio * tabled, rel=3e-3)
    assert torsion_constant(1.0, 1e-3) == pytest.approx(1e-9 / 3 * (1 - 0.63025e-3), rel=1e-6)


def test_a_section_may_lie_and_may_vary_by_lane() -> None:
    heights, widths = np.array([0.02, 0.04, 0.03]), np.array([0.04, 0.02, 0.03])
    found = torsion_constant(heights, widths)
    assert found[0] == found[1]
    singles = [torsion_constant(height, width) for height, width in zip(heights, widths, strict=True)]
    np.testing.assert_allclose(found, singles, rtol=1e-14)
