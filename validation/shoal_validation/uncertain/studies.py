"""Random studies: bounds of a machine in closed form by a method, and random runs that try to leave them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from shoal.response import respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Interval
from shoal.response.respond import ModelResponse
from shoal.response.runs import Answers, Model
from shoal.trajectory import Array

from shoal_validation.uncertain.machines import KINDS, Kind

RUNS = 100_000
"""Random runs that look for a place outside."""
BLOCK = 2_000
CYCLES = 0.3, 300.0
SHORT = 6.0
"""Cycles of a machine that is integrated."""
WIDTH = 0.005, 0.3
"""Of an interval, as a share of the value in its middle."""
MOST = 1_000
"""Runs that a method may make."""
ROUNDING = 1e-9
"""Of the width: what the closed forms themselves may miss."""


@dataclass(frozen=True)
class Drawn:
    """A question. varied: which fields; shares: half widths, as shares; times: instants [s]; watched: whether the
    method may look between them
    """

    seed: int
    kind: Kind
    varied: tuple[int, ...]
    shares: tuple[float, ...]
    times: Array
    watched: bool

    @property
    def cycles(self) -> float:
        """Until the last instant."""
        return float(self.times[-1] / self.kind.period)

    @property
    def signals(self) -> int:
        """Number of signals of the machine."""
        return len(self.kind.motion(np.array(self.kind.fields)[:, None, None], self.times[:1]))

    @property
    def inputs(self) -> Inputs:
        """One parameter a varied field."""
        fields = self.kind.fields
        return Inputs(
            tuple(
                UncertainParameter(f"f{k}", Interval(fields[k] * (1 - share), fields[k] * (1 + share)), {f"f{k}": 1.0})
                for k, share in zip(self.varied, self.shares, strict=True)
            )
        )

    def motion(self, values: Mapping[str, Array], times: Array) -> Array:
        """(runs, instants * signals)."""
        count = len(next(iter(values.values())))
        fields = [np.full((count, 1), one) for one in self.kind.fields]
        for k in self.varied:
            fields[k] = values[f"f{k}"][:, None]
        found = self.kind.motion(np.stack(fields), times)
        return np.moveaxis(found, 0, 2).reshape(count, -1)

    def at(self, times: Array) -> Model:
        """Return the study as a model."""

        def model(values: Mapping[str, Array]) -> Answers:
            found = self.motion(values, times)
            return Answers(found, np.asarray(np.isfinite(found).all(axis=1)))

        return model


def drawn(seed: int) -> Drawn:
    """One to five intervals of one of the machines, at one to eight instants after a few or many cycles."""
    random = np.random.default_rng((seed, 2024))
    make = KINDS[seed % len(KINDS)]
    kind = make(random)
    count = int(random.integers(1, min(5, len(kind.fields)) + 1))
    varied = tuple(sorted(random.choice(len(kind.fields), count, False).tolist()))
    low, high = np.log(WIDTH)
    shares = tuple((np.exp(random.uniform(low, high, count)) / 2).tolist())
    most = SHORT if make.__name__ == "double_pendulum" else CYCLES[1]
    end = kind.period * math.exp(random.uniform(math.log(CYCLES[0]), math.log(most)))
    instants = int(random.integers(1, 9))
    times = np.sort(np.append(random.uniform(0.05, 1, instants - 1), 1.0)) * end
    return Drawn(seed, kind, varied, shares, times, bool(random.random() < 0.8))


@dataclass(frozen=True)
class Judged:
    """seed, machine, parameters, cycles: of the study; runs: made by the method; gap: told; ok: whether it refused no
    instant and knows its gap; beyond: how far a random run lies beyond the outer bounds within the horizon, short: how
    far beyond those that are called attained, as shares of the width; broken: how far the run at the arguments named
    stays inside the bound that it should attain
    """

    seed: int
    machine: str
    parameters: int
    cycles: float
    why: str
    runs: int
    gap: float
    ok: bool
    beyond: float
    short: float
    broken: float

    @property
    def kept(self) -> bool:
        """Return whether no run lies further out than the reported gap, and every bound is attained."""
        return math.isnan(self.gap) or (self.beyond <= self.gap + ROUNDING and self.broken <= ROUNDING)


def judged(asked: Drawn, runs: int = RUNS) -> Judged:
    """The study by `auto`, and `runs` random runs against it."""
    return against(asked, answered(asked), runs)


def answered(asked: Drawn) -> ModelResponse:
    """By `auto`."""
    times, signals = asked.times, asked.signals
    return respond(
        asked.at(times),
        asked.inputs,
        signals * len(times),
        groups=np.tile(np.arange(signals), len(times)),
        instants=np.repeat(times, signals),
        seed=asked.seed,
        most=MOST,
        over_time=asked.at if asked.watched else None,
    )


def against(asked: Drawn, answer: ModelResponse, runs: int) -> Judged:
    """Random runs against an answer."""
    signals = asked.signals
    bounds, times = answer.bounds, asked.times
    assert bounds is not None
    low, high = attempted(asked, runs)
    low, high = np.minimum(low, bounds.lower), np.maximum(high, bounds.upper)
    widest = (high - low).reshape(len(times), signals).max(axis=0)
    width = np.tile(np.where(widest > 0, widest, 1.0), len(times))
    within = np.repeat(times <= bounds.horizon, signals)
    beyond = np.maximum(bounds.lower_outer - low, high - bounds.upper_outer) / width
    short = np.maximum(bounds.lower - low, high - bounds.upper) / width
    names = asked.inputs.names
    every = np.arange(len(low))
    broken = 0.0
    for bound, arguments, sign in ((bounds.lower, bounds.at_lower, 1), (bounds.upper, bounds.at_upper, -1)):
        reached = asked.motion(dict(zip(names, arguments.T, strict=True)), times)[every, every]
        broken = max(broken, float((sign * (reached - bound) / width)[within].max(initial=0.0)))
    ok = math.isinf(bounds.horizon) and not math.isnan(bounds.gap)
    return Judged(
        seed=asked.seed,
        machine=asked.kind.name,
        parameters=len(asked.varied),
        cycles=asked.cycles,
        why=answer.found.why,
        runs=answer.runs.own,
        gap=bounds.gap,
        ok=ok,
        beyond=float(beyond[within].max(initial=0.0)),
        short=float(short[within].max(initial=0.0)),
        broken=broken,
    )


def attempted(asked: Drawn, runs: int) -> tuple[Array, Array]:
    """Extremes of random runs, (columns,): in the box, on its faces, and about the best ones so far."""
    random = np.random.default_rng((asked.seed, 7))
    inputs = asked.inputs
    low = high = asked.motion(inputs.values(np.zeros((1, len(inputs)))), asked.times)[0]
    at = [np.zeros((len(low), len(inputs))), np.zeros((len(low), len(inputs)))]
    blocks = max(1, runs // BLOCK)
    for k in range(blocks):
        if k < 2 * blocks // 3 or k == 0:
            xi = random.uniform(-1, 1, (BLOCK, len(inputs)))
            xi = np.where(random.random(xi.shape) < (0.0, 0.3, 0.7)[k % 3], np.sign(xi), xi)
        else:
            best = np.concatenate(at)
            size = 10.0 ** random.uniform(-4, -0.5, (BLOCK, 1))
            xi = best[random.integers(0, len(best), BLOCK)] + size * random.uniform(-1, 1, (BLOCK, len(inputs)))
            xi = np.clip(xi, -1, 1)
        found = asked.motion(inputs.values(xi), asked.times)
        # A closed form may not reach a singular place, such as a pendulum that stands upright.
        finite = np.isfinite(found).all(axis=1)
        xi, found = xi[finite], found[finite]
        for side, sign in enumerate((1, -1)):
            least = np.argmin(sign * found, axis=0)
            value = found[least, np.arange(len(low))]
            better = sign * value < sign * (low, high)[side]
            at[side][better] = xi[least][better]
        low, high = np.minimum(low, found.min(axis=0)), np.maximum(high, found.max(axis=0))
    return low, high
