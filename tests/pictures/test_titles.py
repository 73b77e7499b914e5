"""Titles are findings: sentences from the numbers that a picture shows."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from shoal.pictures.answer import Answer
from shoal.pictures.landscape import landscape, survey
from shoal.pictures.motion import DrawnMotion
from shoal.pictures.pages import settings
from shoal.pictures.paths import paths
from shoal.pictures.style import canvas, headline, log_ticks
from shoal.pictures.titles import ends, reaches

TIMES = np.linspace(0.0, 2.0, 5)


@pytest.fixture
def motion() -> DrawnMotion:
    """Two markers in one place that go 3 m to the side, and one that goes 0.5 m down."""
    aside = np.stack([1.5 * TIMES, np.zeros(5)], axis=1)
    down = np.stack([np.full(5, 0.25), -0.25 * TIMES], axis=1)
    return DrawnMotion("", TIMES, np.empty((0, 2)), {}, {"A": aside, "B": aside.copy(), "C": down})


def test_a_motion_says_where_it_ends_and_how_far_it_goes(motion: DrawnMotion) -> None:
    assert ends("machine", motion) == "machine: C is at (0.25, −0.5) m after 2 s"
    assert reaches("machine", motion) == "machine: A moves within 3 m in x and 0 m in y in 2 s"


def test_markers_in_one_place_are_one_line(motion: DrawnMotion) -> None:
    figure = paths(motion, reaches("machine", motion))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["A, B", "C"]


def test_a_number_stays_with_its_unit() -> None:
    figure, _ = canvas()
    headline(figure, f"{'x' * 50}: so much is 12 mm")
    assert "12\u00a0mm" in figure.get_suptitle()


@pytest.mark.parametrize(("high", "expected"), [(9e-4, 6), (9.0, 6)])
def test_a_logarithmic_axis_has_labels_that_do_not_touch(high: float, expected: int) -> None:
    figure, axes = canvas()
    axes.set_xscale("log")
    axes.set_xlim(2e-5, high)
    log_ticks(axes)
    figure.canvas.draw()
    boxes = [text.get_window_extent() for text in axes.get_xticklabels() if text.get_text()]
    shown = [box for box in boxes if axes.bbox.x0 <= (box.x0 + box.x1) / 2 <= axes.bbox.x1]
    assert 2 <= len(shown) <= expected
    ordered = sorted(shown, key=lambda box: box.x0)
    assert all(one.x1 < other.x0 for one, other in pairwise(ordered))


def test_a_model_is_told_in_words() -> None:
    bodies = {name: {"element": "rigid"} for name in "abcde"} | {"AB": {"element": "ancf-cable", "elements": 2}}
    told = settings({"step": 1 / 3, "stability_limit": None, "bodies": bodies})
    assert told == "step = 0.333333; 5 bodies: rigid; AB: ancf-cable, 2 elements"


def test_a_rejected_fit_is_not_what_a_parameter_is(rejected: Answer) -> None:
    figure = landscape(rejected, survey(rejected, (0, 1), zoom=True, size=5))
    assert "theta1 fits at" in " ".join(figure.get_suptitle().split())
