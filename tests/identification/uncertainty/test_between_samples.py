"""What a drive does between its samples is in the intervals: nobody measured it, and no residual need show it."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from shoal.identification import Estimate, Problem, identify
from shoal.identification.uncertainty.uncertain_inputs import Given, between_samples, finer_of
from shoal.scene.function import Function

MASS, STIFFNESS, DAMPING, END = 0.5, 0.5 * (2 * np.pi * 17.0) ** 2, 2.0, 2.0
CYCLES = np.array([3.1, 7.3, 11.2, 14.9, 17.4, 19.5])
SIZES = np.array([2.0, -1.0, 3.0, 1.5, -2.0, 1.0])


def force(times: np.ndarray) -> np.ndarray:
    return np.sin(2 * np.pi * np.outer(times, CYCLES) + np.arange(6.0)) @ SIZES


def place(times: np.ndarray) -> np.ndarray:
    """Of a mass on a spring at rest at first, under the force: every line's own answer, and the free swing."""
    turns = 2 * np.pi * CYCLES
    line = SIZES * np.exp(1j * np.arange(6.0)) / (STIFFNESS - MASS * turns**2 + 1j * DAMPING * turns)
    rate = DAMPING / (2 * MASS)
    own = np.sqrt(STIFFNESS / MASS - rate**2)
    begin, speed = -np.sum(line.imag), -np.sum((1j * turns * line).imag)
    free = begin * np.cos(own * times) + (speed + rate * begin) / own * np.sin(own * times)
    return (np.exp(1j * np.outer(times, turns)) @ line).imag + np.exp(-rate * times) * free


def fitted(folder: Path, rate: float, smooth: bool = True, noise: float | None = None) -> Estimate:
    """Stiffness, damping and mass of it, of a force and places that were recorded so many times a second."""
    times = np.arange(0.0, END, 1.0 / rate)
    seen = place(times) + 2e-5 * np.random.default_rng(2).standard_normal(len(times))
    table = np.column_stack([times, force(times), seen])
    np.savetxt(folder / "run.csv", table, delimiter=",", header="t,force,x", comments="")
    ground = {"body": "ground", "point": [0.0, 0.0]}
    spring = {"first": {"body": "ground", "point": [-0.3, 0.0]}, "second": {"body": "M"}, "length": 0.3}
    drive = {"path": "run.csv", "column": "force", "smooth": smooth}
    scene = {
        "name": "driven",
        "gravity": [0.0, 0.0],
        "bodies": {"M": {"kind": "point-mass", "mass": MASS}},
        "joints": {"rail": {"kind": "slider", "first": ground, "second": {"body": "M"}}},
        "loads": {
            "spring": {"kind": "spring", **spring, "stiffness": STIFFNESS, "damping": DAMPING},
            "motor": {"kind": "force", "at": {"body": "M"}, "force": [1.0, 0.0], "scale": drive},
        },
        "markers": {"M": {"body": "M"}},
        "solver": {"duration": END},
    }  # fmt: skip
    (folder / "driven.yaml").write_text(yaml.safe_dump(scene))
    paths = {"stiffness": "loads.spring.stiffness", "damping": "loads.spring.damping", "mass": "bodies.M.mass"}
    truth = {"stiffness": STIFFNESS, "damping": DAMPING, "mass": MASS}
    stated = {
        "name": "driven",
        "scene": str(folder / "driven.yaml"),
        "parameters": {k: {"path": p, "lower": truth[k] / 4, "upper": 4 * truth[k]} for k, p in paths.items()},
        "channels": [{"marker": "M", "quantity": "x", "column": "x"}],
        "source": {"kind": "file", "path": str(folder / "run.csv")},
        "method": "least-squares",
    }
    return identify(Problem.parse(stated if noise is None else {**stated, "noise": noise}, "driven"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("smooth", "noise"),
    [(True, 2e-5), *(pytest.param(*one, marks=pytest.mark.slow) for one in ((True, None), (False, None)))],
)
def test_intervals_hold_the_truth_though_the_drive_was_sampled_coarsely(
    tmp_path: Path, smooth: bool, noise: float | None
) -> None:
    """By splines 50 samples a second of 19.5 Hz make the stiffness 7 % too small, by straight lines 25 %."""
    found = fitted(tmp_path, 50.0, smooth, noise)
    assert found.verdict.trusted
    for name, true in {"stiffness": STIFFNESS, "damping": DAMPING, "mass": MASS}.items():
        assert found.parameters[name].lower < true < found.parameters[name].upper
    assert "of loads.motor.scale" in found.message
    assert "sample the drive more finely" in found.message
    assert ("motion-not-resolved" in found.codes) == (noise is None)


def test_a_drive_that_is_sampled_finely_widens_nothing(tmp_path: Path) -> None:
    found = fitted(tmp_path, 500.0)
    assert found.parameters["stiffness"].upper - found.parameters["stiffness"].lower < 2e-3 * STIFFNESS
    assert not found.findings


@pytest.mark.parametrize(("smooth", "power"), [(True, 4), (False, 2)])
def test_the_error_of_a_table_falls_by_its_order(smooth: bool, power: int) -> None:
    times = [np.arange(0.0, 2.0, step) for step in (0.02, 0.01)]
    tables = [Function(table=np.column_stack([t, np.sin(9.0 * t)]).tolist(), smooth=smooth) for t in times]
    fine = np.linspace(0.3, 1.7, 5001)
    for table in tables:
        finer, _ = finer_of(table) or (None, 0.0)
        assert finer is not None
        assert np.allclose(
            finer(fine), np.sin(9.0 * fine), atol=0.05 * np.max(np.abs(table(fine) - np.sin(9.0 * fine)))
        )
    sizes = [np.sqrt(np.mean((table(fine) - finer_of(table)[0](fine)) ** 2)) for table in tables]  # type: ignore[index]
    assert np.log2(sizes[0] / sizes[1]) == pytest.approx(power, abs=0.2)


def test_a_jump_gives_no_impulse_and_nothing_goes_beyond_the_samples_about_it() -> None:
    times = np.arange(0.0, 1.0, 0.01)
    for smooth in (True, False):
        jump = Function(table=np.column_stack([times, times > 0.495]).tolist(), smooth=smooth)
        finer, size = finer_of(jump) or (None, np.inf)
        assert finer is not None
        off = finer(np.linspace(0.0, 0.99, 9901)) - jump(np.linspace(0.0, 0.99, 9901))
        assert abs(np.mean(off)) < 1e-4
        assert np.max(np.abs(off)) < 0.2
        assert size < 0.02


def test_tables_by_hand_are_what_they_say() -> None:
    corners = np.repeat(np.arange(12.0), 2)[1:] + np.tile([0.0, 1e-6], 12)[1:]
    assert finer_of(Function(table=np.column_stack([corners, corners % 2 > 0.5]).tolist(), smooth=False)) is None
    assert finer_of(Function(table=[(0.0, 0.0), (1.0, 2.0), (2.0, 1.0)])) is None


@pytest.mark.parametrize("one_of_many", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_a_residual_is_no_less_systematic_for_what_a_drive_might_have_done(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, one_of_many: bool
) -> None:
    """What is left of one choice among many may be larger than the residual, and then says nothing of it."""

    def between(*known: Any) -> Given | None:
        found = between_samples(*known)
        return None if found is None else replace(found, moved=9.0 * found.moved, one_of_many=one_of_many)

    monkeypatch.setattr("shoal.identification.uncertainty.uncertain_inputs.between_samples", between)
    tests = fitted(tmp_path, 50.0).residual_tests
    assert (tests.excess > 0.5 * tests.size) == one_of_many
