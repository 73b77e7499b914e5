"""Machines that friction holds where they start: a ladder, a block on a slope, a bar on a dry pin, in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

pytestmark = pytest.mark.compiles("kernels of contacts, which few machines need")
G = 9.81
GROUND = {"body": "ground", "point": [0.0, 0.0]}


def _scene(bodies: dict[str, Any], initial: dict[str, Any], **more: Any) -> Scene:
    markers = {name: {"body": name, "point": [0.0, 0.0]} for name in bodies}
    return Scene.parse({"name": "s", "bodies": bodies, "initial": initial, "markers": markers} | more)


def _ladder(angle: float, floor: float, wall: float) -> Scene:
    """A ladder of 10 kg and 2 m that leans against a wall on its left, with its foot on the floor."""
    bar = {"kind": "rigid-body", "mass": 10.0, "inertia": 10.0 * 4.0 / 12.0, "centre_of_mass": [1.0, 0.0]}
    contacts = {
        "floor": {"first": {"body": "l", "point": [0.0, 0.0]}, "second": GROUND | {"line": 0.0}, "mu": floor},
        "wall": {"first": {"body": "l", "point": [2.0, 0.0]}, "second": GROUND | {"line": -np.pi / 2}, "mu": wall},
    }
    start = {"position": [2.0 * np.cos(angle), 0.0], "angle": np.pi - angle}
    return _scene({"l": bar}, {"l": start}, contacts=contacts)


def _share(found: Equilibrium) -> float | None:
    return next((one.numbers["share"] for one in found.findings if one.kind.code == "held-by-friction"), None)


def test_a_ladder_on_a_smooth_wall_stands_while_its_tangent_is_above_one_over_twice_mu() -> None:
    mu, weight = 0.4, 10.0 * G
    least = np.arctan(1.0 / (2.0 * mu))
    found = statics(_ladder(least + 0.05, mu, 0.0))
    assert found.ok, found.message
    slope = np.tan(least + 0.05)
    assert _share(found) == pytest.approx(1.0 / (2.0 * mu * slope), rel=1e-9)
    assert found.reactions is not None
    assert found.reactions.unbalanced < 1e-12
    foot, top = (found.reactions.contacts[name] for name in ("floor", "wall"))
    assert foot.normal == pytest.approx(weight, rel=1e-9)
    assert top.normal == pytest.approx(weight / (2.0 * slope), rel=1e-9)
    assert foot.force[0] == pytest.approx(-top.force[0], rel=1e-9)
    fallen = statics(_ladder(least - 1e-3, mu, 0.0))
    assert _share(fallen) is None
    assert not fallen.ok  # it lies on the floor, where nothing holds it


@pytest.mark.parametrize(("floor", "wall"), [(0.4, 0.3), (0.3, 0.3)])
def test_a_ladder_on_a_rough_wall_stands_a_little_flatter(floor: float, wall: float) -> None:
    """tan a >= (1 - mu mu') / (2 mu), with both at their limits there; forces between are one of many."""
    least = np.arctan((1.0 - floor * wall) / (2.0 * floor))
    for angle, stands in ((least + 1e-3, True), (least - 1e-3, False)):
        scene = _ladder(angle, floor, wall)
        assert (_share(statics(scene)) is not None) == stands
        moved = simulate(scene, np.array([0.0, 0.5])).points[:, 0, 0, 0]
        assert (abs(moved[1] - moved[0]) < 1e-12) == stands


def test_a_block_on_a_slope_takes_the_share_of_its_tangent_over_mu_and_has_no_modes() -> None:
    angle, mu = 0.3, 0.5
    block = {"kind": "point-mass", "mass": 2.0}
    contact = {"first": {"body": "b"}, "second": GROUND | {"line": angle}, "mu": mu}
    scene = _scene({"b": block}, {"b": {"position": [0.0, 0.0]}}, contacts={"f": contact})
    found = statics(scene)
    assert found.ok, found.message
    assert _share(found) == pytest.approx(np.tan(angle) / mu, rel=1e-9)
    assert found.contacts == {"contacts.f": pytest.approx(2.0 * G * np.cos(angle), rel=1e-9)}
    assert "0.619 of its limit (contacts.f)" in found.explanation
    assert statics(scene.with_values({"contacts.f.mu": 0.2})).status != found.status
    resting = simulate(scene.model_copy(update={"initial_from": "statics"}), np.array([0.0, 100.0]))
    assert resting.ok
    np.testing.assert_allclose(resting.points[:, 0, :, 0], 0.0, atol=1e-12)


def test_a_bar_on_a_dry_pin_stays_where_its_weight_passes_the_circle_of_friction() -> None:
    bar = {"kind": "rigid-body", "mass": 2.0, "inertia": 0.2, "centre_of_mass": [0.5, 0.0]}
    pin = {"first": GROUND, "second": {"body": "A", "point": [0.0, 0.0]}, "mu": 0.3, "radius": 0.05, "stick": "exact"}
    scene = _scene({"A": bar}, {"A": {"angle": -np.pi / 2 + 0.02}}, joints={"O": pin})
    found = statics(scene)
    assert found.ok, found.message
    assert _share(found) == pytest.approx(0.5 * np.sin(0.02) / (0.3 * 0.05), rel=1e-9)
    assert found.reactions is not None
    assert found.reactions.joints["O"].torque == pytest.approx(2.0 * G * 0.5 * np.sin(0.02), rel=1e-9)
    hangs = statics(scene.with_values({"initial.A.angle": 0.3}))
    assert _share(hangs) is None
    assert hangs.angle("A") == pytest.approx(-np.pi / 2, abs=1e-9)
    (mode,) = modes(scene).modes  # those without friction, which the message says
    assert mode.angular_frequency == pytest.approx(np.sqrt(2.0 * G * 0.5 / 0.7), rel=1e-9)
