"""Recordings: windows, whole turns, and files that are wrong."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import InputError
from shoal.identification import Recording, load_problem, measure


def read(path: Path) -> Recording:
    problem = load_problem("kaheman-single")
    return measure(problem, problem.load_scene(), str(path)).first


def test_angles_lose_whole_turns_and_get_their_offset(tmp_path: Path) -> None:
    times = np.arange(0, 3, 0.01)
    angles = 0.3 + 4 * np.pi + 0.1 * np.sin(times)
    path = tmp_path / "turned.csv"
    np.savetxt(path, np.column_stack([times, angles]), delimiter=",", header="t,theta", comments="")
    found = read(path)
    assert found.times[0] == 0
    assert found.times[-1] == pytest.approx(2.0)
    assert found.values[0, 0] == pytest.approx(0.3 + np.pi / 2)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t,theta\n0,1\n0.1,x\n0.2,3\n0.3,4\n", ["row 3", "theta", "'x'"]),
        ("t,theta\n0,1\n0.1,2\n0.1,3\n0.3,4\n", ["row 4", "increase"]),
        ("t,phi\n0,1\n", ["no column 'theta'"]),
        ("t,theta\n0,1\n", ["only 1 samples"]),
        ("", ["not CSV"]),
    ],
)
def test_bad_files_are_refused_with_row_and_column(tmp_path: Path, text: str, words: list[str]) -> None:
    path = tmp_path / "bad.csv"
    path.write_text(text)
    with pytest.raises(InputError) as refusal:
        read(path)
    assert all(word in str(refusal.value) for word in words)
    assert "\n" not in str(refusal.value)


def test_a_missing_file_is_named() -> None:
    with pytest.raises(InputError, match=r"nowhere\.csv"):
        read(Path("nowhere.csv"))


def test_a_problem_that_computes_its_data_takes_no_file() -> None:
    problem = load_problem("paper-case-1")
    with pytest.raises(InputError, match="takes no file"):
        measure(problem, problem.load_scene(), "some.csv")


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (["a.csv", "b.csv"], "'a.csv' is not NAME=FILE"),
        (["run=a.csv", "run=b.csv"], "run is given twice"),
        (["other=a.csv"], "no recording 'other'"),
        (["a=b.csv"], "no column 't'"),
    ],
)
def test_the_option_data_takes_a_file_or_named_files(
    given: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file whose name has an equals sign is a file."""
    monkeypatch.chdir(tmp_path)
    Path("a=b.csv").write_text("time,theta\n0,1\n")
    found = CliRunner().invoke(main, ["identify", "kaheman-single", *(x for one in given for x in ("--data", one))])
    assert found.exit_code == 2
    assert words in " ".join(found.output.split())
