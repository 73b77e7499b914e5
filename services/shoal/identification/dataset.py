"""An estimate as a labelled data set: parameters with their covariance, and one recording with its fit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.errors import InputError
from shoal.identification.units import of_channel, squared

if TYPE_CHECKING:
    import xarray as xr

    from shoal.identification.estimate import Estimate


def dataset(estimate: Estimate, recording: str | None = None) -> xr.Dataset:
    """Over `parameter`: value, std, lower, upper, identifiable, covariance; over `time` and `marker`: of each quantity
    of the recording (else the first) measured_x, predicted_x, residual_x (model minus measurement) and so on.

    A gap in the data is nan, and so is a quantity that a marker was not measured in. Units are in the attributes; those
    of the parameters, which differ, are a coordinate. Raises InputError.
    """
    try:
        import xarray as xr
    except ModuleNotFoundError:
        raise InputError("xarray is not installed; install shoal with its extra 'notebook'") from None
    known = estimate.measurement.recordings
    name = next(iter(known)) if recording is None else recording
    if name not in known:
        raise InputError(f"recording: there is no {name!r}; there are {', '.join(known)}")
    attributes = {
        "problem": estimate.problem,
        "recording": name,
        "verdict": str(estimate.verdict),
        "method": estimate.method,
        "engine": estimate.engine,
    }
    return xr.merge([_parameters(estimate), _signals(estimate, name)]).assign_attrs(attributes)


def _parameters(estimate: Estimate) -> xr.Dataset:
    import xarray as xr

    values = estimate.parameters
    units = [value.unit for value in values.values()]
    # Where all share a unit, it is that of the variables too.
    shared = {"units": units[0]} if len(set(units)) == 1 and units[0] else {}
    fields = ("value", "std", "lower", "upper")
    columns: dict[str, Any] = {
        field: ("parameter", [getattr(value, field) for value in values.values()], shared) for field in fields
    }
    columns["identifiable"] = ("parameter", [value.identifiable for value in values.values()])
    if estimate.covariance is not None:
        units_of_it = {"units": squared(shared["units"])} if shared else {}
        columns["covariance"] = (("parameter", "other_parameter"), estimate.covariance, units_of_it)
    names = list(values)
    return xr.Dataset(columns, {"parameter": names, "other_parameter": names, "unit": ("parameter", units)})


def _signals(estimate: Estimate, name: str) -> xr.Dataset:
    import xarray as xr

    recording, predicted = estimate.measurement.recordings[name], estimate.predicted[name]
    markers = list(dict.fromkeys(channel.marker for channel in recording.channels))
    shape = (len(recording.times), len(markers))
    columns: dict[str, Any] = {}
    for k, channel in enumerate(recording.channels):
        measured, fitted = recording.values[:, k], predicted[:, k]
        parts = {"measured": measured, "predicted": fitted, "residual": fitted - measured}
        for part, signal in parts.items():
            empty = (("time", "marker"), np.full(shape, np.nan), {"units": of_channel(channel)})
            columns.setdefault(f"{part}_{channel.quantity}", empty)[1][:, markers.index(channel.marker)] = signal
    return xr.Dataset(columns, {"time": ("time", recording.times, {"units": "s"}), "marker": markers})
