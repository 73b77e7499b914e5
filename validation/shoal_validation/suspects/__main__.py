"""`python -m shoal_validation.suspects [--seeds A:B] [--kind KIND] [--file FILE]`.

Draws wrong models by seed (0:200), identifies each, and counts how often the cause is named first: alone, with
causes of the same effect, or with others that explain the recording equally well. `--kind right` draws right models
and counts those that are rejected. With a FILE the trials are added to it, one a line, and those it holds are not run
again; the table is of all that it holds.
"""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import Any

from shoal_validation.document import table
from shoal_validation.suspects.cases import KINDS
from shoal_validation.suspects.study import Trial, summary, trial


def main(arguments: list[str]) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.suspects", description=__doc__)
    parser.add_argument("--seeds", default="0:200", help="the first, and the one after the last")
    parser.add_argument("--kind", choices=(*KINDS, "right"), help="draw this kind of fault only; right: none")
    parser.add_argument("--file", type=Path, help="of trials, one a line")
    chosen = parser.parse_args(arguments)
    first, last = map(int, chosen.seeds.split(":"))
    trials = dict[tuple[int, bool], Trial]()
    for line in chosen.file.read_text().splitlines() if chosen.file and chosen.file.exists() else ():
        known: dict[str, Any] = {k: tuple(x) if isinstance(x, list) else x for k, x in json.loads(line).items()}
        found = Trial(**known)
        trials[found.seed, found.kind == "right"] = found
    for seed in range(first, last):
        if (seed, chosen.kind == "right") in trials:
            continue
        trials[seed, chosen.kind == "right"] = found = trial(seed, chosen.kind)
        print(found, file=sys.stderr, flush=True)
        if chosen.file:
            with chosen.file.open("a") as file:
                file.write(json.dumps(asdict(found)) + "\n")
    head, rows, told = summary(list(trials.values()))
    print("\n\n".join([table(head, rows), *told] if rows else told))


if __name__ == "__main__":
    main(sys.argv[1:])
