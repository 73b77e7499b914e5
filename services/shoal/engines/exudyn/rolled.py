"""Items that repeat, such as the nodes and elements of a rod, as loops of a script."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from shoal.engines.exudyn.recorder import Key, RecordedItem, Texts, identifier, is_number_of_item, key_of

LONGEST = 8
"""Items that one turn of a loop enters at most."""
LEAST = 3
"""Turns of a loop that is worth it."""


@dataclass(frozen=True)
class RepeatedEntries:
    """Entries of a loop: turns of `period` entries each; one turn is no loop."""

    entries: list[RecordedItem]
    period: int

    @property
    def turns(self) -> list[list[RecordedItem]]:
        """The entries, turn by turn."""
        return [self.entries[k : k + self.period] for k in range(0, len(self.entries), self.period)]


def blocks(entries: list[RecordedItem]) -> Iterator[RepeatedEntries]:
    """Entries of one field of a scene, in loops where they repeat."""
    shapes = [(entry.kind, *entry.options) for entry in entries]
    begin = 0
    while begin < len(entries):
        period, count = max(
            ((period, _turns(shapes, begin, period)) for period in range(1, LONGEST + 1)),
            key=lambda found: (found[1] >= LEAST, found[0] * found[1] if found[1] >= LEAST else 0, -found[0]),
        )
        if count < LEAST:
            period, count = 1, 1
        yield RepeatedEntries(entries[begin : begin + period * count], period)
        begin += period * count


def _turns(shapes: list[Any], begin: int, period: int) -> int:
    first, count = shapes[begin : begin + period], 1
    while len(first) == period and shapes[begin + count * period : begin + (count + 1) * period] == first:
        count += 1
    return count


class Statements:
    """The text of entries; where an item has a name, others call it by that."""

    def __init__(self, texts: Texts, entries: list[RecordedItem]) -> None:
        self.texts = texts
        self.asked = {key for entry in entries for key in _keys(list(entry.options.values()))}
        self.kinds: set[str] = set()
        self._taken: set[str] = set()
        self._names: dict[Key, str] = {}
        self._lists: dict[Key, tuple[str, int]] = {}

    def name_of(self, key: Key) -> str:
        """Return the name of an item in the script."""
        if key in self._lists:
            name, row = self._lists[key]
            return f"{name}[{row}]"
        return self._names[key]

    def of(self, block: RepeatedEntries) -> Iterator[str]:
        """The lines of a block."""
        turns = block.turns
        self.kinds |= {entry.kind for entry in turns[0]}
        if len(turns) == 1:
            for entry in turns[0]:
                call = self._call(entry, {name: self._text(value) for name, value in entry.options.items()})
                if self._wanted([entry]):
                    self._names[entry.key] = self._new(entry)
                    call = f"{self._names[entry.key]} = {call}"
                yield call
            return
        yield from self._loop(turns)

    def _loop(self, turns: list[list[RecordedItem]]) -> Iterator[str]:
        calls, columns, lists = [], dict[str, list[str]](), []
        shared: dict[Key, tuple[str, int]] = {}
        for place, one in enumerate(turns[0]):
            own = [turn[place] for turn in turns]
            options: dict[str, str] = {}
            for option in one.options:
                values = [entry.options[option] for entry in own]
                found = self._common(values, shared)
                if found is None:
                    column = next(
                        name for name in (option, *(f"{option}{n}" for n in range(2, 99))) if name not in columns
                    )
                    columns[column] = [self._text(value) for value in values]
                    found = column
                options[option] = found
            call = self._call(one, options)
            if self._wanted(own):
                name = self._new(one)
                lists.append(name)
                # In a loop of one turn after the other, what the same turn has entered is the last of its list.
                shared |= {entry.key: (name, row) for row, entry in enumerate(own)}
                call = f"{name}.append({call})"
            calls.append(f"    {call}")
        yield from (f"{name} = []" for name in lists)
        if not columns:
            yield f"for k in range({len(turns)}):"
        else:
            rows = list(zip(*columns.values(), strict=True))
            names = ", ".join(columns)
            yield f"for k, {names if len(columns) == 1 else f'({names})'} in enumerate(["
            yield from ("    " + (row[0] if len(row) == 1 else f"({', '.join(row)})") + "," for row in rows)
            yield "]):"
        yield from calls
        self._lists |= shared

    def _common(self, values: list[Any], shared: dict[Key, tuple[str, int]]) -> str | None:
        """One text for the values of all turns, in which k is the number of the turn; None if there is none."""
        first = values[0]
        if isinstance(first, list) and any(map(is_number_of_item, first)):
            parts = [self._common(list(column), shared) for column in zip(*values, strict=True)]
            return None if None in parts else f"[{', '.join(str(part) for part in parts)}]"
        if is_number_of_item(first):
            keys = [key_of(value) for value in values]
            places = [(shared | self._lists).get(key) for key in keys]
            known = [place for place in places if place is not None]
            if len(known) == len(keys) and len({name for name, _ in known}) == 1:
                name, begin = known[0]
                if [row for _, row in known] == list(range(begin, begin + len(known))):
                    return f"{name}[k{f' + {begin}' if begin else ''}]"
            return self.name_of(keys[0]) if len(set(keys)) == 1 else None
        texts = {self._text(value) for value in values}
        return texts.pop() if len(texts) == 1 else None

    def _text(self, value: Any) -> str:
        return self.texts.of(value, self.name_of)

    def _call(self, entry: RecordedItem, options: dict[str, str]) -> str:
        inner = ", ".join(f"{name}={text}" for name, text in options.items())
        return f"mbs.Add{entry.family}({entry.kind}({inner}))"

    def _wanted(self, entries: list[RecordedItem]) -> bool:
        return any(entry.key in self.asked for entry in entries)

    def _new(self, entry: RecordedItem) -> str:
        stem = identifier("_".join([*entry.where.split(".")[-1:], entry.family.lower()]))
        name, number = stem, 2
        while name in self._taken:
            name, number = f"{stem}_{number}", number + 1
        self._taken.add(name)
        return name


def _keys(values: list[Any]) -> Iterator[Key]:
    for value in values:
        if is_number_of_item(value):
            yield key_of(value)
        elif isinstance(value, list | tuple):
            yield from _keys(list(value))
