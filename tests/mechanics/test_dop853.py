"""The numbers of the method of order 8."""

from __future__ import annotations

import numpy as np
from scipy.integrate import DOP853
from shoal.mechanics.integrators import dop853_tableau as table


def test_the_table_is_that_of_scipy() -> None:
    stages = table.STAGES
    np.testing.assert_array_equal(table.WEIGHTS[:stages, :stages], DOP853.A)
    np.testing.assert_array_equal(table.WEIGHTS[stages, :stages], DOP853.B)
    np.testing.assert_array_equal(table.WEIGHTS[stages + 1 :], DOP853.A_EXTRA)
    np.testing.assert_array_equal(table.INSTANTS, [*DOP853.C, 1.0, *DOP853.C_EXTRA])
    np.testing.assert_array_equal(table.ERROR_3, DOP853.E3)
    np.testing.assert_array_equal(table.ERROR_5, DOP853.E5)
    np.testing.assert_array_equal(table.DENSE, DOP853.D)
