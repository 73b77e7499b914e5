"""Requirements, which must hold, beside limits, which must not happen: the same answer, and no doubt which is which."""

from __future__ import annotations

import importlib
import json

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import InputError
from shoal.notebook import uncertain
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.limits import limit, read_limits, requirement
from shoal.response.marginals import Interval, Normal
from shoal.response.worst import require_case
from shoal.scene import Scene
from thrown import THROWN, UP

SCENE = Scene.parse(THROWN)


@pytest.mark.parametrize("seed", range(8))
def test_a_requirement_is_the_opposite_of_a_limit(seed: int) -> None:
    random = np.random.default_rng(seed)
    quantity, bound = str(random.choice(["P.x", "P.vy", "abs(P.speed)"])), round(float(random.normal()), 3)
    sign, other = random.permutation([">", "<"])
    one, opposite = requirement(f"{quantity} {sign} {bound}", SCENE), limit(f"{quantity} {other} {bound}", SCENE)
    values = random.normal(size=50)
    assert np.array_equal(one.margin(values), opposite.margin(values))
    of = np.abs(values) if quantity.startswith("abs") else values
    assert np.array_equal(one.margin(values) > 0, of > bound if sign == ">" else of < bound)
    assert (one.required, one.excluded) == (opposite.required, opposite.excluded)
    assert one.title == f"requirement {quantity} {sign} {bound}"
    assert opposite.title == f"limit {opposite.text} (must not happen; required: {one.text})"


def test_one_text_cannot_be_both() -> None:
    with pytest.raises(InputError, match=r"require: P.y > 1: is stated as a limit, too"):
        read_limits(["P.y > 1"], ["P.y > 1"], SCENE)
    with pytest.raises(InputError, match=r"require: 'P\.y' is not"):
        requirement("P.y", SCENE)


@pytest.mark.parametrize(
    ("of", "known", "says"),
    [
        ("P.q.upper", Interval(4.7, 5.3), "QUANTITY one of x, y, angle"),
        ("Q.y.upper", Interval(4.7, 5.3), "MARKER one of P"),
        ("P.y.uper", Interval(4.7, 5.3), "neither a limit of the study"),
        ("P.y.upper", Normal(5.0, 0.2), "has a distribution"),
    ],
)
def test_a_wrong_worst_case_is_refused_before_the_study(of: str, known: Interval | Normal, says: str) -> None:
    with pytest.raises(InputError, match=says):
        require_case(of, [], SCENE, Inputs((UncertainParameter(UP, known, {UP: 1.0}),)).parameters)


@pytest.mark.parametrize("known", ["normal(5,0.2)", "uniform(4.7,5.3)", (4.7, 5.3)])
def test_a_refused_run_at_the_design_point_is_a_doubt_and_costs_no_answer(
    known: str | tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise InputError("joints.c: cannot be assembled")

    monkeypatch.setattr(importlib.import_module("shoal.response.limits.judge"), "show", refused)
    found = uncertain(SCENE, {UP: known}, [0.5], limit=["P.y > 1.3"], limit_runs=300)
    assert not found.ok
    assert "limit-run-rejected" in found.codes
    (told,) = found.to_json()["limits"]
    assert told["shown_by"]["status"] == "refused"
    assert told["shown_by"]["margin"] is None
    assert found.bounds is not None or found.statistics is not None


def test_a_wrong_cost_is_refused_before_the_study(monkeypatch: pytest.MonkeyPatch) -> None:
    module = importlib.import_module("shoal.response.uncertain")
    monkeypatch.setattr(module, "respond_markers", lambda *_, **__: pytest.fail("the study was made"))
    with pytest.raises(InputError, match="cost"):
        uncertain(SCENE, {UP: (4.7, 5.3)}, limit=["P.y > 1.3"], allocate=True, cost={"initial.P.vel": 2.0})


def test_the_command_says_which_side_is_required() -> None:
    words = ["uncertain", "single-pendulum", "--vary", "initial.OA.angle=-1.3:-1.2", "--at", "0.5,1,1.5"]
    words += ["--limit", "A.y < -0.95", "--require", "A.y > -0.95", "--require", "abs(A.angle) < 4"]
    told = CliRunner().invoke(main, [*words, "--json"])
    one, other, third = json.loads(told.stdout)["limits"]
    assert one["kept"] is other["kept"] is False
    assert third["kept"] is True
    assert (one["stated"], other["stated"]) == ("limit", "requirement")
    assert one["limit"] == other["limit"] == "A.y < -0.95"
    assert one["require"] == other["require"] == "A.y > -0.95"
    shown = " ".join(CliRunner().invoke(main, words).output.split())
    assert "limit A.y < -0.95 (must not happen; required: A.y > -0.95): is exceeded" in shown
    assert "requirement A.y > -0.95: is violated" in shown
    assert "requirement abs(A.angle) < 4: holds for all values" in shown
