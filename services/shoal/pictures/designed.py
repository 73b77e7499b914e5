"""Page of an experiment design, self-contained: every sensor and its gain over the present ones."""

from __future__ import annotations

import numpy as np

from shoal.identification.design import Design
from shoal.identification.design.precision import Precision
from shoal.pictures.design import design, says, score_of, shown
from shoal.pictures.drawn import Drawn
from shoal.pictures.pages import render, software

_CAPTION = (
    "Above, standard deviations that are to be expected over the ranges of the parameters, by sensor, alone and beside "
    "the best; the dashed line is what is measured now. Below, how they fall with the duration."
)


def designed(found: Design) -> str:
    """The page as HTML without a reference to anything outside."""
    best = found.ranked[0][0].label
    kinds = dict.fromkeys(sensor.quantity for sensor, _ in found.ranked)
    first = [next(one for one in found.ranked if one[0].quantity == kind) for kind in kinds]
    return render(
        "design.html.j2",
        title=f"{found.problem}: what to measure",
        trusted=found.ok,
        lead=f"{says(found)}.",
        picture=Drawn("design", design(found), f"{len(shown(found))} sensors compared", _CAPTION).embedded(),
        headings=["sensor", *(f"std of {name}" for name in found.aim.names), score_of(found), "times sharper than now"],
        best=[_row(found, sensor.label, precision) for sensor, precision in first],
        sensors=[_row(found, sensor.label, precision) for sensor, precision in found.ranked],
        pairs=[_row(found, sensor.label, precision) for sensor, precision in found.second],
        first=best,
        score=score_of(found),
        rates=[f"{rate:.4g} a second" for rate in found.rates],
        durations=[
            [f"{duration:.4g}", *(f"{value:.2g}" for value in row)]
            for duration, row in zip(found.durations, found.table, strict=True)
        ],
        provenance=[
            ("noise", ", ".join(f"{kind} {size:g}" for kind, size in found.noise.items())),
            *(("with", what) for what in found.given),
            ("about", ", ".join(f"{name} {value:.6g}" for name, value in found.values.items())),
            ("measured for", f"{found.duration:.4g} s, {found.rate:.4g} samples a second"),
            ("sensitivities", f"two steps differ by {found.doubt:.1g}"),
            ("versions", software()),
        ],
    )


def _row(found: Design, label: str, precision: Precision) -> list[str]:
    now, here = found.aim.score(found.now), found.aim.score(precision)
    gain = f"{now / here:.3g}" if np.isfinite(now) and np.isfinite(here) else "no figure"
    return [label, *(f"{size:.3g}" for size in precision.std), f"{here:.2g}", gain]
