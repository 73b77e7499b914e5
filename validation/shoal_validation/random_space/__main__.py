"""`python -m shoal_validation.random_space [--kind KIND] [--seeds A:B] [--tolerance METRES]`.

Draws machines in space by seed (0:200), runs each with the default settings and their estimates of the errors, and has
another program judge:

chains      one to four rigid and flexible bodies, open or closed: `tree` where it can, else Exudyn on the same mesh,
            else Exudyn on cables four times as fine
directors   the same with director rods
bent        one or two flat director rods, curved and twisted at rest: Exudyn's geometrically exact beams
frames      two or three such rods and straight ones, welded or hinged to each other: the same
linkages    tops, Bennett's, Bricard's, Sarrus' and spherical linkages, RSSR, slider-cranks, platforms, generic loops:
            Newton's and Euler's equations of every body, written for this study alone

With a tolerance, those with flexible rods are asked for `--tolerance METRES`, and Exudyn's cables, of bent rods its
geometrically exact beams, whose own error two meshes tell, judge whether it is met.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from shoal_validation.random_space.study import BEAMS, KINDS, drawn, judged, met


def main(arguments: list[str]) -> None:
    """Judge, print, and end with status 1 if any answer is wrong and called right."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(
        "python -m shoal_validation.random_space", description=__doc__, formatter_class=plain
    )
    parser.add_argument("--kind", choices=KINDS, default=KINDS[0], help="what is drawn")
    parser.add_argument("--seeds", default="0:200", help="the first, and the one after the last")
    parser.add_argument("--tolerance", type=float, help="of flexible machines [m]")
    asked = parser.parse_args(arguments)
    first, last = map(int, asked.seeds.split(":"))
    counts: Counter[str] = Counter()
    for seed in range(first, last):
        if (asked.kind in ("directors", *BEAMS) or asked.tolerance) and not drawn(seed, asked.kind)[1].flexible_rods:
            continue
        found = met(seed, asked.tolerance, asked.kind) if asked.tolerance else judged(seed, asked.kind)
        counts[found.verdict] += 1
        print(found, flush=True)
    print(", ".join(f"{verdict}: {count}" for verdict, count in counts.most_common()))
    if counts["wrong and called right"]:
        sys.exit(1)


if __name__ == "__main__":
    main(sys.argv[1:])
