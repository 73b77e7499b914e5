"""Expectations of a scene of the library, checked nightly: a value, a recording, another engine, its earlier result."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from shoal.scene.record import NonNegative, Positive, Record


class ExpectedValue(Record):
    """One number at one instant."""

    kind: Literal["value"] = "value"
    marker: str
    """Name of the marker."""
    quantity: Literal["x", "y", "angle", "rate"]
    """Quantity of the marker."""
    at: NonNegative
    """Instant [s]."""
    value: float
    """Expected value [m, rad or rad/s]."""
    tolerance: Positive
    """Largest difference [m, rad or rad/s]."""


class ExpectedRecording(Record):
    """A measured motion."""

    kind: Literal["recording"] = "recording"
    path: str
    """A recording of the library by name, or a file beside the scene."""
    tolerance: Positive
    """Largest root mean square of the differences of a signal [m or rad]."""


class ExpectedEngine(Record):
    """The same scene on another engine."""

    kind: Literal["engine"] = "engine"
    engine: str
    """Name of the engine, or the address of a service."""
    tolerance: Positive
    """Largest distance of a marker at any time [m]."""


class ExpectedAsBefore(Record):
    """The motion that the night before found."""

    kind: Literal["as-before"] = "as-before"
    tolerance: Positive
    """Largest distance of a marker at any time [m]."""


Expectation = Annotated[
    ExpectedValue | ExpectedRecording | ExpectedEngine | ExpectedAsBefore, Field(discriminator="kind")
]
