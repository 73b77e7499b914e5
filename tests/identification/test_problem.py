"""Problems are checked before anything is computed."""

from pathlib import Path

import pytest
from shoal.errors import InputError
from shoal.identification import load_problem, problem_names
from shoal.identification.problem import Problem

GOOD = {
    "name": "small",
    "scene": "single-pendulum",
    "parameters": {"angle": {"path": "initial.OA.angle", "lower": -1.0, "upper": 1.0}},
    "channels": [{"marker": "A", "quantity": "x", "column": "x"}],
    "source": {"kind": "file", "duration": 1.0},
}


@pytest.mark.parametrize("name", problem_names())
def test_built_in_problems_fit_their_scenes(name: str) -> None:
    scene = load_problem(name).load_scene()
    assert scene.markers


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"parameters": {}}, "parameters"),
        ({"parameters": {"a": {"path": "initial.OA.angle", "lower": 1.0, "upper": 0.0}}}, "parameters.a"),
        ({"parameters": {"a": {"path": "initial.OA.angle", "lower": 0, "upper": 1, "start": 2}}}, "parameters.a"),
        ({"quantities": {"q": "angle + other"}}, "quantities.q"),
        ({"channels": [{"marker": "A", "quantity": "x"}]}, "channels"),
        ({"colour": 1}, "colour"),
        ({"source": {"kind": "file", "duration": -1}}, "source"),
    ],
)
def test_bad_problems_are_refused_in_one_line(change: dict[str, object], field: str) -> None:
    with pytest.raises(InputError, match=field) as refusal:
        Problem.parse({**GOOD, **change}, "small")
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"parameters": {"a": {"path": "bodies.XX.mass", "lower": 0, "upper": 1}}}, "parameters.a"),
        ({"parameters": {"a": {"path": "bodies.OA.mass", "lower": -1, "upper": 1}}}, "parameters.a"),
        ({"channels": [{"marker": "Q", "quantity": "x", "column": "x"}]}, "channels"),
    ],
)
def test_problems_that_do_not_suit_their_scene_are_refused(change: dict[str, object], field: str) -> None:
    with pytest.raises(InputError, match=field):
        Problem.parse({**GOOD, **change}, "small").load_scene()


def test_a_problem_file_finds_a_scene_beside_it(tmp_path: Path) -> None:
    import yaml
    from shoal.scene import load_scene

    scene = load_scene("single-pendulum").model_dump(mode="json")
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump({**scene, "name": "mine"}))
    (tmp_path / "problem.yaml").write_text(yaml.safe_dump({**GOOD, "scene": "mine.yaml"}))
    assert load_problem(str(tmp_path / "problem.yaml")).load_scene().name == "mine"


GEARED = {
    "name": "geared",
    "bodies": {name: {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1} for name in ("wheel", "arm")},
    "joints": {
        "W": {"kind": "revolute", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "wheel"}},
        "O": {"kind": "revolute", "first": {"body": "ground", "point": [1.0, 0.0]}, "second": {"body": "arm"}},
        "G": {"kind": "gear", "first": {"body": "wheel"}, "second": {"body": "arm"}, "ratio": -2.0},
    },
    "markers": {"A": {"body": "arm", "point": "start"}},
}


@pytest.mark.parametrize(
    "sought",
    [
        {"parameters": {"a": {"path": "joints.G.ratio", "lower": -4.0, "upper": 4.0}}},
        {"parameters": {"a": {"lower": -4.0, "upper": 4.0}}, "ties": {"joints.G.ratio": "2*a"}},
    ],
)
def test_the_ratio_of_a_gear_cannot_be_sought(tmp_path: Path, sought: dict[str, object]) -> None:
    import yaml

    (tmp_path / "geared.yaml").write_text(yaml.safe_dump(GEARED))
    problem = Problem.parse({**GOOD, "scene": str(tmp_path / "geared.yaml"), **sought}, "small")
    with pytest.raises(
        InputError, match=r"joints.G.ratio is of whole teeth and cannot be sought; .*--set joints.G.ratio"
    ):
        problem.load_scene()
