"""`python -m shoal_validation.random_contacts [--seeds A:B]`.

Draws planar machines with contacts by seed (0:200), runs each with the default settings and their estimates of the
errors, and compares it with Newton's and Euler's equations that try every mode of the contacts, written for this alone:

balls   one to three balls between a sloping floor and two walls
block   a block that tumbles on a slope with its corners
chain   one to three pinned links whose ends strike a floor
drum    a disc in a hole of the ground or of a body on a pin

Each up to its twelfth impact. A run that is rejected, as of a near graze or of a paradox of friction, is `refused`.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from shoal_validation.random_contacts.study import WRONG, judged


def main(arguments: list[str]) -> None:
    """Judge, print, and end with status 1 if any answer is wrong and called right."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        "python -m shoal_validation.random_contacts", description=__doc__, formatter_class=plain
    )
    parser.add_argument("--seeds", default="0:200", help="the first, and the one after the last")
    first, last = map(int, parser.parse_args(arguments).seeds.split(":"))
    counts: Counter[str] = Counter()
    for seed in range(first, last):
        found = judged(seed)
        counts[found.verdict] += 1
        print(found, flush=True)
    print(", ".join(f"{verdict}: {count}" for verdict, count in counts.most_common()))
    if counts[WRONG]:
        sys.exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
