"""Rods that joints close upon themselves: the frequencies and the stiffness of a circular ring in closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene

LENGTH, HEIGHT, WIDTH, YOUNG, DENSITY = 2.0, 0.004, 0.02, 1e9, 1000.0
RADIUS, BENDING, LINE = LENGTH / (2 * np.pi), YOUNG * WIDTH * HEIGHT**3 / 12, DENSITY * WIDTH * HEIGHT


def ring(element: str = "ancf-cable", elements: int = 24, **fields: Any) -> Scene:
    """A free ring of a rod whose ends are welded; it begins at the origin and goes round to the left."""
    rod = {"kind": "rod", "length": LENGTH, "height": HEIGHT, "width": WIDTH, "density": DENSITY,
           "youngs_modulus": YOUNG, "element": element, "elements": elements,
           "curvature": [2 * np.pi / LENGTH]}  # fmt: skip
    return Scene.parse(
        {
            "name": "ring",
            "gravity": [0.0, 0.0],
            "bodies": {"ring": rod},
            "joints": {"seam": {"kind": "weld", "first": {"body": "ring"},
                                "second": {"body": "ring", "point": [LENGTH, 0.0]}}},
            "markers": {"seam": {"body": "ring"}, "top": {"body": "ring", "point": [LENGTH / 2, 0.0]}},
            "initial": {"ring": {"position": [0.0, 0.0]}},
        }
        | fields
    )  # fmt: skip


@pytest.mark.parametrize(("element", "elements"), [("ancf-cable", 96), ("ancf-quintic", 12)])
def test_a_ring_rings_as_hoppe_says(element: str, elements: int) -> None:
    """w^2 = EI/(rho A R^4) k^2 (k^2 - 1)^2/(k^2 + 1), each twice, of a ring that does not stretch.

    Cubic elements resist bending of a thin arc at first and need more of them.
    """
    found = [mode.frequency for mode in modes(ring(element, elements), count=9).modes]
    told = [
        np.sqrt(BENDING / (LINE * RADIUS**4) * k**2 * (k * k - 1) ** 2 / (k * k + 1)) / (2 * np.pi) for k in (2, 3, 4)
    ]
    elastic = [frequency for frequency in found if frequency > 1e-2 * told[0]][:6]
    assert elastic == pytest.approx(np.repeat(told, 2), rel=2e-3)


def test_a_ring_that_is_pulled_apart_gives_way_as_its_bending_lets_it() -> None:
    """Opposite forces F along a diameter lengthen it by F R^3/EI (pi/4 - 2/pi) (Timoshenko)."""
    force = 1e-4
    pull = {"kind": "force", "at": {"body": "ring", "point": [LENGTH / 2, 0.0]}, "force": [0.0, force]}
    foot = {"kind": "weld", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "ring"}}
    scene = ring("ancf-quintic", 12, loads={"pull": pull})
    found = statics(scene.with_values({"joints": {**scene.model_dump(mode="json")["joints"], "foot": foot}}))
    assert found.balanced, found.message
    told = force * RADIUS**3 / BENDING * (np.pi / 4 - 2 / np.pi)
    assert found.marker("top")[1] - 2 * RADIUS == pytest.approx(told, rel=5e-3)


def test_a_ring_stays_closed_and_moves_by_the_push_it_gets() -> None:
    """Its centre of mass is the mean of twelve places along it, and goes F t1/m (t - t1/2) after a push F until t1."""
    force, end, count = np.array([0.03, 0.05]), 0.05, 12
    push = {"kind": "force", "at": {"body": "ring", "point": [LENGTH / 2, 0.0]}, "force": [*force],
            "scale": f"1 - step(t - {end})"}  # fmt: skip
    places = {f"p{k}": {"body": "ring", "point": [LENGTH * k / count, 0.0]} for k in range(count)}
    run = verified(get_engine("gauss"), ring(loads={"push": push}, markers=places, solver={"duration": 0.2}))
    assert run.ok, run.message
    assert float(np.max(run.constraint_drift)) < 1e-9
    centre = np.mean([run.marker(name) for name in places], axis=0)[-1] - [0.0, RADIUS]
    assert centre == pytest.approx(force * end / (LINE * LENGTH) * (0.2 - end / 2), rel=2e-2)


def test_a_ring_that_spins_turns_about_its_centre() -> None:
    """It is wider by rho (rate R)^2 / E of its radius and turns so much more slowly, about which it then swings."""
    rate, stop = 20.0, 0.1
    start = {"ring": {"position": [0.0, 0.0], "velocity": [rate * RADIUS, 0.0], "rate": rate}}
    solver = {"duration": stop, "step": 2e-5}
    run = verified(get_engine("gauss"), ring("ancf-quintic", 12, initial=start, solver=solver))
    assert run.ok, run.message
    seam, top = run.marker("seam"), run.marker("top")
    assert (seam + top) / 2 == pytest.approx(np.tile([0.0, RADIUS], (len(seam), 1)), abs=1e-6)
    wider = DENSITY * (rate * RADIUS) ** 2 / YOUNG
    turned = np.array([np.sin(rate * stop), -np.cos(rate * stop)])
    assert (seam[-1] - [0.0, RADIUS]) / RADIUS == pytest.approx(turned, abs=5 * wider * rate * stop)


def test_a_rigid_body_is_not_joined_to_itself() -> None:
    with pytest.raises(InputError, match="joins 'ring' to itself; a joint needs two bodies, or two places of a flex"):
        ring(bodies={"ring": {"kind": "rigid-body", "mass": 1.0, "inertia": 1.0, "named_points": {"a": [1, 0]}}},
             joints={"seam": {"first": {"body": "ring"}, "second": {"body": "ring", "point": "a"}}},
             markers={"top": {"body": "ring"}})  # fmt: skip


def test_an_arc_that_does_not_close_is_refused() -> None:
    with pytest.raises(InputError, match=r"^joints\.seam: cannot be assembled; its places stay .* apart at best$"):
        get_engine("gauss").simulate(ring().with_values({"bodies.ring.curvature": [2.0]}))


def test_a_closed_rod_is_for_the_plane() -> None:
    with pytest.raises(InputError, match="closes 'ring' upon itself; that is for the plane"):
        ring(dimensions=3)


@pytest.mark.parametrize("at", [0.25, 0.5, 1.0])
def test_a_curved_rod_may_hang_from_any_place_of_it(at: float) -> None:
    """It starts where its arc has that place, however far along the rod that is."""
    pin = {"first": {"body": "ground", "point": [0.3, 0.2]}, "second": {"body": "ring", "point": [at * LENGTH, 0.0]}}
    scene = ring(joints={"pin": pin}, initial={"ring": {"angle": 0.4}})
    run = get_engine("gauss").simulate(scene.with_values({"solver.duration": 1e-3}), [0.0])
    turn = 2 * np.pi * at
    origin = 0.3 + 0.2j - np.exp(0.4j) * RADIUS * (np.sin(turn) + 1j * (1 - np.cos(turn)))
    assert run.marker("seam")[0] == pytest.approx([origin.real, origin.imag], abs=1e-12)
