"""Initial state: stated quantities of each body, guesses among them, and the final state of another run."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Literal, NamedTuple

from pydantic import ValidationError

from shoal.errors import InputError
from shoal.scene.ended import End
from shoal.scene.record import Angle, Record, Vector, Vector3, one_line

INITIAL, FROM = "initial", "from"
Quantity = Literal["angle", "rate", "position", "velocity", "rotation", "spin"]
POSES: tuple[Quantity, ...] = ("angle", "position", "rotation")
RATES: tuple[Quantity, ...] = ("rate", "velocity", "spin")
UNITS: dict[Quantity, str] = {
    "angle": "rad",
    "position": "m",
    "rate": "rad/s",
    "velocity": "m/s",
    "rotation": "rad",
    "spin": "rad/s",
}
ABOUT_Z: dict[Quantity, Quantity] = {"angle": "rotation", "rate": "spin"}
"""In space what an angle and a rate are short for."""


class InitialState(Record):
    """Absolute angle [rad], counter-clockwise from +X, and rate [rad/s] of a body at time zero.

    position [m] and velocity [m/s] are those of its frame's origin. None: not stated; it follows from the joints
    and the stated quantities, else it is zero. rotation, spin: in space, a rotation vector [rad] in place of the angle
    and an angular velocity [rad/s] along the axes of the ground in place of the rate. modes, mode_rates: of a body that
    bends by modes, their amplitudes and rates, all or none. guess: the quantities that may change
    where the joints demand it.
    """

    angle: Angle | None = None
    rate: float | None = None
    position: Vector | None = None
    velocity: Vector | None = None
    rotation: Vector3 | None = None
    spin: Vector3 | None = None
    modes: tuple[float, ...] = ()
    mode_rates: tuple[float, ...] = ()
    guess: tuple[Quantity, ...] = ()

    def stated(self, quantity: Quantity) -> bool:
        """Return whether the user gave this quantity a value."""
        return getattr(self, quantity) is not None


class Begin(NamedTuple):
    """Initial state of one body with zeros for what is not stated; without a position, joints place it."""

    angle: float
    rate: float
    position: Vector | None
    velocity: Vector
    rotation: Vector3 | None = None
    spin: Vector3 | None = None
    modes: tuple[float, ...] = ()
    mode_rates: tuple[float, ...] = ()


def check_start(origin: Any, paths: Iterable[str]) -> None:
    """Raises InputError for a path that would move a start which is the end of a run."""
    for path in paths if isinstance(origin, End | dict) else ():
        if path.split(".")[0] == INITIAL:
            raise InputError(f"{path}: the machine starts at the end of a run; take initial.from out (null)")


def end_of(stated: Any) -> End:
    """The end of a run. Raises ValueError."""
    try:
        return End.model_validate(dict(stated) if isinstance(stated, Mapping) else stated)
    except ValidationError as error:
        raise ValueError(str(one_line(error, "initial.from", End))) from None


def guessed(start: Any, quantities: tuple[Quantity, ...] = POSES) -> Any:
    """The initial state of a body with its pose, or other quantities, as a guess."""
    stated = start.model_dump() if isinstance(start, InitialState) else start
    if not isinstance(stated, dict):
        return start
    return {**stated, "guess": [quantity for quantity in quantities if stated.get(quantity) is not None]}
