"""What a user may write for a function of time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.interpolate import CubicSpline
from shoal.scene.function import Function
from shoal.scene.record import Record, one_line

ROWS = [[0.0, 1.0], [1.0, 3.0], [2.0, 2.0], [4.0, 0.0]]


class Motor(Record):
    drive: Function


@pytest.mark.parametrize(
    ("written", "expected"),
    [
        pytest.param(2, lambda t: np.full_like(t, 2.0), id="number"),
        pytest.param("0.1*sin(3*t)", lambda t: 0.1 * np.sin(3 * t), id="text"),
        pytest.param({"expression": "e**(-t) + pi"}, lambda t: np.exp(-t) + np.pi, id="expression"),
        pytest.param("5", lambda t: np.full_like(t, 5.0), id="constant-text"),
        pytest.param(
            {"table": ROWS, "smooth": False}, lambda t: np.interp(t, *np.array(ROWS).T), id="straight-lines"
        ),
        pytest.param({"table": ROWS}, lambda t: CubicSpline(*np.array(ROWS).T)(np.clip(t, 0, 4)), id="spline"),
    ],
)  # fmt: skip
def test_values_and_round_trip(written: Any, expected: Any) -> None:
    motor = Motor(drive=written)
    times = np.linspace(-1.0, 6.0, 50).reshape(5, 10)
    np.testing.assert_allclose(motor.drive(times), expected(times), rtol=1e-14, atol=1e-15)
    assert Motor.model_validate(motor.model_dump()) == motor
    assert Motor.model_validate_json(motor.model_dump_json()) == motor
    assert motor.drive(np.float64(0.5)).shape == ()


@pytest.mark.parametrize(("text", "value"), [("5", 5.0), (" -0.5 ", -0.5), ("1e-3", 1e-3), (".5", 0.5)])
def test_the_text_of_a_number_is_that_number(text: str, value: float) -> None:
    """`--set loads.motor.torque=5` gives text; what a number may do, such as be an input of a unit, it may too."""
    assert Motor(drive=text).drive == Function(number=value)


def test_expressions_keep_extended_precision() -> None:
    assert Function(expression="sin(t) + 1")(np.ones(2, dtype=np.longdouble)).dtype == np.longdouble


def test_knots() -> None:
    assert Function(table=ROWS).knots == (0.0, 1.0, 2.0, 4.0)
    assert Function(number=1.0).knots == ()


@pytest.mark.parametrize(
    ("written", "named", "why"),
    [
        pytest.param({"table": []}, "drive.table", "2 to 20000 rows", id="empty"),
        pytest.param({"table": [[0, 1]]}, "drive.table", "found 1", id="one-row"),
        pytest.param({"table": [[0, 1], [2, 1], [1, 1]]}, "drive.table", "found 1 after 2 in row 2", id="unsorted"),
        pytest.param({"table": [[0, 1], [0, 2]]}, "drive.table", "times must increase", id="twice"),
        pytest.param({"table": [[0, 1], [1, np.nan]]}, "drive.table.1.1", "finite", id="nan"),
        pytest.param({"table": [[0, 1], [np.inf, 1]]}, "drive.table.1.0", "finite", id="infinite"),
        pytest.param({"table": [[0, 1, 2], [1, 2, 3]]}, "drive.table.0", "at most 2 belong", id="three-columns"),
        pytest.param({"table": "x"}, "drive.table", "needs a list", id="no-table"),
        pytest.param("sin(x)", "drive.expression", "'x', which is not known; the time is `t`", id="unknown-name"),
        pytest.param("open(t)", "drive.expression", "calls what is none of sin", id="unknown-function"),
        pytest.param("t +" * 200, "drive.expression", "longer than 500 characters", id="long"),
        pytest.param("t +", "drive.expression", "is not arithmetic", id="broken"),
        pytest.param({"expression": "t", "table": ROWS}, "drive", "found expression and table", id="two"),
        pytest.param({}, "drive", "found none", id="none"),
        pytest.param({"expression": "t", "smooth": True}, "drive", "smooth: belongs to a table", id="smooth"),
        pytest.param({"expression": "t", "colour": 1}, "drive.colour", "no such field, found 1", id="extra"),
        pytest.param(np.inf, "drive.number", "finite", id="infinite-number"),
        pytest.param(True, "drive", "a function of time is", id="boolean"),
        pytest.param(None, "drive", "a function of time is", id="nothing"),
        pytest.param([[0, 1]], "drive", "a function of time is", id="list"),
    ],
)
def test_refused_in_one_line(written: Any, named: str, why: str) -> None:
    with pytest.raises(ValidationError) as caught:
        Motor(drive=written)
    text = str(one_line(caught.value, "scene.yaml"))
    assert text.startswith(f"scene.yaml: {named}: ")
    assert why in text
    assert "\n" not in text
