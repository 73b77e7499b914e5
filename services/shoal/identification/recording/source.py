"""Statement of measured motion: columns, signals, units and clock."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from shoal.scene.record import Angle, NonNegative, Positive, Record
from shoal.table_units import (
    AccelerationUnit,
    AngleUnit,
    ForceUnit,
    LengthUnit,
    StrainUnit,
    TimeUnit,
    TorqueUnit,
)

Quantity = Literal[
    "x",
    "y",
    "z",
    "angle",
    "rate",
    "ax",
    "ay",
    "az",
    "wx",
    "wy",
    "wz",
    "fx",
    "fy",
    "fz",
    "mx",
    "my",
    "mz",
    "torque",
    "normal",
    "friction",
    "impact",
    "strain",
    "signal",
]
ACCELERATIONS: tuple[Quantity, ...] = ("ax", "ay", "az")
RATES: tuple[Quantity, ...] = ("wx", "wy", "wz")
"""What an accelerometer shows, and a gyroscope in space."""
FORCES: tuple[Quantity, ...] = ("fx", "fy", "fz")
MOMENTS: tuple[Quantity, ...] = ("mx", "my", "mz")
STRAIN: Quantity = "strain"
PRESSING: tuple[Quantity, ...] = ("normal", "friction")
"""What a load cell below a contact shows along its normal and across it."""
SIGNAL: Quantity = "signal"
"""A signal or a state of the scene, as a controller logs it, in the unit of its formula."""
IMPACT: Quantity = "impact"
"""The times of impacts, as a microphone hears them, one a row."""
REACTIONS: tuple[Quantity, ...] = (*FORCES, *MOMENTS, "torque", *PRESSING)
"""What a load cell in a joint or below a contact shows."""
IN_SPACE = ("z", "az", *RATES, "fz", *MOMENTS)
"""What is measured in space only."""
_UNITS: dict[str, Any] = {
    **dict.fromkeys(("x", "y", "z"), LengthUnit),
    **dict.fromkeys(("angle", "rate", *RATES), AngleUnit),
    **dict.fromkeys(ACCELERATIONS, AccelerationUnit),
    **dict.fromkeys((*FORCES, *PRESSING), ForceUnit),
    **dict.fromkeys((*MOMENTS, "torque"), TorqueUnit),
    STRAIN: StrainUnit,
    IMPACT: TimeUnit,
    SIGNAL: Literal["1"],
}


def units_of(quantity: str) -> tuple[str, ...]:
    """The units in which a column of that quantity may be, that of SI first; a rate is in them per second."""
    return get_args(_UNITS[quantity])


class Channel(Record):
    """One measured signal: a marker's x, y, in space z [m], angle [rad] or rate of its angle [rad/s].

    ax, ay, in space az [m/s^2]: acceleration less gravity at a marker, along the axes of its body turned by `tilt`
    [rad], as an accelerometer shows it; wx, wy, wz [rad/s]: angular velocity in space along these axes, for which the
    tilt may be a rotation vector. fx, fy [N], torque [N m]: what a `joint` exerts on its second body, along the axes of
    the ground, friction and drive included; in space fx, fy, fz, mx, my, mz, and of a drive the torque about its axis.
    fx, fy, in space fz, normal, friction [N]: what a `contact` exerts on its first body; friction is in the plane along
    the normal turned clockwise, in space a size. impact [s]: the time of the n-th impact of a `contact`, or of a
    `joint` with stops, in the n-th row; the times of the rows are the same.
    strain: of a flexible rod along its axis, at a marker and a `height` above the axis, in space a `side` of it
    towards the local z axis too [m].

    signal: the name of a signal or a state of the scene, in the unit of its formula.

    With `to`, an angle or rate is that of the marker's body less that of the body at another marker: of a joint between
    them, what its encoder shows. Neither tilts with the camera.

    The signal is offset + scale * unit * (column - origin); where the y axis grows down, y, angle and rate change sign
    before `offset` is added.
    column, origin: names of columns; origin is that of a point that stands still, such as a tracked pivot
    unit: of the column; a rate is in the unit per second
    noise: standard deviation in SI units; offset: in SI units
    """

    marker: str = ""
    joint: str | None = None
    contact: str | None = None
    signal: str | None = None
    quantity: Quantity = SIGNAL
    to: str | None = None
    tilt: Angle | tuple[Angle, Angle, Angle] = 0.0
    height: float = 0.0
    side: float = 0.0
    column: str = ""
    scale: float = 1.0
    offset: float = 0.0
    origin: str | None = None
    unit: LengthUnit | AngleUnit | AccelerationUnit | ForceUnit | TorqueUnit | StrainUnit | TimeUnit | None = None
    noise: Positive | None = None

    @model_validator(mode="after")
    def _unit_of_its_quantity(self) -> Self:
        right = units_of(self.quantity)
        if self.quantity == SIGNAL and self.unit is not None:
            raise ValueError("unit: a signal has that of its formula; use scale")
        if self.unit is not None and self.unit not in right:
            raise ValueError(f"unit: {self.quantity} is measured in one of {', '.join(right)}, found {self.unit!r}")
        return self

    @model_validator(mode="after")
    def _somewhere(self) -> Self:
        named = [field for field in ("marker", "joint", "contact", "signal") if getattr(self, field)]
        if self.quantity == SIGNAL or self.signal:
            if named != ["signal"] or self.quantity != SIGNAL:
                quantities = ", ".join(one for one in get_args(Quantity) if one != SIGNAL)
                raise ValueError(f"quantity: name a `signal` and nothing else, or state what is measured: {quantities}")
            named = []
        elif not named:
            named = ["none"]
        in_joints, at_contacts = (*FORCES, *MOMENTS, "torque", IMPACT), (*FORCES, *PRESSING, IMPACT)
        places = ["in a joint"] * (self.quantity in in_joints) + ["at a contact"] * (self.quantity in at_contacts)
        places = places or ["at a marker"]
        kinds = [one.rsplit(maxsplit=1)[-1] for one in places]
        if named and (len(named) != 1 or named[0] not in kinds):
            other = "joint" if kinds == ["marker"] else "marker"
            where = " or ".join(places)
            raise ValueError(f"{kinds[0]}: {self.quantity} is measured {where}; name it, and no {other}")
        if self.tilt and self.quantity not in (*ACCELERATIONS, *RATES):
            raise ValueError(f"tilt: of the axes of ax and ay, found {self.quantity}")
        for field in ("height", "side"):
            if getattr(self, field) and self.quantity != STRAIN:
                raise ValueError(f"{field}: of a strain gauge above the axis of its rod, found {self.quantity}")
        return self

    @model_validator(mode="after")
    def _between_two(self) -> Self:
        if self.to is not None and self.quantity not in ("angle", "rate"):
            raise ValueError(f"to: an angle or a rate is measured between two markers, found {self.quantity}")
        if self.to == self.marker:
            raise ValueError(f"to: another marker than {self.marker} is needed")
        return self

    @property
    def name(self) -> str:
        """Measured quantity, in words."""
        height = f" at height {self.height:g} m" if self.height else ""
        height += f" to the side by {self.side:g} m" if self.side else ""
        return f"{self.quantity} of {self.place}{f' against {self.to}' if self.to else ''}{height}"

    @property
    def kind(self) -> str:
        """Quantity that is measured in a place, as one word."""
        height = f"_at_{self.height:g}" if self.height or self.side else ""
        height += f"_{self.side:g}" if self.side else ""
        return self.quantity + (f"_against_{self.to}" if self.to else "") + height

    @property
    def place(self) -> str:
        """The marker, the joint, the contact or the signal."""
        return self.joint or self.contact or self.signal or self.marker

    @property
    def label(self) -> str:
        """Place and kind, as columns and charts name it."""
        return f"{self.place}.{self.kind}"

    @property
    def is_sensor(self) -> bool:
        """Return whether a sensor on the machine shows it that knows no camera: of acceleration, force or strain.

        Signals are those of a sensor as well.
        """
        return self.quantity in (*ACCELERATIONS, *RATES, *REACTIONS, STRAIN, IMPACT, SIGNAL)

    @property
    def is_dynamic(self) -> bool:
        """Return whether it shows accelerations or forces, which depend on the whole machine and not on its motion
        alone.
        """
        return self.quantity in (*ACCELERATIONS, *REACTIONS)

    @property
    def is_pose(self) -> bool:
        """Return whether a pose alone shows it."""
        return self.is_position or self.quantity == "angle"

    @property
    def is_position(self) -> bool:
        """Return whether it is a coordinate of a marker, in metres."""
        return self.quantity in ("x", "y", "z")


def _windows(value: Any) -> Any:
    """A single window is a list of one."""
    return [value] if isinstance(value, list | tuple) and value and not isinstance(value[0], list | tuple) else value


def _apart(windows: list[tuple[float, float]]) -> list[tuple[float, float]]:
    for begin, end in windows:
        if not begin < end:
            raise ValueError(f"a window is [from, to], the later last, found [{begin:g}, {end:g}]")
    for (_, end), (begin, _) in pairwise(sorted(windows)):
        if begin < end:
            raise ValueError(f"windows overlap: one ends at {end:g} s, another begins at {begin:g} s")
    return windows


Windows = Annotated[list[tuple[float, float]], BeforeValidator(_windows), AfterValidator(_apart)]
"""Spans of time [s]: [from, to], or several of them."""


class Clocked(Record):
    """Statements of a recording of any kind: the motion's time is recorded time / clock + delay [s] after its start.

    So `clock` is how many seconds the recording's clock shows in one second: 1.26 is a clock that is fast by 26 %.
    A marker at X [m] is recorded at rotation(-tilt) (X - [x, y]) / scale, its z at z / scale, angles less `tilt`:
    clock, delay, scale, x, y and tilt may be parameters, with the paths `measurement.clock` and so on; mounting and
    the biases too.
    mounting: angle [rad] about its z axis that an IMU is turned by beside its own `tilt`
    bias_ax, bias_ay, bias_az [m/s^2], bias_rate, bias_wx, bias_wy, bias_wz [rad/s]: what these channels show too much
    known: fields of the scene that are different in this recording
    channels: instead of those of the problem
    hold_out: windows [from, to] in seconds of the recording's clock that are predicted instead of fitted
    """

    clock: Positive = 1.0
    delay: float = 0.0
    scale: Positive = 1.0
    x: float = 0.0
    y: float = 0.0
    tilt: float = 0.0
    mounting: float = 0.0
    bias_ax: float = 0.0
    bias_ay: float = 0.0
    bias_az: float = 0.0
    bias_rate: float = 0.0
    bias_wx: float = 0.0
    bias_wy: float = 0.0
    bias_wz: float = 0.0
    known: dict[str, Any] = {}
    channels: Annotated[list[Channel], Field(min_length=1)] | None = None
    hold_out: Windows = []

    def as_stated(self) -> Clocked:
        """Its clock, camera and scene, without the origin of the data."""
        return Clocked(**{name: getattr(self, name) for name in Clocked.model_fields})


class EngineSource(Clocked):
    """Data computed by another engine: the scene with `values` set (the truth), sampled `count` times up to `stop` s.

    noise: standard deviation of white noise that is added, in SI units; seed: of its random numbers
    """

    kind: Literal["engine"] = "engine"
    engine: str = "exudyn"
    values: dict[str, Any] = {}
    stop: Positive
    count: Annotated[int, Field(ge=2)]
    noise: NonNegative = 0.0
    seed: int = 0


class FileSource(Clocked):
    """Data from a CSV (gzip allowed) or Parquet file: `duration` s from `start` s on, every `every`-th sample.

    start: when the motion's time is zero, by the table's clock [s]; left out, 0 where the table begins about there,
    else its first sample
    path: beside the YAML file that names it; may itself be the YAML of a FileSource, whose fields then hold instead
    columns: names, where the file has no header line
    time: the column of time, in `time_scale` s; or rate: samples per second, for files without one
    y_axis: whether y grows up or down; down, angles and rates are clockwise and change their sign too
    swaps: whether samples with two markers exchanged are mended
    """

    kind: Literal["file"] = "file"
    path: str | None = None
    columns: list[str] | None = None
    time: str = "t"
    time_scale: Positive = 1.0
    rate: Positive | None = None
    start: float | None = None
    duration: Positive | None = None
    every: Annotated[int, Field(ge=1)] = 1
    y_axis: Literal["up", "down"] = "up"
    swaps: bool = True

    @model_validator(mode="after")
    def _with_columns(self) -> Self:
        for channel in self.channels or ():
            if not channel.column:
                raise ValueError(f"channels: name the `column` of {channel.place} {channel.quantity}")
        return self


Source = Annotated[EngineSource | FileSource, Field(discriminator="kind")]
