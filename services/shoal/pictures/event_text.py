"""Events of contacts in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from shoal.mechanics.event_record import place_of


def told(model: Mapping[str, Any]) -> Iterator[str]:
    """Yield a sentence on the events of a run: how many impacts, the last event, and what is closed at the end."""
    events = model.get("events")
    if not events:
        return
    count = sum(event["kind"] == "impact" and event["impulse"] > 0.0 for event in events)
    last, closed = events[-1], model.get("closed_contacts", ())
    said = f"{count} impact{'' if count == 1 else 's'}, the last event: {place_of(last)} {last['kind']}"
    yield f"{said} at {last['time']:.6g} s; in contact at the end: {', '.join(closed) or 'none'}"
