"""Machines side by side that differ in where their joints are: each starts as it would alone."""

from typing import Any

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics.start.closure import Closure
from shoal.mechanics.start.poses import ATTEMPTS, CLOSED, Assembly
from shoal.mechanics.start.start import started
from shoal.scene import Scene, load_scene


@pytest.mark.parametrize(("path", "stated"), [("joints.A1.first.point.0", 1.0), ("joints.A0.first.point.1", 0.0)])
def test_rates_that_depend_on_each_other(path: str, stated: float) -> None:
    """Three stated rates of two closed loops."""
    scene = load_scene("n-four-bar-2")
    values = stated + np.array([0.0, 0.01, 0.02])
    found = started(scene.with_lanes({path: values}))
    assert not np.any(found.failed)
    for lane, value in enumerate(values):
        alone = started(scene.with_lanes({path: np.array([value])})).scene
        for body in scene.bodies:
            for quantity in ("angle", "rate"):
                one, other = (getattr(s.initial[body], quantity) for s in (found.scene, alone))
                assert one[lane] == pytest.approx(other[0], abs=1e-12)


def four_bar(lengths: list[float], base: float, **angles: float) -> Scene:
    """Three rods between two points of the ground; the angles are guesses, but for that of a."""
    rod = {"kind": "rod", "height": 0.02, "width": 0.04, "density": 5540.0, "element": "rigid"}
    ends = [("ground", [0, 0], "a", "start"), ("a", "end", "b", "start"), ("b", "end", "c", "end")]
    ends.append(("c", "start", "ground", [base, 0]))
    initial: dict[str, Any] = {name: {"angle": angle, "guess": ["angle"]} for name, angle in angles.items()}
    return Scene.parse(
        {
            "name": "four-bar",
            "bodies": {name: {**rod, "length": length} for name, length in zip("abc", lengths, strict=True)},
            "joints": {
                f"J{k}": {"kind": "revolute", "first": {"body": a, "point": x}, "second": {"body": b, "point": y}}
                for k, (a, x, b, y) in enumerate(ends)
            },
            "initial": {**initial, "a": {"angle": 0.7}},
            "markers": {"B": {"body": "b", "point": "end"}},
            "solver": {"duration": 1.0},
        },
        "four-bar",
    )


@pytest.mark.slow
def test_guesses_side_by_side_find_what_one_after_the_other_finds() -> None:
    random, later, none = np.random.default_rng(8), 0, 0
    for _ in range(60):
        lengths, base, guess = random.uniform(0.3, 2.0, 3).tolist(), random.uniform(0.5, 3.0), random.uniform(-3, 3, 2)
        assembly = Assembly(four_bar(lengths, float(base), b=float(guess[0]), c=float(guess[1])), 1)
        firm = [one for one in assembly.statements if one.firm]
        fixed, first = assembly.held(firm)
        found = assembly.seek(firm)
        closure = Closure(assembly.scene, first)
        for attempt in range(ATTEMPTS):
            begin = assembly.held(firm, assembly._guess(attempt, fixed))[1]
            poses, gap = assembly.close(closure, begin, fixed)
            if gap[0] <= CLOSED:
                assert found.ok[0]
                assert np.allclose(found.poses, poses, rtol=0.0, atol=1e-12)
                later += attempt > 0
                break
        else:
            assert not found.ok[0]
            none += 1
    assert later >= 1
    assert none >= 3


def test_what_cannot_be_assembled_is_soon_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Counted by what takes the time; guess after guess it was thousands."""
    looked, rows = [], Closure.rows
    monkeypatch.setattr(Closure, "rows", lambda self, u: looked.append(len(u)) or rows(self, u))
    with pytest.raises(InputError, match=r"cannot be assembled; its places stay 18\.7 m apart at best"):
        started(four_bar([1.0, 2.0, 1.5], 20.0))
    assert len(looked) < 500
