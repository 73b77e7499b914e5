"""Machines drawn at random by a seed, each judged by a formulation that shares no code with the mechanics."""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

WRONG = "wrong and called right"


@dataclass(frozen=True)
class Judged:
    """A verdict: right, wrong and called right, refused, or not judged; and what it is about."""

    seed: int
    verdict: str
    text: str

    def __str__(self) -> str:
        return f"{self.seed:4d} {self.verdict:22s} {self.text}"


def main(study: str, described: str | None, judged: Callable[[int], Judged], arguments: list[str]) -> None:
    """Judge seeds, print, and end with status 1 if any answer is wrong and called right."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        f"python -m shoal_validation.{study}", description=described, formatter_class=plain
    )
    parser.add_argument("--seeds", default="0:200", help="the first, and the one after the last")
    first, last = map(int, parser.parse_args(arguments).seeds.split(":"))
    counts: Counter[str] = Counter()
    for seed in range(first, last):
        found = judged(seed)
        counts[found.verdict] += 1
        print(found, flush=True)  # noqa: T201 - a command
    print(", ".join(f"{verdict}: {count}" for verdict, count in counts.most_common()))  # noqa: T201 - a command
    if counts[WRONG]:
        sys.exit(1)
