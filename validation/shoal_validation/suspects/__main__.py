"""`python -m shoal_validation.suspects [--wrong N] [--right N] [--first SEED] [--kind KIND]`.

Draws N wrong models (200) and N right ones (100), identifies each, and counts how often the cause is named first
(alone, or with others that explain the recording equally well) and how often a right model is rejected.
"""

from __future__ import annotations

import argparse
import sys
import time

from shoal_validation.document import table
from shoal_validation.suspects.cases import KINDS
from shoal_validation.suspects.study import Trial, summary, trial


def main(arguments: list[str]) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.suspects", description=__doc__)
    parser.add_argument("--wrong", type=int, default=200)
    parser.add_argument("--right", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="seed of the first case")
    parser.add_argument("--kind", choices=KINDS, help="draw this kind of fault only")
    chosen = parser.parse_args(arguments)
    seeds = range(chosen.first, chosen.first + max(chosen.wrong, chosen.right))
    trials = list[Trial]()
    for kind, count in ((chosen.kind, chosen.wrong), ("right", chosen.right)):
        for seed in seeds[:count]:
            begin = time.process_time()
            trials.append(found := trial(seed, kind))
            print(f"{seed:4d} {found} {time.process_time() - begin:.1f} s", file=sys.stderr, flush=True)
    head, rows, last = summary(trials)
    print(table(head, rows))
    print(last)


if __name__ == "__main__":
    main(sys.argv[1:])
