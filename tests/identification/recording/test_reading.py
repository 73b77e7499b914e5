"""Tables of any shape give the numbers that were written; whatever else is in a file is refused in one line."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shoal import table as tabular
from shoal.errors import InputError
from shoal.identification import Recording
from shoal.identification.recording.reading import described
from shoal.identification.recording.reading import read as read_source
from shoal.identification.recording.source import Channel, FileSource
from shoal.table_units import SI

ANGLE = (Channel(marker="A", quantity="angle", column="theta"),)
TIP = (Channel(marker="A", quantity="x", column="x"), Channel(marker="A", quantity="y", column="y"))


def read(source: FileSource, channels: tuple[Channel, ...], path: Path) -> Recording:
    return read_source(source.model_copy(update={"path": str(path)}), channels)


def written(folder: Path, text: str, name: str = "run.csv") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def rows(columns: list[np.ndarray], header: str, separator: str = ",") -> str:
    lines = [separator.join("" if np.isnan(x) else repr(float(x)) for x in row) for row in zip(*columns, strict=True)]
    return "\n".join([header, *lines]) + "\n"


@st.composite
def tables(draw: st.DrawFn) -> tuple[np.ndarray, dict[str, np.ndarray], list[Channel], list[str], str, bool]:
    """Times, columns with gaps, channels with units, order of columns, separator, decimal comma."""
    count = draw(st.integers(3, 12))
    times = np.cumsum(draw(st.lists(st.floats(1e-3, 1.0), min_size=count, max_size=count)))
    numbers = st.floats(-1e3, 1e3) | st.just(np.nan)
    columns, channels = {}, []
    for k, unit in enumerate(
        draw(st.lists(st.sampled_from(["m", "cm", "mm", "um", "in", "px"]), min_size=1, max_size=4))
    ):
        column = np.array(draw(st.lists(numbers, min_size=count, max_size=count)))
        column[draw(st.integers(0, count - 1))] = draw(st.floats(-1e3, 1e3))
        columns[f"c{k}"] = column
        channels.append(Channel(marker=f"M{k}", quantity="x", column=f"c{k}", unit=unit))
    separator = draw(st.sampled_from([",", ";", "\t"]))
    return times, columns, channels, draw(st.permutations(["t", *columns])), separator, draw(st.booleans())


@pytest.mark.slow
@given(tables())
@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_tables_come_back_as_they_were_written(
    tmp_path: Path, table: tuple[np.ndarray, dict[str, np.ndarray], list[Channel], list[str], str, bool]
) -> None:
    times, columns, channels, order, separator, comma = table
    text = rows([{"t": times, **columns}[name] for name in order], separator.join(order), separator)
    if separator == ";" and comma:
        text = text.replace(".", ",")
    path = tmp_path / "run.csv.gz"
    path.write_bytes(gzip.compress(text.encode()))
    begin = 0.0 if times[-1] > 0 and times[0] <= 0.1 * (times[-1] - times[0]) else times[0]
    found = read(FileSource(), tuple(channels), path)
    np.testing.assert_allclose(found.times, times - begin, rtol=1e-12, atol=1e-12)
    for k, channel in enumerate(channels):
        np.testing.assert_allclose(found.values[:, k], columns[channel.column] * SI[channel.unit or "m"], rtol=1e-12)


@given(st.binary(max_size=300), st.sampled_from(["run.csv", "run.csv.gz", "run.parquet", "run.yaml"]), st.booleans())
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_garbage_is_refused_in_one_line_and_nothing_else(tmp_path: Path, data: bytes, name: str, packed: bool) -> None:
    path = tmp_path / name
    path.write_bytes(b"\x1f\x8b\x08" + data if packed else data)
    with pytest.raises(InputError) as refusal:
        described({}, path) if name.endswith("yaml") else read(FileSource(), ANGLE, path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(("value", "digits", "told"), [(None, 9, True), (0.0, 9, True), (None, 2, False)])
def test_a_marker_that_stands_still_to_the_last_digit_is_noted(
    tmp_path: Path, value: float | None, digits: int, told: bool
) -> None:
    """The last place or a zero in place of a lost marker; where digits are few, equal neighbours are usual."""
    t = np.arange(100) * 0.02
    theta = np.round(np.sin(3.0 * t) + 1e-4 * np.random.default_rng(0).standard_normal(100), digits)
    theta[40:46] = theta[40] if value is None else value
    path = written(tmp_path, rows([t, theta], "t,theta"))
    notes = [note for note in read(FileSource(), ANGLE, path).notes if "in a row" in note]
    assert len(notes) == told
    assert not told or f"6 samples in a row are all {theta[40]:.6g} from 0.8 s on" in notes[0]


def test_the_statement_of_the_separator_that_excel_reads_is_no_row(tmp_path: Path) -> None:
    path = written(tmp_path, "sep=;\nt;theta\n0;0,5\n1;0,25\n2;x\n")
    with pytest.raises(InputError, match="row 5, column 'theta': 'x'"):
        read(FileSource(), ANGLE, path)
    path.write_text(path.read_text().replace("x", "1"))
    np.testing.assert_array_equal(read(FileSource(), ANGLE, path).values[:, 0], [0.5, 0.25, 1.0])


@given(st.text(alphabet="0123456789.,;-+einfa \t\n\"'xé_", max_size=80))
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_table_of_any_text_is_read_or_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "run.csv"
    path.write_text("t,theta\n" + text)
    try:
        found = read(FileSource(), ANGLE, path)
    except InputError:
        pass
    else:
        assert np.all(np.diff(found.times) > 0)
        assert not np.any(np.isinf(found.values))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t,theta\n0,1\n\n0.1,x\n0.2,3\n", ["row 4", "theta", "'x'"]),
        ("t,theta\n0,1\n0.1,inf\n0.2,3\n", ["row 3", "theta", "not finite"]),
        ("t,theta\n0,1\n0.1,2\n0.1,3\n0.3,4\n", ["row 4", "'t'", "increase"]),
        ("t,theta\n0,1\n,2\n0.2,3\n", ["row 3", "'t'", "needs its time"]),
        ('t,theta\n0,1\n0.1,"1,000"\n0.2,3\n', ["row 3", "theta", "'1,000'"]),
        ("t,theta\n0,1\n0.1,1_0\n0.2,3\n", ["row 3", "theta", "'1_0'"]),
        ("t,theta\n0,1\n0.1,True\n0.2,3\n", ["row 3", "theta", "'True'"]),
        ("t,theta\n0,1,\n1,2,3\n", ["not CSV"]),
        ("t,theta\n0,\n0.1,\n0.2,nan\n", ["'theta'", "no sample"]),
        ("t,phi\n0,1\n", ["no column 'theta'", "t, phi"]),
        ("t,theta,theta\n0,1,1\n", ["'theta'", "twice"]),
        ("0,1\n1,2\n2,3\n", ["no header line", "columns"]),
        (
            "By a tracker\nmass A\nt,theta,theta\n0,1,2\n1,2,3\n",
            ["no header line: row 1", "row 4 has 3 cells", "row 3 may be it"],
        ),
        ("t,theta\n0,1\n1,-9999\n2,1.1\n3,-9999\n4,1.2\n", ["'theta': -9999 stands 2 times", "1 to 1.2", "empty"]),
        ("t,theta\n0,1\n", ["only 1 samples"]),
        ("", ["not CSV"]),
    ],
)
def test_what_is_wrong_is_named_by_line_and_column(tmp_path: Path, text: str, words: list[str]) -> None:
    with pytest.raises(InputError) as refusal:
        read(FileSource(), ANGLE, written(tmp_path, text))
    assert all(word in str(refusal.value) for word in words)


def test_a_window_outside_the_recording_says_what_the_file_covers(tmp_path: Path) -> None:
    path = written(tmp_path, "t,theta\n0,1\n1,2\n2,3\n3,4\n")
    with pytest.raises(InputError, match="covers 0 s to 3 s"):
        read(FileSource(start=10.0), ANGLE, path)


def test_files_beyond_the_bound_are_refused_packed_or_not(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tabular, "LARGEST", 10_000)
    text = rows([np.arange(2000.0), np.zeros(2000)], "t,theta")
    packed = tmp_path / "run.csv.gz"
    packed.write_bytes(gzip.compress(text.encode()))
    assert packed.stat().st_size < 10_000
    for path in (packed, written(tmp_path, text)):
        with pytest.raises(InputError, match="MB"):
            read(FileSource(), ANGLE, path)


def test_pixels_with_y_down_and_a_tracked_pivot(tmp_path: Path) -> None:
    path = written(tmp_path, "100,50,110,70\n100,51,111,70\n101,50,111,68\n")
    channels = (
        Channel(marker="A", quantity="x", column="ax", origin="ox", unit="px"),
        Channel(marker="A", quantity="y", column="ay", origin="oy", unit="px"),
    )
    found = read(FileSource(columns=["ox", "oy", "ax", "ay"], rate=10.0, y_axis="down"), channels, path)
    np.testing.assert_allclose(found.times, [0.0, 0.1, 0.2])
    np.testing.assert_allclose(found.values, [[10, -20], [11, -19], [10, -18]])


def test_an_angle_that_the_y_axis_turns_round_changes_its_sense(tmp_path: Path) -> None:
    path = written(tmp_path, "t,theta\n0,10\n1,20\n2,30\n")
    channels = (Channel(marker="A", quantity="angle", column="theta", unit="deg", offset=1.0),)
    found = read(FileSource(y_axis="down"), channels, path)
    np.testing.assert_allclose(found.values[:, 0], 1.0 - np.deg2rad([10, 20, 30]))


@pytest.mark.parametrize(("unit", "turn"), [("rad", 2 * np.pi), ("deg", 360.0), ("rev", 1.0)])
def test_wrapped_angles_become_continuous_before_the_window(tmp_path: Path, unit: str, turn: float) -> None:
    times = np.arange(0, 4, 0.01)
    angle = 3.0 + 5.0 * times
    wrapped = (angle + np.pi) % (2 * np.pi) - np.pi
    path = written(tmp_path, rows([times, wrapped * turn / (2 * np.pi)], "t,theta"))
    channels = (Channel(marker="A", quantity="angle", column="theta", unit=unit),)
    found = read(FileSource(start=1.0, every=100), channels, path)
    np.testing.assert_allclose(np.diff(found.values[:, 0]), 5.0, atol=1e-9)
    assert abs(found.values[0, 0]) <= np.pi


def test_angles_that_are_not_wrapped_stay_as_they_are_however_fast(tmp_path: Path) -> None:
    times = np.arange(0, 4, 0.1)
    path = written(tmp_path, rows([times, 40.0 * times], "t,theta"))
    found = read(FileSource(), ANGLE, path)
    np.testing.assert_allclose(found.values[:, 0], 40.0 * times)


def test_turns_lost_in_a_gap_are_called_a_guess(tmp_path: Path) -> None:
    times = np.delete(np.arange(0, 4, 0.01), slice(100, 250))
    wrapped = (8.0 * times + np.pi) % (2 * np.pi) - np.pi
    found = read(FileSource(), ANGLE, written(tmp_path, rows([times, wrapped], "t,theta")))
    assert any("is a guess" in note for note in found.notes)
    before = read(FileSource(duration=0.9), ANGLE, tmp_path / "run.csv")
    assert not any("is a guess" in note for note in before.notes)


def test_an_angle_that_turns_half_round_between_samples_is_called_a_guess(tmp_path: Path) -> None:
    times = np.arange(0, 4, 0.1)
    for rate, told in ((10.0, False), (29.0, True)):
        wrapped = (rate * times + np.pi) % (2 * np.pi) - np.pi
        found = read(FileSource(), ANGLE, written(tmp_path, rows([times, wrapped], "t,theta")))
        np.testing.assert_allclose(np.diff(found.values[:, 0]), rate * 0.1)
        assert any("is a guess" in note for note in found.notes) == told


def test_gaps_dropped_frames_and_spikes_are_told(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    times = np.delete(np.arange(0, 2, 0.01), [50, 51, 120])
    x = np.sin(3 * times) + 1e-4 * rng.standard_normal(len(times))
    y = np.cos(3 * times) + 1e-4 * rng.standard_normal(len(times))
    y[20:24] = np.nan
    found = read(FileSource(), TIP, written(tmp_path, rows([times, x, y], "t,x,y")))
    assert any("y: 4 of 197 samples are gaps" in note for note in found.notes)
    assert any("3 dropped frames" in note for note in found.notes)
    times = np.arange(0, 2, 0.01)
    x = np.sin(3 * times) + 1e-4 * rng.standard_normal(len(times))
    quiet = read(FileSource(), TIP, written(tmp_path, rows([times, x, x], "t,x,y")))
    assert quiet.notes == ()
    x[[30, 90, 150]] += [0.01, -0.02, 0.005]
    found = read(FileSource(), TIP[:1], written(tmp_path, rows([times, x], "t,x")))
    assert [note for note in found.notes if "outliers, 3 samples" in note and "huber" in note]


@pytest.mark.parametrize("kind", ["interpolated", "past a dead centre", "another marker"])
def test_motion_that_the_samples_do_not_resolve_is_no_outlier(kind: str, tmp_path: Path) -> None:
    """Kinks, fast turns and jumps are not mended by another value of one sample, as an outlier is."""
    times = np.arange(400) / 200
    noise = 2e-4 * np.random.default_rng(0).standard_normal(400)
    knots = np.arange(0, 401, 10) / 200
    x = {
        "interpolated": np.interp(times, knots, np.sin(3 * knots)),
        "past a dead centre": np.arctan(150 * np.sin(3 * times + 0.3)) + noise,
        "another marker": np.sin(3 * times) + (times > 1.0) + noise,
    }[kind]
    found = read(FileSource(), TIP[:1], written(tmp_path, rows([times, x], "t,x")))
    assert not [note for note in found.notes if "outliers" in note]


def test_parquet_is_read_with_its_gaps(tmp_path: Path) -> None:
    pyarrow = pytest.importorskip("pyarrow")
    from pyarrow import parquet

    path = tmp_path / "run.parquet"
    parquet.write_table(pyarrow.table({"t": [0, 1, 2], "theta": [0.1, None, 0.3], "name": ["a", "b", "c"]}), path)
    found = read(FileSource(), ANGLE, path)
    np.testing.assert_array_equal(found.values[:, 0], [0.1, np.nan, 0.3])
    with pytest.raises(InputError, match=r"row 1, column 'name': 'a' is not a number"):
        read(FileSource(), (Channel(marker="A", quantity="angle", column="name"),), path)
