"""One machine with contacts, and the verdict on its run."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.scene import Scene

from shoal_validation.random_contacts.machines import DURATION, Data, drawn
from shoal_validation.random_contacts.newton_euler import NewtonEuler, UndecidedError
from shoal_validation.random_machines import WRONG, Judged

IMPACTS = 12
"""A machine is followed up to so many impacts, as each makes differences grow."""
KNOWN = 1e-8
"""Error of the judge [m]: its tolerance of 1e-12 after `IMPACTS`; found are differences up to 4e-10."""
TIMES = np.linspace(0.0, DURATION, 61)[1:]


def judged(seed: int, machine_of: Callable[[int], tuple[str, Data]] = drawn) -> Judged:
    """Run the machine of a seed, with the estimate of its errors, and judge it."""
    kind, data = machine_of(seed)
    try:
        run = verified(get_engine("gauss"), Scene.parse(data), TIMES)
    except InputError as error:
        return Judged(seed, "refused", f"{kind}: {error}")
    if not run.ok:
        return Judged(seed, "refused", f"{kind}: {run.message}")
    machine = NewtonEuler(data)
    try:
        places = machine.run(TIMES, IMPACTS)
    except UndecidedError as error:
        return Judged(seed, "not judged", f"{kind}: {error}")
    known = ~np.isnan(places[:, 0, 0])
    away = max(
        float(np.max(np.abs(run.marker(name)[known] - places[known, k, :2]), initial=0.0))
        for k, name in enumerate(machine.names)
    )
    known_error = run.model["verification"]["time_error"]
    if known_error is None:
        return Judged(seed, "not judged", f"{kind}: the error is not estimated")
    allowed = 3.0 * known_error + KNOWN
    verdict = "right" if away <= allowed else WRONG
    told = f"{away:.1e} m away, allowed {allowed:.1e} m, {len(machine.events)} impacts, {known.sum()} samples"
    return Judged(seed, verdict, f"{kind}: {told}")
