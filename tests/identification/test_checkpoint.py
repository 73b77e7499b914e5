"""A search that was broken off goes on where it was, and a file that is not its own is refused."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.evaluation_cache import EvaluationCache
from shoal.identification import Estimate, Verdict, identify
from shoal.identification.deadline import TimeIsUp
from shoal.identification.forward import ForwardModel
from shoal_validation.inverse_precision.cases import rigid_problem, textbook

METHOD = "iafsa-unseeded"
SCRIPT = f"""
import sys
from pathlib import Path
from shoal.identification import identify
from shoal_validation.inverse_precision.cases import rigid_problem, textbook
problem = rigid_problem()
identify(problem, method="{METHOD}", measurement=textbook(problem, 1.0), checkpoint=Path(sys.argv[1]))
"""


def run(**options: object) -> Estimate:
    problem = rigid_problem()
    return identify(problem, method=METHOD, measurement=textbook(problem, 1.0), **options)  # type: ignore[arg-type]


def same(one: Estimate, other: Estimate) -> bool:
    """Whether two answers agree in every bit, and in what they say they cost."""
    return (one.parameters, one.fitness, one.evaluations) == (other.parameters, other.fitness, other.evaluations)


@pytest.mark.slow
def test_a_killed_run_goes_on_to_the_same_answer(tmp_path: Path) -> None:
    """kill -9 in the middle; what was kept is not computed again, and the answer is that of an undisturbed run."""
    path = tmp_path / "kept"
    process = subprocess.Popen([sys.executable, "-c", SCRIPT, str(path)], env=dict(os.environ))
    deadline = time.monotonic() + 600
    while not path.exists() or path.stat().st_size < 300_000:
        assert process.poll() is None, "the run ended before it could be killed"
        assert time.monotonic() < deadline
        time.sleep(0.002)
    process.send_signal(signal.SIGKILL)
    process.wait()
    kept = path.stat().st_size
    resumed = run(checkpoint=path)
    assert same(resumed, run())
    assert path.stat().st_size > kept


def test_what_is_known_is_not_computed_again(tmp_path: Path) -> None:
    memory = EvaluationCache(tmp_path / "kept", "one")
    points, residuals = np.array([[1.0, 2.0]]), np.array([[3.0, np.inf]])
    memory.keep(0.5, points, residuals)
    memory.close()
    again = EvaluationCache(tmp_path / "kept", "one")
    assert np.array_equal(again.recall(0.5, points), residuals)  # type: ignore[arg-type]
    assert again.recalled == 1
    assert again.recall(0.4, points) is None
    assert again.recall(0.5, points.T) is None
    again.close()


@pytest.mark.parametrize("lost", [1, 30, 10_000])
def test_a_cut_off_end_is_dropped(tmp_path: Path, lost: int) -> None:
    """Whatever a crash left unwritten, down to the file's own head, is computed again; the rest is found."""
    path = tmp_path / "kept"
    memory = EvaluationCache(path, "one")
    batches = [np.full((1, 2), float(k)) for k in range(3)]
    for points in batches:
        memory.keep(0.5, points, points)
    memory.close()
    path.write_bytes(path.read_bytes()[: max(10, path.stat().st_size - lost)])
    again = EvaluationCache(path, "one")
    found = [again.recall(0.5, points) is not None for points in batches]
    assert found == ([True, True, False] if lost < 1000 else [False] * 3)
    again.keep(0.5, batches[2], batches[2])
    again.close()
    with closing(EvaluationCache(path, "one")) as whole:
        assert whole.recall(0.5, batches[2]) is not None


def test_a_foreign_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    EvaluationCache(path, "one").close()
    with pytest.raises(InputError, match=r"checkpoint: .* another identification"):
        EvaluationCache(path, "other")
    path.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match=r"checkpoint: .* another identification"):
        EvaluationCache(path, "one")
    assert path.read_text() == "a,b\n1,2\n"


def test_another_seed_is_another_identification(tmp_path: Path) -> None:
    path = tmp_path / "kept"
    run(checkpoint=path, time_limit=0.05)
    with pytest.raises(InputError, match="another identification"):
        run(checkpoint=path, seed=1)


def test_a_damaged_file_is_refused(tmp_path: Path) -> None:
    """A changed byte in a kept residual would change the answer without a word."""
    path = tmp_path / "kept"
    memory = EvaluationCache(path, "one")
    memory.keep(0.5, np.zeros((1, 2)), np.ones((1, 50)))
    memory.close()
    data = bytearray(path.read_bytes())
    data[-20] ^= 1
    path.write_bytes(data)
    with pytest.raises(InputError, match=r"checkpoint: .* damaged"):
        EvaluationCache(path, "one")


def test_a_place_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"checkpoint: .* cannot be written"):
        EvaluationCache(tmp_path / "nowhere" / "kept", "one")


def test_a_time_limit_gives_the_best_so_far_and_says_so() -> None:
    estimate = run(time_limit=0.05)
    assert estimate.verdict is Verdict.FAILED
    assert estimate.codes[0] == "search-stopped"
    assert 0 < estimate.evaluations < 4040
    assert np.isfinite(estimate.fitness)


def test_a_time_limit_on_the_fine_model_leaves_what_the_coarse_one_found(monkeypatch: pytest.MonkeyPatch) -> None:
    def no_time_left(model: ForwardModel, *_: object) -> None:
        raise TimeIsUp

    monkeypatch.setattr("shoal.identification.adapt.descend", no_time_left)
    problem = rigid_problem()
    limited = identify(
        problem, method="least-squares", measurement=textbook(problem, 1.0), tolerance=1e-3, time_limit=60.0
    )
    assert limited.verdict is Verdict.FAILED
    assert limited.codes[0] == "search-stopped"
    for name, true in limited.truth.items():
        assert limited.parameters[name].value == pytest.approx(true, abs=1e-3)
