"""The classical Runge-Kutta method of order 4 as a CasADi function: exact derivatives at a known cost."""

from __future__ import annotations

import math
from typing import Any

import casadi as ca
import numpy as np

from shoal.engines.casadi.model import CasadiModel
from shoal.trajectory import Array


def runge_kutta(model: CasadiModel, times: Array, step: float, directions: int = 0) -> tuple[Any, Array, int]:
    """Integrator over given instants, none of its steps longer than `step`.

    times: instants [s] after the start at 0 s, increasing, (samples,); step: [s]
    directions: derivatives carried along, exactly those of the discrete steps

    Returns the function (X at 0 s, substeps [s]) -> X at all instants, side by side; the substeps,
    (1, samples), each interval divided into equally many; and the number of all steps. X is the state,
    (2 unknowns + 1,), followed by `directions` columns of its derivatives, stacked into one column.
    """
    gaps = np.diff(times, prepend=0.0)
    # The slack keeps an interval of ten steps from being cut into eleven by round-off.
    substeps = max(1, math.ceil(float(gaps.max()) / step * (1 - 1e-9)))
    single = _step(model, directions)
    many = single.fold(substeps) if substeps > 1 else single
    x, h = ca.MX.sym("x", single.size1_in(0)), ca.MX.sym("h")
    interval = ca.Function("interval", [x, h], [many(x, ca.repmat(h, 1, substeps))])
    return interval.mapaccum(times.size), gaps[None, :] / substeps, substeps * times.size


def _step(model: CasadiModel, directions: int) -> Any:
    size = 2 * model.unknowns + 1
    x, h = ca.SX.sym("x", size), ca.SX.sym("h")
    k1 = model.rate(x)
    k2 = model.rate(x + h / 2 * k1)
    k3 = model.rate(x + h / 2 * k2)
    k4 = model.rate(x + h * k3)
    after = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    carried = ca.SX.sym("carried", size, directions)
    # In one scalar graph the directions share every factor of the chain rule.
    forward = ca.jtimes(after, x, carried) if directions else carried
    return ca.Function("step", [ca.veccat(x, carried), h], [ca.veccat(after, forward)], {"cse": True})
