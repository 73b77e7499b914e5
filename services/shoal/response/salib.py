"""SALib's problem dictionaries, in and out (Herman and Usher, SALib, Journal of Open Source Software 2, 2017)."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

from scipy import stats

from shoal.errors import InputError
from shoal.response.inputs import Inputs
from shoal.response.marginals import Frozen, Interval, Marginal, Normal, Uniform

_FORMS: dict[str, tuple[int, Callable[..., Marginal]]] = {
    "unif": (2, lambda low, high: Uniform(low, high, f"uniform({low:g},{high:g})")),
    "norm": (2, lambda mean, deviation: Normal(mean, deviation, f"normal({mean:g},{deviation:g})")),
    "lognorm": (2, lambda mean, deviation: Normal(mean, deviation, "lognormal", logarithmic=True)),
    "logunif": (2, lambda low, high: Frozen(stats.loguniform(low, high), "log-uniform")),
    "triang": (
        3,
        lambda low, high, peak: Frozen(
            stats.triang(peak, low, high - low), f"triangular({low!r},{low + peak * (high - low)!r},{high!r})"
        ),
    ),
    "truncnorm": (
        4,
        lambda low, high, mean, deviation: Frozen(
            stats.truncnorm((low - mean) / deviation, (high - mean) / deviation, mean, deviation),
            f"truncated-normal({mean!r},{deviation!r},{low!r},{high!r})",
        ),
    ),
}
"""Name -> how many bounds, and what they make: of lognorm those of the logarithm, of triang the last is a share."""
_CALL = re.compile(r"^([a-z-]+)\((.*)\)$")


def is_problem(given: Any) -> bool:
    """Return whether a mapping is a problem of SALib."""
    return isinstance(given, Mapping) and {"names", "bounds"} <= given.keys() and "num_vars" in given


def from_salib(problem: Mapping[str, Any]) -> dict[str, Marginal]:
    """Name -> what is known. Bounds without `dists` are uniform distributions, as in SALib. Raises InputError."""
    names, bounds = list(problem["names"]), list(problem["bounds"])
    kinds = list(problem.get("dists") or ["unif"] * len(names))
    if not len(names) == len(bounds) == len(kinds) == problem["num_vars"]:
        raise InputError("vary: num_vars, names, bounds and dists of the problem differ in length")
    if problem.get("groups") not in (None, names):
        raise InputError("vary: groups of a problem of SALib are not known here")
    found = {}
    for name, ends, kind in zip(names, bounds, kinds, strict=True):
        if kind not in _FORMS:
            raise InputError(f"vary: {name}: dists has {kind!r}; there are {', '.join(_FORMS)}")
        count, make = _FORMS[kind]
        numbers = [float(end) for end in ends]
        if len(numbers) != count:
            raise InputError(f"vary: {name}: {kind} needs {count} bounds, found {len(numbers)}")
        spread = numbers[1] - numbers[0] if kind not in ("norm", "lognorm") else numbers[1]
        if not spread > 0:
            raise InputError(f"vary: {name}: {kind} with bounds {numbers} has no width")
        found[name] = make(*numbers)
    return found


def to_salib(inputs: Inputs) -> dict[str, Any]:
    """The problem of these parameters; intervals are uniform there. Raises InputError."""
    told = [_told(one.name, one.marginal) for one in inputs.parameters]
    return {
        "num_vars": len(told),
        "names": inputs.names,
        "bounds": [numbers for _, numbers in told],
        "dists": [kind for kind, _ in told],
    }


def _told(name: str, marginal: Marginal) -> tuple[str, list[float]]:
    if isinstance(marginal, Interval):
        return "unif", [marginal.low, marginal.high]
    if isinstance(marginal, Normal):
        return "lognorm" if marginal.logarithmic else "norm", [marginal.mean, marginal.deviation]
    called = _CALL.match(marginal.text.replace(" ", ""))
    numbers = [float(part) for part in called[2].split(",")] if called and called[1] != "empirical" else []
    if called and called[1] == "triangular":
        low, mode, high = numbers
        return "triang", [low, high, (mode - low) / (high - low)]
    if called and called[1] == "truncated-normal":
        mean, deviation, low, high = numbers
        return "truncnorm", [low, high, mean, deviation]
    raise InputError(f"vary: {name}: SALib has no distribution {marginal.text or 'such as this one'}")
