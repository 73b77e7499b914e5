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
    """Initial state of a body.

    What is not stated follows from the joints and the stated quantities, else it is zero.
    """

    angle: Angle | None = None
    """Angle from +X, counter-clockwise [rad]."""
    rate: float | None = None
    """Angular velocity [rad/s]."""
    position: Vector | None = None
    """Origin of the body's frame [m]."""
    velocity: Vector | None = None
    """Velocity of the origin of the body's frame [m/s]."""
    rotation: Vector3 | None = None
    """In space, rotation vector in place of `angle` [rad]."""
    spin: Vector3 | None = None
    """In space, angular velocity along the axes of the ground in place of `rate` [rad/s]."""
    modes: tuple[float, ...] = ()
    """Amplitudes of a body that bends by modes, all or none [m]."""
    mode_rates: tuple[float, ...] = ()
    """Rates of these amplitudes, all or none [m/s]."""
    guess: tuple[Quantity, ...] = ()
    """The quantities that may change where the joints demand it."""

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
