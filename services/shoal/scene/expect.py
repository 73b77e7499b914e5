"""Expectations of a scene of the library, checked nightly: a value, a recording, another engine, its earlier result."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from shoal.scene.record import NonNegative, Positive, Record


class ExpectedValue(Record):
    """One number at one instant: a marker's x or y [m], its angle [rad] or rate [rad/s] `at` s.

    tolerance: largest difference, in the unit of the number
    """

    kind: Literal["value"] = "value"
    marker: str
    quantity: Literal["x", "y", "angle", "rate"]
    at: NonNegative
    value: float
    tolerance: Positive


class ExpectedRecording(Record):
    """A measured motion: a recording of the library by name, or a file beside the scene.

    tolerance: largest root mean square of the differences of a signal, in SI units
    """

    kind: Literal["recording"] = "recording"
    path: str
    tolerance: Positive


class ExpectedEngine(Record):
    """The same scene on another engine. tolerance: largest distance of a marker at any time [m]"""

    kind: Literal["engine"] = "engine"
    engine: str
    tolerance: Positive


class ExpectedAsBefore(Record):
    """The motion that the night before found. tolerance: largest distance of a marker at any time [m]"""

    kind: Literal["as-before"] = "as-before"
    tolerance: Positive


Expectation = Annotated[
    ExpectedValue | ExpectedRecording | ExpectedEngine | ExpectedAsBefore, Field(discriminator="kind")
]
