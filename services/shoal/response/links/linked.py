"""Which columns are told by a function of something simpler: those that it foretells clearly better."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shoal.response.expansion import Expansion, unexplained
from shoal.response.inputs import BoolArray, IntArray
from shoal.response.links.exponential import exponentials
from shoal.response.links.link import CLEARLY, Fitted, Link, some
from shoal.response.links.ridge import ridges
from shoal.response.outermost import outermost
from shoal.response.study import Study
from shoal.trajectory import Array

FOLDS = 5
"""Parts of the runs that are left out in turn, beside the outermost ones."""
Kind = Callable[[Study, Expansion, IntArray, Fitted], Sequence[tuple[IntArray, Link]]]
KINDS: list[Kind] = [exponentials, ridges]
"""In which the answers are functions of something simpler."""


@dataclass(frozen=True)
class Linked:
    """An expansion, and what tells some columns better.

    links: the columns, (n,), and what tells them; left_out, squares: as those of `Expansion`
    """

    plain: Expansion
    links: tuple[tuple[IntArray, Link], ...]
    left_out: Array
    squares: Array

    @property
    def mean(self) -> Array:
        """Over all parameters, (columns,)."""
        found = self.plain.mean.copy()
        for columns, link in self.links:
            found[columns] = link.mean
        return found

    @property
    def variance(self) -> Array:
        """Over all parameters, (columns,)."""
        found = self.plain.variance.copy()
        for columns, link in self.links:
            found[columns] = link.variance
        return found

    def again(self, study: Study, fitted: Fitted, simply: Fitted) -> Linked:
        """The same links for other runs; fitted: the expansion, simply: those within links."""
        links = tuple((columns, link.again(some(study, columns), simply)) for columns, link in self.links)
        all_of_them = sum(len(columns) for columns, _ in links) == len(self.left_out)
        return replace(self, plain=(simply if all_of_them else fitted)(study), links=links)

    @property
    def why(self) -> str:
        """In words, which columns are told otherwise."""
        texts = dict.fromkeys(link.text for _, link in self.links)
        counts = {text: sum(len(which) for which, link in self.links if link.text == text) for text in texts}
        return "".join(f"; {count} of {len(self.left_out)} answers by {text}" for text, count in counts.items())


def plainly(found: Expansion) -> Linked:
    """An expansion without links."""
    squares = found.left_out if found.squares is None else found.squares
    return Linked(found, (), found.left_out, squares)


def linked(study: Study, found: Expansion, wanted: BoolArray, fitted: Fitted) -> Linked:
    """With links in those of the wanted columns, (columns,), that they tell clearly better."""
    told = plainly(found)
    for kind in KINDS:
        for columns, link in kind(study, found, np.flatnonzero(wanted), fitted):
            told = _better(study, told, columns, link, fitted)
    return told


def beside(told: Linked, found: Expansion) -> Linked:
    """The links where they are still clearly better than another expansion."""
    return _with(plainly(found), told.links, told.left_out, told.squares)


def _better(study: Study, told: Linked, columns: IntArray, link: Link, fitted: Fitted) -> Linked:
    """With the link in those of these columns in which it is clearly better."""
    part, left_out, squares = some(study, columns), np.full(len(told.left_out), np.inf), told.squares.copy()
    with np.errstate(all="ignore"):
        missed, outer = _missed(part, link, fitted)
        found, squares[columns] = unexplained(part.runs.values, missed)
        sound = np.isfinite(link.mean) & np.isfinite(link.variance)
        left_out[columns] = np.where(sound, np.maximum(np.maximum(found, outer), link.beyond), np.inf)
    return _with(told, [(columns, link)], left_out, squares)


def _with(told: Linked, links: Iterable[tuple[IntArray, Link]], left_out: Array, squares: Array) -> Linked:
    """With links where their error, (columns,), is clearly smaller."""
    better = left_out < CLEARLY * told.left_out
    kept = [*_where(told.links, ~better), *_where(links, better)]
    left_out, squares = (np.where(better, *pair) for pair in ((left_out, told.left_out), (squares, told.squares)))
    return Linked(told.plain, tuple(kept), left_out, squares)


def _where(links: Iterable[tuple[IntArray, Link]], wanted: BoolArray) -> Iterator[tuple[IntArray, Link]]:
    """In those of their columns that are wanted, (columns,)."""
    for columns, link in links:
        which = wanted[columns]
        if which.any():
            yield columns[which], link.some(which)


def _missed(study: Study, link: Link, fitted: Fitted) -> tuple[Array, Array]:
    """What fits to other runs miss of each, (runs, columns), and the error of the outermost ones, (columns,)."""
    runs = study.runs
    missed = np.empty_like(runs.values)
    for left in np.array_split(np.arange(len(missed)), FOLDS):
        missed[left] = _foretold(study, link, fitted, left)
    outer = np.flatnonzero(outermost(study.inputs, runs.germs))
    beyond = _foretold(study, link, fitted, outer) if len(outer) else np.zeros((0, missed.shape[1]))
    return missed, np.sqrt((beyond**2).sum(axis=0) / len(missed))


def _foretold(study: Study, link: Link, fitted: Fitted, left: IntArray) -> Array:
    """What a fit without them misses of these runs."""
    kept = np.ones(len(study.runs.germs), dtype=bool)
    kept[left] = False
    other = link.again(replace(study, runs=study.runs.part(kept)), fitted)
    return np.asarray(study.runs.values[left] - other(study.runs.germs[left]))
