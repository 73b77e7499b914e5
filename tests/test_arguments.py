"""What may be asked for is the same for library, command line and services, and what may not is refused in one line.

Judged by the stated limits: a value beyond one was dropped or taken for another in silence, or ended in a traceback.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import shoal
from click.testing import CliRunner
from shoal.arguments import numbers
from shoal.cli import main
from shoal.errors import InputError

PENDULUM, FLEXIBLE, PROBLEM = "single-pendulum", "flexible-double-pendulum", "paper-case-1"
ANGLE = "initial.OA.angle"
NAN, INF = math.nan, math.inf


def _uncertain(**asked: Any) -> Callable[[], Any]:
    return lambda: shoal.uncertain(PENDULUM, {ANGLE: (0.1, 0.12)}, **asked)


def _identify(**asked: Any) -> Callable[[], Any]:
    return lambda: shoal.identify(PROBLEM, **asked)


def _simulate(*given: Any, **asked: Any) -> Callable[[], Any]:
    return lambda: shoal.simulate(PENDULUM, *given, **asked)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: shoal.modes(PENDULUM, about="x"), "about: needs one of equilibrium, start, found 'x'"),
        (lambda: shoal.modes(PENDULUM, count=0), "count: needs a whole number of at least 1, found 0"),
        (lambda: shoal.modes(PENDULUM, count=-1), "count: needs a whole number of at least 1, found -1"),
        (lambda: shoal.modes(PENDULUM, count=2.5), "count: needs a whole number of at least 1, found 2.5"),
        (lambda: shoal.statics(PENDULUM, "1"), "time: needs a time of at least 0 s, found '1'"),
        (lambda: shoal.statics(FLEXIBLE, tolerance=1e-3, verify=False), "verify: a tolerance is kept by estimates"),
        (lambda: shoal.design(PROBLEM, about="foo"), "about: needs one of answer, start, found 'foo'"),
        (lambda: shoal.design(PROBLEM, noise="1e-3"), "noise: needs a standard deviation above 0 m, found '1e-3'"),
        (_uncertain(count=-3), "count: needs a whole number of at least 1, found -3"),
        (_uncertain(gap=-1), "gap: needs a share above 0 and of at most 1, found -1"),
        (_uncertain(gap=NAN), "gap: needs a share above 0 and of at most 1, found nan"),
        (_uncertain(limit_runs=-5), "limit_runs: needs a whole number of at least 100, found -5"),
        (_uncertain(degree=-3), "degree: needs a whole number of at least 1 and of at most 40, found -3"),
        (_uncertain(runs=-1), "runs: needs a whole number of at least 3, found -1"),
        (_uncertain(seed=-1), "seed: needs a whole number of at least 0, found -1"),
        (_uncertain(time_limit=INF), "time_limit: needs a time above 0 s, found inf"),
        (_uncertain(allocate=True, target=0.5), "target: needs a probability above 0 and below 0.5, found 0.5"),
        (_uncertain(target=1e-3), "target: belongs to allocate"),
        (_uncertain(cost={ANGLE: 2.0}), "cost: belongs to allocate"),
        (_uncertain(limit_method="form"), "limit_method: belongs to a limit"),
        (_uncertain(limit_runs=500), "limit_runs: belongs to a limit"),
        (_identify(seed=-1), "seed: needs a whole number of at least 0, found -1"),
        (_identify(time_limit=NAN), "time_limit: needs a time above 0 s, found nan"),
        (_identify(bootstrap=-5), "bootstrap: needs a whole number of at least 0, found -5"),
        (_identify(sample=-3), "sample: needs a whole number of at least 0, found -3"),
        (_identify(tolerance="1e-3"), "tolerance: needs a length above 0 m, found '1e-3'"),
        (_identify(data=["a.csv"]), r"data: needs a file or a table \(a DataFrame\).*found \['a.csv'\]"),
        (_identify(data=np.zeros((2, 2))), "data: needs a file or a table"),
        (_identify(values=3), "values: needs fields of a scene by path, an estimate.*found 3"),
        (_simulate(tolerance=NAN), "tolerance: needs a length above 0 m, found nan"),
        (_simulate(tolerance="1e-3"), "tolerance: needs a length above 0 m, found '1e-3'"),
        (_simulate(tolerance=1e-3, verify=False), "verify: a tolerance is kept by estimates"),
        (
            lambda: shoal.sweep(PENDULUM, {ANGLE: [0.1, 0.2]}, set={ANGLE: 0.3}),
            "initial.OA.angle: is set to 0.3 and varied as well",
        ),
        (_simulate("abc"), "at: needs a list of one or more finite times in s, found 'abc'"),
        (_simulate(engine=None), "engine: needs a text, found None"),
        (_simulate(set={1: 1}), "values: 1 is no dotted path of a field"),
        (_simulate(set={ANGLE: np.array([0.3, 0.4])}), r"initial.OA.angle: needs a number, found \[0.3, 0.4\]"),
        (_simulate(set={ANGLE: np.ma.array(0.3, mask=True)}), "values: a masked array is no value of a field"),
        (lambda: shoal.simulate(3), "scene: needs a scene, its fields, a name or the path of a YAML file, found 3"),
        (lambda: shoal.identify(3), "problem: needs a problem, its fields, a name or the path"),
        (lambda: shoal.simulate({"name": "x"}), "scene: bodies: Field required"),
        (lambda: shoal.reactions(PENDULUM, 0.5), "at: needs a list of one or more finite times in s, found 0.5"),
        (lambda: shoal.compare(PENDULUM, []), r"engines: needs a list of one or more names, found \[\]"),
        (lambda: shoal.compare(PENDULUM, "gauss"), "engines: needs a list of one or more names, found 'gauss'"),
        (lambda: shoal.sweep(PENDULUM, {}), r"vary: needs a mapping of one or more fields with their values, found {}"),
        (lambda: shoal.sweep(PENDULUM, {ANGLE: []}), rf"vary: {ANGLE}: needs a list of one or more finite numbers"),
        (lambda: shoal.sweep(PENDULUM, {ANGLE: [[0.1], [0.2]]}), rf"vary: {ANGLE}: needs a list"),
    ],
)
def test_the_library_refuses_in_one_line(call: Callable[[], Any], said: str) -> None:
    with pytest.raises(InputError, match=said) as refused:
        call()
    assert len(str(refused.value).splitlines()) == 1


LANES = [
    np.ma.array([0.1, 0.2], mask=[False, True]),
    np.array([0.1j, 0.2]),
    np.array([0.1, None]),
    np.array(["0.1", "0.2"]),
    np.zeros(0),
    np.array([0.1, NAN]),
    np.array([True, False]),
]


@pytest.mark.parametrize("lanes", LANES, ids=str)
def test_lanes_are_finite_real_numbers(lanes: Any) -> None:
    """A masked entry was simulated with the value beneath, a complex one without its imaginary part."""
    with pytest.raises(InputError, match=f"{ANGLE}: needs a list of one or more finite numbers"):
        shoal.prepare(PENDULUM)({ANGLE: lanes}, [0.5])
    with pytest.raises(InputError, match=f"vary: {ANGLE}: needs a list of one or more finite numbers"):
        shoal.sweep(PENDULUM, {ANGLE: lanes}, 0.5)


def test_a_list_of_numbers_becomes_an_array_of_its_own() -> None:
    given = np.array([0.5, 1.0])
    assert not np.shares_memory(numbers("times", given), given)
    for same in ([0.5, 1], (np.float32(0.5), np.int64(1)), given[:, None][:, 0]):
        np.testing.assert_array_equal(numbers("times", same), given)


@pytest.mark.parametrize(
    "arguments",
    [
        ["identify", PROBLEM, "--seed", "-1"],
        ["identify", PROBLEM, "--time-limit", "nan"],
        ["identify", PROBLEM, "--time-limit", "inf"],
        ["uncertain", PENDULUM, "--vary", f"{ANGLE}=0.1:0.12", "--gap", "nan"],
        ["uncertain", PENDULUM, "--vary", f"{ANGLE}=0.1:0.12", "--time-limit", "inf"],
        ["uncertain", PENDULUM, "--vary", f"{ANGLE}=0.1:0.12", "--target", "0.01"],
        ["uncertain", PENDULUM, "--vary", f"{ANGLE}=0.1:0.12", "--cost", f"{ANGLE}=2"],
        ["simulate", PENDULUM, "--tolerance", "1e-3", "--no-verify"],
        ["statics", FLEXIBLE, "--tolerance", "1e-3", "--no-verify"],
    ],
    ids=" ".join,
)
def test_the_command_line_refuses_too(arguments: list[str]) -> None:
    result = CliRunner().invoke(main, arguments)
    assert (result.exit_code, result.stdout) == (2, "")
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("wrong", [NAN, INF, np.float64(NAN), np.array(NAN)])
def test_a_client_sends_no_number_that_is_not_finite(wrong: Any) -> None:
    """JSON would write null, and the service take its default; nobody listens there, so that nothing was sent."""
    client = shoal.Client("http://127.0.0.1:9")
    for call, field in (
        (lambda: client.simulate(PENDULUM, set={ANGLE: wrong}), f"set.{ANGLE}"),
        (lambda: client.simulate(PENDULUM, tolerance=wrong), "tolerance"),
        (lambda: client.simulate(PENDULUM, [0.5, wrong]), "at"),
        (lambda: client.sweep(PENDULUM, {ANGLE: [0.1, wrong]}), f"vary.{ANGLE}"),
        (lambda: client.identify(PROBLEM, time_limit=wrong), "time_limit"),
    ):
        with pytest.raises(InputError, match=f"^{field}: needs a finite number, found (nan|inf)$"):
            call()
    with pytest.raises(InputError, match="cannot be sent"):
        client.simulate(PENDULUM, set={ANGLE: 0.1j})
