"""Runs of a study: standardised variables, answers and validity; their file, and the time that they may take."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from shoal.compile import clock
from shoal.errors import ComputationError, InputError
from shoal.evaluation_cache import EvaluationCache
from shoal.response.inputs import BoolArray, Inputs
from shoal.trajectory import Array

Model = Callable[[Mapping[str, Array]], "Answers"]
"""Path -> values, (runs,), to answers."""
SAME = 1e-9
"""Distance below which two places are one run."""


@dataclass(frozen=True)
class Answers:
    """Answers of several runs.

    values: (runs, columns); good: which may be believed, (runs,); repeated: how many took smaller steps; why: of the
    first that may not be believed; away: how far each starts from what is stated of its start, (runs, stated values),
    None where starts are not counted; words: of events of contacts until each instant, as numbers, (runs, instants),
    None of machines without contacts
    """

    values: Array
    good: BoolArray
    repeated: int = 0
    why: str = ""
    away: Array | None = None
    words: Array | None = None


class TooManyRunsError(Exception):
    """The study has used up its runs."""


@dataclass
class CachedModel:
    """A model whose runs are kept: call it with standardised variables.

    most: runs that it may make; progress: called after every call with their number; controls: runs all over the box
    that test a surrogate; named: runs at the arguments of its extremes, which attain the bounds; aside: runs that were
    set aside; looked: those of them that looked for different events
    """

    model: Model
    inputs: Inputs
    most: int
    progress: Callable[[int], None] | None = None
    repeated: int = 0
    why: str = ""
    _xi: list[Array] = field(default_factory=list)
    _values: list[Array] = field(default_factory=list)
    _good: list[BoolArray] = field(default_factory=list)
    _words: list[Array] = field(default_factory=list)
    controls: int = 0
    named: int = 0
    aside: int = 0
    looked: int = 0

    @classmethod
    def known(cls, model: Model, inputs: Inputs, xi: Array, values: Array, most: int | None = None) -> CachedModel:
        """Return a model with these runs, all good, and no further ones unless `most` allows them."""
        most, good = len(xi) if most is None else most, np.ones(len(xi), dtype=bool)
        return cls(model, inputs, most, None, 0, "", [xi], [values], [good])

    def __call__(self, xi: Array) -> int:
        """Make the runs at these places that have not been made; how many they are.

        Raises TooManyRunsError, InputError.
        """
        return self.all(self._fresh(np.atleast_2d(xi)))

    def all(self, fresh: Array) -> int:
        """Make the runs at all of these places; how many they are.

        Raises TooManyRunsError, InputError, and ComputationError if none may be believed.
        """
        if not len(fresh):
            return 0
        if self.evaluations + len(fresh) > self.most:
            raise TooManyRunsError
        return self.keep(fresh, self.model(self.inputs.values(fresh)))

    def keep(self, fresh: Array, answers: Answers) -> int:
        """Keep runs that were made at these places; how many they are. Raises InputError, ComputationError."""
        if answers.values.shape[0] != len(fresh):
            raise InputError(f"model: needs one answer a run, found {answers.values.shape[0]} for {len(fresh)}")
        self._xi.append(fresh)
        self._values.append(answers.values)
        self._good.append(answers.good)
        if answers.words is not None:
            self._words.append(answers.words)
        self.repeated += answers.repeated
        self.why = self.why or answers.why
        if self.failed == sum(map(len, self._xi)):
            raise ComputationError(f"all {self.failed} runs failed: {self.why}")
        if self.progress is not None:
            self.progress(self.evaluations)
        return len(fresh)

    def _fresh(self, xi: Array) -> Array:
        kept: list[Array] = []
        known = np.concatenate(self._xi) if self._xi else np.empty((0, xi.shape[1]))
        for one in xi:
            beside = np.concatenate([known, np.array(kept)]) if kept else known
            if not len(beside) or np.min(np.max(np.abs(beside - one), axis=1)) > SAME:
                kept.append(one)
        return np.array(kept).reshape(-1, xi.shape[1])

    def set_aside(self) -> None:
        """Forget all runs but their number, where they do not suit the method that goes on."""
        self.aside, self.why = self.evaluations, ""
        self._xi, self._values, self._good, self._words = [], [], [], []

    def part(self, which: BoolArray) -> CachedModel:
        """Some of the good runs, (runs,), for fits to fewer of them."""
        return CachedModel.known(self.model, self.inputs, self.xi[which], self.values[which], self.most)

    @property
    def left(self) -> int:
        """Runs that may still be made."""
        return self.most - self.evaluations

    @property
    def evaluations(self) -> int:
        """Runs made, those that failed among them."""
        return self.aside + sum(map(len, self._xi))

    @property
    def own(self) -> int:
        """Runs made but for those of control, at the extremes of a surrogate of cycles, and that looked for events."""
        return self.evaluations - self.controls - self.named - self.looked

    @property
    def failed(self) -> int:
        """Runs that failed and went on failing with smaller steps."""
        return int(sum(np.sum(~good) for good in self._good))

    def describe_failed(self) -> str:
        """Describe the values of the parameters between which runs have failed, and those of the first."""
        bad = np.concatenate(self._xi)[~np.concatenate(self._good)]
        if not len(bad):
            return ""
        values = self.inputs.named(bad)
        ends = zip(self.inputs.names, values.min(axis=0), values.max(axis=0), values[0], strict=True)
        return ", ".join(
            f"{name} {low:.6g} to {high:.6g} (first {one:.6g})" if low < high else f"{name} {one:.6g}"
            for name, low, high, one in ends
        )

    @property
    def xi(self) -> Array:
        """Standardised variables of the good runs, (runs, parameters)."""
        return np.concatenate(self._xi)[np.concatenate(self._good)]

    @property
    def values(self) -> Array:
        """Answers of the good runs, (runs, columns)."""
        return np.concatenate(self._values)[np.concatenate(self._good)]

    @property
    def words(self) -> Array | None:
        """Words of events of the good runs, (runs, instants); None of machines without contacts."""
        return np.concatenate(self._words)[np.concatenate(self._good)] if self._words else None

    @property
    def attaining(self) -> Array:
        """Germs of the runs that attain the least or the largest answer of some column, (some, parameters)."""
        values = self.values
        return np.asarray(self.xi[np.union1d(values.argmin(axis=0), values.argmax(axis=0))])


class TimeIsUpError(TooManyRunsError):
    """The study has used up its time."""


@dataclass
class Keep:
    """memory: of the runs, None if they are not kept; end: by `clock` [s], None if there is none; over: whether a run
    was refused because of it
    """

    memory: EvaluationCache | None = None
    end: float | None = None
    over: bool = False

    def close(self) -> None:
        """Close the file, if there is one."""
        if self.memory is not None:
            self.memory.close()

    def __call__(
        self, label: str, values: Mapping[str, Array], run: Callable[[Mapping[str, Array]], Answers], stated: int = 0
    ) -> Answers:
        """Return the answers of runs, from the file where they are known. Raises TimeIsUpError.

        label: of the answers; stated: number of start values whose distance is stored
        """
        points = np.stack(list(values.values()))
        known = None if self.memory is None else self.memory.recall(label, points)
        if known is not None:
            good, columns = known[:-1, -1] == 1.0, known.shape[1] - 1 - stated
            why = "" if good.all() else "they failed before the study was broken off"
            away = known[:-1, columns:-1].copy() if stated else None
            return Answers(known[:-1, :columns].copy(), good, int(known[-1, -1]), why, away)
        if self.end is not None and clock.now() > self.end:
            self.over = True
            raise TimeIsUpError
        found = run(values)
        if self.memory is not None:
            parts = [found.values, *([found.away] if found.away is not None and stated else []), found.good]
            rows = np.column_stack(parts)
            last = np.zeros((1, rows.shape[1]))
            last[0, -1] = found.repeated
            self.memory.keep(label, points, np.concatenate([rows, last]))
        return found
