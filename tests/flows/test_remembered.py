"""A study that was killed computes only what is missing, and ends as if nothing had happened."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.identification import Measurement
from shoal_flows import fingerprint, jobs, remembered, workers
from shoal_flows.jobs import Cell

SEEDS = (0, 1, 2, 3)
STUDY = """
import sys
from shoal_flows import fingerprint, jobs, remembered, workers
from shoal_flows.jobs import Cell

workers.run = lambda function, *arguments: function(*arguments)
measurement = jobs.measured("paper-case-1")
for seed in (0, 1, 2, 3):
    cell = Cell("paper-case-1", "least-squares", seed)
    remembered.run(fingerprint.of_cell(cell, measurement), jobs.fit, cell, measurement)
    print(seed, flush=True)
    sys.stdin.readline()
"""


@pytest.fixture
def computed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Any]:
    """Whatever is really computed, in this process, with nothing kept from before."""
    done: list[Any] = []

    def run(function: Any, *arguments: Any) -> Any:
        done.append(arguments[0])
        return function(*arguments)

    monkeypatch.setattr(workers, "run", run)
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))
    return done


def fits(measurement: Measurement) -> list[jobs.Fit]:
    cells = [Cell("paper-case-1", "least-squares", seed) for seed in SEEDS]
    return [remembered.run(fingerprint.of_cell(cell, measurement), jobs.fit, cell, measurement) for cell in cells]


@pytest.mark.slow
def test_a_killed_study_goes_on_where_it_was(computed: list[Any], measurement: Measurement) -> None:
    command = [sys.executable, "-c", STUDY]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as study:
        assert study.stdin is not None
        assert study.stdout is not None
        for seed in (0, 1):
            assert study.stdout.readline() == f"{seed}\n"
            study.stdin.write("\n")
            study.stdin.flush()
        study.send_signal(signal.SIGKILL)  # in the midst of the third
    kept = {path.name for path in remembered.folder().iterdir() if not path.name.startswith(".")}
    assert len(kept) in (2, 3)

    found = fits(measurement)
    assert [cell.seed for cell in computed] == list(SEEDS[len(kept) :])
    with remembered.recomputed():
        undisturbed = fits(measurement)
    assert len(computed) == 4 - len(kept) + 4
    for one, other in zip(found, undisturbed, strict=True):
        assert one.cell == other.cell
        assert one.estimate.fitness == other.estimate.fitness
        assert np.array_equal(one.motion.points, other.motion.points)


def test_what_changes_a_result_changes_its_key(measurement: Measurement, monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell("paper-case-1", "least-squares")
    usual = fingerprint.of_cell(cell, measurement)
    assert usual == fingerprint.of_cell(Cell("paper-case-1", "least-squares"), measurement)
    others = [
        fingerprint.of_cell(Cell("paper-case-1", "least-squares", 1), measurement),
        fingerprint.of_cell(Cell("paper-case-1", "afsa"), measurement),
        fingerprint.of_cell(Cell("paper-case-1", "least-squares", values={"bodies.OA.elements": 8}), measurement),
        fingerprint.of_cell(cell, jobs.measured("paper-case-2")),
    ]
    monkeypatch.setattr(fingerprint, "of_code", lambda: "another version of the sources")
    others.append(fingerprint.of_cell(cell, measurement))
    assert len({usual, *others}) == 6


def test_a_file_that_nobody_can_read_is_computed_again(computed: list[Any]) -> None:
    (remembered.folder() / "broken").write_bytes(b"\x80\x05half")
    assert remembered.run("broken", len, "abc") == 3
    assert remembered.run("broken", len, "abc") == 3
    assert computed == ["abc"]


def test_halves_of_files_do_not_pile_up(computed: list[Any]) -> None:
    """A process that is killed while it writes leaves one; the folder does not grow with the number of kills."""
    for name, age in (("old", 2 * 86400), ("recent", 60)):
        half = remembered.folder() / f".new-{name}"
        half.write_bytes(b"half")
        os.utime(half, (time.time() - age,) * 2)
    assert remembered.run("whole", len, "abc") == 3
    assert {path.name for path in remembered.folder().iterdir()} == {"whole", ".new-recent"}
