"""Tables as instruments write them: comments, a header among them, other encodings, units, a million lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
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


@pytest.mark.parametrize("units", ["s,m", "[s],[mm]", "(ms),(px)", "s,m/s"])
def test_a_line_of_units_is_named_as_that(tmp_path: Path, units: str) -> None:
    with pytest.raises(InputError, match="row 2 holds units"):
        seen(tmp_path / "run.csv", f"t,x\n{units}\n{ROWS}")


def test_of_too_many_samples_every_nth_is_taken_with_a_note(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "MOST", 100)
    times = np.arange(1001) / 100
    text = "t,x\n" + "\n".join(f"{t},{np.sin(t)}" for t in times)
    found = seen(tmp_path / "run.csv", text)
    np.testing.assert_allclose(found.times, times[::11])
    assert "of 1001 samples every 11th is fitted" in found.notes[-1]
    assert len(seen(tmp_path / "run.csv", text, every=20).times) == 51
