"""Static equilibria against published digits, elliptic integrals and textbook statics."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import ellipeinc, ellipk, ellipkinc
from shoal.cli import main
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.findings import EquilibriumStatus
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene, load_scene

GROUND = {"body": "ground", "point": [0.0, 0.0]}
TIP = {"body": "rod", "point": "end"}
CLAMP = {"clamp": {"kind": "weld", "first": GROUND, "second": {"body": "rod"}}}
STEEL = {"kind": "rod", "density": 7850.0, "youngs_modulus": 2.07e11, "poisson_ratio": 0.3}
THICK = STEEL | {"length": 2.0, "height": 0.1, "width": 0.1}
THIN = STEEL | {"length": 1.0, "height": 0.001, "width": 0.01}


def _bending(rod: dict[str, Any]) -> float:
    return float(rod["youngs_modulus"] * rod["width"] * rod["height"] ** 3 / 12)


def _cantilever(
    rod: dict[str, Any], loads: dict[str, Any], gravity: tuple[float, float] = (0, 0), angle: float = 0.0
) -> Scene:
    joints = {"clamp": CLAMP["clamp"] | {"angle": angle}}
    scene = {"name": "cantilever", "gravity": gravity, "bodies": {"rod": rod}, "joints": joints, "loads": loads,
             "markers": {"tip": TIP}, "initial": {"rod": {"angle": angle}}}  # fmt: skip
    return Scene.parse(scene)


def _force(x: float, y: float, **more: Any) -> dict[str, Any]:
    return {"load": {"kind": "force", "at": TIP, "force": [x, y], **more}}


def _solved(scene: Scene, **options: Any) -> Equilibrium:
    found = statics(scene, **options)
    assert found.ok, found.message
    assert found.stable
    assert found.residual < 1e-8
    return found


@pytest.mark.parametrize(
    ("element", "elements", "expected"),
    [
        ("ancf-cable", 2, (-0.4889263083414858, -1.1752228650551666)),
        ("ancf-cable", 4, (-0.5074287151188892, -1.2055337022335404)),
        ("ancf-cable", 8, (-0.5085092364970802, -1.2071977560198281)),
        ("ancf-cable", 32, (-0.508537277761696, -1.2072398264650905)),
        ("ancf-quintic", 8, (-0.5085373043209689, -1.2072398545457785)),
    ],
)
def test_large_deflection_of_a_cantilever_against_published_digits(
    element: str, elements: int, expected: tuple[float, float]
) -> None:
    # Exudyn's ANCF cable examples print these for meshes of 2, 4, 8, 32 and (in place of the quintic) 256 cables.
    scene = _cantilever(THICK | {"element": element, "elements": elements}, _force(0.0, -3 * _bending(THICK) / 4))
    found = _solved(scene)
    np.testing.assert_allclose(found.marker("tip") - [2.0, 0.0], expected, atol=2e-9)
    assert found.reactions is not None
    clamp = found.reactions.joints["clamp"]
    np.testing.assert_allclose(clamp.force, [0.0, 3 * _bending(THICK) / 4], atol=1e-2)
    assert clamp.torque == pytest.approx(3 * _bending(THICK) / 4 * found.marker("tip")[0], rel=1e-9)


@pytest.mark.parametrize("load", [1.0, 3.0, 10.0])
def test_elastica_under_a_dead_tip_load(load: float) -> None:
    # Bisshopp and Drucker 1945; load = P L^2 / EI, m = p^2 = (1 + sin(theta_tip))/2.
    def rest(m: float) -> float:
        return float(ellipk(m) - ellipkinc(np.arcsin(1 / np.sqrt(2 * m)), m) - np.sqrt(load))

    m = brentq(rest, 0.5 + 1e-12, 1 - 1e-12, xtol=1e-15)
    phi = np.arcsin(1 / np.sqrt(2 * m))
    across = 1 - 2 * (ellipeinc(np.pi / 2, m) - ellipeinc(phi, m)) / np.sqrt(load)
    along = np.sqrt(2 * (2 * m - 1)) / np.sqrt(load)
    scene = _cantilever(THIN | {"element": "ancf-quintic", "elements": 8}, _force(0.0, -load * _bending(THIN)))
    found = _solved(scene)
    np.testing.assert_allclose(found.marker("tip"), [along, -across], atol=2e-6)
    assert found.angle("tip") == pytest.approx(-np.arcsin(2 * m - 1), abs=3e-6)


def test_force_that_follows_the_tip_against_the_elastica_equation() -> None:
    # Back from the tip, EI psi'' = -F cos(psi) for psi = theta - theta_tip.
    load = 5.0
    run = solve_ivp(
        lambda s, y: [-y[1], load * np.cos(y[0]), -np.cos(y[0]), -np.sin(y[0])], (0, 1), [0, 0, 0, 0], rtol=1e-12,
        atol=1e-12,
    )  # fmt: skip
    psi, _, x, y = run.y[:, -1]
    tip = -(x + 1j * y) * np.exp(-1j * psi)
    rod = THIN | {"element": "ancf-quintic", "elements": 8}
    found = statics(_cantilever(rod, _force(0.0, load * _bending(THIN), follows=True)))
    assert found.ok, found.message
    np.testing.assert_allclose(found.marker("tip"), [tip.real, tip.imag], atol=3e-6)
    assert found.angle("tip") == pytest.approx(-psi, abs=3e-6)


@pytest.mark.parametrize(("element", "elements"), [("ancf-cable", 16), ("ancf-quintic", 8)])
def test_end_moment_bends_a_rod_into_a_circle(element: str, elements: int) -> None:
    stiffness = _bending(THICK)
    loads = {"moment": {"kind": "torque", "at": TIP, "torque": np.pi * stiffness}}
    found = _solved(_cantilever(THICK | {"element": element, "elements": elements}, loads))
    tolerance = 3e-3 if element == "ancf-cable" else 2e-5
    np.testing.assert_allclose(found.marker("tip"), [0.0, 0.0], atol=tolerance)
    assert found.angle("tip") == pytest.approx(2 * np.pi, abs=tolerance)
    assert found.strain_energy["rod"] == pytest.approx(stiffness * np.pi**2, rel=1e-3)


@pytest.mark.parametrize(("height", "elements", "tolerance"), [(0.1, 16, 1.2e-3), (0.05, 24, 8e-4)])
def test_ancf_full_with_the_enhanced_law_against_a_beam_with_shear(
    height: float, elements: int, tolerance: float
) -> None:
    # Reissner 1972: r' = (1 + N/EA) t + (Q/GA) n, EI theta' = M, M' = -r' x F; shot from the clamp.
    rod = THICK | {"height": height}
    area, bending = rod["height"] * rod["width"], _bending(rod)
    axial, shear, force = 2.07e11 * area, 2.07e11 / 2.6 * area, 3 * bending / 4

    def rate(_: float, y: Any) -> list[float]:
        tangent = np.exp(1j * y[0])
        normal_force, shear_force = -force * np.sin(y[0]), -force * np.cos(y[0])
        way = tangent * (1 + normal_force / axial + 1j * shear_force / shear)
        return [y[1] / bending, force * way.real, way.real, way.imag]

    def shoot(moment: float) -> Any:
        return solve_ivp(rate, (0, 2), [0, moment, 0, 0], rtol=1e-11, atol=1e-9).y[:, -1]

    moment = brentq(lambda m: shoot(m)[1], -2 * force, 0.0, xtol=1e-6)
    expected = shoot(moment)[2:]
    scene = _cantilever(rod | {"element": "ancf-full", "elements": elements, "law": "enhanced"}, _force(0.0, -force))
    np.testing.assert_allclose(_solved(scene).marker("tip"), expected, atol=tolerance)


def test_column_buckles_into_the_elastica() -> None:
    # Clamped at the foot, L = 1: P_cr = pi^2 EI / 4; beyond it k = sqrt(P/EI) = K(p), theta_tip = 2 asin p, x = 2 p/k.
    critical = np.pi**2 / 4 * _bending(THIN)
    rod = THIN | {"element": "ancf-quintic", "elements": 4}

    def column(ratio: float) -> Scene:
        return _cantilever(rod, _force(0.0, -ratio * critical), angle=np.pi / 2)

    below = _solved(column(0.99))
    assert abs(below.marker("tip")[0]) < 1e-9
    straight = statics(column(1.2), leave_unstable=False)
    assert straight.status is EquilibriumStatus.UNSTABLE
    assert abs(straight.marker("tip")[0]) < 1e-9
    found = _solved(column(1.2))
    root = np.sqrt(1.2 * np.pi**2 / 4)
    m = brentq(lambda m: ellipk(m) - root, 1e-6, 0.99)
    assert abs(found.marker("tip")[0]) == pytest.approx(2 * np.sqrt(m) / root, abs=1e-4)
    assert abs(found.angle("tip") - np.pi / 2) == pytest.approx(2 * np.arcsin(np.sqrt(m)), abs=2e-4)


def test_hanging_chain_of_rigid_rods() -> None:
    # tan(angle) grows evenly from rod to rod: H tan(angle_k) = w (k - (n - 1)/2) for n rods of weight w.
    count, span, weight = 6, 4.2, 9.81 * 0.5
    slant = float(np.arccos(span / count))
    rods = {f"r{k}": {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.01, "density": 5000.0} for k in range(6)}
    joints = {f"j{k}": {"first": {"body": f"r{k - 1}", "point": "end"}, "second": {"body": f"r{k}"}}
              for k in range(1, count)}  # fmt: skip
    joints["left"] = {"first": GROUND, "second": {"body": "r0"}}
    joints["right"] = {
        "first": {"body": "ground", "point": [span, 0.0]},
        "second": {"body": f"r{count - 1}", "point": "end"},
    }
    scene = Scene.parse(
        {
            "name": "chain",
            "bodies": rods,
            "joints": joints,
            "markers": {f"m{k}": {"body": f"r{k}", "point": "end"} for k in range(count)},
            "initial": {f"r{k}": {"angle": -slant if k < count // 2 else slant} for k in range(count)},
        }
    )
    found = _solved(scene)
    steps = np.arange(count) - (count - 1) / 2
    pull = brentq(lambda h: np.sum(np.cos(np.arctan(weight * steps / h))) - span, 1e-2, 1e3, xtol=1e-13)
    np.testing.assert_allclose(found.angles, np.arctan(weight * steps / pull), atol=1e-9)
    assert found.reactions is not None
    np.testing.assert_allclose(found.reactions.joints["left"].force, [-pull, count * weight / 2], rtol=1e-9)


def test_flexible_chain_hangs_straight_down_and_stretches() -> None:
    found = _solved(load_scene("flexible-double-pendulum"))
    # Two rods of sections 8e-4 m^2: the weight below stretches each, EA u' = N.
    weight = 5540 * 8e-4 * 9.81
    upper = 1 + (2 * weight + weight / 2) / (2e8 * 8e-4)
    lower = 2 + (2 * weight) * 2 / 2 / (2e7 * 8e-4)
    np.testing.assert_allclose(found.points, [[0.0, -upper], [0.0, -upper - lower]], atol=1e-9)
    assert found.reactions is not None
    np.testing.assert_allclose(found.reactions.joints["O"].force, [0.0, 3 * weight], atol=1e-7)


def _pendulum(angle: float, **more: Any) -> Scene:
    return Scene.parse(
        {
            "name": "pendulum",
            "bodies": {"rod": {"kind": "rod", "length": 1.0, "height": 0.01, "width": 0.1, "density": 1000.0}},
            "joints": {"O": {"first": GROUND, "second": {"body": "rod"}, "coulomb": 0.5}},
            "markers": {"tip": TIP},
            "initial": {"rod": {"angle": angle}},
            **more,
        }
    )


def test_pendulum_on_a_torsion_spring() -> None:
    spring = {"kind": "torsion-spring", "first": GROUND, "second": {"body": "rod"}, "stiffness": 7.0, "angle": 0.4}
    found = _solved(_pendulum(0.0, loads={"spring": spring}))
    expected = brentq(lambda a: 7.0 * (a - 0.4) + 9.81 / 2 * np.cos(a), -np.pi, np.pi, xtol=1e-14)
    assert found.angle("tip") == pytest.approx(expected, abs=1e-11)


def test_inverted_pendulum_is_unstable_or_is_left() -> None:
    scene = _pendulum(np.pi / 2)
    standing = statics(scene, leave_unstable=False)
    assert standing.status is EquilibriumStatus.UNSTABLE
    assert standing.eigenvalues[0] == pytest.approx(-1.5 * 9.81, rel=1e-12)
    assert "rod" in standing.message
    found = _solved(scene)
    np.testing.assert_allclose(found.marker("tip"), [0.0, -1.0], atol=1e-9)
    assert "unstable-left" in found.codes


def test_what_nothing_holds_is_refused_by_name() -> None:
    floating = statics(_pendulum(0.3, gravity=[0.0, 0.0]))
    assert floating.status is EquilibriumStatus.UNHELD
    assert "nothing holds rod" in floating.message
    falling = _pendulum(0.0).model_dump(mode="json")
    falling["joints"] = {}
    falling["initial"]["rod"]["position"] = [0.0, 0.0]
    found = statics(Scene.parse(falling))
    assert found.status is EquilibriumStatus.UNHELD
    assert found.codes == ["falls-without-end"]
    assert not found.ok


def test_a_shallow_truss_snaps_through() -> None:
    # Beyond the limit load of a von Mises truss only the inverted branch is left: k (1 - l0/l) y = F.
    spring = {"kind": "spring", "first": GROUND, "second": {"body": "top"}, "stiffness": 100.0}
    load = {"kind": "force", "at": {"body": "top"}, "force": [0.0, -2.0]}
    rail = {"kind": "slider", "first": {"body": "ground", "point": [1.0, 0.0]}, "second": {"body": "top"},
            "direction": np.pi / 2}  # fmt: skip
    scene = Scene.parse(
        {
            "name": "truss",
            "gravity": [0.0, 0.0],
            "bodies": {"top": {"kind": "point-mass", "mass": 1.0}},
            "joints": {"rail": rail},
            "loads": {"spring": spring, "load": load},
            "markers": {"top": {"body": "top"}},
            "initial": {"top": {"position": [1.0, 0.3]}},
        }
    )
    found = _solved(scene)
    rest = np.hypot(1.0, 0.3)
    y = brentq(lambda y: 100 * (1 - rest / np.hypot(1, y)) * y + 2.0, -1.0, -0.3, xtol=1e-14)
    np.testing.assert_allclose(found.marker("top"), [1.0, y], atol=1e-10)
    assert "snapped" in found.codes


@pytest.mark.parametrize("start", [3.0, -2.6, 0.4])
def test_a_body_under_a_force_that_follows_comes_to_rest_from_afar(start: float) -> None:
    """Weight, a hinge's spring and a force that turns with the body: the one angle where their torques cancel."""
    spring = {"kind": "torsion-spring", "first": GROUND, "second": {"body": "rod"}, "stiffness": 6.0, "cubic": 8.0,
              "angle": -0.5}  # fmt: skip
    found = _solved(_pendulum(start, loads={"spring": spring, **_force(9.0, 4.0, follows=True)}))

    def torque(a: float) -> float:
        return 4.0 - 6.0 * (a + 0.5) - 8.0 * (a + 0.5) ** 3 - 9.81 / 2 * np.cos(a)

    grid = np.linspace(-4, 4, 4001)
    assert np.count_nonzero(np.diff(np.sign(torque(grid)))) == 1
    assert found.angle("tip") == pytest.approx(brentq(torque, -4, 4, xtol=1e-14), abs=1e-9)


def test_two_bodies_under_a_force_that_follows_come_to_rest_from_afar() -> None:
    """The follower force bears the outer body, so that the inner one hangs by what is left."""
    force, mass = 2.0, 1.0
    data = _pendulum(2.5, loads={}).model_dump(mode="json")
    data["bodies"]["bob"] = data["bodies"]["rod"]
    data["joints"]["A"] = {"first": TIP, "second": {"body": "bob"}}
    end = {"body": "bob", "point": "end"}
    data["loads"] = {"load": {"kind": "force", "at": end, "force": [0.0, force], "follows": True}}
    data["initial"]["bob"] = {"angle": -2.8}
    data["markers"]["bob"] = end
    found = _solved(Scene.parse(data))
    outer = np.arctan2(-np.sqrt((mass * 9.81 / 2) ** 2 - force**2), force)
    across, along = force * -np.sin(outer), force * np.cos(outer) - 1.5 * mass * 9.81
    assert np.cos(found.angle("bob")) == pytest.approx(np.cos(outer), abs=1e-9)
    np.testing.assert_allclose(found.marker("tip"), np.array([across, along]) / np.hypot(across, along), atol=1e-9)


@pytest.mark.parametrize(
    "load",
    [
        pytest.param({"kind": "torque", "at": {"body": "rod"}, "torque": 8.0}, id="torque", marks=pytest.mark.slow),
        pytest.param({"kind": "force", "at": TIP, "force": [0.0, 8.0], "follows": True}, id="follower"),
    ],
)
def test_what_turns_without_end_is_told_with_what_turns_it(load: dict[str, Any]) -> None:
    """More than the weight can hold at any angle, m g L / 2 = 4.9 N m."""
    found = statics(_pendulum(0.0, loads={"drive": load}))
    assert found.status is EquilibriumStatus.UNHELD
    assert found.codes[0] == "turns-without-end"


def test_commands_tell_a_stable_rest_from_an_answer_that_is_none() -> None:
    def shoal(*arguments: str) -> Any:
        return CliRunner().invoke(main, list(arguments))

    rest = shoal("statics", "rigid-double-pendulum", "--json")
    assert rest.exit_code == 0
    assert json.loads(rest.stdout)["markers"]["B"]["y"] == pytest.approx(-3.0, abs=1e-9)
    assert shoal("statics", "single-pendulum", "--set", "gravity.1=0").exit_code == 3
    assert shoal("statics", "nothing").exit_code == 2
    found = shoal("modes", "single-pendulum", "--json")
    assert found.exit_code == 0
    assert json.loads(found.stdout)["modes"][0]["angular_frequency"] == pytest.approx(np.sqrt(9.81), rel=1e-9)
    assert shoal("modes", "rigid-double-pendulum", "--about", "start").exit_code == 3
    assert "unique" in shoal("reactions", "single-pendulum", "--at", "0.1").stdout


def test_drives_stand_where_they_are_at_the_stated_time() -> None:
    data = _pendulum(0.0).model_dump(mode="json")
    data["bodies"]["bob"] = data["bodies"]["rod"]
    data["joints"]["A"] = {"first": TIP, "second": {"body": "bob"}}
    data["joints"]["motor"] = {"kind": "driven-angle", "first": GROUND, "second": {"body": "rod"}, "angle": "2*t"}
    data["markers"]["bob"] = {"body": "bob", "point": "end"}
    found = _solved(Scene.parse(data), time=0.6)
    tip = np.array([np.cos(1.2), np.sin(1.2)])
    np.testing.assert_allclose(found.points, [tip, tip - [0.0, 1.0]], atol=1e-10)
    assert found.reactions is not None
    assert found.reactions.joints["motor"].torque == pytest.approx(1.5 * 9.81 * np.cos(1.2), rel=1e-9)


def test_a_cantilever_under_its_weight_has_plain_data() -> None:
    rod = THICK | {"element": "ancf-quintic", "elements": 4}
    found = _solved(_cantilever(rod, {}, gravity=(0.0, -9.81)))
    line = 7850 * 0.01 * 9.81
    assert found.marker("tip")[1] == pytest.approx(-line * 2**4 / 8 / _bending(THICK), rel=1e-4)
    data = found.to_json()
    assert data["status"] == "ok"
    assert data["reactions"]["joints"]["clamp"]["torque"] == pytest.approx(line * 2, rel=1e-5)
