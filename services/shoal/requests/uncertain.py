"""The request for the motion of a scene of which some numbers are intervals or distributions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import KW_ONLY
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self

from pydantic import BeforeValidator, model_validator
from pydantic.dataclasses import dataclass

from shoal.arguments import Limit
from shoal.requests import texts
from shoal.requests.fields import At, Engine, Length, OfScene, Seconds, Seed, Verify, check_tolerance
from shoal.requests.option import HERE, Option
from shoal.requests.request import STRICT, wrong

if TYPE_CHECKING:
    from collections.abc import Sequence

LIMIT_RUNS = 5_000
"""Runs for each probability, unless stated."""
_VARY = (
    'An interval (-2%:2% is relative) or a distribution, such as "bodies.OA.length~normal(1,0.01)". PATH,PATH=... ties '
    "fields together. FILE is what `shoal identify --out` wrote, .json or .nc of draws. In Python also path -> "
    "(low, high), a text, or a frozen distribution of scipy."
)
_CORRELATE = "Correlation of two random parameters; in Python (path, path) -> value."
_GAP = "Go on until outer and attained bounds differ by this share of the width."
_LIMIT = (
    "What must not happen, the opposite of a requirement; also JOINT.force, .torque, energy, .strain and so on "
    "(docs/reference/uncertain.md)."
)
_TOLERANCE = "Use the cheapest model whose errors at the markers stay below [m]."
_WORST = "Write the scene that comes nearest to a limit, or goes furthest beyond, or attains a bound."
_WHOLE = "a whole number"


def _texts(given: Any) -> tuple[str, ...]:
    return tuple(texts.listed(given))


def _spans(given: Any) -> Any:
    """Return entries as on the command line; a mapping is path -> span or distribution."""
    if not isinstance(given, Mapping):
        return texts.listed(given)
    return [f"{path}{'~' if '(' in str(known) else '='}{_span(known)}" for path, known in given.items()]


def _span(known: Any) -> Any:
    return f"{known[0]}:{known[1]}" if isinstance(known, list) and len(known) == 2 else known


def _entries(given: Any) -> list[str]:
    return [f"{key}={value}" for key, value in given.items()] if isinstance(given, Mapping) else texts.listed(given)


def _correlations(given: Any) -> dict[tuple[str, str], float]:
    """Read PATH,PATH=VALUE entries."""
    found: dict[tuple[str, str], float] = {}
    for text in _entries(given):
        names, _, value = text.rpartition("=")
        one, comma, other = names.partition(",")
        try:
            known = float(value)
        except ValueError:
            comma = ""
        if not comma:
            raise ValueError(f"{text!r} is not PATH,PATH=VALUE, such as bodies.A.length,bodies.B.length=0.8")
        pair = one.strip(), other.strip()
        if pair in found or pair[::-1] in found:
            raise ValueError(f"{', '.join(pair)}: is given twice")
        found[pair] = known
    return found


def _by_pair(given: Any) -> Any:
    """Return [path, path, value] entries as a mapping too."""
    return {(one, other): value for one, other, value in given} if isinstance(given, list) else given


def _costs(given: Any) -> dict[str, float]:
    """Read PATH=COST entries."""
    found: dict[str, float] = {}
    for text in _entries(given):
        name, _, cost = text.rpartition("=")
        try:
            known = float(cost)
        except ValueError:
            name = ""
        if not name:
            raise ValueError(f"{text!r} is not PATH=COST, such as bodies.OA.length=2.5")
        if (name := name.strip()) in found:
            raise ValueError(f"{name} is given twice")
        found[name] = known
    return found


def _condition(about: str, metavar: str, old: str) -> Any:
    return Annotated[
        tuple[str, ...],
        BeforeValidator(_texts),
        Option(about, metavar, many=True, old=old, shown="Sequence[str]"),
    ]


if TYPE_CHECKING:
    Vary = Mapping[str, Any] | Sequence[Any] | str
    Correlate = Mapping[tuple[str, str], float] | None
    Cost = Mapping[str, float] | None
    Limits = Sequence[str]
    Requirements = Sequence[str]
else:
    Vary = Annotated[
        Any,
        Option(
            _VARY,
            "PATH=LOW:HIGH|PATH~DISTRIBUTION|FILE",
            many=True,
            shown="Mapping[str, Any] | Sequence[str]",
            text=_spans,
        ),
    ]
    Correlate = Annotated[
        Any,
        BeforeValidator(_by_pair),
        Option(
            _CORRELATE,
            "PATH,PATH=VALUE",
            many=True,
            old="correlations",
            shown="Mapping[tuple[str, str], float] | None",
            text=_correlations,
        ),
    ]
    Cost = Annotated[
        Mapping[str, float] | None,
        Option(
            "With allocate: cost of tightening this tolerance (default: 1).",
            "PATH=COST",
            many=True,
            old="costs",
            text=_costs,
        ),
    ]
    Limits = _condition(_LIMIT, '"MARKER.QUANTITY < NUMBER"', "limits")
    Requirements = _condition("What must hold, the opposite of a limit.", '"MARKER.QUANTITY > NUMBER"', "requirements")


@dataclass(frozen=True, config=STRICT)
class Uncertain(OfScene):
    """Bound or predict the motion of the markers if fields of a scene are intervals or distributions.

    Intervals give bounds that runs attain, distributions give means, standard deviations, quantiles and Sobol indices.
    A requirement states what must hold, a limit what must not happen: with intervals the answer is whether it can be
    violated, with distributions how probable that is.
    """

    vary: Vary
    at: At = None
    _: KW_ONLY
    correlate: Correlate = None
    method: Annotated[str, Option("Method.", "NAME", names="responses")] = "auto"
    gap: Annotated[Annotated[float, Limit("a share", gt=0, le=1)] | None, Option(_GAP, "SHARE")] = None
    tolerance: Annotated[Length | None, Option(_TOLERANCE, "METRES")] = None
    runs: Annotated[int, Limit(_WHOLE, ge=3, whole=True), Option("Most runs that may be made.", old="most")] = 20_000
    degree: Annotated[
        Annotated[int, Limit(_WHOLE, ge=1, le=40, whole=True)] | None,
        Option("Of a method that has one (default: its own)."),
    ] = None
    count: Annotated[
        Annotated[int, Limit(_WHOLE, ge=1, whole=True)] | None,
        Option("Runs of a method that samples (default: its own)."),
    ] = None
    limit: Limits = ()
    require: Requirements = ()
    limit_method: Annotated[str, Option("Of a probability.", "NAME", names="probabilities")] = "auto"
    limit_runs: Annotated[int, Limit(_WHOLE, ge=100, whole=True), Option("Runs for each probability.")] = LIMIT_RUNS
    allocate: Annotated[bool, Option("Look for the widest tolerances that keep the limit.")] = False
    target: Annotated[
        Annotated[float, Limit("a probability", gt=0, lt=0.5)] | None,
        Option("With allocate: the probability of exceeding the limit (default: 0.001)."),
    ] = None
    cost: Cost = None
    time_limit: Annotated[Seconds | None, Option("End after this time [s] with what is known.", "SECONDS")] = None
    checkpoint: Annotated[
        str | Path | None, Option("Keep the runs in this file; where it exists, go on from it.", "FILE", fronts=HERE)
    ] = None
    engine: Engine = "gauss"
    verify: Verify = True
    seed: Seed = 0
    worst: Annotated[str | None, Option(_WORST, "FILE.yaml", fronts=("command", "study"))] = None
    worst_of: Annotated[
        str,
        Option("Which: a limit, or MARKER.QUANTITY.lower, .upper.", "LIMIT|BOUND", fronts=("command", "study")),
    ] = ""
    progress: Annotated[
        Callable[[int], None] | None, Option("Called with the number of runs so far.", fronts=("python",))
    ] = None

    @model_validator(mode="after")
    def _together(self) -> Self:
        check_tolerance(self.tolerance, True, self.engine)
        for name in ("cost", "target"):
            if getattr(self, name) and not self.allocate:
                wrong(name, "belongs to allocate, the search for the widest tolerances; ask for that too")
        for name, own in {"limit_method": "auto", "limit_runs": LIMIT_RUNS}.items():
            if getattr(self, name) != own and not (self.limit or self.require):
                wrong(name, "belongs to a limit, whose probability it is for; state one, such as B.y < -1.2")
        if self.allocate and len(self.limit) + len(self.require) != 1:
            number = len(self.limit) + len(self.require)
            wrong("allocate", f"needs one limit, found {number}; state it as what must hold or must not happen")
        return self
