"""The fully parameterised element: mass, objectivity, derivatives, another integration, energy-momentum, limits."""

from __future__ import annotations

from typing import Any

import element_doors as doors
import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_bvp
from shoal.compile.pointers import pointer, raw
from shoal.mechanics.dynamics import ELEMENT_ROOM
from shoal.mechanics.elements import ancf_full, families
from shoal.mechanics.elements.ancf_full import LAWS
from shoal.mechanics.numerics.tile import SINGLE, WIDE, packed

YOUNG, POISSON, SHEAR, LENGTH, HEIGHT, WIDTH, DENSITY = 2e8, 0.3, 0.85, 0.5, 0.06, 0.04, 5540.0
laws = pytest.mark.parametrize("law", list(LAWS))


@njit(cache=True)
def _mean_door(tile, family, before, after, f, w):
    families.add_mean_force(tile, raw(family), pointer(before), pointer(after), pointer(f), pointer(w))


def _family(
    law: str,
    *,
    lanes: int = 1,
    elements: int = 1,
    length: float = LENGTH,
    height: float = HEIGHT,
    width: float = WIDTH,
    young: float = YOUNG,
    shear: float = SHEAR,
) -> Any:
    """A chain of equal elements."""
    found = families.Collected()
    for number in range(elements):
        numbers = ancf_full.coefficients(LAWS[law], length, height, width, young, POISSON, shear)
        part = families.Entry(ancf_full.quadrature(LAWS[law]), 0, False, numbers, [])
        found.add("rod", [*range(6 * number, 6 * number + 12)], part)
    return packed(found.family(ancf_full.Solids), slice(0, lanes), (0,) * lanes)


STRAIGHT = [0j, 1 + 0j, 1j, LENGTH + 0j, 1 + 0j, 1j]


def _pairs(vectors: Any) -> Any:
    values = np.asarray(vectors, dtype=complex)
    return np.column_stack([values.real, values.imag]).ravel()


def _bent(seed: int) -> Any:
    """A random element: everything off by some percent, slopes by some tenths of a radian, turned anyhow."""
    rng = np.random.default_rng(seed)
    turn, first = np.exp(1j * rng.uniform(-np.pi, np.pi)), complex(*rng.normal(size=2))
    nodal = np.array(STRAIGHT) * (1 + rng.uniform(-0.05, 0.05, 6))
    nodal[[1, 2, 4, 5]] *= np.exp(1j * rng.uniform(-0.4, 0.4, 4))
    nodal[[0, 3]] += first / turn
    return _pairs(nodal * turn)


def _force(family: Any, z: Any) -> Any:
    f, at, work = np.zeros(z.size), z.copy(), np.zeros(ELEMENT_ROOM)
    doors.force(SINGLE, family, at, at, f, work, work)
    return f


def _mean_force(family: Any, before: Any, after: Any) -> Any:
    f = np.zeros(before.size)
    _mean_door(SINGLE, family, before.copy(), after.copy(), f, np.zeros(ELEMENT_ROOM))
    return f


def _energy(family: Any, z: Any) -> float:
    energy = np.zeros(1)
    doors.energy(SINGLE, family, z.copy(), np.zeros(ELEMENT_ROOM), energy)
    return float(energy[0])


def _tangent(family: Any, z: Any) -> Any:
    """Assembled over the chain."""
    out = np.full(144 * family.size, np.nan)
    doors.tangent(SINGLE, family, z.copy(), np.zeros(ELEMENT_ROOM), out)
    whole = np.zeros((z.size, z.size))
    for rows, block in zip(family.rows[: 12 * family.size].reshape(-1, 12), out.reshape(-1, 12, 12), strict=True):
        whole[np.ix_(rows, rows)] += block
    return whole


def _matrices(law: str, shear: float = SHEAR) -> tuple[Any, Any]:
    """Constitutive matrices of (E11, E22, 2 E12) over Young's modulus, of the section and of the axis."""
    nu, g = POISSON, shear / (2 * (1 + POISSON))
    plane = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, g * (1 - nu**2)]]) / (1 - nu**2)
    free = np.diag([1, 1, g])
    volume = np.array([[1 - nu, nu, 0], [nu, 1 - nu, 0], [0, 0, g * (1 + nu) * (1 - 2 * nu)]]) / (1 + nu) / (1 - 2 * nu)
    none = np.zeros((3, 3))
    return {
        "plane-stress": (plane, none),
        "lame": (volume, none),
        "enhanced": (free, plane - free),
        "two-point": (plane, none),
    }[law]


def _integrated_energy(law: str, z: Any) -> float:
    """U by quadrature over x and y with the strains of F = (dr/dx, dr/dy), written out from the shape functions."""
    nodal = z[0::2] + 1j * z[1::2]
    along, across = np.polynomial.legendre.leggauss(LAWS[law].points), np.polynomial.legendre.leggauss(4)
    total = 0.0
    for x, wx in zip((1 + along[0]) / 2, along[1] / 2, strict=True):
        for y, wy, matrix in [
            *((y * HEIGHT / 2, w / 2, _matrices(law)[0]) for y, w in zip(*across, strict=True)),
            (0.0, 1.0, _matrices(law)[1]),
        ]:
            step = 1e-3  # position_shape is cubic in x and linear in y: differences of order four are exact
            fx = doors.differences(
                lambda at, y=y: np.array(ancf_full.position_shape(at[0], y, LENGTH)) @ nodal, np.array([x]), step
            )
            fy = doors.differences(
                lambda at, x=x: np.array(ancf_full.position_shape(x, at[0], LENGTH)) @ nodal, np.array([y]), step
            )
            u, v = fx[0] / LENGTH, fy[0]
            strain = np.array([(abs(u) ** 2 - 1) / 2, (abs(v) ** 2 - 1) / 2, np.real(np.conj(u) * v)])
            total += wx * wy * YOUNG * (strain @ matrix @ strain) / 2
    return float(total * LENGTH * HEIGHT * WIDTH)


def test_mass_is_positive_exact_and_keeps_mass_and_moments() -> None:
    mass = np.array(ancf_full.mass_matrix(DENSITY, LENGTH, HEIGHT, WIDTH))
    np.testing.assert_array_equal(mass, mass.T)
    assert np.linalg.eigvalsh(mass).min() > 0
    whole = DENSITY * LENGTH * HEIGHT * WIDTH
    one, x, y = (np.array(v, dtype=float) for v in ([1, 0, 0] * 2, [0, 1, 0, LENGTH, 1, 0], [0, 0, 1] * 2))
    moments = [whole, whole * LENGTH / 2, whole * LENGTH**2 / 3, whole * HEIGHT**2 / 12, 0, 0]
    found = [one @ mass @ one, one @ mass @ x, x @ mass @ x, y @ mass @ y, one @ mass @ y, x @ mass @ y]
    np.testing.assert_allclose(found, moments, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(ancf_full.weight(DENSITY * HEIGHT * WIDTH, LENGTH), mass @ one, rtol=1e-14)
    points, weights = np.polynomial.legendre.leggauss(4)
    expected = np.zeros((6, 6))
    for a, wa in zip(points, weights, strict=True):
        for b, wb in zip(points, weights, strict=True):
            shape = np.array(ancf_full.position_shape((1 + a) / 2, b * HEIGHT / 2, LENGTH))
            expected += wa * wb / 4 * whole * np.outer(shape, shape)
    np.testing.assert_allclose(mass, expected, rtol=1e-13, atol=1e-15)


@laws
@pytest.mark.parametrize("seed", range(3))
def test_rigid_motion_gives_no_force(law: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    at = np.array(STRAIGHT) * np.exp(1j * rng.uniform(-np.pi, np.pi))
    swing = _pairs(1j * at)
    at[[0, 3]] += complex(*rng.normal(size=2))
    family, z = _family(law), _pairs(at)
    stiffness = YOUNG * HEIGHT * WIDTH
    assert np.abs(_force(family, z)).max() < 1e-14 * stiffness
    assert _energy(family, z) < 1e-25 * stiffness
    tangent = _tangent(family, z)
    assert np.abs(tangent @ swing).max() < 1e-12 * np.abs(tangent).max()


@laws
@pytest.mark.parametrize("seed", range(3))
def test_energy_is_the_integral_over_the_rectangle(law: str, seed: int) -> None:
    z = _bent(seed)
    assert _energy(_family(law), z) == pytest.approx(_integrated_energy(law, z), rel=1e-9)


@laws
@pytest.mark.parametrize("seed", range(3))
def test_force_and_tangent_are_derivatives(law: str, seed: int) -> None:
    family, z = _family(law), _bent(seed)
    force = _force(family, z)
    gradient = doors.differences(lambda at: _energy(family, at), z, 1e-2)
    np.testing.assert_allclose(force, -gradient, rtol=0, atol=1e-11 * np.abs(force).max())
    tangent = _tangent(family, z)
    np.testing.assert_allclose(tangent, tangent.T, rtol=0, atol=1e-14 * np.abs(tangent).max())
    slope = doors.differences(lambda at: _force(family, at), z, 1e-2)
    np.testing.assert_allclose(tangent, -slope, rtol=0, atol=1e-11 * np.abs(tangent).max())
    # Inner forces: no resultant, no moment.
    f, at = (values[0::2] + 1j * values[1::2] for values in (force, z))
    assert abs(f[0] + f[3]) < 1e-13 * np.abs(force).max()
    assert abs(np.imag(np.conj(at) * f).sum()) < 1e-12 * np.abs(force).max()


@laws
def test_energy_is_quartic(law: str) -> None:
    """Along a line: the fifth differences vanish."""
    family, z, step = _family(law), _bent(0), _bent(1) - _bent(0)
    values = np.array([_energy(family, z + s * step) for s in np.linspace(0, 1, 6)])
    assert abs(np.diff(values, 5)[0]) < 1e-12 * values.max()


@laws
@pytest.mark.parametrize("seed", range(3))
def test_the_work_of_the_mean_force_is_the_loss_of_energy(law: str, seed: int) -> None:
    family, before, after = _family(law), _bent(seed), _bent(seed + 10)
    f = _mean_force(family, before, after)
    loss = _energy(family, before) - _energy(family, after)
    assert f @ (after - before) == pytest.approx(loss, abs=1e-13 * np.abs(f) @ np.abs(after - before))
    # It exerts no moment about the configuration half-way, which keeps angular momentum.
    g, at = (values[0::2] + 1j * values[1::2] for values in (f, (before + after) / 2))
    assert abs(g[0] + g[3]) < 1e-13 * np.abs(f).max()
    assert abs(np.imag(np.conj(at) * g).sum()) < 1e-12 * np.abs(f).max()
    np.testing.assert_allclose(
        _mean_force(family, before, before), _force(family, before), rtol=0, atol=1e-13 * np.abs(f).max()
    )


@laws
@pytest.mark.by_day(2)
def test_lanes_equal_singles(law: str) -> None:
    width = len(WIDE)
    states = np.array([_bent(seed) for seed in range(width)]).T
    others = np.roll(states, 1, axis=1)
    wide, single, work = _family(law, lanes=width), _family(law), np.zeros(64 * width)
    forces, means, energy, blocks = (np.zeros(rows * width) for rows in (12, 12, 1, 144))
    doors.force(WIDE, wide, states.ravel(), states.ravel(), forces, work, work)
    _mean_door(WIDE, wide, states.ravel(), others.ravel(), means, work)
    doors.energy(WIDE, wide, states.ravel(), work, energy)
    doors.tangent(WIDE, wide, states.ravel(), work, blocks)
    for lane in range(width):
        z = states[:, lane].copy()
        for found, expected in (
            (forces, _force(single, z)),
            (means, _mean_force(single, z, others[:, lane])),
            (energy, np.array([_energy(single, z)])),
            (blocks, _tangent(single, z).ravel()),
        ):
            np.testing.assert_allclose(found[lane::width], expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("elements", [1, 4])
@laws
def test_modes_without_stiffness(law: str, elements: int) -> None:
    """The three rigid motions; two Gauss points miss two more, which a held r_x at one node removes."""
    family = _family(law, elements=elements)
    z = _chain(elements, LENGTH, lambda s: (s, 0.0, 0.0))
    stiffness = np.abs(np.linalg.eigvalsh(_tangent(family, z)))
    assert np.count_nonzero(stiffness < 1e-10 * stiffness.max()) == (5 if law == "two-point" else 3)
    held = np.linalg.eigvalsh(_tangent(family, z)[6:, 6:])
    assert held.min() > 1e-8 * held.max()


# Large deflections of a rod clamped along x under a transverse force at its end. The clamp holds r and the
# direction of r_y; r_x is free, as a sheared axis need not be normal to the section and may stretch.
SPAN, THICKNESS, STEEL = 2.0, 0.1, 2.07e11
BENDING = STEEL * THICKNESS**4 / 12
LOAD = 3 * BENDING / SPAN**2


def _chain(elements: int, length: float, shape: Any) -> Any:
    nodal = []
    for s in length * np.arange(elements + 1):
        x, y, theta = shape(s)
        turn = np.exp(1j * theta)
        nodal += [x + 1j * y, turn, 1j * turn]
    return _pairs(nodal)


def _director_rod(law: str, shear: float) -> Any:
    """x, y, theta over s of the rod that the elements of a law converge to, and the displacement of its end.

    Stationary points of int W(r', v', v) ds + P y(end) with W the energy of the strains on u = r', m = v', v = r_y:
    dW/du = (0, -P), G = dW/dm, G' = dW/dv, G(end) = 0. Solved by collocation; derivatives of W by complex steps.
    """
    inner, outer = (STEEL * THICKNESS**2 * matrix for matrix in _matrices(law, shear))
    i2, i4 = THICKNESS**2 / 12, THICKNESS**4 / 80
    unit = STEEL * THICKNESS**2 * i2

    def gradient(a: Any) -> Any:
        """Of W in (u, m, v), (6, points)."""
        u, m, v = a[0:2], a[2:4], a[4:6]
        e, t, g = ((u * u).sum(0) - 1) / 2, ((v * v).sum(0) - 1) / 2, (m * m).sum(0)
        mean, spread = e + i2 * g / 2, (u * m).sum(0)
        s11 = inner[0, 0] * mean + inner[0, 1] * t + outer[0, 0] * e + outer[0, 1] * t
        # int y S11 and int y^2 S11, with E11 = e + y spread + y^2 g/2.
        first, second = inner[0, 0] * i2 * spread, inner[0, 0] * (i2 * e + i4 * g / 2) + inner[0, 1] * i2 * t
        s22 = inner[0, 1] * mean + outer[0, 1] * e + (inner[1, 1] + outer[1, 1]) * t
        s12, taper = (inner[2, 2] + outer[2, 2]) * (u * v).sum(0), inner[2, 2] * i2 * (m * v).sum(0)
        return np.vstack(
            [s11 * u + first * m + s12 * v, first * u + second * m + taper * v, s22 * v + s12 * u + taper * m]
        )

    def strains(v: Any, couple: Any) -> Any:
        """u and m from dW/du = (0, -P) and dW/dm = the couple."""
        normal = v / np.hypot(*v)
        tangent = np.vstack([normal[1], -normal[0]])
        a = np.vstack([tangent, couple / unit, v]).astype(complex)
        target = np.vstack([np.zeros(v.shape[1]), np.full(v.shape[1], -LOAD), couple])
        size = np.array([unit / i2, unit / i2, unit, unit])
        for _ in range(30):
            residual = (gradient(a)[:4] - target) / size[:, None]
            jacobian = np.empty((v.shape[1], 4, 4))
            for j in range(4):
                shifted = a.copy()
                shifted[j] += 1e-30j
                jacobian[:, :, j] = (gradient(shifted)[:4].imag / 1e-30 / size[:, None]).T
            step = np.linalg.solve(jacobian, -residual.real.T[:, :, None])[:, :, 0].T
            a[:4] += step
            if np.abs(step).max() < 1e-13:
                break
        return a.real

    def rate(_s: Any, y: Any) -> Any:
        a = strains(y[2:4], y[4:6] * unit)
        return np.vstack([a[:4], gradient(a)[4:] / unit])

    def ends(start: Any, end: Any) -> Any:
        return np.array([start[0], start[1], start[2], start[5], end[4], end[5]])

    s = np.linspace(0, SPAN, 100)
    theta = -LOAD * (SPAN * s - s * s / 2) / inner[0, 0] / i2 * 0.8
    steps = np.diff(s, prepend=0.0)
    turn = np.exp(1j * theta)
    at = np.cumsum(turn * steps)
    moment = LOAD * (SPAN - s) * 0.8 / unit
    guess = np.vstack([at.real, at.imag, -turn.imag, turn.real, moment * turn.real, moment * turn.imag])
    found = solve_bvp(rate, ends, s, guess, tol=1e-7, max_nodes=5000)
    assert found.status == 0

    def shape(at: float) -> tuple[float, float, float]:
        y = found.sol(at)
        return y[0], y[1], np.arctan2(-y[2], y[3])

    return shape, found.y[:2, -1] - [SPAN, 0]


def _tip(law: str, elements: int, shear: float, shape: Any, held: tuple[int, ...] = (0, 1, 4)) -> Any:
    """Displacement of the end by Newton's method from the nodes of `shape`."""
    length = SPAN / elements
    family = _family(law, elements=elements, length=length, height=THICKNESS, width=THICKNESS, young=STEEL, shear=shear)
    z = _chain(elements, length, shape)
    free = np.setdiff1d(np.arange(z.size), held)
    for _ in range(20):
        residual = _force(family, z)
        residual[6 * elements + 1] -= LOAD
        step = np.linalg.solve(_tangent(family, z)[np.ix_(free, free)], residual[free])
        z[free] += step
        if np.abs(step).max() < 1e-10:
            return z[6 * elements : 6 * elements + 2] - [SPAN, 0]
    raise AssertionError("Newton's method did not converge")


COWPER = 10 * (1 + POISSON) / (12 + 11 * POISSON)


@laws
@pytest.mark.by_day(1)
def test_a_cantilever_converges_to_the_director_rod_of_its_law(law: str) -> None:
    shape, exact = _director_rod(law, COWPER)
    # Two Gauss points need r_x held at one node, which costs the second order there.
    held = (0, 1, 2, 3, 4, 5) if law == "two-point" else (0, 1, 4)
    errors = [np.linalg.norm(_tip(law, n, COWPER, shape, held) - exact) for n in (16, 32)]
    assert errors[1] < 5e-4
    assert np.log2(errors[0] / errors[1]) > 1.95


@pytest.mark.slow
def test_only_the_enhanced_law_bends_like_a_beam() -> None:
    """Tips of the shear-deformable beam with this shear factor, by its bending stiffness (Reissner's equations).

    (-0.509465, -1.208823) with E I is published for this rod. At this thickness (strains of 7.5 %) a St
    Venant-Kirchhoff rod differs from it by 1.4 mm (0.36 mm at half the thickness and the same shape).
    """
    beam, coupled, volume = [-0.509465, -1.208823], [-0.462727, -1.160537], [-0.368211, -1.050583]
    for law, expected in (("enhanced", beam), ("plane-stress", coupled), ("lame", volume)):
        assert np.linalg.norm(_director_rod(law, COWPER)[1] - expected) < 2e-3
