"""What is told of the error of mean and deviation, against closed forms."""

from __future__ import annotations

import pytest
from shoal_validation.uncertain.moments import drawn, tried


@pytest.mark.parametrize(
    "seed",
    [
        pytest.param(21, id="cosine of a sum, curved between its runs"),
        pytest.param(23, id="a wide lognormal variable", marks=pytest.mark.slow),
        pytest.param(32, id="a kink that few runs pass", marks=pytest.mark.slow),
        pytest.param(48, id="three oscillators"),
        *(pytest.param(k, marks=pytest.mark.slow) for k in (16, 20, 36, 51, 58, 99, 103, 134)),
    ],
)
def test_the_error_told_is_not_smaller_than_the_true_one(seed: int) -> None:
    """Functions for which half of the error, or less, was told when left-out runs alone told of it."""
    met = tried(drawn(seed))
    assert met.kept == (True, True), (met.errors, met.told)
