"""`python -m shoal_validation.random_space [--seeds A:B]`.

Draws machines in space by seed (0:200), runs each with the default settings and their estimates of the errors, and has
another engine judge: `tree` where it can, else Exudyn on the same mesh, else Exudyn on cables four times as fine.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from shoal_validation.random_space.study import judged


def main(arguments: list[str]) -> None:
    """Judge, print, and end with status 1 if any answer is wrong and called right."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.random_space", description=__doc__)
    parser.add_argument("--seeds", default="0:200", help="the first, and the one after the last")
    first, last = map(int, parser.parse_args(arguments).seeds.split(":"))
    counts: Counter[str] = Counter()
    for seed in range(first, last):
        found = judged(seed)
        counts[found.verdict] += 1
        print(found, flush=True)
    print(", ".join(f"{verdict}: {count}" for verdict, count in counts.most_common()))
    if counts["wrong and called right"]:
        sys.exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
