"""One machine under feedback, and the verdict on its run."""

from __future__ import annotations

import numpy as np
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.scene import Scene

from shoal_validation.random_feedback.lagrange import Lagrange, UndecidedError
from shoal_validation.random_feedback.machines import DURATION, drawn
from shoal_validation.random_machines import WRONG, Judged

TIMES = np.linspace(0.0, DURATION, 31)[1:]
TOLERANCES = 1e-10, 1e-12
"""Of the judge, whose error is taken as ten times what lies between them."""


def judged(seed: int) -> Judged:
    """Run the machine of a seed, with the estimate of its errors, and judge it."""
    data = drawn(seed)
    kind = data["solver"]["integrator"]
    try:
        run = verified(get_engine("gauss"), Scene.parse(data), TIMES)
    except InputError as error:
        return Judged(seed, "refused", f"{kind}: {error}")
    if not run.ok:
        return Judged(seed, "refused", f"{kind}: {run.message}")
    estimated = run.model["verification"]["time_error"]
    if estimated is None:
        return Judged(seed, "not judged", f"{kind}: the error is not estimated")
    judge = Lagrange(data)
    try:
        rough, places = (judge.run(TIMES, tolerance) for tolerance in TOLERANCES)
    except UndecidedError as error:
        return Judged(seed, "not judged", f"{kind}: {error}")
    names = ["cart"] * judge.first + [f"tip{k}" for k in range(judge.count)]
    away = max(float(np.max(np.abs(run.marker(name) - places[:, k]))) for k, name in enumerate(names))
    allowed = 3.0 * estimated + 10.0 * float(np.max(np.abs(rough - places))) + 1e-9
    verdict = "right" if away <= allowed else WRONG
    return Judged(seed, verdict, f"{kind}: {away:.1e} m away, allowed {allowed:.1e} m, estimated {estimated:.1e} m")
