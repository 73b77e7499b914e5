"""The pages of identifications say what the numbers say, also when made later from a file."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import InputError
from shoal.identification import Estimate, Verdict, identify, load_problem
from shoal.identification.findings import MISFIT, SEVERAL_MINIMA
from shoal.pictures import archive, files
from shoal.pictures.answer import Answer
from shoal.pictures.gallery import model_choice, motions
from shoal.pictures.numbers import length, power, rounded
from shoal.pictures.report import report, shown
from shoal.pictures.study import best_of, study


def test_page_says_what_the_numbers_say(pages: Callable[[str], str], several: Answer) -> None:
    text = pages("estimate")
    assert f"Verdict: {several.estimate.verdict}." in text
    for name, value in several.estimate.parameters.items():
        row = re.search(rf'<th scope="row">{re.escape(name)}[^<]*</th>(.*?)</tr>', text)
        assert row is not None
        cells = re.findall("<td>(.*?)</td>", row[1])
        assert float(cells[0]) == pytest.approx(value.value, abs=0.06 * value.std)
        low, high = map(float, cells[2].split(" to "))
        assert (low, high) == pytest.approx((value.lower, value.upper), abs=0.06 * value.std)


def test_numbers_have_the_digits_of_their_uncertainty(several: Answer) -> None:
    value = replace(several.estimate.parameters["density"], value=998.76543, std=1.23456, lower=996.2, upper=1001.3)
    estimate = several.estimate
    assert shown(estimate, value) == ("998.8", "1.2", "996.2 to 1001.3", "yes")
    assert shown(estimate, replace(value, identifiable=False, at_bound=True)) == ("999", "–", "–", "at bound")
    # Nothing is known by an answer that is none.
    assert shown(replace(estimate, findings=[MISFIT.found("the best fit is off")]), value) == ("999", "–", "–", "no")
    assert rounded(1.23456e12, 1e9) == "1.2346e+12"


def test_an_untrusted_answer_is_not_sold(pages: Callable[[str], str], several: Answer, rejected: Answer) -> None:
    assert rejected.estimate.verdict is Verdict.REJECTED
    assert "Verdict: model rejected. Do not use these numbers." in pages("rejected")
    assert "Numbers that are no answer" in pages("rejected")
    bad = Answer(several.problem, replace(several.estimate, findings=[MISFIT.found("<too> far off")]))
    assert "<li>&lt;too&gt; far off.</li>" in report(bad, motions(several)[:1], [])


def test_each_recording_moves(pages: Callable[[str], str]) -> None:
    data = re.findall(r'<script type="application/json">(.*?)</script>', pages("estimate"), re.DOTALL)
    runs = [json.loads(one) for one in data]
    assert [run["name"] for run in runs] == ["high", "low"]
    assert all(len(run["drawing"]["carriers"]["AB"]["place"]) == len(run["times"]) for run in runs)


def test_a_study_shows_all_and_the_best_in_full(pages: Callable[[str], str], estimates: dict[str, Estimate]) -> None:
    text = pages("study")
    assert best_of(estimates) == "fine"
    assert "Best: fine. Verdict: identified." in text
    for name, estimate in estimates.items():
        assert f'<th scope="row">{name}</th>' in text
        assert power(estimate.fitness) in text
    assert "The best: fine" in text


def test_the_best_is_one_that_can_be_used(estimates: dict[str, Estimate]) -> None:
    doubtful = {
        **estimates,
        "fine": replace(estimates["fine"], findings=[SEVERAL_MINIMA.found("2 parameter sets fit equally well")]),
    }
    assert best_of(doubtful) == "coarse"


def test_a_study_is_of_one_problem(several: Answer, flexible: Answer) -> None:
    with pytest.raises(InputError, match="paper-case-1, several"):
        study({"one": several, "other": flexible})


@pytest.mark.slow
def test_a_tolerance_shows_why_this_model() -> None:
    problem = load_problem("paper-case-1")
    answer = Answer(problem, identify(problem, tolerance=1e-2))
    ladder = model_choice(answer)
    chosen = answer.estimate.model["selection"][-1]["model"]
    assert f"it was found with {chosen}" in ladder.caption
    assert "within 10 mm" in " ".join(ladder.figure.get_suptitle().split())
    assert [axes.get_ylabel() for axes in ladder.figure.axes] == ["estimated error [m]"]


def same(one: Any, other: Any) -> bool:
    """Deep equality of dataclasses, arrays (nan equals nan) and containers."""
    if hasattr(one, "__dataclass_fields__"):
        return type(one) is type(other) and all(same(v, getattr(other, k)) for k, v in vars(one).items())
    if isinstance(one, np.ndarray):
        return bool(np.array_equal(one, other, equal_nan=True))
    if isinstance(one, dict):
        return list(one) == list(other) and all(same(v, other[k]) for k, v in one.items())
    if isinstance(one, list | tuple):
        return len(one) == len(other) and all(map(same, one, other))
    return bool(one == other or (one != one and other != other))


def test_a_file_keeps_everything(several: Answer) -> None:
    text = json.dumps(archive.archived(several), allow_nan=False)
    again = archive.parse(text, "text")
    assert same(several.estimate, again.estimate)
    assert again.problem == several.problem
    assert np.isnan(again.estimate.measurement.recordings["high"].values[25, 0])
    changed = replace(again.estimate, predicted={k: v + 1e-9 for k, v in again.estimate.predicted.items()})
    assert not same(several.estimate, changed)


@pytest.mark.slow
def test_report_from_files(flexible: Answer, tmp_path: Path) -> None:
    for name in ("one.json", "two.json"):
        files.estimate(flexible.estimate, flexible.problem, tmp_path / name)
    out = tmp_path / "page.html"
    given = [str(tmp_path / name) for name in ("one.json", "two.json")]
    result = CliRunner().invoke(main, ["report", *given, "--out", str(out)])
    assert result.exit_code == 0, result.output
    text = out.read_text(encoding="utf-8")
    assert "2 of 2 identifications" in text
    assert "Best: one. Verdict: identified." in text
    assert flexible.estimate.scene.fingerprint in text


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda path: None, "cannot be read"),
        (lambda path: path.write_text("no JSON"), "is not JSON"),
        (lambda path: path.write_text("{}"), "holds no identification"),
        (lambda path: path.write_text('{"record": {"problem": 1}}'), "problem"),
    ],
)
def test_a_file_that_is_none_is_one_line(make: Callable[[Path], object], word: str, tmp_path: Path) -> None:
    path = tmp_path / "estimate.json"
    make(path)
    result = CliRunner().invoke(main, ["report", str(path), "--out", str(tmp_path / "page.html")])
    assert result.exit_code == 2
    assert word in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1


@pytest.mark.parametrize("ending", [".png", ".gif"])
def test_files_are_what_they_end_in(several: Answer, tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"estimate{ending}"
    files.estimate(several.estimate, several.problem, path)
    begin = {".png": b"\x89PNG", ".gif": b"GIF89a"}[ending]
    assert path.read_bytes().startswith(begin)


@pytest.mark.parametrize(
    ("metres", "text"), [(2.0, "2 m"), (0.0015, "1.5 mm"), (5.6e-5, "56 µm"), (2e-9, "2 nm"), (None, "unknown")]
)
def test_lengths_have_the_unit_that_fits(metres: float | None, text: str) -> None:
    assert length(metres) == text


def test_powers_of_ten() -> None:
    assert power(2.16739e-6) == "2.1674 × 10⁻⁶"
    assert power(None) == "none"
