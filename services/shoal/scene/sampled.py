"""Sampled signals and states: zero-order holds and equations of differences, at the instants first + k period.

At an instant all is measured as it is just before, samples are made in the order in which they depend on each other,
and then sampled states take their next values (Astrom and Wittenmark, Computer-Controlled Systems, 1997, chapter 2).
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Annotated, Any, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import Discriminator, Tag

from shoal.errors import InputError
from shoal.scene.function import SignalFunction
from shoal.scene.record import NonNegative, Positive, Record

MOST_SAMPLES = 1_000_000
"""In a run: a convention, of seconds of computing and of memory of a few tens of megabytes."""
MOST_CLOCKS = 29
"""What is due at an instant is a number of 64 bits, two a clock."""
INSTANTS = ("period", "delay", "first", "quantum")
"""Fields in which lanes, whose steps end at the same instants, do not differ."""


class Clock(NamedTuple):
    """Instants first + k period of samples, whose values are there `delay` later [s], exactly as they are written."""

    first: Fraction
    period: Fraction
    delay: Fraction = Fraction(0)

    @property
    def flying(self) -> int:
        """Return the largest number of values that are on their way at once."""
        return -int(-self.delay // self.period)

    def instants(self, end: float, delay: Fraction = Fraction(0)) -> npt.NDArray[np.float64]:
        """Return the instants from 0 up to an end [s], each rounded once; delay: by which all are later."""
        first = self.first + delay
        count = int((Fraction(end) - first) / self.period) + 1 if first <= end else 0
        unit = first.denominator * self.period.denominator
        begin, step = int(first * unit), int(self.period * unit)
        if begin + count * step < 2**53 and unit < 2**53:  # both are numbers of floating point
            return np.asarray((begin + step * np.arange(count)) / unit)
        return np.array([(begin + step * k) / unit for k in range(count)])


class Sampling(Record):
    """When a controller measures and acts, and how finely it measures."""

    period: Positive
    """Time from a sample to the next one [s]."""
    delay: NonNegative = 0.0
    """Time from a sample to the command that follows from it [s]."""
    quantum: Positive | None = None
    """What is measured is rounded to multiples of this [its unit]."""
    first: NonNegative = 0.0
    """Instant of the first sample [s]; before its command the output is 0."""


class Sampled(Sampling):
    """A signal that is sampled and held: its value changes at its instants only."""

    sample: SignalFunction
    """What is sampled, a formula of time, measures, states and signals."""

    @property
    def clock(self) -> Clock:
        """Its instants."""
        return Clock(*(Fraction(repr(one)) for one in (self.first, self.period, self.delay)))


class SampledState(Record):
    """A number that obeys an equation of differences, as the memory of a sampled controller."""

    next: SignalFunction
    """Its next value, a formula of time, measures, signals and states as they are at an instant."""
    period: Positive
    """Time from an instant to the next one [s]."""
    first: NonNegative = 0.0
    """The first instant [s]."""
    start: float = 0.0
    """Its value up to the first instant [1]."""

    @property
    def clock(self) -> Clock:
        """Its instants."""
        return Clock(*(Fraction(repr(one)) for one in (self.first, self.period)))


def _sampled(data: Any) -> str:
    named = data if isinstance(data, dict) else ()
    return "function-sampled" if isinstance(data, Sampled) or {"sample", "period"} & {*named} else "function-of-signals"


def differences(data: Any) -> str:
    """Return the tag of a state: whether it has a next value or a rate."""
    named = data if isinstance(data, dict) else ()
    return "function-next" if isinstance(data, SampledState) or {"next", "period"} & {*named} else "function-rate"


Signal = Annotated[
    Annotated[SignalFunction, Tag("function-of-signals")] | Annotated[Sampled, Tag("function-sampled")],
    Discriminator(_sampled),
]


def refuse_apart(scene: Any, paths: Iterable[str]) -> None:
    """Raises InputError for paths of instants that other parts of a scene share, as those of one controller do."""
    for path in paths:
        part, name, field = ([*path.split("."), "", ""])[:3]
        one = getattr(scene, part).get(name) if part in ("signals", "states") else None
        if field not in ("period", "first") or not isinstance(one, Sampled | SampledState):
            continue
        parts = {**scene.signals, **scene.states}
        kinds = {k: each for k, each in parts.items() if isinstance(each, Sampled | SampledState) and k != name}
        others = [k for k, each in kinds.items() if (each.period, each.first) == (one.period, one.first)]
        if others:
            raise InputError(
                f"{path}: {', '.join(others)} is sampled at the same instants, as parts of a controller are, in whose "
                "formulas the period stands too; state another one in the file of the scene"
            )


def merged_instants(clocks: tuple[tuple[Clock, str], ...], end: float) -> tuple[Any, Any]:
    """Return the instants of clocks up to an end [s], increasing, and what is due at each.

    Bit 2 k of that: samples of clock k; bit 2 k + 1: what these led to. clocks: with the field of what follows
    each. Raises InputError for more than `MOST_SAMPLES`.
    """
    times, due = [np.zeros(0)], [np.zeros(0, dtype=np.int64)]
    if len(clocks) > MOST_CLOCKS:
        raise InputError(f"{clocks[MOST_CLOCKS][1]}: a scene has at most {MOST_CLOCKS} different instants of samples")
    for number, (clock, name) in enumerate(clocks):
        if end / clock.period > MOST_SAMPLES:
            raise InputError(
                f"{name}: its period of {float(clock.period):g} s makes {end / clock.period:.3g} samples in {end:g} s; "
                f"a run has at most {MOST_SAMPLES}"
            )
        for bit, delay in ((0, Fraction(0)), (1, clock.delay)) if clock.delay else ((0, clock.delay),):
            times.append(clock.instants(end, delay))
            due.append(np.full(len(times[-1]), 1 << (2 * number + bit), dtype=np.int64))
    at, where = np.unique(np.concatenate(times), return_inverse=True)
    if len(at) > 2 * MOST_SAMPLES:
        raise InputError(f"{clocks[0][1]}: with {clocks[1][1]} there are {len(at)} instants of samples in a run")
    masks = np.zeros(len(at), dtype=np.int64)
    np.bitwise_or.at(masks, where, np.concatenate(due))
    return at, masks
