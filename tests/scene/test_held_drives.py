"""Motions read as drives: where a table does not cover the motion, its hold and the jump of its rate are told."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import shoal
from shoal.pictures.start import remarks
from shoal.scene import Scene, load_scene
from shoal.scene.held_drives import held_drives

BODY = {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "named_points": {"end": [1.0, 0.0]}}
FREE = {
    "name": "free",
    "bodies": {"A": BODY},
    "joints": {"O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "A"}}},
    "markers": {"T": {"body": "A", "point": "end"}},
}


def driven(angle: object, duration: float) -> Scene:
    motor = {"kind": "driven-angle", "first": {"body": "ground", "point": [0, 0]}, "second": {"body": "A"}}
    joints = {**FREE["joints"], "motor": {**motor, "angle": angle}}  # type: ignore[dict-item]
    return Scene.parse({**FREE, "joints": joints, "solver": {"duration": duration}})


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
def test_a_motion_that_is_written_from_its_start_on_drives_without_a_jump(suffix: str, tmp_path: Path) -> None:
    scene = Scene.parse({**FREE, "gravity": [0, 0], "initial": {"A": {"angle": 0.4, "rate": 2.0}}})
    motion = shoal.simulate(scene, at=np.linspace(0.0, 1.0, 51))
    path = tmp_path / f"run.{suffix}"
    frame = motion.to_pandas().reset_index()
    frame.to_csv(path, index=False) if suffix == "csv" else frame.to_parquet(path)
    assert frame["t"][0] == 0.0
    assert motion.to_json()["markers"]["T"]["angle"][0] == pytest.approx(0.4)
    (tmp_path / "driven.yaml").write_text(
        "name: driven\nbodies: {A: {kind: rigid-body, mass: 1.0, inertia: 0.1, named_points: {end: [1.0, 0.0]}}}\n"
        "joints:\n  O: {first: {body: ground, point: [0, 0]}, second: {body: A}}\n"
        "  motor: {kind: driven-angle, first: {body: ground, point: [0, 0]}, second: {body: A},\n"
        f"    angle: {{path: run.{suffix}, column: T.angle}}}}\n"
        "markers: {T: {body: A, point: end}}\ninitial: {A: {angle: 0.4}}\n"
    )
    scene = load_scene(str(tmp_path / "driven.yaml"))
    assert held_drives(scene) == []
    again = shoal.simulate(scene, at=np.linspace(0.0, 1.0, 51))
    assert again.angle("T") == pytest.approx(motion.angle("T"), abs=1e-9)


def test_where_a_table_does_not_cover_the_motion_its_hold_and_its_jump_are_told() -> None:
    """Tables drawn at random: the sizes of jumps follow from polynomials."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        cubic = np.polynomial.Polynomial(rng.normal(size=4))
        begin, length = float(rng.choice([0.0, 0.1])), float(rng.uniform(0.5, 1.0))
        times = np.linspace(begin, begin + length, int(rng.integers(6, 30)))
        duration = float(rng.choice([0.9, 1.2])) * times[-1]
        scene = driven({"table": np.column_stack([times, cubic(times)]).tolist()}, duration)
        told = held_drives(scene)
        wanted = []
        if begin > 0.0:
            holds = f"begins at {begin:.6g} s: until then it holds {cubic(begin):.6g} rad"
            wanted.append((f"{holds}, then its rate jumps from 0 to", begin))
        if duration > times[-1]:
            ends = f"ends at {times[-1]:.6g} s, before the motion at {duration:.6g} s"
            wanted.append((f"{ends}: there its rate jumps from", float(times[-1])))
        assert len(told) == len(wanted)
        for line, (words, when) in zip(told, wanted, strict=True):
            assert line.startswith("joints.motor.angle: its table ")
            assert words in line
            after = line.split(words)[1].split()[0]
            assert float(after) == pytest.approx(cubic.deriv()(when), rel=1e-3)


def test_runs_and_pages_tell_it() -> None:
    scene = driven({"table": [[0.2, 0.0], [0.4, 0.1], [0.6, 0.3], [0.8, 0.6]]}, 0.8)
    motion = shoal.simulate(scene, at=[0.3])
    (line,) = motion.model["held_drives"]
    assert line in remarks(motion.model)
    assert "until then it holds 0 rad" in line


def test_a_drive_that_rests_at_its_ends_has_no_jump() -> None:
    table = [[0.2, 1.0], [0.4, 1.0], [0.6, 1.0]]
    assert held_drives(driven({"table": table}, 1.0)) == []
    assert held_drives(driven({"table": table, "smooth": False}, 1.0)) == []
