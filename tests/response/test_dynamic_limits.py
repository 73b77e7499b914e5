"""Limits on energies and on forces in joints, against pendulums and an oscillator in closed form."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import optimize, special, stats
from shoal.cli import main
from shoal.errors import InputError
from shoal.notebook import uncertain
from shoal.response.limits.choice import WAYS
from shoal.response.limits.limit import limit
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array

PENDULUM, START, G = "single-pendulum", "initial.OA.angle", 9.81
"""1 kg at 1 m, released at rest at an angle from the horizontal."""
TIMES = np.linspace(0.0, 0.6, 13)


def pin(angle: float, times: Array = TIMES) -> Array:
    """What the pin exerts on the rod [N], (instants, 2), by Jacobi's functions.

    From straight down the pendulum is at p with sin(p / 2) = k cd(w t), and its rod is pulled by m (g cos p + L p'^2).
    """
    k = math.sin((angle + math.pi / 2) / 2)
    _, cn, dn, _ = special.ellipj(math.sqrt(G) * times, k**2)
    p = 2 * np.arcsin(k * cn / dn)
    pull = G * np.cos(p) + 2 * G * (np.cos(p) - math.cos(angle + math.pi / 2))
    return np.stack([-pull * np.sin(p), pull * np.cos(p)], axis=1)


def worst(text: str, angle: float) -> float:
    """The least margin of a pendulum."""
    one = limit(text, load_scene(PENDULUM))
    force = pin(angle)
    of = {"fx": force[:, 0], "fy": force[:, 1], "force": np.linalg.norm(force, axis=1)}
    return float(one.margin(of[one.quantity]).min())


@pytest.mark.parametrize(
    ("text", "kept"),
    [
        ("O.force > 12", False),
        ("O.force > 13", True),
        *(pytest.param(*one, marks=pytest.mark.slow) for one in (("O.fy < -0.5", True), ("abs(O.fx) > 4", False))),
    ],
)
@pytest.mark.slow
def test_forces_in_a_joint_with_intervals(text: str, kept: bool) -> None:
    """The least margin is that of the closed form over a dense scan of the angle."""
    found = uncertain(PENDULUM, {START: (-1.2, -1.0)}, TIMES, limit=[text], verify=False)
    told = found.to_json()["limits"][0]
    assert told["kept"] is kept
    assert told["unit"] == "N"
    least = min(worst(text, angle) for angle in np.linspace(-1.2, -1.0, 2001))
    assert told["margin"] == pytest.approx(least, abs=1e-6)
    assert told["shown_by"]["margin"] == pytest.approx(worst(text, told["shown_by"]["parameters"][START]), abs=1e-8)


def test_the_probability_of_a_force_in_a_joint() -> None:
    """The force grows with the drop: beyond the angle where it is the bound lies the probability."""
    text, mean, deviation = "O.force > 12.8", -1.1, 0.03
    edge = optimize.brentq(lambda angle: worst(text, angle), -1.2, -0.9, xtol=1e-12)
    exact = stats.norm.sf((edge - mean) / deviation)
    found = uncertain(
        *(PENDULUM, [f"{START}~normal({mean},{deviation})"], TIMES),
        **dict[str, Any](limit=[text], limit_method="form", verify=False, method="sobol", count=16),
    )
    told = found.to_json()["limits"][0]
    assert told["probability"] == pytest.approx(exact, rel=1e-3)
    assert told["design_points"][0]["parameters"][START] == pytest.approx(edge, abs=1e-5)


@pytest.mark.slow
def test_a_rare_force_by_importance_sampling() -> None:
    """About 1e-5."""
    times, text, mean, deviation = TIMES[2::2], "O.force > 13.2", -1.1, 0.03
    bound = limit(text, load_scene(PENDULUM)).bound
    edge = optimize.brentq(lambda a: float(np.linalg.norm(pin(a, times), axis=1).max()) - bound, -1.2, -0.9)
    exact = stats.norm.sf((edge - mean) / deviation)
    found = uncertain(
        *(PENDULUM, [f"{START}~normal({mean},{deviation})"], times),
        **dict[str, Any](limit=[text], limit_runs=1500, verify=False, method="sobol", count=16),
    )
    told = found.to_json()["limits"][0]
    assert told["lower"] <= exact <= told["upper"]
    assert told["probability"] == pytest.approx(exact, rel=0.2)


@pytest.mark.parametrize("way", WAYS)
@pytest.mark.by_day(1)
def test_the_probability_of_an_energy_by_every_way(way: str) -> None:
    """The energy is m g L sin(angle) from the start on, at all instants."""
    bound, mean, deviation = -8.3, -1.1, 0.04
    exact = stats.norm.sf((math.asin(bound / G) - mean) / deviation)
    found = uncertain(
        *(PENDULUM, [f"{START}~normal({mean},{deviation})"], [0.2, 0.4]),
        **dict[str, Any](limit=[f"energy > {bound}"], limit_method=way, limit_runs=400, verify=False),
        **dict[str, Any](method="sobol", count=16),
    )
    told = found.to_json()["limits"][0]
    assert told["unit"] == "J"
    if way == "form":
        assert told["probability"] == pytest.approx(exact, rel=1e-3)
    else:
        assert told["lower"] <= exact <= told["upper"]


@pytest.mark.slow
def test_energies_of_an_oscillator() -> None:
    """1/2 k A^2 in all, of which sin^2(w t) is that of the motion; the mass differs by lanes."""
    scene = Scene.parse(oscillator(turned=False))
    times, stiffness, drawn = np.array([0.1, 0.2, 0.3]), 40.0, 0.3
    masses = np.linspace(1.9, 2.1, 2001)[:, None]
    moving = 0.5 * stiffness * drawn**2 * np.sin(np.sqrt(stiffness / masses) * times) ** 2
    whole = 0.5 * stiffness * drawn**2
    for text, extreme in (
        ("kinetic > 1.9", moving.max()),
        ("potential > 1.9", whole - moving.min()),
        ("energy > 1.9", whole),
    ):
        found = uncertain(scene, {"bodies.P.mass": (1.9, 2.1)}, times, limit=[text], verify=False)
        assert found.limits[0].margin == pytest.approx(1.9 - extreme, abs=1e-6), text
        assert found.limits[0].kept, text
        assert found.ok, text


@pytest.mark.slow
def test_energies_of_a_torsion_spring_that_is_wound_up() -> None:
    """Turned once and a quarter, 1/2 k (5 pi / 2)^2, and what its motion has of it, whole turns counted."""
    found = uncertain(
        Scene.parse(oscillator(turned=True)),
        {"bodies.P.inertia": (0.9, 1.1)},
        [0.7, 0.9],
        limit=["energy > 100", "potential > 100"],
        verify=False,
    )
    held, stiffness = 2.5 * math.pi, 2.0
    rates = np.sqrt(stiffness / np.linspace(0.9, 1.1, 2001))[:, None]
    assert found.limits[0].margin == pytest.approx(100 - 0.5 * stiffness * held**2, abs=1e-6)
    most = (0.5 * stiffness * (held * np.cos(rates * np.array([0.7, 0.9]))) ** 2).max()
    assert found.limits[1].margin == pytest.approx(100 - most, abs=1e-5)


@pytest.mark.slow
def test_a_parameter_that_is_a_number_in_a_table() -> None:
    """A push of s along the guide and 2 s across, s the height of a table of one step, in [1, 2].

    It draws the spring by s / k, about which the body swings.
    """
    data, times = oscillator(turned=False), np.array([0.1, 0.2, 0.3])
    table = {"table": [[0.0, 1.5], [1.0, 1.5]], "smooth": False}
    own = {"body": "P", "point": [0.0, 0.0]}
    data["loads"]["push"] = {"kind": "force", "at": own, "force": [1.0, 2.0], "scale": table}
    ends = {"loads.push.scale.table.0.1,loads.push.scale.table.1.1": (1.0, 2.0)}
    limits = ["abs(guide.fy) > 5", "kinetic > 2", "P.x > 1"]
    found = uncertain(Scene.parse(data), ends, times, limit=limits, verify=False)
    assert found.ok, found.message
    rate, swing = math.sqrt(20.0), 0.3 - np.array([[1.0], [2.0]]) / 40
    assert found.limits[0].margin == pytest.approx(5 - 4, abs=1e-8)
    assert found.limits[1].margin == pytest.approx(2 - np.max((rate * swing * np.sin(rate * times)) ** 2), abs=1e-6)
    assert found.limits[2].margin == pytest.approx(1 - np.max(0.3 - swing + swing * np.cos(rate * times)), abs=1e-6)


def oscillator(turned: bool) -> dict[str, Any]:
    """A body on a spring along x, drawn by 0.3 m, or on a torsion spring, wound up by 5 pi / 2."""
    ground, own = {"body": "ground", "point": [0.0, 0.0]}, {"body": "P", "point": [0.0, 0.0]}
    sides = {"first": ground, "second": own}
    body = {"kind": "rigid-body", "mass": 2.0, "inertia": 1.0, "centre_of_mass": [0.0, 0.0]}
    spring = {"kind": "spring", "first": {"body": "ground", "point": [-1.0, 0.0]}, "second": own, "stiffness": 40.0}
    if turned:
        start: dict[str, Any] = {"angle": 2.5 * math.pi}
        joint: dict[str, Any] = {"kind": "revolute", **sides}
        load: dict[str, Any] = {"kind": "torsion-spring", **sides, "stiffness": 2.0, "angle": 0.0}
    else:
        start = {"position": [0.3, 0.0]}
        joint = {"kind": "slider", **sides, "rotation": "locked"}
        load = {**spring, "length": 1.0}
    return {
        "name": "oscillator",
        "gravity": [0.0, 0.0],
        "bodies": {"P": body},
        "joints": {"guide": joint},
        "loads": {"spring": load},
        "markers": {"P": own},
        "initial": {"P": start},
        "solver": {"duration": 2.0, "samples": 20},
    }


@pytest.mark.parametrize(
    ("scene", "text", "names"),
    [
        (PENDULUM, "Z.force > 3", r"no joint 'Z'; there are O"),
        (PENDULUM, "A.fx > 3", r"no joint 'A' \(A is a marker, and fx is that of a joint\); there are O"),
        (PENDULUM, "O.x < 3", r"no marker 'O' \(O is a joint, and x is that of a marker\); there are A"),
        (PENDULUM, "A.energy > 2", "energy is that of the whole machine"),
        (PENDULUM, "force > 2", "write JOINT.force, there are O"),
        (PENDULUM, "A.moment > 2", "that of a flexible rod; OA, with marker A, is rigid"),
        ("flexible-double-pendulum", "B.torsion > 2", "normal, shear, moment, strain, strain_above, strain_below of a"),
        ("spherical-pendulum", "O.torque > 3", "that of a driven-angle about its axis; joint O is a distance"),
    ],
)
def test_what_a_machine_does_not_tell_is_refused(scene: str, text: str, names: str) -> None:
    with pytest.raises(InputError, match=names):
        limit(text, load_scene(scene))


def test_a_force_that_is_not_unique_is_refused_before_the_study() -> None:
    """A bar in the air on two sliders along the same line: each may bear any part of what they bear together."""
    data = oscillator(turned=False)
    data["joints"]["second"] = {**data["joints"]["guide"], "first": {"body": "ground", "point": [1.0, 0.0]}}
    runs: list[int] = []
    with pytest.raises(InputError, match=r"limit: second\.fy > 1: the forces of joint second are not unique"):
        uncertain(Scene.parse(data), {"bodies.P.mass": (1.9, 2.1)}, limit=["second.fy > 1"], progress=runs.append)
    assert not runs


def test_the_worst_case_of_a_force_by_the_command(tmp_path: Path) -> None:
    words = ["uncertain", PENDULUM, "--vary", f"{START}=-1.2:-1.0", "--at", "0.3,0.6", "--json"]
    file = tmp_path / "worst.yaml"
    run = CliRunner().invoke(main, [*words, "--limit", "O.force > 12", "--worst", str(file)])
    assert run.exit_code == 0, run.output
    shown = json.loads(run.stdout)["limits"][0]["shown_by"]
    assert shown["status"] == "ok"
    scene = load_scene(str(file))
    assert list(scene.markers) == ["A"]
    assert float(scene.value(START)) == pytest.approx(shown["parameters"][START])
    wrong = CliRunner().invoke(main, [*words, "--limit", "A.force > 12"])
    assert wrong.exit_code == 2
    assert "no joint 'A'" in wrong.output
