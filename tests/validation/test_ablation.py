"""The ablation measures what it says: known effects are found, parts are really on and off, costs are counted."""

import numpy as np
import pytest
from shoal_validation.ablation import dynamics, inverse
from shoal_validation.ablation.factorial import PARTS, combinations, effects, label

ALL, NONE = (True,) * 4, (False,) * 4


def test_the_factorial_is_full_and_labelled() -> None:
    found = [label(combination) for combination in combinations()]
    assert len(set(found)) == 16
    assert found[0] == "····"
    assert found[-1] == "TPVM"


def test_effects_find_what_was_put_in_and_ignore_what_differs_between_seeds() -> None:
    """Seeds differ a thousand times more than the parts do: only paired differences see the parts."""
    rng = np.random.default_rng(0)
    values = 1e3 * rng.standard_normal(20) + np.zeros((2, 2, 2, 2, 20))
    put_in = (-3.0, 0.5, 0.0, -0.25)
    for axis, size in enumerate(put_in):
        np.moveaxis(values, axis, 0)[1] += size
    values += 1e-3 * rng.standard_normal(values.shape)
    for part, effect, size in zip(PARTS, effects(values), put_in, strict=True):
        assert effect.part == part
        assert effect.lower - 2e-3 <= size <= effect.upper + 2e-3
        assert effect.falls == (size < 0)
        assert effect.rises == (size > 0)


def test_other_parts_are_judged_without_the_traditional_seed() -> None:
    values = np.zeros((2, 2, 2, 2, 3))
    values[1, :, :, 1] = 100.0
    assert effects(values)[3].mean == 0.0


def test_a_part_that_is_off_is_off_in_the_time_loop() -> None:
    assert dynamics.switches(NONE) == dynamics.Switches(
        seed_traditional=False, seed_previous=False, velocity=False, mutation=False
    )
    assert dynamics.switches(ALL) == dynamics.Switches()


def test_only_the_traditional_seed_gives_the_acceleration_of_a_flexible_machine() -> None:
    """The finding of the chart, on one step and one seed."""
    result = dynamics.measure("flexible-double-pendulum", "iafsa-printed", seeds=1, steps=1)
    assert np.all(result.error[1] < 1e-12)
    assert np.all(result.error[0] > 1e-3)
    assert np.all(result.evaluations == 2 * 40 * 101)


@pytest.fixture(scope="module")
def data() -> inverse.Data:
    return inverse.Data.load()


def test_the_traditional_seed_alone_reaches_the_target(data: inverse.Data) -> None:
    evaluations, reached, error = inverse.search("iafsa", data, (True, False, True, True), 0, 100)
    assert reached
    assert evaluations < 40
    assert error < inverse.CLOSE


def test_the_previous_seed_is_paid_for(data: inverse.Data) -> None:
    """Eleven swarms on half the record cost half of eleven swarms, or the budget."""
    without, *_ = inverse.search("iafsa", data, (False, False, True, True), 0, 300)
    evaluations, reached, _ = inverse.search("iafsa", data, (False, True, True, True), 0, 300)
    assert without == evaluations == 300
    assert not reached
