"""Values that one recording gave are set, or sought on from, elsewhere."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shoal
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import InputError
from shoal.identification import Estimate, Problem, identify
from shoal.identification.carried import of_estimate, read_values

SCENE = "rigid-double-pendulum"
TRUTH = {"initial.OA.angle": 0.4, "initial.AB.angle": 0.7, "bodies.AB.length": 1.3}


def problem(**changes: Any) -> Problem:
    """The second angle is tied to the first by a parameter without a path; the clock is the recording's."""
    data: dict[str, Any] = {
        "name": "first-run",
        "scene": SCENE,
        "parameters": {
            "first": {"path": "initial.OA.angle", "lower": -3.3, "upper": 3.3},
            "spread": {"lower": -1.0, "upper": 1.0},
            "length": {"path": "bodies.AB.length", "lower": 0.5, "upper": 3.0, "start": 2.0},
            "clock": {"path": "measurement.clock", "lower": 0.5, "upper": 2.0, "start": 1.0},
        },
        "ties": {"initial.AB.angle": "first + spread"},
        "channels": [{"marker": m, "quantity": q} for m in "AB" for q in "xy"],
        "source": {"kind": "engine", "engine": "gauss", "values": TRUTH, "stop": 1.0, "count": 40, "noise": 1e-4},
    }
    return Problem.parse(data | changes, "problem")


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    return identify(problem(), method="least-squares")


@pytest.fixture(scope="module")
def file(estimate: Estimate, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("values") / "estimate.json"
    path.write_text(json.dumps(estimate.to_json()))
    return path


def test_an_estimate_tells_its_values_by_path_with_ties(estimate: Estimate) -> None:
    assert estimate.values.keys() == TRUTH.keys()
    for path, true in TRUTH.items():
        assert estimate.values[path] == pytest.approx(true, abs=2e-3)
    both = estimate.parameters["first"].value + estimate.parameters["spread"].value
    assert estimate.values["initial.AB.angle"] == pytest.approx(both, abs=1e-14)
    assert estimate.left_out == {"clock": "of the measurement"}


def test_what_a_recording_has_for_itself_is_left_out() -> None:
    parameters = problem().model_dump()["parameters"]
    parameters["first"] |= {"own": True}
    source = problem().model_dump()["source"]
    both = problem(parameters=parameters, source=None, recordings={"low": source, "high": {**source, "seed": 1}})
    found = identify(both, method="least-squares")
    assert found.values.keys() == {"bodies.AB.length"}
    assert found.left_out == {
        "low.first": "of recording low",
        "high.first": "of recording high",
        "clock": "of the measurement",
        "initial.AB.angle": "depends on first of each recording",
    }


def test_they_are_set_in_a_scene_and_what_is_stated_wins(estimate: Estimate, file: Path) -> None:
    assert read_values(file).values == of_estimate(estimate).values
    expected = shoal.simulate(SCENE, [0.5], set=estimate.values, verify=False).points
    for given in (estimate, file, str(file)):
        np.testing.assert_array_equal(shoal.simulate(SCENE, [0.5], values=given, verify=False).points, expected)
    scene = of_estimate(estimate).set_in(shoal.load_scene(SCENE), {"bodies.AB.length": 2.5})
    assert (scene.value("bodies.AB.length"), scene.value("initial.OA.angle")) == (
        2.5,
        estimate.values["initial.OA.angle"],
    )


def test_the_commands_set_them(estimate: Estimate, file: Path) -> None:
    expected = shoal.simulate(SCENE, [0.5], set=estimate.values, verify=False).marker("B")[-1]
    arguments = ["simulate", SCENE, "--values", str(file), "--at", "0.5", "--no-verify", "--json"]
    result = CliRunner().invoke(main, arguments)
    assert result.exit_code == 0, result.stderr
    assert json.loads(result.stdout)["final"]["B"] == expected.tolist()
    assert "left out: clock (of the measurement)" in result.stderr
    result = CliRunner().invoke(main, [*arguments, "--set", "bodies.AB.length=2"])
    other = shoal.simulate(SCENE, [0.5], set={**estimate.values, "bodies.AB.length": 2.0}, verify=False)
    assert json.loads(result.stdout)["final"]["B"] == other.marker("B")[-1].tolist()


def test_what_a_problem_seeks_starts_there_and_the_rest_is_known(estimate: Estimate) -> None:
    sought = {"first": {"path": "initial.OA.angle", "lower": 0.45, "upper": 1.0}, "spread": {"lower": -1, "upper": 1}}
    later = problem(name="second-run", parameters=sought)
    changed, values, notes = of_estimate(estimate).into(later)
    assert values == {"bodies.AB.length": estimate.values["bodies.AB.length"]}
    assert changed.parameters["first"].start == 0.45
    assert changed.parameters["spread"].start == estimate.parameters["spread"].value
    assert "first = 0.4" in notes[1]
    assert "beyond its bounds" in notes[1]
    assert of_estimate(estimate).into(later, {"bodies.AB.length": 2.0})[1] == {"bodies.AB.length": 2.0}
    found = shoal.identify(problem(), values=estimate, method="least-squares")
    assert "estimate of first-run: the search starts from first, spread, length" in found.notes
    assert found.evaluations < estimate.evaluations
    assert found.fitness == pytest.approx(estimate.fitness, rel=1e-6)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("no json", "is no JSON"),
        ("[1]", "is no estimate"),
        ('{"status": "ok", "markers": {}}', "is no estimate"),
        ('{"verdict": "identified", "parameters": {}}', "older version"),
        (
            '{"verdict": "identified", "parameters": {}, "values": {"a.b": null}, "left_out": {}}',
            "a.b: a finite number",
        ),
        ("[" * 100_000, "is no JSON"),
    ],
)
@pytest.mark.parametrize("command", [["simulate", SCENE], ["identify", "paper-case-1"]])
def test_a_file_of_something_else_is_refused_in_one_line(
    tmp_path: Path, text: str, words: str, command: list[str]
) -> None:
    (path := tmp_path / "values.json").write_text(text)
    with pytest.raises(InputError, match=words):
        read_values(path)
    result = CliRunner().invoke(main, [*command, "--values", str(path)])
    assert result.exit_code == 2
    assert len(result.stderr.splitlines()) == 1


def test_values_of_another_machine_are_refused(estimate: Estimate) -> None:
    with pytest.raises(InputError, match=r"estimate of first-run: .*no such field"):
        shoal.simulate("single-pendulum", values=estimate)
