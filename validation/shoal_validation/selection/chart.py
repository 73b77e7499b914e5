"""True error over tolerance against stiffness, and work over the cheapest."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from shoal_validation.selection.study import Case

KINDS = (
    ("all rods rigid", "s", "#0072B2"),
    ("some flexible", "o", "#E69F00"),
    ("not met, and said so", "x", "#555555"),
)


def draw_chart(cases: Sequence[Case], path: Path) -> None:
    """Two panels as PNG."""
    figure, (above, below) = plt.subplots(2, 1, figsize=(8.6, 8.2), layout="constrained", height_ratios=(3, 2))
    for name, marker, colour in KINDS:
        chosen = [case for case in cases if _kind(case) == name and (case.known or not case.met)]
        ratios = [np.clip(case.error / case.tolerance, 1e-4, 1e3) for case in chosen]
        above.scatter([c.stiffness for c in chosen], ratios, marker=marker, color=colour, label=name, s=26, alpha=0.8)
    above.axhline(1.0, color="black", linewidth=1)
    above.annotate("tolerance", (0.01, 1.0), xycoords=("axes fraction", "data"), va="bottom")
    above.set(
        xscale="log", yscale="log", xlabel="Young's modulus, mean of the rods [Pa]", ylabel="true error / tolerance"
    )
    met = [case for case in cases if case.met and case.known]
    share = 100 * np.mean([case.error <= case.tolerance for case in met]) if met else 0.0
    above.set_title(f"{share:.3g} % of the {len(met)} models said to meet the tolerance do", loc="left")
    above.legend(loc="lower left")
    ratios = [case.uncapped / case.least for case in met if np.isfinite(case.least) and case.least > 0]
    below.hist(np.clip(ratios, 1.0, 4.0), bins=np.linspace(1.0, 4.0, 25).tolist(), color="#009E73")
    below.axvline(2.0, color="black", linewidth=1)
    below.set(xlabel="work / work of the cheapest model that would do", ylabel="machines of one or two rods")
    cheap = np.mean(np.array(ratios) <= 2) if ratios else 0.0
    below.set_title(f"{cheap:.0%} cost at most twice the cheapest", loc="left")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _kind(case: Case) -> str:
    if not case.met:
        return KINDS[2][0]
    return KINDS[0][0] if case.rigid else KINDS[1][0]
