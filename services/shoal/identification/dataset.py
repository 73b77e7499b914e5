"""An answer as a labelled data set: parameters with their covariance, and one recording with its fit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.errors import InputError
from shoal.identification.recording.measurement import Recording
from shoal.identification.recording.units import of_channel, squared
from shoal.identification.spread.value import Value
from shoal.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr


def dataset(
    parameters: Mapping[str, Value], covariance: Array | None, recording: Recording, predicted: Array
) -> xr.Dataset:
    """Over `parameter`: value, std, lower, upper, identifiable, covariance; over `time` and `marker`: of each quantity
    of the recording measured_x, predicted_x, residual_x (model minus measurement) and so on.

    predicted: channels of the model at the recording's samples, (samples, channels)
    A gap in the data is nan, and so is a quantity that a marker was not measured in. Units are in the attributes; those
    of the parameters, which differ, are a coordinate. Raises InputError.
    """
    try:
        import xarray as xr
    except ModuleNotFoundError:
        raise InputError("xarray is not installed; install shoal with its extra 'notebook'") from None
    return xr.merge([_parameters(parameters, covariance), _signals(recording, predicted)])


def _parameters(values: Mapping[str, Value], covariance: Array | None) -> xr.Dataset:
    import xarray as xr

    units = [value.unit for value in values.values()]
    # Where all share a unit, it is that of the variables too.
    shared = {"units": units[0]} if len(set(units)) == 1 and units[0] else {}
    fields = ("value", "std", "lower", "upper")
    columns: dict[str, Any] = {
        field: ("parameter", [getattr(value, field) for value in values.values()], shared) for field in fields
    }
    columns["identifiable"] = ("parameter", [value.identifiable for value in values.values()])
    if covariance is not None:
        units_of_it = {"units": squared(shared["units"])} if shared else {}
        columns["covariance"] = (("parameter", "other_parameter"), covariance, units_of_it)
    names = list(values)
    return xr.Dataset(columns, {"parameter": names, "other_parameter": names, "unit": ("parameter", units)})


def _signals(recording: Recording, predicted: Array) -> xr.Dataset:
    import xarray as xr

    markers = list(dict.fromkeys(channel.place for channel in recording.channels))
    shape = (len(recording.times), len(markers))
    columns: dict[str, Any] = {}
    for k, channel in enumerate(recording.channels):
        measured, fitted = recording.values[:, k], predicted[:, k]
        parts = {"measured": measured, "predicted": fitted, "residual": fitted - measured}
        for part, signal in parts.items():
            empty = (("time", "marker"), np.full(shape, np.nan), {"units": of_channel(channel)})
            columns.setdefault(f"{part}_{channel.kind}", empty)[1][:, markers.index(channel.place)] = signal
    return xr.Dataset(columns, {"time": ("time", recording.times, {"units": "s"}), "marker": markers})
