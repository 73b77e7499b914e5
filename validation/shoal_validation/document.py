"""Generated parts of a page of the documentation stand between two comments."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path


def rewrite(page: Path, name: str, text: str) -> None:
    """Put the text between `<!-- begin name -->` and `<!-- end name -->`. Raises ValueError where they are missing."""
    begin, end = f"<!-- begin {name} -->", f"<!-- end {name} -->"
    before, found, rest = page.read_text(encoding="utf-8").partition(begin)
    _, closed, after = rest.partition(end)
    if not (found and closed):
        raise ValueError(f"{page}: no section between {begin} and {end}")
    page.write_text(f"{before}{begin}\n{text.strip()}\n{end}{after}", encoding="utf-8")


def publish(page: Path, tables: Mapping[str, str]) -> None:
    """Print every text and, where the page is there, put it into the section of its name. Raises ValueError."""
    for name, text in tables.items():
        sys.stdout.write(f"{text}\n\n")
        if page.exists():
            rewrite(page, name, text)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(cells) + " |" for cells in lines)
