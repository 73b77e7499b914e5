"""The damping of a compliant contact that gives back a part of the rate."""

from __future__ import annotations

import pytest
from shoal.scene.contact_law import loss_of


@pytest.mark.parametrize("restitution", [1.0, 0.9, 0.5, 0.1, 0.02, 1e-3])
def test_the_damping_of_a_restitution_is_positive_and_below_its_inverse(restitution: float) -> None:
    """Of a small one the root of its equation is 1 / e within round-off."""
    assert 0.0 <= loss_of(restitution) <= 1.0 / restitution
    assert restitution > 0.02 or loss_of(restitution) == pytest.approx(1.0 / restitution)
