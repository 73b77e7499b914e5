"""What another engine computed is not computed again, unless anything that it depends on is different."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shoal.identification.recording import computed
from shoal.scene import load_scene

SCENE = load_scene("single-pendulum")
TIMES = np.array([0.1, 0.2])


class Engine:
    """Counts how often it is asked to compute."""

    def __init__(self) -> None:
        self.runs = 0

    def __call__(self) -> np.ndarray:
        self.runs += 1
        return np.array([[1.0, np.nextafter(2.0, 3.0)]])


@pytest.fixture(autouse=True)
def own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))
    return tmp_path


def test_the_same_is_computed_once_and_comes_back_to_the_last_bit() -> None:
    engine = Engine()
    first, second = (computed.kept("exudyn", SCENE, TIMES, "x", engine) for _ in range(2))
    assert engine.runs == 1
    assert np.array_equal(first, second)


def test_whatever_it_depends_on_makes_it_another_one(monkeypatch: pytest.MonkeyPatch) -> None:
    engine = Engine()
    computed.kept("exudyn", SCENE, TIMES, "x", engine)
    computed.kept("casadi", SCENE, TIMES, "x", engine)
    computed.kept("exudyn", SCENE.with_values({"solver.step": 1e-4}), TIMES, "x", engine)
    computed.kept("exudyn", SCENE, 2 * TIMES, "x", engine)
    computed.kept("exudyn", SCENE, TIMES, "y", engine)
    monkeypatch.setattr(computed, "_program", lambda: ("a later one",))
    computed.kept("exudyn", SCENE, TIMES, "x", engine)
    assert engine.runs == 6


@pytest.mark.parametrize("engine_name", ["gauss", "http://127.0.0.1:1"])
def test_what_may_change_unseen_is_not_kept(engine_name: str, own_state: Path) -> None:
    engine = Engine()
    for _ in range(2):
        computed.kept(engine_name, SCENE, TIMES, "x", engine)
    assert engine.runs == 2
    assert not (own_state / "data").exists()


def test_a_damaged_file_is_as_good_as_none(own_state: Path) -> None:
    engine = Engine()
    computed.kept("exudyn", SCENE, TIMES, "x", engine)
    (file,) = (own_state / "data").iterdir()
    for damage in (b"", file.read_bytes()[:-3], b"nonsense"):
        file.write_bytes(damage)
        computed.kept("exudyn", SCENE, TIMES, "x", engine)
    assert engine.runs == 4


def test_failures_are_not_kept(own_state: Path) -> None:
    def fail() -> np.ndarray:
        raise ValueError("no motion")

    with pytest.raises(ValueError, match="no motion"):
        computed.kept("exudyn", SCENE, TIMES, "x", fail)
    assert not (own_state / "data").exists()
