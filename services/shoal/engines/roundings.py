"""Roundings of measured values: whether a more careful run rounds each as a run does."""

from __future__ import annotations

from shoal.findings import Finding
from shoal.mechanics import findings as kinds
from shoal.trajectory import Trajectory


def sensitive(run: Trajectory, careful: Trajectory, factor: float) -> Finding | None:
    """Return the finding that a run's own error decides on a rounding; None where it decides on none.

    factor: of the error in the distance from the more careful run
    """
    one, other = (each.model.get("nearest_tie") for each in (run, careful))
    if not one or not other:
        return None
    where = f"signals.{one['signal']} at t = {one['time']:.6g} s is {one['quanta']:.2g} quanta from a tie"
    numbers = {"time": one["time"], "quanta": one["quanta"]}
    if one["checksum"] != other["checksum"]:
        return kinds.SENSITIVE_SAMPLES.found(
            f"a more careful run rounds a measured value otherwise; {where}", **numbers
        )
    if (one["signal"], one["time"]) != (other["signal"], other["time"]):
        return None
    error = factor * abs(one["quanta"] - other["quanta"])
    if error <= one["quanta"]:
        return None
    return kinds.SENSITIVE_SAMPLES.found(f"{where}, less than its own error of {error:.2g}", error=error, **numbers)
