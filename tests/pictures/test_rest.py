"""A machine at rest is drawn where its forces balance, over where it was placed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image
from shoal.cli import main
from shoal.engines import get_engine
from shoal.mechanics.analysis.statics import statics
from shoal.pictures.motion import scene_motion
from shoal.pictures.rest import rest, rest_motion
from shoal.scene import load_scene


@pytest.mark.parametrize(
    "name",
    [
        *["flexible-double-pendulum", "bricard", "flexible-slider-crank", "ibm-double-pendulum"],
        pytest.param("swinging-strip", marks=pytest.mark.slow),
    ],
)
@pytest.mark.by_day(2)
def test_two_frames_are_the_start_and_the_equilibrium(name: str) -> None:
    """The first is that of the time loop, the second has its markers where statics finds them."""
    scene = load_scene(name)
    found = statics(scene)
    shown = rest_motion(found)
    moving = scene_motion(scene, get_engine("gauss"), 1e-4, frames=2)
    assert shown.outlines.keys() == scene.bodies.keys()
    for body, outline in shown.outlines.items():
        np.testing.assert_allclose(outline[0], moving.outlines[body][0], atol=1e-9)
    for marker in scene.markers:
        np.testing.assert_allclose(shown.markers[marker][0], moving.markers[marker][0], atol=1e-9)
        np.testing.assert_allclose(shown.markers[marker][1], found.marker(marker), atol=1e-12)


def test_a_pendulum_hangs_and_its_title_says_where() -> None:
    title = " ".join(rest(statics(load_scene("rigid-double-pendulum"))).get_suptitle().split())
    assert title == "rigid-double-pendulum: at rest B is at (0, -3) m"


def test_what_nothing_holds_is_not_to_be_trusted(tmp_path: Path) -> None:
    """The picture is written, as the numbers are printed, and both say so."""
    found = statics(load_scene("heavy-top"))
    assert "nothing-holds: not to be trusted" in rest(found).get_suptitle()
    out = tmp_path / "rest.png"
    told = CliRunner().invoke(main, ["statics", "heavy-top", "--out", str(out)])
    assert told.exit_code == 3
    with Image.open(out) as picture:
        assert picture.width > 300
