"""Machines side by side that differ in where their joints are: each starts as it would alone."""

import numpy as np
import pytest
from shoal.mechanics.start.start import started
from shoal.scene import load_scene


@pytest.mark.parametrize(("path", "stated"), [("joints.A1.first.point.0", 1.0), ("joints.A0.first.point.1", 0.0)])
def test_rates_that_depend_on_each_other(path: str, stated: float) -> None:
    """Three stated rates of two closed loops."""
    scene = load_scene("n-four-bar-2")
    values = stated + np.array([0.0, 0.01, 0.02])
    found = started(scene.with_lanes({path: values}))
    assert not np.any(found.failed)
    for lane, value in enumerate(values):
        alone = started(scene.with_lanes({path: np.array([value])})).scene
        for body in scene.bodies:
            for quantity in ("angle", "rate"):
                one, other = (getattr(s.initial[body], quantity) for s in (found.scene, alone))
                assert one[lane] == pytest.approx(other[0], abs=1e-12)
