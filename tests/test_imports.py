"""What a simulation does not need is not imported by it: counted in modules, in an interpreter of its own."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

FOREIGN = ("scipy", "pandas", "matplotlib", "prefect", "mlflow", "xarray", "casadi", "exudyn", "fastapi", "cma")
RUN = """
import sys
import numba
before = set(sys.modules)
import numpy as np
import shoal
import shoal.scene
import shoal.mechanics.simulate
for scene in ("single-pendulum", "flexible-double-pendulum"):
    run = shoal.simulate(scene, [1e-3], verify=False)
    assert run.ok, run.message
from click.testing import CliRunner
from shoal.cli import main
told = CliRunner().invoke(main, ["simulate", "single-pendulum", "--at", "1e-3"])
assert "status ok" in told.stdout, told
print(sorted(name for name in set(sys.modules) - before if name.partition(".")[0] in {foreign!r}))
"""


def test_a_simulation_imports_nothing_that_it_does_not_need() -> None:
    program = RUN.format(foreign=FOREIGN)
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.stdout == "[]\n"


IDENTIFY = """
import sys
from click.testing import CliRunner
from shoal.cli import main
told = CliRunner().invoke(main, ["identify", "paper-case-1", "--json"])
assert '"verdict": "identified"' in told.stdout, told
lazy = ("scipy.optimize", "scipy.stats", "scipy.integrate", "exudyn", "rich.progress", "numba.typed.typeddict")
print([name for name in lazy if name in sys.modules])
"""


def test_an_identification_that_finds_its_kernels_and_data_imports_little() -> None:
    for _ in range(2):  # the first may have to compile, and to compute the data
        done = subprocess.run([sys.executable, "-c", IDENTIFY], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_numba_looks_for_no_linear_algebra_before_a_kernel_wants_it() -> None:
    program = "import sys, shoal.mechanics.simulate, numba.np.arraymath; print('scipy.linalg' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


@pytest.mark.slow
def test_numba_finds_the_linear_algebra_of_scipy_when_a_kernel_wants_it() -> None:
    import shoal.mechanics.simulate  # noqa: F401 - puts it off
    from numba import njit

    solved = njit(lambda matrix, vector: np.linalg.solve(matrix, matrix @ vector))
    vector = np.array([1.0, -2.0])
    assert np.allclose(solved(np.array([[2.0, 1.0], [1.0, 3.0]]), vector), vector)


LATER = """
import sys
import numpy as np
import shoal.mechanics.simulate
from numba import njit
from shoal.mechanics.numerics import sparse
from shoal.scene import load_scene
shoal.mechanics.simulate.simulate(load_scene("single-pendulum"), np.array([1e-3]))
pattern = sparse.analyse(1, {(0, 0): 0})[0]
from shoal.mechanics.model import _factor_mass
values = np.array([4.0])
_factor_mass((0,), pattern, values)
again = njit(lambda pattern, values: _factor_mass((0,), pattern, values))
again(pattern, values)
print(values[0])
"""


@pytest.mark.slow
def test_a_kernel_that_was_only_loaded_can_still_be_compiled_into_another() -> None:
    for _ in range(2):  # the first may have to compile it
        done = subprocess.run([sys.executable, "-c", LATER], capture_output=True, text=True, check=True)
    assert float(done.stdout) == 4.0  # the inverse of the inverse


def test_python_does_not_look_through_all_that_was_imported_once_more_at_its_end() -> None:
    program = "import atexit, gc; atexit.register(lambda: print(gc.get_freeze_count() > 1000))\n"
    program += "from shoal.cli import main; main(['--version'])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "True"
