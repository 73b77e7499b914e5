"""Free directions and spectra of large machines, by sparse factors and Lanczos, against dense ones and closed forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse
from shoal.mechanics.analysis import balance
from shoal.mechanics.analysis.freedom import Metric
from shoal.mechanics.analysis.lanczos import lowest
from shoal.mechanics.analysis.modes import Modes, modes
from shoal.mechanics.analysis.small_motions import ROUND, BoundedMatrix
from shoal.mechanics.analysis.sparse_freedom import SparseMetric
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene

GROUND = {"body": "ground", "point": [0.0, 0.0]}
STEEL = {"kind": "rod", "length": 1.0, "density": 7800.0, "youngs_modulus": 2.1e11, "element": "ancf-cable"}


def _chain(count: int, size: int = 60) -> tuple[Any, Any, Any]:
    """Masses of 1 to 2 kg on springs in two equal rows; constraints tie some of them, the last ones redundantly."""
    masses = scipy.sparse.diags_array(np.tile(np.linspace(1.0, 2.0, size), 2)).tocsc()
    one = scipy.sparse.diags_array([np.full(size - 1, -1.0), np.full(size, 2.0), np.full(size - 1, -1.0)],
                                   offsets=[-1, 0, 1])  # fmt: skip
    stiffness = 1e4 * scipy.sparse.block_diag([one, one], format="csc")
    rows = np.zeros((count + 2, 2 * size))
    for k in range(count):
        rows[k, [3 * k, 3 * k + 1, 3 * k + size, 3 * k + size + 1]] = 1.0, -0.5, 1.0, -0.5
    if count:
        rows[count] = 2.0 * rows[0] - rows[1]
        rows[count + 1] = rows[2] + 1e-3 * rows[3]
    return masses, stiffness, scipy.sparse.csr_array(rows[: count + 2 if count else 0])


@pytest.mark.parametrize("count", [0, 5])
def test_what_constraints_leave_of_a_force_with_rows_that_depend_on_others(count: int) -> None:
    mass, stiffness, jacobian = _chain(count)
    dense, sparse = Metric(mass).freedom(jacobian), SparseMetric(mass, stiffness).freedom(jacobian)
    assert (sparse.rank, sparse.degrees) == (dense.rank, dense.degrees) == (count, 120 - count)
    force = np.random.default_rng(1).normal(size=120)
    np.testing.assert_allclose(sparse.split(force)[0], dense.split(force)[0], rtol=0, atol=1e-14)
    np.testing.assert_allclose(sparse.split(force)[1], dense.split(force)[1], rtol=0, atol=1e-13)
    gap = jacobian @ np.random.default_rng(2).normal(size=120)
    np.testing.assert_allclose(sparse.shift(gap), dense.shift(gap), rtol=0, atol=1e-13)
    step = sparse.step(stiffness, force, 3.0)
    np.testing.assert_allclose(step, dense.step(stiffness, force, 3.0), rtol=0, atol=1e-14)
    assert sparse.dependent.shape == dense.dependent.shape
    np.testing.assert_allclose(sparse.dependent.T @ jacobian.toarray(), 0.0, atol=1e-14)
    wanted = scipy.linalg.orth(dense.dependent)
    np.testing.assert_allclose(wanted @ (wanted.T @ sparse.dependent), sparse.dependent, atol=1e-12)


@pytest.mark.parametrize("count", [0, 5])
@pytest.mark.parametrize("least", [4, 5, 11])
@pytest.mark.parametrize("softer", [0.0, 50.0])
def test_lanczos_finds_equal_and_negative_eigenvalues(count: int, least: int, softer: float) -> None:
    mass, stiffness, jacobian = _chain(count)
    tangent = stiffness - softer * mass
    found = lowest(SparseMetric(mass, stiffness).freedom(jacobian), BoundedMatrix(tangent, ROUND * abs(tangent)), mass,
                   np.zeros(120, dtype=int), least)  # fmt: skip
    basis = Metric(mass).freedom(jacobian).basis
    wanted = scipy.linalg.eigvalsh(basis.T @ (tangent @ basis))
    assert len(found.values) >= least + np.sum(wanted < 0)
    np.testing.assert_allclose(found.values, wanted[: len(found.values)], rtol=1e-11)
    np.testing.assert_allclose(found.shapes.T @ (mass @ found.shapes), np.eye(len(found.values)), atol=1e-12)
    np.testing.assert_allclose(jacobian @ found.shapes, 0.0, atol=1e-13)


def _rod(ends: str, elements: int = 40, **more: Any) -> Scene:
    """A steel rod with an end held by a weld, a hinge or not at all."""
    held = {"O": {"kind": ends, "first": GROUND, "second": {"body": "A"}}} if ends else {}
    rod = STEEL | {"height": 0.01, "width": 0.02, "elements": elements}
    return Scene.parse(
        {
            "name": "rod",
            "gravity": [0.0, -9.81] if ends else [0.0, 0.0],
            "bodies": {"A": rod},
            "joints": held,
            "markers": {"T": {"body": "A", "point": "end"}},
            "initial": {"A": {"angle": -np.pi / 2} if ends == "revolute" else {"position": [0.0, 0.0]}},
        }
        | more
    )


def _both(scene: Scene, monkeypatch: pytest.MonkeyPatch, **how: Any) -> tuple[Modes, Modes]:
    monkeypatch.setattr(balance, "LARGE", 10**9)
    dense = modes(scene, **how)
    monkeypatch.setattr(balance, "LARGE", 0)
    return dense, modes(scene, **how)


@pytest.mark.parametrize("ends", ["weld", "revolute", ""])
def test_sparse_modes_are_the_dense_ones(ends: str, monkeypatch: pytest.MonkeyPatch) -> None:
    dense, sparse = _both(_rod(ends), monkeypatch, about="equilibrium" if ends else "start")
    assert [mode.kind for mode in sparse.modes] == [mode.kind for mode in dense.modes]
    assert sparse.status is dense.status
    values = [np.array([mode.eigenvalue for mode in one.modes]) for one in (sparse, dense)]
    # Each squared frequency is known to the round-off of the stiffness, some eps * 40^4 of the lowest one.
    np.testing.assert_allclose(*values, rtol=1e-10, atol=1e-9 * abs(values[1][-1]))


def test_an_unstable_rod_has_the_same_sparse_modes(monkeypatch: pytest.MonkeyPatch) -> None:
    standing = _rod("revolute", 3, initial={"A": {"angle": np.pi / 2}})
    dense, sparse = _both(standing, monkeypatch, leave_unstable=False, count=3)
    assert [mode.kind for mode in sparse.modes] == [mode.kind for mode in dense.modes]
    assert sparse.modes[0].eigenvalue.real == pytest.approx(dense.modes[0].eigenvalue.real, rel=1e-8)
    assert sparse.modes[0].eigenvalue.real == pytest.approx(np.sqrt(1.5 * 9.81), rel=1e-3)


@pytest.mark.parametrize("ends", ["weld", "revolute"])
def test_sparse_statics_is_the_dense_one(ends: str, monkeypatch: pytest.MonkeyPatch) -> None:
    force = {"kind": "force", "at": {"body": "A", "point": "end"}, "force": [60.0, -20.0]}
    scene = _rod(ends, 12, loads={"P": force})
    monkeypatch.setattr(balance, "LARGE", 10**9)
    dense = statics(scene)
    monkeypatch.setattr(balance, "LARGE", 0)
    sparse = statics(scene)
    assert (sparse.status, sparse.message) == (dense.status, dense.message)
    np.testing.assert_allclose(sparse.points, dense.points, rtol=0, atol=1e-9)
    count = len(sparse.eigenvalues)
    np.testing.assert_allclose(sparse.eigenvalues, dense.eigenvalues[:count], rtol=1e-7)


def test_a_cantilever_of_150_elements_against_the_bernoulli_euler_beam() -> None:
    found = modes(_rod("weld", 150, gravity=[0.0, 0.0]), count=3)
    roots = np.array([1.8751040687119611, 4.694091132974174, 7.854757438237612])
    wanted = roots**2 * np.sqrt(2.1e11 / 7800.0 / 12.0) * 0.01
    np.testing.assert_allclose([mode.angular_frequency for mode in found.modes], wanted, rtol=1e-5)


def test_damped_modes_of_a_large_machine_are_the_dense_ones(monkeypatch: pytest.MonkeyPatch) -> None:
    rod = STEEL | {"height": 0.01, "width": 0.02, "elements": 10, "retardation": 1e-5}
    dense, sparse = _both(_rod("weld", bodies={"A": rod}), monkeypatch, count=5)
    values = [np.array([mode.eigenvalue for mode in one.modes]) for one in (sparse, dense)]
    np.testing.assert_allclose(*values, rtol=1e-9)
