"""Tables as instruments write them: comments, a header among them, other encodings, units, a million lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from shoal import table
from shoal.errors import InputError
from shoal.identification import Recording
from shoal.identification.recording import reading
from shoal.identification.recording.reading import read
from shoal.identification.recording.source import Channel, FileSource

X = (Channel(marker="A", quantity="x", column="x"),)
ROWS = "0.0,1.0\n0.1,2.0\n0.2,4.0\n0.3,3.0\n"


def seen(path: Path, data: str | bytes, **source: object) -> Recording:
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return read(FileSource(path=str(path), **source), X)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "text",
    [
        f"# a rig\n% of 1994\nt,x\n{ROWS}",
        f"t,x\n{ROWS}# the end\n",
        f"# a rig, in its cellar\n# t,x\n{ROWS}",
        "t,x\n0.0,1.0\n# a pause\n0.1,2.0\n0.2,4.0\n% another\n0.3,3.0\n",
        f"\n# t;x\n{ROWS}".replace(",", ";"),
    ],
)
def test_comments_are_no_rows_and_may_hold_the_header(tmp_path: Path, text: str) -> None:
    np.testing.assert_array_equal(seen(tmp_path / "run.csv", text).values[:, 0], [1, 2, 4, 3])


@pytest.mark.parametrize(
    "text",
    [
        "t x\n0.0 1.0\n0.1 2.0\n0.2 4.0\n0.3 3.0\n",
        "# a rig of 1994\n# t x\n 0.0   1.0\n 0.1   2.0 \n 0.2   4.0\n 0.3   3.0",
        "t  x\r\n0.0  1.0\r\n0.1  2.0  \r\n0.2  4.0\r\n0.3  3.0\r\n",
        "t x\ns mm\n0 1e3\n0.1 2e3\n0.2 4e3\n0.3 3e3\n",
        "t\tx\n0,0\t1,0\n0,1\t2,0\n0,2\t4,0\n0,3\t3,0\n",
        "t,x\r0.0,1.0\r0.1,2.0\r0.2,4.0\r0.3,3.0\r",
    ],
    ids=["blanks", "comments", "windows", "units", "tabs and decimal commas", "returns"],
)
def test_other_ways_to_part_cells_and_lines(tmp_path: Path, text: str) -> None:
    found = seen(tmp_path / "run.txt", text)
    np.testing.assert_allclose(found.times, [0.0, 0.1, 0.2, 0.3])
    np.testing.assert_allclose(found.values[:, 0], [1, 2, 4, 3])


def test_what_numpy_writes_by_default_is_read(tmp_path: Path) -> None:
    rows = np.array([[0.0, 1.0, -3.0], [0.1, 2.0, np.nan], [0.2, -4.0e-9, 5.0]])
    np.savetxt(tmp_path / "named.txt", rows, header="t x y")
    np.testing.assert_array_equal(read(FileSource(path=str(tmp_path / "named.txt")), X).values[:, 0], rows[:, 1])
    np.savetxt(tmp_path / "plain.txt", rows)
    source = FileSource(path=str(tmp_path / "plain.txt"), columns=["t", "x", "y"])
    np.testing.assert_array_equal(read(source, X).values[:, 0], rows[:, 1])
    with pytest.raises(InputError, match="no header line; name its columns with `columns`"):
        read(FileSource(path=str(tmp_path / "plain.txt")), X)


@pytest.mark.parametrize("seed", range(40))
def test_tables_drawn_at_random_hold_what_was_written(seed: int, tmp_path: Path) -> None:
    """Any way to part cells and lines and to name the columns, with gaps in the first row too."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(6, 3)) * 10.0 ** rng.integers(-9, 6, size=(1, 3))
    values[rng.random((6, 3)) < 0.15] = np.nan
    values[0, 0] = 1.0
    cell, ending = str(rng.choice(["%.18e", "%.6f", "%g", "%8.3f"])), str(rng.choice(["\n", "\r\n", "\r"]))
    separator, names = str(rng.choice([" ", "  ", "\t", ",", ";"])), ["a", "b", "c"]
    commas = separator in ";\t" and rng.random() < 0.5
    head = [separator.join(names) + ending, f"# {separator.join(names)}{ending}", ""][int(rng.integers(3))]
    text = ending.join(separator.join(cell % x for x in row) for row in values)
    path = tmp_path / "table.txt"
    path.write_bytes((head + (text.replace(".", ",") if commas else text)).encode())
    read_back = table.load_table(path, None if head else names)
    found = np.column_stack([read_back.numbers(name) for name in names])
    written = np.array([[float(cell % x) for x in row] for row in values])
    np.testing.assert_array_equal(found, written[~np.all(np.isnan(written), axis=1)])


ABOVE = (
    "mass A",
    "multi:",
    "Export of run 7",
    "fps{0}240",
    "mass A{0}",
    "{0}mass A",
    "By a tracker, version 6",
    "",
    "#c",
)


@pytest.mark.parametrize("seed", range(40))
def test_lines_above_the_header_drawn_at_random_are_passed_over(seed: int, tmp_path: Path) -> None:
    """Titles, the name of a mass, blank lines and settings, with and without a line of units below the names."""
    rng = np.random.default_rng(seed)
    separator, ending = str(rng.choice([",", "\t", ";"])), str(rng.choice(["\n", "\r\n"]))
    names = ["t", "x", "y"]
    rows = [[f"{x:.4f}" for x in row] for row in np.column_stack([np.arange(5) / 10, rng.normal(size=(5, 2))])]
    rows[int(rng.integers(5))][1] = ""
    units = [["s", "mm", "mm"]] * int(rng.integers(2))
    above = [str(rng.choice(ABOVE)).format(separator) for _ in range(int(rng.integers(1, 5)))]
    if all(line == "" or line.startswith("#") for line in above):
        above[0] = "mass A"
    lines = above + [separator.join(line) for line in (names, *units, *rows)]
    path = tmp_path / "table.txt"
    path.write_bytes(ending.join([*lines, ""]).encode())
    read_back = table.load_table(path)
    assert list(read_back.frame.columns) == names
    wanted = np.array([[float(cell or "nan") for cell in row] for row in rows])
    np.testing.assert_array_equal(np.column_stack([read_back.numbers(name) for name in names]), wanted)
    assert read_back.rows[0] == len(above) + 2 + len(units)
    np.testing.assert_array_equal(read_back.frames, np.arange(5))
    assert (read_back.units is not None) == bool(units)


def test_two_lines_that_may_name_the_columns_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("A,B,C\nt,x,y\n0,1,2\n1,2,3\n")
    with pytest.raises(InputError, match="row 2, column 'A': 't' is not a number"):
        table.load_table(path).numbers("A")


def test_a_comma_beside_points_is_no_decimal_mark(tmp_path: Path) -> None:
    """A thousand and two hundred millimetres are not 1.2."""
    with pytest.raises(InputError, match=r"row 2, column 'x': '1,200' is not a number"):
        seen(tmp_path / "run.txt", "t\tx\n0.0\t1,200\n0.1\t1,300\n0.2\t1,400\n")


def test_a_binary_table_without_a_line_feed_stays_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    data, seen = b"PAR1\r\r\rPAR1", []
    empty = table.ColumnTable(tmp_path, None, np.zeros(0, np.intp))
    monkeypatch.setattr(table, "_parquet", lambda path, found, largest: seen.append(found) or empty)
    (tmp_path / "run.parquet").write_bytes(data)
    table.load_table(tmp_path / "run.parquet")
    assert seen == [data]


def test_comments_are_no_frames_and_blank_lines_are(tmp_path: Path) -> None:
    found = seen(tmp_path / "run.csv", "x\n1\n# lamp off\n2\n\n4\n", rate=10.0)
    np.testing.assert_allclose(found.times, [0.0, 0.1, 0.3])


def test_a_bad_cell_is_named_by_its_line_in_the_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="row 5, column 'x'"):
        seen(tmp_path / "run.csv", "# one\nt,x\n0,1\n# two\n1,oops\n2,3\n")


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be", "utf-8-sig", "latin-1"])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    mark = {"utf-16-le": b"\xff\xfe", "utf-16-be": b"\xfe\xff"}.get(encoding, b"")
    data = mark + f"t,x,Länge\n{ROWS.replace(chr(10), ',ü' + chr(10))}".encode(encoding)
    np.testing.assert_array_equal(seen(tmp_path / "run.csv", data).values[:, 0], [1, 2, 4, 3])


@pytest.mark.parametrize(
    ("units", "time", "length"),
    [
        ("s,m", 1.0, 1.0),
        ("[s],[mm]", 1.0, 1e-3),
        ("(ms), (cm)", 1e-3, 1e-2),
        ("µs;Inches", 1e-6, 0.0254),
        ("Seconds,", 1.0, 1.0),
        ("-,[px]", 1.0, 1.0),
    ],
)
@pytest.mark.parametrize("above", ["", "# a rig\n"])
@pytest.mark.parametrize("below", ["", "% warm\n\n"])
def test_a_line_of_units_states_them(
    tmp_path: Path, units: str, time: float, length: float, above: str, below: str
) -> None:
    separator = ";" if ";" in units else ","
    text = f"{above}t,x\n".replace(",", separator) + f"{units}\n{below}" + ROWS.replace(",", separator)
    found = seen(tmp_path / "run.csv", text)
    np.testing.assert_allclose(found.times, np.array([0.0, 0.1, 0.2, 0.3]) * time)
    np.testing.assert_allclose(found.values[:, 0], np.array([1, 2, 4, 3]) * length)
    assert not found.notes


def test_units_in_a_comment_under_the_names(tmp_path: Path) -> None:
    found = seen(tmp_path / "run.csv", f"# a rig\n# t, x\n# ms, mm\n{ROWS}")
    np.testing.assert_allclose(found.times, [0.0, 1e-4, 2e-4, 3e-4])
    np.testing.assert_allclose(found.values[:, 0], [1e-3, 2e-3, 4e-3, 3e-3])


def test_a_line_of_units_is_no_frame(tmp_path: Path) -> None:
    found = seen(tmp_path / "run.csv", "x\nmm\n1\n2\n\n4\n", rate=10.0)
    np.testing.assert_allclose(found.times, [0.0, 0.1, 0.3])


@pytest.mark.parametrize(
    ("quantity", "unit", "factor"),
    [
        ("angle", "deg", np.pi / 180),
        ("angle", "°", np.pi / 180),
        ("rate", "rev/s", 2 * np.pi),
        ("rate", "deg s^-1", np.pi / 180),
    ],
)
def test_units_of_angles_and_rates(tmp_path: Path, quantity: str, unit: str, factor: float) -> None:
    (path := tmp_path / "run.csv").write_text(f"t,x\ns,{unit}\n{ROWS}")
    channel = Channel.model_validate({"marker": "A", "quantity": quantity, "column": "x"})
    values = read(FileSource(path=str(path)), (channel,)).values[:, 0]
    np.testing.assert_allclose(np.diff(values), np.diff([1, 2, 4, 3]) * factor)


def test_what_is_stated_wins_over_the_line_of_units_with_a_note(tmp_path: Path) -> None:
    (path := tmp_path / "run.csv").write_text(f"t,x\nms,mm\n{ROWS}")
    metres = (Channel(marker="A", quantity="x", column="x", unit="m"),)
    found = read(FileSource(path=str(path), time_scale=1.0), metres)
    assert (found.times[-1], found.values[-1, 0]) == (0.3, 3.0)
    assert found.notes == (
        "times: the table says ms, the recording time_scale 1, which is taken",
        "A x: the table says mm, the recording m, which is taken",
    )
    agreed = (Channel(marker="A", quantity="x", column="x", unit="mm"),)
    assert not read(FileSource(path=str(path), time_scale=1e-3), agreed).notes


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("t,x\ns,furlong\n", "row 2, column 'x': unit 'furlong' of x is none of m, cm, mm"),
        ("t,x\ns,deg\n", "row 2, column 'x': unit 'deg' of x"),
        ("t,x\ns,m/s\n", "row 2, column 'x': unit 'm/s' of x"),
        ("# a rig\nt,x\nframe,m\n", "row 3, column 't': unit 'frame' is none of s, ms"),
        ("t,x\nnobody,knows\n", "row 2, column 't': 'nobody' is not a number"),
    ],
)
def test_an_unknown_unit_is_refused_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as refusal:
        seen(tmp_path / "run.csv", text + ROWS)
    assert "\n" not in str(refusal.value)


def test_a_column_and_its_origin_have_one_unit(tmp_path: Path) -> None:
    (path := tmp_path / "run.csv").write_text("t,x,o\ns,mm,cm\n0,1,1\n1,2,1\n2,3,1\n")
    with pytest.raises(InputError, match="'x' is in mm, its origin 'o' in cm"):
        read(FileSource(path=str(path)), (Channel(marker="A", quantity="x", column="x", origin="o"),))


def test_of_too_many_samples_every_nth_is_taken_with_a_note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "MOST", 100)
    times = np.arange(1001) / 100
    text = "t,x\n" + "\n".join(f"{t},{np.sin(t)}" for t in times)
    found = seen(tmp_path / "run.csv", text)
    np.testing.assert_allclose(found.times, times[::11])
    assert "of 1001 samples every 11th is fitted" in found.notes[-1]
    assert len(seen(tmp_path / "run.csv", text, every=20).times) == 51
