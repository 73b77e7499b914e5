"""Motions and sweeps as tables that say what they are: Parquet and NetCDF, with units and what was computed."""

from __future__ import annotations

from importlib.metadata import version
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.error_budget import ErrorBudget
from shoal.json_values import json_text
from shoal.trajectory import Array

if TYPE_CHECKING:
    import xarray as xr

    from shoal.engines.sweep import Sweep
    from shoal.scene import Scene
    from shoal.trajectory import Trajectory

Columns = dict[str, tuple[Any, str]]
"""Values and their unit, by name."""


def of_motion(motion: Trajectory) -> Columns:
    """Return time, position, angle and, where the engine has them, velocity and rate of every marker of one lane."""
    found: Columns = {"t": (motion.times, "s")}
    for name in motion.markers:
        found |= {f"{name}.{axis}": (x, "m") for axis, x in zip(motion.axes, motion.marker(name).T, strict=True)}
        found[f"{name}.angle"] = motion.angle(name), "rad"
        number = motion.markers.index(name)
        if motion.velocities is not None:
            speeds = zip(motion.axes, motion.velocities[:, number, :, 0].T, strict=True)
            found |= {f"{name}.v{axis}": (x, "m/s") for axis, x in speeds}
        if motion.rates is not None:
            found[f"{name}.rate"] = motion.rates[:, number, 0], "rad/s"
    return found


def about_motion(motion: Trajectory, scene: Scene) -> dict[str, str | float]:
    """The scene, what computed its motion, and how far to trust it; without what is not known."""
    told = {
        **_about(scene, motion.engine, str(motion.status[0]), motion.message),
        "integrator": motion.model.get("integrator"),
        "step_s": motion.model.get("step"),
        "steps": float(motion.steps),
        "energy_drift": float(motion.energy_drift[0]),
        "constraint_drift": float(motion.constraint_drift[0]),
        **_errors(motion.errors),
    }
    return {name: value for name, value in told.items() if value is not None and value == value}


def _errors(errors: ErrorBudget) -> dict[str, float | None]:
    """Return the sum of the known errors, and its parts [m]."""
    return {"error_m": errors.total, **{f"{source}_error_m": error for source, error in errors.estimates.items()}}


def _about(scene: Scene, engine: str, status: str, message: str) -> dict[str, Any]:
    return {
        "scene": scene.name,
        "fingerprint": scene.fingerprint,
        "description": scene.description,
        "scene_as_json": json_text(scene.model_dump(mode="json")),
        "shoal": version("shoal"),
        "engine": engine,
        "status": status,
        "message": message,
    }


def of_sweep(result: Sweep) -> Columns:
    """Values, positions and displacements from the start of every marker, and the status, of every point."""
    rows = result.rows()
    texts, begun = ("status", "reason"), {name: unit for name, (_, unit) in result.begun.items()}
    units = {name: "m" for name in rows[0] if name not in result.grid and name not in texts} | begun
    return {name: (_column([row[name] for row in rows]), units.get(name, "")) for name in rows[0]}


def _column(values: list[Any]) -> Any:
    """Numbers, not a number where there is none; texts as they are."""
    return values if isinstance(values[0], str) else np.array(values, dtype=float)


def about_sweep(result: Sweep) -> dict[str, str | float]:
    """Return the attributes of a sweep, as of a motion."""
    told = {
        **_about(result.scene, result.engine, "ok" if result.ok else "failed", result.message),
        "time_s": result.time,
        **_errors(result.errors),
    }
    return {name: value for name, value in told.items() if value is not None}


def parquet(columns: Columns, about: dict[str, str | float]) -> bytes:
    """A table whose columns have a unit each, and a file that says what it is."""
    import pyarrow
    from pyarrow import parquet as files

    fields = [
        pyarrow.field(name, pyarrow.array(values).type, metadata={"unit": unit} if unit else None)
        for name, (values, unit) in columns.items()
    ]
    told = {f"shoal.{name}": value if isinstance(value, str) else repr(value) for name, value in about.items()}
    table = pyarrow.table([values for values, _ in columns.values()], schema=pyarrow.schema(fields, metadata=told))
    stream = BytesIO()
    files.write_table(table, stream)
    return stream.getvalue()


def motion_to_netcdf(motion: Trajectory, scene: Scene) -> bytes:
    """Over time and marker: x, y, (z,) angle and, where they are known, velocities and rates."""
    data = motion.to_xarray().isel(lane=0, drop=True)
    more: dict[str, tuple[Array, str]] = {}
    if motion.velocities is not None:
        more |= {f"v{axis}": (motion.velocities[:, :, k, 0], "m/s") for k, axis in enumerate(motion.axes)}
    if motion.rates is not None:
        more["rate"] = motion.rates[:, :, 0], "rad/s"
    for name, (values, unit) in more.items():
        data[name] = ("time", "marker"), values, {"units": unit}
    return _netcdf(data, about_motion(motion, scene))


def sweep_to_netcdf(result: Sweep) -> bytes:
    """Write a sweep as NetCDF: positions and displacements over point and marker; values, status and reason over point.

    Also the starts of points that do not keep a stated value.
    """
    import xarray as xr

    markers = list(result.positions)
    values = {path: ("point", numbers) for path, numbers in result.grid.items()}
    data = xr.Dataset(coords={**values, "marker": markers, "status": ("point", [str(one) for one in result.status])})
    for prefix, found in (("", result.positions), ("d", result.displacements)):
        stacked = np.stack([found[name] for name in markers], axis=1)
        for k, axis in zip(range(stacked.shape[2]), "xyz", strict=False):
            data[f"{prefix}{axis}"] = ("point", "marker"), stacked[:, :, k], {"units": "m"}
    for name, (used, unit) in result.begun.items():
        data[name] = "point", used, {"units": unit}
    if any(result.reasons):
        data["reason"] = "point", list(result.reasons)
    return _netcdf(data, about_sweep(result))


def _netcdf(data: xr.Dataset, about: dict[str, str | float]) -> bytes:
    return bytes(data.assign_attrs(about).to_netcdf(engine="scipy"))
