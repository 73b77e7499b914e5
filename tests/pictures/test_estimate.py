"""The pictures of one identification say what its numbers say, for one recording and for several with gaps."""

from __future__ import annotations

import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from shoal.identification.conclude import Options
from shoal.identification.design import design
from shoal.identification.identify import identify
from shoal.identification.problem import Problem
from shoal.pictures import files
from shoal.pictures.answer import Answer
from shoal.pictures.correlations import strongest
from shoal.pictures.design import design as draw_design
from shoal.pictures.design import shown
from shoal.pictures.gallery import gallery, motions
from shoal.pictures.gif import gif
from shoal.pictures.landscape import landscape, survey
from shoal.pictures.motion import motion
from shoal.pictures.numbers import handy
from shoal.pictures.overlay import follows, overlay
from shoal.pictures.profiles import profiles
from shoal.pictures.residuals import autocorrelation, residuals, white
from shoal.pictures.signals import gaps, signals, worst
from shoal.pictures.style import png
from shoal.pictures.waterfall import waterfall


@pytest.mark.slow
def test_every_picture_is_drawn_without_warnings_labelled_and_described(several: Answer) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        drawn = gallery(several, motions(several))
        for one in drawn:
            assert png(one.figure).startswith(b"\x89PNG")
    names = [one.name for one in drawn]
    assert len(set(names)) == len(names)
    assert {
        "overlay",
        "poses",
        "residuals",
        "convergence",
        "landscape",
        "landscape-zoom",
        "correlations",
        "posterior",
    } <= set(names)
    for one in drawn:
        assert one.figure.get_suptitle()
        assert len(one.alt) > 30
        assert len(one.caption) > 15
        if one.name != "correlations":
            assert any(axes.get_xlabel() for axes in one.figure.axes)


def test_signals_cover_every_channel_and_know_their_gaps(several: Answer) -> None:
    found = signals(several.estimate)
    assert [s.name for s in found][-2:] == ["low: x of B", "low: y of B"]
    assert len(found) == 5
    (gap,) = gaps(found[0])
    times = several.estimate.measurement.recordings["high"].times
    assert gap == (times[19], times[30])
    assert gaps(found[1]) == []
    assert all(s.rms == pytest.approx(0.003, rel=0.3) for s in found)
    spoilt = replace(found[2], fitted=found[2].fitted + 1.0)
    assert worst([*found[:2], spoilt, *found[3:]], 1) == [spoilt]


def test_the_gap_shows_and_six_panels_are_enough(several: Answer) -> None:
    figure = overlay(several.estimate)
    assert len(figure.axes) == 5
    assert [len(axes.patches) for axes in figure.axes] == [1, 0, 0, 0, 0]
    assert "2.9 mm and" in follows(several.estimate)


def test_no_line_crosses_a_window_that_was_held_out(several: Answer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its samples are not fitted, and a chord over it looked like the model."""
    whole = signals(several.estimate)[1]
    kept = np.flatnonzero((np.arange(len(whole.times)) < 5) | (np.arange(len(whole.times)) > 9))
    cut = replace(whole, **{name: getattr(whole, name)[kept] for name in ("times", "measured", "fitted")})
    monkeypatch.setattr("shoal.pictures.overlay.signals", lambda _: [cut])
    (axes,) = overlay(several.estimate, "cut").axes
    times, model = (np.asarray(values, dtype=float) for values in axes.lines[1].get_data())
    assert np.flatnonzero(np.isnan(times)).tolist() == np.flatnonzero(np.isnan(model)).tolist() == [5]
    np.testing.assert_array_equal(times[~np.isnan(times)], cut.times)


def test_autocorrelation_of_known_noise() -> None:
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(20_000)
    coloured = np.zeros_like(noise)
    for k in range(1, len(noise)):
        coloured[k] = 0.8 * coloured[k - 1] + noise[k]
    coloured[rng.integers(0, len(noise), 500)] = np.nan
    assert autocorrelation(coloured)[:4] == pytest.approx(0.8 ** np.arange(4), abs=0.03)
    assert np.all(np.abs(autocorrelation(noise)[1:]) < 0.03)


@pytest.mark.slow
def test_words_tell_noise_from_what_the_model_lacks(flexible: Answer, several: Answer) -> None:
    """One source: the picture says what the tests of the verdict say."""
    assert "none, like white noise" in white(several.estimate)
    # The coarse mesh leaves a wave.
    for answer in (several, flexible):
        assert answer.estimate.residual_tests.correlation in white(answer.estimate)
    assert not flexible.estimate.residual_tests.correlation.startswith("none")
    assert [axes.get_ylabel() for axes in residuals(several.estimate).axes][1] == "autocorrelation"


def test_waterfall_orders_the_ends_of_searches(flexible: Answer) -> None:
    estimate = flexible.estimate
    assert estimate.minima
    (line, *_) = waterfall(estimate).axes[0].lines
    values = np.asarray(line.get_ydata())
    assert values[0] == estimate.fitness
    assert np.all(np.diff(values) >= 0)


def test_the_landscape_is_lowest_at_the_answer(flexible: Answer) -> None:
    found = survey(flexible, (0, 1), zoom=True, size=11)
    row, column = np.unravel_index(int(np.argmin(found.fitness)), found.fitness.shape)
    steps = [axis[1] - axis[0] for axis in (found.first, found.second)]
    assert abs(found.first[row] - flexible.point[0]) <= steps[0]
    assert abs(found.second[column] - flexible.point[1]) <= steps[1]
    figure = landscape(flexible, found)
    assert figure.axes[0].get_xlabel() == "theta1 [rad]"


def test_landscapes_do_not_count_as_evaluations(flexible: Answer) -> None:
    before = flexible.model.counter.evaluations
    survey(flexible, (0, 1), size=5)
    assert flexible.model.counter.evaluations == before == 0


def test_correlations_are_those_of_a_jacobian(several: Answer) -> None:
    found = several.correlation
    assert np.allclose(np.diag(found), 1.0)
    assert np.all(np.abs(found) <= 1 + 1e-9)
    one, other = strongest(several)
    off = np.abs(found - np.eye(len(found)))
    assert abs(found[one, other]) == pytest.approx(off.max())


def test_profiles_are_drawn_where_wished_for(flexible: Answer) -> None:
    estimate = identify(flexible.problem, measurement=flexible.estimate.measurement, options=Options(profiles=True))
    figure = profiles(estimate, flexible.problem)
    assert [axes.get_xlabel() for axes in figure.axes] == ["theta1 [rad]", "theta2 [rad]"]
    assert "bound every parameter" in figure.get_suptitle()


def test_motion_puts_model_and_measurement_into_one_frame(several: Answer) -> None:
    """Clock, tilt and place of the camera are undone: the marker stays within noise of what was measured."""
    found = motion(several, "low", frames=51)
    recording = several.estimate.measurement.recordings["low"]
    assert found.times[-1] == recording.times[-1]
    assert np.nanmax(np.abs(found.markers["B"] - found.measured["B"])[1:]) < 5 * 0.003
    # The body that carries the marker ends there, though the motion runs twice as fast as the recorded time.
    assert np.allclose(found.outlines["AB"][:, -1], found.markers["B"], atol=1e-12)


def test_bending_shows(flexible: Answer) -> None:
    outline = motion(flexible, "recording", frames=5).outlines["AB"][-1]
    chord = outline[-1] - outline[0]
    off = (outline - outline[0]) @ np.array([-chord[1], chord[0]]) / np.linalg.norm(chord)
    assert np.max(np.abs(off)) > 0.05 * np.linalg.norm(chord)


def test_gif_moves(several: Answer) -> None:
    moving = gif(motion(several, "high", frames=60), "title")
    assert moving.startswith(b"GIF89a")
    assert moving.count(b"\x21\xf9\x04") == 60
    assert len(moving) < 500_000


@pytest.mark.parametrize(("size", "text"), [(2.0, "m"), (2e-4, "mm"), (3e-8, "nm"), (5e-5, "µm")])
def test_units_without_zeros(size: float, text: str) -> None:
    factor, unit = handy(size, "m")
    assert unit == text
    assert 0.1 <= factor * size < 1000


def test_a_design_is_drawn(flexible: Answer) -> None:
    found = design(flexible.problem, noise=0.002, angle_noise=0.005, at={"theta1": 0.78, "theta2": 0.52})
    figure = draw_design(found)
    assert f"measure {found.ranked[0][0].label}" in figure.get_suptitle()
    assert all(axes.get_xlabel() for axes in figure.axes)


@pytest.mark.slow
def test_a_design_is_a_page_that_shows_the_best_sensor_of_every_kind(flexible: Answer, tmp_path: Path) -> None:
    sizes = {"acceleration": 0.05, "rate": 0.005, "strain": 1e-6}
    found = design(flexible.problem, noise=0.002, sensor_noise=sizes, at={"theta1": 0.78, "theta2": 0.52})
    kinds = {sensor.quantity for sensor, _ in found.ranked}
    assert kinds >= {"position", "imu", "strain"}
    assert {found.ranked[k][0].quantity for k in shown(found)} == kinds
    files.design(found, tmp_path / "design.html")
    page = (tmp_path / "design.html").read_text(encoding="utf-8")
    assert all(sensor.label in page for sensor, _ in found.ranked)
    assert "http://" not in page.replace("http://www.w3.org", "")


def test_a_machine_measured_by_load_cells_alone_is_shown(tmp_path: Path) -> None:
    """No channel names a marker; the page of such an identification was an IndexError."""
    problem = Problem.model_validate(
        {
            "name": "cell",
            "scene": "single-pendulum",
            "parameters": {"angle": {"path": "initial.OA.angle", "lower": -0.5, "upper": 0.5}},
            "channels": [{"joint": "O", "quantity": "fx"}, {"joint": "O", "quantity": "fy"}],
            "source": {"kind": "engine", "engine": "gauss", "stop": 0.5, "count": 20},
        }
    )
    found = motion(Answer(problem, identify(problem, method="least-squares")), "recording")
    assert list(found.markers) == ["A"]
    assert np.isfinite(found.markers["A"]).all()
