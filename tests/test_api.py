"""`import shoal`: light, the same answers as the command line, results that convert and show themselves."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import shoal
from shoal.errors import InputError
from shoal.identification import Estimate

TIMES = [0.1, 0.2, 0.5]


@pytest.fixture(scope="module")
def motion() -> shoal.Trajectory:
    return shoal.simulate("single-pendulum", TIMES)


@pytest.fixture(scope="module")
def problem() -> shoal.Problem:
    """The angle of a pendulum, from a table that the user holds."""
    return shoal.Problem.parse(
        {
            "name": "mine",
            "scene": "single-pendulum",
            "parameters": {"angle": {"path": "initial.OA.angle", "lower": -1.0, "upper": 1.0}},
            "channels": [
                {"marker": "A", "quantity": "x", "column": "x", "unit": "cm"},
                {"marker": "A", "quantity": "y", "column": "y", "unit": "cm"},
            ],
            "source": {"kind": "file"},
        },
        "mine",
    )


@pytest.fixture(scope="module")
def estimate(problem: shoal.Problem) -> Estimate:
    run = shoal.simulate("single-pendulum", np.linspace(0, 1, 21), set={"initial.OA.angle": 0.3}, verify=False)
    x, y = run.marker("A").T
    return shoal.identify(problem, pd.DataFrame({"t": run.times, "x": 100 * x, "y": 100 * y}))


def test_import_loads_nothing_until_a_name_is_used() -> None:
    program = "import sys, shoal; print([m for m in ('numpy', 'numba', 'pydantic', 'matplotlib') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert (done.stdout.strip(), done.stderr) == ("[]", "")


def test_every_name_is_there() -> None:
    assert {name for name in shoal.__all__ if getattr(shoal, name, None) is None} == set()
    with pytest.raises(AttributeError, match="magic"):
        shoal.magic  # type: ignore[attr-defined]  # noqa: B018


def test_simulate_verifies_sets_values_and_takes_scenes(motion: shoal.Trajectory) -> None:
    assert motion.model["verification"]["time_error"] < 1e-6
    scene = shoal.load_scene("single-pendulum").with_values({"initial.OA.angle": 0.3})
    by_scene = shoal.simulate(scene, TIMES)
    by_values = shoal.simulate("single-pendulum", TIMES, set={"initial.OA.angle": 0.3})
    np.testing.assert_array_equal(by_scene.points, by_values.points)
    with pytest.raises(InputError, match="gauss only"):
        shoal.simulate(scene, engine="exudyn", tolerance=1e-3)


def test_motion_converts_without_loss(motion: shoal.Trajectory) -> None:
    table, cube = motion.to_pandas(), motion.to_xarray()
    assert table.index.tolist() == TIMES
    np.testing.assert_array_equal(table[["A.x", "A.y"]].to_numpy(), motion.marker("A"))
    np.testing.assert_array_equal(cube["angle"].sel(marker="A").isel(lane=0), motion.angle("A"))
    assert cube["status"].item() == "ok"
    assert [cube[name].attrs["units"] for name in ("time", "x", "y", "angle")] == ["s", "m", "m", "rad"]


def test_estimate_converts_with_its_units(estimate: Estimate) -> None:
    cube = estimate.to_xarray()
    assert cube["value"].sel(parameter="angle").item() == estimate.parameters["angle"].value
    assert (cube["unit"].item(), cube["value"].attrs["units"], cube["covariance"].attrs["units"]) == (
        "rad",
        "rad",
        "rad²",
    )
    assert cube["covariance"].item() == pytest.approx(cube["std"].item() ** 2, rel=1e-6)
    recording = estimate.measurement.first
    np.testing.assert_array_equal(cube["measured_x"].sel(marker="A"), recording.values[:, 0])
    np.testing.assert_allclose(cube["residual_y"], cube["predicted_y"] - cube["measured_y"], atol=1e-15)
    assert (cube["residual_y"].attrs["units"], cube["time"].attrs["units"]) == ("m", "s")
    with pytest.raises(InputError, match="there is no 'high'; there are recording"):
        estimate.to_xarray("high")


def test_a_table_is_a_recording(estimate: Estimate) -> None:
    assert estimate.verdict.trusted, estimate.message
    assert estimate.to_pandas().loc["angle", "value"] == pytest.approx(0.3, abs=1e-6)
    assert estimate.data.startswith("table.csv, 0 s to 1 s")


def test_reprs_are_short_and_say_what_counts(motion: shoal.Trajectory, estimate: Estimate) -> None:
    scene = shoal.load_scene("single-pendulum")
    assert repr(scene) == "Scene(single-pendulum: 1 body OA; 1 joint O; 1 marker A)"
    flexible, large = shoal.load_scene("flexible-double-pendulum"), shoal.load_scene("n-four-bar-40")
    assert "2 bodies OA, AB of 6 elements; 2 joints O, A; 2 markers A, B" in repr(flexible)
    assert repr(large) == "Scene(n-four-bar-40: 81 bodies; 121 joints; 1 marker B0)"
    assert repr(motion) == "Trajectory(A; 3 samples, gauss, ok)"
    assert repr(estimate).startswith("Estimate(mine: identified; angle 0.3 ±")


def test_notebooks_show_a_table_and_a_picture(motion: shoal.Trajectory, estimate: Estimate) -> None:
    scene = shoal.load_scene("single-pendulum")
    for shown, word in ((scene, "Bodies at the start"), (motion, "status ok"), (estimate, "Verdict: identified")):
        html = shown._repr_html_()  # type: ignore[union-attr]
        assert word in html
        assert "<table>" in html
        assert html.count("data:image/") == (0 if shown is scene else 1)


def test_each_kind_of_result_has_a_picture(motion: shoal.Trajectory, estimate: Estimate, tmp_path: Path) -> None:
    scene = shoal.load_scene("single-pendulum")
    swept = shoal.sweep(scene, {"initial.OA.angle": [0.0, 0.5, 1.0]}, 0.5)
    compared = shoal.compare(scene, ["gauss", "casadi"], TIMES)
    for k, result in enumerate((scene, motion, estimate, swept, compared)):
        shoal.plot(result).save(tmp_path / f"{k}.png")
        assert (tmp_path / f"{k}.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(InputError, match="no picture of a int"):
        shoal.plot(3)


FIELDS = {
    "name": "mine",
    "bodies": {"rod": {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 2700.0}},
    "joints": {"O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "rod", "point": "start"}}},
    "markers": {"tip": {"body": "rod", "point": "end"}},
}


def test_a_scene_is_an_object_its_fields_or_a_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(json.dumps(FIELDS))
    found = [
        shoal.simulate(one, TIMES, verify=False).points  # type: ignore[arg-type]
        for one in (shoal.Scene.parse(FIELDS), FIELDS, file, str(file))
    ]
    for other in found[1:]:
        np.testing.assert_array_equal(other, found[0])
    assert shoal.load_scene(file).name == "mine"


def test_a_problem_is_an_object_its_fields_or_a_file(problem: shoal.Problem, tmp_path: Path) -> None:
    fields = problem.model_dump(mode="json", exclude_unset=True)
    file = tmp_path / "mine.yaml"
    file.write_text(json.dumps(fields))
    plans = [shoal.design(one, noise=1e-3, duration=1.0, rate=20.0, about="start") for one in (problem, fields, file)]  # type: ignore[arg-type]
    assert [plan.to_json() for plan in plans[1:]] == [plans[0].to_json()] * 2


def test_values_may_be_of_numpy() -> None:
    by_list = shoal.simulate("single-pendulum", TIMES, set={"gravity": [0.0, -9.0]}, verify=False)
    by_array = shoal.simulate("single-pendulum", TIMES, set={"gravity": np.array([0.0, -9.0])}, verify=False)
    np.testing.assert_array_equal(by_array.points, by_list.points)


def test_who_edits_a_scene_edits_no_other() -> None:
    """Neither one that is loaded by the same name later, nor what was kept of an equal one."""
    mine, before = shoal.load_scene("single-pendulum"), shoal.simulate("single-pendulum", TIMES, verify=False)
    shoal.simulate(mine, TIMES, verify=False)
    prepared = shoal.prepare(mine)
    mine.initial["OA"] = mine.initial["OA"].model_copy(update={"angle": 0.7})
    mine.markers["Q"] = mine.markers["A"]
    assert list(shoal.load_scene("single-pendulum").markers) == ["A"]
    for again in (shoal.simulate("single-pendulum", TIMES, verify=False), prepared(times=TIMES)):
        np.testing.assert_array_equal(again.points, before.points)
    other = [*TIMES, 7.0]
    longer = shoal.simulate("single-pendulum", other, verify=False).points[:3]
    np.testing.assert_allclose(longer, before.points, rtol=0, atol=1e-8)


def test_the_times_of_a_motion_are_its_own() -> None:
    times = np.array(TIMES)
    found = shoal.prepare("single-pendulum")(times=times), shoal.simulate("single-pendulum", times, verify=False)
    times[:] = 7.0
    assert [motion.times.tolist() for motion in found] == [TIMES, TIMES]


def test_results_compare_as_the_objects_that_they_are(motion: shoal.Trajectory, estimate: Estimate) -> None:
    """Their arrays have no truth value; == and hash raised ValueError and TypeError."""
    scene = shoal.load_scene("single-pendulum")
    swept = shoal.sweep(scene, {"initial.OA.angle": [0.0, 0.5]}, 0.5)
    results = [motion, estimate, shoal.modes(scene), shoal.statics(scene), swept, shoal.select(scene, 1e-3)]
    for one in results:
        assert one == one
        assert one != copy.copy(one)
    assert len({*results}) == len(results)


def test_a_marker_that_is_not_there_is_named(motion: shoal.Trajectory) -> None:
    with pytest.raises(InputError, match="marker: no marker 'Z'; there are A"):
        motion.marker("Z")
    with pytest.raises(InputError, match="marker: no marker 'Z'; there are A"):
        motion.angle("Z")


def test_sweeps_and_modes_are_tables_too() -> None:
    swept = shoal.sweep("single-pendulum", {"initial.OA.angle": [0.0, 0.5]}, 0.5)
    table = swept.to_pandas()
    np.testing.assert_array_equal(table[["A.x", "A.y"]].to_numpy(), swept.positions["A"])
    found = shoal.modes("single-pendulum")
    modes = found.to_pandas()
    assert (modes.index.tolist(), modes["kind"].tolist()) == ([1], ["oscillating"])
    np.testing.assert_array_equal(modes["frequency"], found.frequencies)


def test_the_library_is_there_and_the_package_says_its_types() -> None:
    assert callable(shoal.library.entries)
    assert Path(shoal.__file__).with_name("py.typed").exists()
