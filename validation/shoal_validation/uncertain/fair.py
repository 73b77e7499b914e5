"""Error of bounds against their cost, by the runs that a study may take without further reason.

`python -m shoal_validation.uncertain.fair` runs random studies of seeds that no test uses with several values of
`shoal.response.study.FAIR`, runs for every term of a polynomial of degree four. Printed for each: the mean number of
runs, quantiles of the gap, and how far random runs lie beyond the attained bounds, as shares of the width.
"""

from __future__ import annotations

import sys

import numpy as np
from shoal.response import study

from shoal_validation.uncertain.studies import drawn, judged

SEEDS = range(10_000, 10_110)
STUDIES = 16
FEW_CYCLES = 6.0
"""Beyond, surrogates of cycles take the place of polynomials."""
VALUES = 1.0, 1.2, 1.4, 1.7, 2.0
RUNS = 5_000
"""Random runs against every study."""


def main() -> None:
    """Print a line for each value."""
    asked = [one for one in map(drawn, SEEDS) if 2 <= len(one.varied) <= 4 and one.cycles < FEW_CYCLES][:STUDIES]
    stated = study.FAIR
    for fair in VALUES:
        study.FAIR = fair
        found = [judged(one, RUNS) for one in asked]
        gaps, short = np.array([(one.gap, one.short) for one in found]).T
        median, three_quarters, most = np.nanquantile(gaps, (0.5, 0.75, 0.9))
        sys.stdout.write(
            f"{fair}: {np.mean([one.runs for one in found]):.0f} runs; gap {median:.1e} (median), {three_quarters:.1e} "
            f"(75 %), {most:.1e} (90 %); {short.max():.1e} beyond; {sum(not one.kept for one in found)} wrong\n"
        )
    study.FAIR = stated


if __name__ == "__main__":
    main()
