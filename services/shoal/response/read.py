"""Uncertain parameters as users write them: PATH=LOW:HIGH, PATH~normal(MEAN,SD), ... or a problem of SALib.

SALib: Herman and Usher, Journal of Open Source Software 2, 2017.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
from scipy import stats

from shoal.errors import InputError
from shoal.regular import require_regular
from shoal.response.inputs import ENDS, Inputs, UncertainParameter
from shoal.response.marginals import Empirical, Frozen, Interval, Marginal, Normal, Uniform
from shoal.response.posterior import from_posterior, is_source
from shoal.scene import Function, Scene
from shoal.trajectory import Array

FORM = "PATH=LOW:HIGH or PATH~normal(MEAN,SD) or the FILE.json of an estimate"
_CALL = re.compile(r"^\s*([a-z-]+)\s*\((.*)\)\s*$")
EVERYTHING = 10
"""Observations that an empirical distribution needs."""


def _normal(mean: float, deviation: float) -> Marginal:
    return Normal(mean, _positive("the deviation", deviation))


def _uniform(low: float, high: float) -> Marginal:
    return Uniform(low, _above(low, high))


def _lognormal(mean: float, deviation: float) -> Marginal:
    _positive("the mean", mean), _positive("the deviation", deviation)
    spread = math.sqrt(math.log1p((deviation / mean) ** 2))
    return Normal(math.log(mean) - 0.5 * spread**2, spread, logarithmic=True)


def _truncated(mean: float, deviation: float, low: float, high: float) -> Marginal:
    _positive("the deviation", deviation), _above(low, high)
    return Frozen(stats.truncnorm((low - mean) / deviation, (high - mean) / deviation, mean, deviation))


def _triangular(low: float, mode: float, high: float) -> Marginal:
    if not low <= mode <= _above(low, high):
        raise ValueError(f"the mode {mode:g} is not between {low:g} and {high:g}")
    return Frozen(stats.triang((mode - low) / (high - low), low, high - low))


def _beta(a: float, b: float, low: float, high: float) -> Marginal:
    _positive("a", a), _positive("b", b)
    return Frozen(stats.beta(a, b, low, _above(low, high) - low))


DISTRIBUTIONS: dict[str, tuple[Callable[..., Marginal], str]] = {
    "normal": (_normal, "MEAN,SD"),
    "uniform": (_uniform, "LOW,HIGH"),
    "lognormal": (_lognormal, "MEAN,SD"),
    "truncated-normal": (_truncated, "MEAN,SD,LOW,HIGH"),
    "triangular": (_triangular, "LOW,MODE,HIGH"),
    "beta": (_beta, "A,B,LOW,HIGH"),
}
"""Name -> what makes it from its numbers, and what these are. `empirical(FILE.csv)` is another."""


def parameters(
    vary: Mapping[str, Any] | Sequence[str | UncertainParameter], scene: Scene
) -> tuple[UncertainParameter, ...]:
    """The uncertain parameters of a scene, each of which it accepts at its ends. Raises InputError."""
    if is_problem(vary):
        vary = from_salib(cast(Mapping[str, Any], vary))
    if isinstance(vary, Mapping):
        return tuple(_parameter(name, known, scene) for name, known in vary.items())
    given = [vary] if isinstance(vary, str) else vary
    found: list[UncertainParameter] = []
    for one in given:
        if isinstance(one, UncertainParameter):
            found.append(one)
        elif is_source(one):
            found += from_posterior(one, scene)
        else:
            found.append(_parameter(*_split(one), scene))
    return tuple(found)


def by_name(vary: Mapping[str, Any] | Sequence[str]) -> dict[str, Any]:
    """Name -> (low, high) or a text, of what users write. Raises InputError for what only an object describes."""
    found = list(vary.items()) if isinstance(vary, Mapping) else [_split(text) for text in vary]
    for name, known in found:
        if not isinstance(known, str) and not (isinstance(known, Sequence) and len(known) == 2):
            raise InputError(f"vary: {name}: needs (low, high) or a text such as normal(1,0.01), found {known!r:.60}")
        if sum(other == name for other, _ in found) > 1:
            raise InputError(f"vary: {name} is varied twice")
    return dict(found)


def _split(text: str) -> tuple[str, Any]:
    for sign in ("~", "="):
        name, found, known = text.partition(sign)
        if found and name.strip() and known.strip() and (sign == "~" or "~" not in name):
            return name.strip(), known.strip() if sign == "~" else _ends(text, known)
    raise InputError(f"vary: {text!r} is not {FORM}")


def _ends(text: str, known: str) -> tuple[str, str]:
    low, colon, high = known.partition(":")
    if not colon or ":" in high:
        raise InputError(f"vary: {text} is not {FORM}")
    return low.strip(), high.strip()


def _parameter(name: str, known: Any, scene: Scene) -> UncertainParameter:
    paths = [path.strip() for path in name.split(",")]
    nominal = {path: _nominal(path, scene) for path in paths}
    marginal = _marginal(name, known, nominal[paths[0]])
    factors = dict.fromkeys(paths, 1.0)
    if len(paths) > 1 and nominal[paths[0]]:
        # Tied fields keep the ratios that the scene states.
        factors = {path: value / nominal[paths[0]] for path, value in nominal.items()}
    low, high = marginal.value(marginal.quantile(np.array(ENDS)))
    if isinstance(marginal, Interval):
        low, high = marginal.low, marginal.high
    for end in (low, high):
        try:
            scene.with_values({path: float(end) * factor for path, factor in factors.items()})
        except InputError as error:
            raise InputError(_reaching(name, marginal, low, high, error)) from None
    return UncertainParameter(name, marginal, factors)


def _reaching(name: str, marginal: Marginal, low: float, high: float, error: InputError) -> str:
    """Message for an end that a scene refuses: a distribution reaches further than its numbers suggest."""
    if not marginal.random:
        return str(error)
    below = "; truncated-normal(MEAN,SD,LOW,HIGH) and lognormal(MEAN,SD) stay above zero" if low < 0 < high else ""
    return f"vary: {name}~{marginal.text}: reaches from {low:.4g} to {high:.4g}{below}: {error}"


def _nominal(path: str, scene: Scene) -> float:
    if path.startswith("solver."):
        raise InputError(
            f"vary: {path} is a setting of the solver, whose error is no uncertainty of the machine; what may vary are "
            "numbers of gravity, bodies, joints, loads and initial"
        )
    value = scene.value(path)
    if value is None and path.startswith("initial."):
        return 0.0
    if isinstance(value, Function):
        value = value.number if value.number is not None else "a function of time"
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"vary: {path} is {value!r}, which is no number")
    if isinstance(value, int) and path.split(".")[-1] in ("elements", "modes", "axial_modes"):
        raise InputError(f"vary: {path} is a whole number, which cannot vary continuously")
    return float(value)


def _marginal(name: str, known: Any, nominal: float) -> Marginal:
    if isinstance(known, str):
        return _distribution(name, known)
    if hasattr(known, "quantile") and hasattr(known, "basis"):
        return cast(Marginal, known)
    if hasattr(known, "computeQuantile"):
        return Frozen(_OpenTurns(name, known), str(known))
    if hasattr(known, "ppf"):
        return Frozen(known, str(getattr(getattr(known, "dist", known), "name", known)))
    if isinstance(known, Sequence) and len(known) == 2:
        low, high = (_number(name, end, nominal) for end in known)
        if not low < high:
            raise InputError(
                f"vary: {name}={low:g}:{high:g}: LOW must be below HIGH; state what is known with --set PATH=VALUE"
            )
        return Interval(low, high, f"{low:g}:{high:g}")
    raise InputError(f"vary: {name}: {known!r} is neither (low, high) nor a distribution")


class _OpenTurns:
    """A distribution of OpenTURNS, by what those of scipy answer. Raises InputError."""

    def __init__(self, name: str, distribution: Any) -> None:
        if distribution.getDimension() != 1:
            raise InputError(f"vary: {name}: needs a distribution of one variable, found {distribution}")
        self._distribution = distribution

    def ppf(self, x: Array) -> Array:
        """Quantiles at probabilities x."""
        found = [self._distribution.computeQuantile(float(p))[0] for p in np.ravel(x)]
        return np.reshape(found, np.shape(x))

    def mean(self) -> float:
        """The mean."""
        return float(self._distribution.getMean()[0])

    def std(self) -> float:
        """The standard deviation."""
        return float(self._distribution.getStandardDeviation()[0])


def _number(name: str, end: Any, nominal: float) -> float:
    """A bound; with a per cent sign it is relative to what the scene states."""
    text = str(end).strip()
    try:
        value = nominal + abs(nominal) * float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except ValueError:
        raise InputError(f"vary: {name}: {text!r} is no number; write {FORM}") from None
    if text.endswith("%") and nominal == 0:
        raise InputError(f"vary: {name}: {text} of what the scene states, which is 0, is nothing; write numbers")
    if not math.isfinite(value):
        raise InputError(f"vary: {name}: bounds are finite, found {text}")
    return value


def _distribution(name: str, text: str) -> Marginal:
    called = _CALL.match(text)
    if called is None or called[1] not in (*DISTRIBUTIONS, "empirical"):
        forms = ", ".join(f"{one}({form})" for one, (_, form) in DISTRIBUTIONS.items())
        raise InputError(f"vary: {name}~{text}: no such distribution; there are {forms}, empirical(FILE.csv)")
    kind, inside = called[1], called[2]
    if kind == "empirical":
        return _empirical(name, inside.strip(), text)
    make, form = DISTRIBUTIONS[kind]
    try:
        numbers = [float(part) for part in inside.split(",")]
        if len(numbers) != len(form.split(",")) or not np.isfinite(numbers).all():
            raise ValueError(f"write {kind}({form}) with finite numbers")
        made = make(*numbers)
    except ValueError as error:
        reason = str(error) if "could not convert" not in str(error) else f"write {kind}({form})"
        raise InputError(f"vary: {name}~{text}: {reason}") from None
    object.__setattr__(made, "text", text)
    return made


def _empirical(name: str, file: str, text: str) -> Marginal:
    require_regular(Path(file), f"vary: {name}~{text}")
    try:
        lines = [line for line in Path(file).read_text().splitlines() if line.strip() and not line.startswith("#")]
        data = np.loadtxt(lines[_is_name(lines) :], delimiter=",", ndmin=1, dtype=float)
    except (OSError, ValueError) as error:
        raise InputError(f"vary: {name}~{text}: cannot read one column of numbers: {error}") from None
    if data.ndim != 1 or len(data) < EVERYTHING or not np.isfinite(data).all() or np.ptp(data) == 0:
        raise InputError(f"vary: {name}~{text}: needs one column of at least {EVERYTHING} different finite numbers")
    return Empirical(np.asarray(data, dtype=float), text)


def _is_name(lines: list[str]) -> bool:
    """Return whether the first line of a column names it."""
    try:
        float(lines[0].split(",")[0]) if lines else None
    except ValueError:
        return True
    return False


def _positive(what: str, value: float) -> float:
    if value <= 0:
        raise ValueError(f"{what} must be positive, found {value:g}")
    return value


def _above(low: float, high: float) -> float:
    if not low < high:
        raise ValueError(f"{high:g} is not above {low:g}")
    return high


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
    """Return marginals by name. Bounds without `dists` are uniform distributions, as in SALib. Raises InputError."""
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
    stated = [_salib_form(one.name, one.marginal) for one in inputs.parameters]
    return {
        "num_vars": len(stated),
        "names": inputs.names,
        "bounds": [numbers for _, numbers in stated],
        "dists": [kind for kind, _ in stated],
    }


def _salib_form(name: str, marginal: Marginal) -> tuple[str, list[float]]:
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
