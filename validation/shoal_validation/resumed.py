"""Long studies that go on where they were stopped: what was found is kept, a line of JSON for each case."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import track

Found = dict[str, Any]
"""What a case showed, as JSON can hold it."""


def resumed(keys: Sequence[str], study: Callable[[str], Found], record: Path | None) -> Iterator[tuple[str, Found]]:
    """Every case with what it showed, in order, with progress on standard error.

    keys: names of the cases; study: finds what a case shows; record: file that keeps it (None: nothing is kept), whose
    cases are not studied again: delete it when the code has changed
    """
    known = dict[str, Found]()
    if record is not None and record.exists():
        lines = record.read_text(encoding="utf-8").splitlines()
        known = {row["case"]: row["found"] for row in map(json.loads, lines)}
    console = Console(stderr=True)
    for key in track(keys, "cases", console=console, transient=True):
        if key not in known:
            known[key] = study(key)
            if record is not None:
                with record.open("a", encoding="utf-8") as file:
                    file.write(json.dumps({"case": key, "found": known[key]}) + "\n")
        console.print(f"{key}: {known[key]}", highlight=False)
        yield key, known[key]
