"""Everything that a fit takes as given and that is known with an uncertainty: measured signals, fields of the scene."""

from __future__ import annotations

from collections.abc import Mapping

from shoal.identification.forward import ForwardModel
from shoal.identification.spread.between_samples import between_samples
from shoal.identification.spread.given import Given
from shoal.identification.spread.signal_noise import signal_noise
from shoal.identification.spread.uncertain_fields import uncertain_fields
from shoal.trajectory import Array


def taken_as_given(
    model: ForwardModel, point: Array, predicted: Mapping[str, Array], residual: Array
) -> tuple[list[Given], Given | None]:
    """At a point whose channels by recording, and residuals (rows,), are known: signals, and uncertain fields.

    Signals by their noise and by what they may do between their samples. Raises TimeIsUp, InputError.
    """
    signals = between_samples(model, point, predicted, residual), signal_noise(model, point, predicted, residual)
    return [one for one in signals if one is not None], uncertain_fields(model, point, predicted)
