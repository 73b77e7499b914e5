"""Exchanged markers are found without false alarm; a recording's YAML; the examples of the manual."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml
from shoal.errors import InputError
from shoal.identification import Measurement, Problem, Verdict, identify, load_problem, measure
from shoal.identification.problem import Parameter, Prior
from shoal.identification.recording.reading import read
from shoal.identification.recording.source import Channel, EngineSource, FileSource
from shoal.identification.recording.swaps import mend as mend_tracks
from shoal.scene.record import Record

GUIDE = Path(__file__).parents[3] / "docs" / "recordings.md"
REFERENCE = GUIDE.parent / "reference" / "recordings.md"
RECORDINGS = Path(__file__).parents[4] / "shared" / "data" / "ibm_double_pendulum"
VIDEO = FileSource(columns=["Oy", "Ox", "Ay", "Ax", "By", "Bx"], rate=400.0, y_axis="down", swaps=False)
MARKERS = tuple(Channel(marker=m, quantity=q, column=m + q, unit="px") for m in "OAB" for q in ("x", "y"))  # type: ignore[arg-type]


def mend(times: np.ndarray, channels: tuple[Channel, ...], values: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """Values with markers put right, and notes."""
    names = [channel.marker for channel in channels[::2]]
    found, notes = mend_tracks(times, {m: values[:, 2 * k : 2 * k + 2] for k, m in enumerate(names)})
    return np.hstack([found[m] for m in names]), notes


def swapped(values: np.ndarray, first: int, last: int, pair: tuple[int, int]) -> np.ndarray:
    """Values with the markers of a pair exchanged from one sample to another."""
    there, back = (slice(2 * k, 2 * k + 2) for k in pair)
    found = values.copy()
    found[first:last, there], found[first:last, back] = values[first:last, back], values[first:last, there]
    return found


def whirl(times: np.ndarray) -> np.ndarray:
    """Two markers of a made-up motion with noise; they pass close by each other."""
    noise = 1e-3 * np.random.default_rng(0).standard_normal((len(times), 4))
    a = np.column_stack([np.cos(3 * times), np.sin(3 * times)])
    return np.column_stack([a, a + 0.1 * np.column_stack([np.cos(11 * times), np.sin(7 * times)])]) + noise


PAIR = tuple(Channel(marker=m, quantity=q, column=m + q) for m in "AB" for q in ("x", "y"))  # type: ignore[arg-type]


@pytest.mark.parametrize(("first", "last"), [(120, 135), (70, 71), (200, 400), (0, 12), (1, 2), (390, 400)])
def test_exchanged_markers_are_mended_and_named(first: int, last: int) -> None:
    times = np.arange(400) * 0.005
    values = whirl(times)
    found, events = mend(times, PAIR, swapped(values, first, last, (0, 1)))
    np.testing.assert_array_equal(found, values)
    which = f"sample {first}" if last == first + 1 else f"samples {first} to {last - 1}"
    assert events == [f"markers A and B exchanged in {which}: mended"]


def test_markers_that_come_near_each_other_are_left_alone() -> None:
    times = np.arange(400) * 0.005
    crossing = np.column_stack([times, 0 * times, 1 - times, 0.001 * np.sin(5 * times)])
    for values in (whirl(times), crossing):
        found, events = mend(times, PAIR, values)
        assert not events
        np.testing.assert_array_equal(found, values)


def test_a_block_with_gaps_and_dropped_frames_is_mended() -> None:
    keep = np.delete(np.arange(400), [100, 130, 131, 220])
    times, values = keep * 0.005, whirl(keep * 0.005)
    values[[115, 240], 2] = np.nan
    found, events = mend(times, PAIR, swapped(values, 110, 180, (0, 1)))
    np.testing.assert_array_equal(found, values)
    assert len(events) == 1


def test_a_table_is_mended_as_it_is_read_unless_swaps_is_false(tmp_path: Path) -> None:
    times = np.arange(400) * 0.005
    values = whirl(times)
    wrong = swapped(values, 120, 135, (0, 1))
    header = ",".join(["t", *(channel.column for channel in PAIR)])
    np.savetxt(tmp_path / "run.csv", np.column_stack([times, wrong]), delimiter=",", header=header, comments="")
    source = FileSource(path=str(tmp_path / "run.csv"))
    mended, left = read(source, PAIR), read(source.model_copy(update={"swaps": False}), PAIR)
    np.testing.assert_array_equal(mended.values, values)
    assert mended.notes == ("markers A and B exchanged in samples 120 to 134: mended",)
    np.testing.assert_array_equal(left.values, wrong)


@pytest.mark.skipif(not RECORDINGS.exists(), reason="the recordings are not here")
def test_real_markers_raise_no_alarm_and_injected_exchanges_are_found() -> None:
    rng = np.random.default_rng(0)
    found = 0
    for run in range(5):
        path = RECORDINGS / f"{run}.csv.gz"
        samples = read(VIDEO.model_copy(update={"path": str(path)}), MARKERS)
        _, events = mend(samples.times, MARKERS, samples.values)
        assert not events
        for trial in range(20):
            begin = int(rng.integers(0, len(samples.times) - 2000))
            times, values = samples.times[begin : begin + 2000], samples.values[begin : begin + 2000]
            first = int(rng.integers(1, 1900))
            last = {0: first + 1, 1: first + int(rng.integers(2, 500)), 2: 2000}[trial % 3]
            first, last = (1000, 2000) if trial % 3 == 2 else (first, min(last, 2000))
            pair = [(0, 1), (0, 2), (1, 2)][int(rng.integers(3))]
            mended, _ = mend(times, MARKERS, swapped(values, first, last, pair))
            found += np.array_equal(mended, values)
    assert found >= 95


DOUBLE = {
    "name": "double",
    "scene": "rigid-double-pendulum",
    "parameters": {
        "first": {"path": "initial.OA.angle", "lower": -1.0, "upper": 2.0},
        "second": {"path": "initial.AB.angle", "lower": -1.0, "upper": 2.0},
    },
    "channels": [{"marker": m, "quantity": q, "column": m + q} for m in "AB" for q in "xy"],
    "source": {"kind": "engine", "engine": "gauss", "stop": 1.0, "count": 50},
}


@pytest.mark.slow
def test_a_whole_recording_with_exchanged_markers_contradicts_the_model() -> None:
    problem = Problem.parse(DOUBLE, "double")
    right = measure(problem, problem.load_scene())
    recording = right.first
    noisy = recording.values + 1e-3 * np.random.default_rng(0).standard_normal(recording.values.shape)
    wrong = Measurement.single(recording.times, recording.channels, noisy[:, [2, 3, 0, 1]], "exchanged")
    larger = Measurement.single(recording.times, recording.channels, 1.3 * noisy, "another size")
    found = identify(problem, measurement=wrong, method="least-squares")
    assert found.verdict is Verdict.REJECTED
    assert found.suspects[0].name == "columns of A and B"
    found = identify(problem, measurement=larger, method="least-squares")
    assert found.suspects[0].name == "scale"


def described_run(folder: Path) -> Path:
    """A recording's YAML in its own folder, beside its table."""
    folder.mkdir()
    (folder / "table.csv").write_text("time;phi\n0;10,5\n20;11\n40;11,5\n60;12\n")
    channels = [{"marker": "A", "quantity": "angle", "column": "phi", "unit": "deg", "noise": 0.001}]
    text = {"path": "table.csv", "time": "time", "time_scale": 1e-3, "channels": channels, "clock": 1.1}
    (folder / "run.yaml").write_text(yaml.safe_dump(text))
    return folder / "run.yaml"


SINGLE = {
    "name": "single",
    "scene": "single-pendulum",
    "parameters": {"angle": {"path": "initial.OA.angle", "lower": -1.0, "upper": 1.0}},
}


def test_a_recordings_yaml_says_how_its_table_is_read(tmp_path: Path) -> None:
    described_run(tmp_path / "data")
    (tmp_path / "problem.yaml").write_text(
        yaml.safe_dump({**SINGLE, "source": {"kind": "file", "path": "data/run.yaml"}})
    )
    named = load_problem(str(tmp_path / "problem.yaml"))
    given = Problem.parse({**SINGLE, "source": {"kind": "file"}}, "single")
    for problem, data in ((named, None), (given, str(tmp_path / "data" / "run.yaml"))):
        found = measure(problem, problem.load_scene(), data).first
        np.testing.assert_allclose(found.times, [0, 0.02, 0.04, 0.06])
        np.testing.assert_allclose(found.values[:, 0], np.deg2rad([10.5, 11, 11.5, 12]))
        assert found.stated.clock == 1.1
        assert found.noise[0] == 0.001


def test_several_recordings_are_named(tmp_path: Path) -> None:
    path = str(described_run(tmp_path / "data"))
    problem = Problem.parse({**SINGLE, "recordings": {"low": {"kind": "file"}, "high": {"kind": "file"}}}, "single")
    scene = problem.load_scene()
    other = described_run(tmp_path / "other")
    table = other.parent / "table.csv"
    table.write_text(table.read_text().replace("12", "13"))
    assert list(measure(problem, scene, {"high": path, "low": str(other)}).recordings) == ["low", "high"]
    for data, words in (({"low": path}, "high needs"), ({"other": path}, "no recording 'other'"), (path, "NAME=FILE")):
        with pytest.raises(InputError, match=words):
            measure(problem, scene, data)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time: t\n", "path"),
        ("path: other.yaml\n", "path"),
        ("path: table.csv\ncolour: 1\n", "colour"),
        ("path: table.csv\nchannels: [{marker: A, quantity: x}]\n", "column"),
        ("path: table.csv\nchannels: [{marker: Q, quantity: x, column: phi}]\n", "no marker 'Q'"),
        ("path: table.csv\n", "channels: none are stated"),
        ("- 1\n", "mapping"),
        ("[", "line"),
    ],
)
def test_a_wrong_description_is_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    described_run(tmp_path / "data").write_text(text)
    problem = Problem.parse({**SINGLE, "source": {"kind": "file"}}, "single")
    with pytest.raises(InputError, match=words) as refusal:
        measure(problem, problem.load_scene(), str(tmp_path / "data" / "run.yaml"))
    assert "\n" not in str(refusal.value)


EXAMPLES = [yaml.safe_load(text.split("```")[0]) for text in GUIDE.read_text().split("```yaml\n")[1:]]


@pytest.mark.parametrize("example", [one for one in EXAMPLES if "scene" in one], ids=lambda one: one["name"])
def test_problems_of_the_manual_suit_their_scenes(example: dict[str, object]) -> None:
    assert Problem.parse(example, "docs/recordings.md").load_scene().markers


@pytest.mark.parametrize("example", [one for one in EXAMPLES if "path" in one], ids=lambda one: one["path"])
def test_recordings_of_the_manual_name_their_columns(example: dict[str, object]) -> None:
    assert FileSource.model_validate(example).channels


@pytest.mark.parametrize("record", [Channel, FileSource, EngineSource, Parameter, Problem, Prior])
def test_the_manual_names_every_field(record: type[Record]) -> None:
    words = set(re.findall(r"\w+", " ".join(re.findall(r"`([^`\n]+)`", REFERENCE.read_text()))))
    assert set(record.model_fields) <= words


def test_pixels_without_a_size_are_told(tmp_path: Path) -> None:
    (tmp_path / "video.csv").write_text("t,x\n0,1\n1,2\n2,3\n")
    channels = [{"marker": "A", "quantity": "x", "column": "x", "unit": "px"}]
    for scale, told in ((1.0, True), (2e-3, False)):
        source = {"kind": "file", "path": str(tmp_path / "video.csv"), "scale": scale, "channels": channels}
        problem = Problem.parse({**SINGLE, "source": source}, "single")
        notes = measure(problem, problem.load_scene()).first.notes
        assert any("count as metres" in note for note in notes) == told


def test_a_prior_needs_noise_to_weigh_against(tmp_path: Path) -> None:
    angle = {**SINGLE["parameters"]["angle"], "prior": {"mean": 0.0, "std": 0.1}}  # type: ignore[index]
    problem = Problem.parse({**SINGLE, "parameters": {"angle": angle}, "source": {"kind": "file"}}, "single")
    path = described_run(tmp_path / "data")
    assert measure(problem, problem.load_scene(), str(path)).first.noise[0] == 0.001
    path.write_text(path.read_text().replace("  noise: 0.001\n", ""))
    with pytest.raises(InputError, match="noise: a prior weighs"):
        measure(problem, problem.load_scene(), str(path))


def test_a_video_of_the_textbook_motion_gives_its_angles_and_its_clock(tmp_path: Path) -> None:
    """Pixels of 2 mm, y down, a tracked pivot, dropped frames, gaps; 125 frames a second, not the stated 100."""
    from shoal_validation.problems.double_pendulum import settle

    rng = np.random.default_rng(0)
    frames = np.delete(np.arange(100), [30, 31, 70])
    tip = settle(frames / 125.0).points / 2e-3
    shaken = 0.2 * rng.standard_normal(tip.shape)
    shaken[[12, 55]] = np.nan
    pivot = [640.0, 360.0]
    table = np.column_stack([frames, np.full((len(frames), 2), pivot), pivot + tip * [1, -1] + shaken])
    text = "\n".join(";".join("" if np.isnan(x) else f"{x:.3f}".replace(".", ",") for x in row) for row in table)
    (tmp_path / "video.csv").write_text("frame;Ox;Oy;Bx;By\n" + text + "\n")
    channels = [
        {"marker": "B", "quantity": q, "column": f"B{q}", "origin": f"O{q}", "unit": "px", "noise": 0.2} for q in "xy"
    ]
    source = {"kind": "file", "path": "video.csv", "time": "frame", "time_scale": 0.01, "y_axis": "down", "scale": 2e-3}
    angle = {"lower": -3.2, "upper": 3.2}
    problem = {
        "name": "video",
        "scene": "rigid-double-pendulum",
        "parameters": {
            "first": {"path": "initial.OA.angle", **angle},
            "second": {"path": "initial.AB.angle", **angle},
            "clock": {"path": "measurement.clock", "lower": 0.5, "upper": 1.5, "start": 1.0},
        },
        "channels": channels,
        "source": source,
    }
    (tmp_path / "problem.yaml").write_text(yaml.safe_dump(problem))
    estimate = identify(load_problem(str(tmp_path / "problem.yaml")), method="least-squares")
    found = {name: value.value for name, value in estimate.parameters.items()}
    assert found == pytest.approx({"first": np.pi / 4, "second": np.pi / 6, "clock": 1.25}, abs=3e-3)
    assert estimate.rms == pytest.approx(0.2, rel=0.5)
