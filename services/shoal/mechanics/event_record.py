"""The record of the events of contacts: impacts, openings, and the rest in which impacts accumulate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from typing import Any

from shoal.mechanics.contact.decision import KINDS
from shoal.mechanics.gaps import HIT, LIFT
from shoal.mechanics.numerics.tile import Array

UNCLEAR = 1e-6
"""Part of the impulses by which those of another order may differ: they are known to the root of round-off."""
LAST = 3
"""Impacts whose times give the limit of a geometric sequence (Aitken's delta-squared process)."""


def recorded(log: Array, fields: Sequence[str], closed: Array) -> list[dict[str, Any]]:
    """Return events in the order of time: time [s], joint or contact, kind, and the impulse [N s or N m s] of impacts.

    Impacts of several contacts of which the order matters have `order`, how far their impulses would be from those at
    once, relative to these (`impact`). log: as of `GapWork`, (events, RECORD). fields: what states the contacts, as
    `contacts.NAME`, `joints.NAME.stops` or, of a guide with play, `joints.NAME.play.CORNER`. closed: which are
    closed at the end, not 0. A contact that stays closed after several impacts `rests` from where their times
    accumulate, with the number of `impacts`; it follows the last of these in the list.
    """
    found: list[dict[str, Any]] = []
    impacts: dict[int, list[int]] = {}
    rests: dict[int, dict[str, Any]] = {}
    parts = [field.split(".") for field in fields]
    places: list[dict[str, Any]] = [
        {part[0].removesuffix("s"): part[1]} | ({"corner": int(part[3])} if len(part) > 3 else {}) for part in parts
    ]

    def rest(contact: int) -> None:
        """Let the impacts of a contact so far end in rest."""
        numbers = impacts.pop(contact, [])
        if len(numbers) > 1:
            times = [found[k]["time"] for k in numbers]
            rests[numbers[-1]] = {"time": _limit(times), **places[contact], "kind": "rests", "impacts": len(numbers)}

    for time, number, kind, push, order in log.tolist():
        contact = int(number)
        event = {"time": time, **places[contact], "kind": KINDS[kind]}
        if kind == HIT:
            event["impulse"] = push
            if order > UNCLEAR:
                event["order"] = order
            impacts.setdefault(contact, []).append(len(found))
        elif kind == LIFT:
            rest(contact)
        found.append(event)
    for contact in [contact for contact in impacts if closed[contact] != 0.0]:
        rest(contact)
    return [each for k, event in enumerate(found) for each in (event, rests.get(k)) if each is not None]


def letter(event: Mapping[str, Any]) -> tuple[float, str]:
    """Return the time [s] of an event, and what it is and where, as `floor impact`."""
    return float(event["time"]), f"{place_of(event)} {event['kind']}"


def word(letters: Sequence[tuple[float, str]], until: float) -> str:
    """Return the events until a time [s] as one text. Impacts that accumulate in a rest are part of it."""
    found: list[str] = []
    for time, one in letters:
        if time > until:
            continue
        place, _, kind = one.rpartition(" ")
        if kind == "rests":
            found = [each for each in found if each != f"{place} impact"]
        found.append(one)
    times = ((one, len(list(same))) for one, same in groupby(found))
    return ", ".join(one if count == 1 else f"{count} x {one}" for one, count in times)


def place_of(event: Mapping[str, Any]) -> str:
    """Return the name of the joint or the contact of an event."""
    return str(event.get("contact") or event["joint"])


def _limit(times: Sequence[float]) -> float:
    """Return the time [s] where the impacts accumulate: hops under a constant acceleration last ever shorter by one
    factor, the restitution.
    """
    if len(times) < LAST:
        return times[-1]
    first, second = times[-2] - times[-3], times[-1] - times[-2]
    return times[-1] + second * second / (first - second) if first > second else times[-1]
