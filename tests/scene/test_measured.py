"""A measured signal drives a machine: the file that a scene names becomes its table."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.interpolate import CubicSpline
from shoal import library
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.scene import Scene, load_scene
from shoal.scene.smoothing import smooth, strength_of

CRANK: dict[str, Any] = {
    "name": "driven",
    "gravity": [0.0, 0.0],
    "bodies": {"crank": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "named_points": {"tip": [0.5, 0.0]}}},
    "joints": {
        "pivot": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "crank"}},
        "motor": {"kind": "driven-angle", "first": {"body": "ground", "point": [0.0, 0.0]},
                  "second": {"body": "crank"}, "angle": {"path": "encoder.csv", "column": "angle"}},
    },
    "markers": {"tip": {"body": "crank", "point": "tip"}},
    "solver": {"duration": 1.0, "samples": 10},
}  # fmt: skip


def written(folder: Path, signal: dict[str, Any], text: str | None = None) -> str:
    """The file of a scene whose motor follows a signal, 0.3 sin(2 t) over an encoder's clock where no text is given."""
    times = np.linspace(-0.2, 1.4, 161)
    rows = "\n".join(f"{1e3 * (t + 5.0):.6f},{np.degrees(0.3 * np.sin(2 * t)):.12f}" for t in times)
    (folder / "encoder.csv").write_text(f"# an encoder\nms,angle\n{rows}\n" if text is None else text)
    motor = {**CRANK["joints"]["motor"], "angle": {"path": "encoder.csv", **signal}}
    file = folder / "driven.yaml"
    file.write_text(yaml.safe_dump({**CRANK, "joints": {**CRANK["joints"], "motor": motor}}))
    return str(file)


STATED = {"time": "ms", "time_scale": 1e-3, "start": 5.0, "column": "angle", "scale": np.pi / 180}


def test_a_crank_follows_its_encoder(tmp_path: Path) -> None:
    scene = load_scene(written(tmp_path, STATED))
    run = get_engine("gauss").simulate(scene)
    angle = 0.3 * np.sin(2 * run.times)
    # A spline through samples 0.01 s apart is off by 5/384 h^4 max f(4) = 6e-10 rad, near its ends by more.
    assert run.marker("tip") == pytest.approx(0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1), abs=1e-8)


def test_a_line_of_units_tells_the_scales(tmp_path: Path) -> None:
    text = "t,angle\n[ms],[deg]\n0,0\n500,90\n1000,180\n"
    scene = load_scene(written(tmp_path, {"column": "angle"}, text))
    table = scene.joints["motor"].angle.table
    assert np.array(table) == pytest.approx(np.array([[0.0, 0.0], [0.5, np.pi / 2], [1.0, np.pi]]), rel=1e-12)
    stated = load_scene(written(tmp_path, {"column": "angle", "scale": 2.0, "time_scale": 1.0}, text))
    assert stated.joints["motor"].angle.table[1] == (500.0, 180.0)
    with pytest.raises(InputError, match="column 'angle': unit 'furlong' is not known here; state `scale`"):
        load_scene(written(tmp_path, {"column": "angle"}, text.replace("[deg]", "[furlong]")))


def test_what_is_kept_of_the_scene_has_the_numbers(tmp_path: Path) -> None:
    scene = load_scene(written(tmp_path, STATED))
    (tmp_path / "encoder.csv").unlink()
    again = Scene.parse(scene.model_dump(mode="json"))
    assert again.fingerprint == scene.fingerprint
    assert len(again.joints["motor"].angle.table) == 161


def test_a_library_keeps_the_signal_with_its_scene(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_LIBRARY", str(tmp_path / "library"))
    file = written(tmp_path, STATED)
    entry = library.add(file)
    fingerprint = load_scene(file).fingerprint
    (tmp_path / "encoder.csv").unlink()
    assert sorted(entry.files()) == ["driven.yaml", "encoder.csv"]
    assert load_scene("driven").fingerprint == fingerprint


@pytest.mark.parametrize("path", ["../encoder.csv", "/etc/hostname", "none.csv"])
def test_a_signal_does_not_lead_out_of_a_library(path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_LIBRARY", str(tmp_path / "library"))
    stated = Path(written(tmp_path, STATED)).read_text().replace("encoder.csv", path)
    with pytest.raises(InputError, match=r"leads out of the entry|is not among the files"):
        library.put("scenes", "driven", {"driven.yaml": stated.encode()})


@pytest.mark.parametrize(
    ("signal", "text", "told"),
    [
        ({"column": "angel", "time": "ms"}, None, "joints.motor.angle: .*no column 'angel'; there are ms, angle"),
        ({"column": "angle"}, None, "joints.motor.angle: .*no column 't'"),
        (
            {"column": "angle", "colour": 1},
            None,
            "joints.motor.angle: colour: no such field, found 1; did you mean column",
        ),
        ({"column": "angle"}, "t,angle\n0,0\n1,x\n", "row 3, column 'angle': 'x' is not a number"),
        ({"column": "angle"}, "t,angle\n0,0\n0,1\n", "joints.motor.angle.table: times must increase"),
        ({"column": "angle"}, "t,angle\ns,mm\n0,0\n1,1\n", "row 2, column 'angle': 'mm' is no unit of an angle; state"),
        ({"column": "angle"}, "t,angle\nmm,rad\n0,0\n1,1\n", "row 2, column 't': 'mm' is no unit of a time; state"),
        ({"column": "angle"}, "t,angle\n1700000000,0\n1700000002,1\n", "begins at 0 s of a table that covers 17000"),
        ({"column": "angle", "start": 3.0}, "t,angle\n0,0\n2,1\n", "begins at 3 s of a table that covers 0 s to 2 s"),
        ({"column": "angle", "path": "gone.csv"}, None, "joints.motor.angle: data: .*gone.csv cannot be read"),
    ],
)
def test_a_wrong_signal_is_one_line(signal: dict[str, Any], text: str | None, told: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=told) as error:
        load_scene(written(tmp_path, signal, text))
    assert "\n" not in str(error.value)


def test_a_scene_that_is_no_file_states_its_tables() -> None:
    with pytest.raises(
        InputError, match=r"'encoder.csv' is read from beside the YAML file of a scene; here state its table"
    ):
        Scene.parse(CRANK)


def test_smoothing_leaves_what_is_smooth_and_finds_the_noise_of_what_is_not() -> None:
    """Quartics pass unchanged, signals without noise too; the acceleration of one with noise is then its own."""
    times = np.sort(np.random.default_rng(0).uniform(0.0, 3.2, 300)) + 1e-3 * np.arange(300)
    quartic = np.polyval([1.0, -4.0, 5.0, -2.0, 0.3], times)
    assert smooth(times, quartic, 1e6) == pytest.approx(quartic, abs=1e-6)
    times = np.linspace(0.0, 3.2, 320)
    angle = 0.6 * np.sin(4.0 * times + 1.0)
    for clean in (angle, np.sign(angle), 1.0 * (times > 1.0), np.abs(angle), 0.0 * times):
        assert strength_of(times, clean) == (0.0, 0.0)
    measured = angle + 1e-3 * np.random.default_rng(0).standard_normal(len(times))
    strength, noise = strength_of(times, measured)
    assert noise == pytest.approx(1e-3, rel=0.1)
    accelerations = (
        CubicSpline(times, smooth(times, measured, strength))(times, 2),
        CubicSpline(times, measured)(times, 2),
    )
    freed, raw = (np.sqrt(np.mean((found + 16.0 * angle)[20:-20] ** 2)) for found in accelerations)
    assert freed < 0.4 < 20.0 < raw


@pytest.mark.parametrize(
    ("stated", "noise", "left"), [({}, None, None), ({"noise": 0.0}, 0.0, None), ({"noise": 0.002}, 0.002, 3e-4)]
)
def test_a_signal_is_freed_of_noise_that_it_states_and_of_no_other(
    tmp_path: Path, stated: dict[str, float], noise: float | None, left: float | None
) -> None:
    times = np.linspace(0.0, 1.2, 240)
    drawn = 1e-3 * np.random.default_rng(1).standard_normal(len(times))
    rows = "\n".join(
        f"{t!r},{x!r}" for t, x in zip(times.tolist(), (0.3 * np.sin(2 * times) + drawn).tolist(), strict=True)
    )
    scene = load_scene(written(tmp_path, {"column": "angle", **stated}, f"t,angle\n{rows}\n"))
    angle = scene.joints["motor"].angle
    off = np.array(angle.table)[:, 1] - 0.3 * np.sin(2 * times)
    assert angle.noise == noise
    assert np.allclose(off, drawn, atol=1e-15) if left is None else np.std(off) < left
    assert Scene.parse(scene.model_dump(mode="json")).joints["motor"].angle == angle
