"""A table of CSV or Parquet, and its columns as numbers; a file that is wrong gets one line."""

from __future__ import annotations

import csv
import gzip
import io
import re
import warnings
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shoal.errors import InputError
from shoal.regular import require_regular
from shoal.table_units import Units, is_unit_line, of_columns
from shoal.trajectory import Array

Mask = NDArray[np.bool_]

LARGEST = 200_000_000
"""Bytes of a table, unpacked; more are refused."""
_MOST_COLUMNS = 2000
_COMMENT = re.compile(rb"^[ \t]*[#%][^\r\n]*", re.MULTILINE)
_SEPARATES = re.compile(rb"\A\"?sep=.\"?[ \t]*(?=\r?\n)", re.IGNORECASE)
"""What Excel reads as a statement of the separator, above the header."""
_CELLS = re.compile(r"[,;\t]")
_MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}
"""First bytes of a text by its encoding."""
_LOOKED = 200
"""Lines at the beginning, among which a header is looked for where the first is none."""
_EMPTY = ("", "nan", "na", "n/a", "null", "none", "<na>", "nat")
"""Cells that are gaps, in small letters."""


@dataclass(frozen=True)
class ColumnTable:
    """Columns as a file has them, by name.

    rows: the line of the file that each row stands on, (rows,); decimal: how its text writes the decimal mark
    comments: lines that are no rows, increasing
    units: of the columns, as a line of the file states them; digest: SHA-256 of the file, unpacked
    """

    path: Path
    frame: Any
    rows: NDArray[np.intp]
    decimal: str = "."
    comments: NDArray[np.intp] = field(default_factory=lambda: np.zeros(0, np.intp))
    units: Units | None = None
    digest: str = ""

    @property
    def frames(self) -> NDArray[np.intp]:
        """The number of each row among all lines but comments, from 0: a line that is blank is a frame too."""
        numbers = self.rows - np.searchsorted(self.comments, self.rows)
        return np.asarray(numbers - numbers[0])

    def numbers(self, column: str) -> Array:
        """A column, (rows,), nan where a cell is empty. Raises InputError for what is no finite number."""
        self.require(column)
        series = self.frame[column]
        if series.dtype.kind in "iuf":
            numbers = series.to_numpy(dtype=float, na_value=np.nan)
        else:
            words = [None if x is None or x is np.nan or str(x).strip().lower() in _EMPTY else str(x) for x in series]
            numbers = np.array([np.nan if word is None else _float(word, self.decimal) for word in words])
            self._refuse_first(np.array([w is not None for w in words]) & np.isnan(numbers), column, "is not a number")
        self._refuse_first(np.isinf(numbers), column, "is not finite")
        return np.asarray(numbers, dtype=float)

    def require(self, column: str) -> None:
        """Refuse a column that is not there."""
        if column not in self.frame.columns:
            raise InputError(f"{self.path}: no column {column!r}; there are {_named(self.frame.columns)}")

    def _refuse_first(self, bad: Mask, column: str, why: str) -> None:
        if np.any(bad):
            k = int(np.argmax(bad))
            found = str(self.frame[column].iloc[k])
            raise InputError(f"{self.path}: row {self.rows[k]}, column {column!r}: {_short(found)} {why}")


def load_table(path: Path, columns: list[str] | None = None, *, largest: int | None = None) -> ColumnTable:
    """A table of CSV or Parquet; columns: names, where it has no header line. Raises InputError.

    largest: bytes, unpacked; LARGEST if not stated
    """
    largest = LARGEST if largest is None else largest
    require_regular(path, "data")
    try:
        with path.open("rb") as file:
            data = file.read(largest + 1)
        if data.startswith(b"\x1f\x8b"):
            with gzip.open(io.BytesIO(data)) as packed:
                data = packed.read(largest + 1)
    except (OSError, EOFError, zlib.error) as error:
        raise InputError(f"data: {path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > largest:
        raise InputError(f"data: {path} holds more than {largest / 1e6:.0f} MB; cut the part to fit on out of it")
    parquet = data.startswith(b"PAR1")
    found = _parquet(path, data, largest) if parquet else _csv(path, _utf8(path, data), columns)
    return replace(found, digest=sha256(data).hexdigest())


def _utf8(path: Path, data: bytes) -> bytes:
    """Text as UTF-8: of UTF-16 with a mark and of Latin-1 too. Raises InputError."""
    encoding = next((name for mark, name in _MARKS.items() if data.startswith(mark)), None)
    try:
        if encoding is not None:
            data = data.decode(encoding).encode()
    except UnicodeDecodeError:
        raise InputError(f"data: {path} is not CSV: it begins as {encoding} and is not") from None
    if b"\0" in data[:65536]:
        raise InputError(f"data: {path} is not CSV: it is binary")
    try:
        data.decode()
    except UnicodeDecodeError:
        data = data.decode("latin-1").encode()
    return data


def _parquet(path: Path, data: bytes, largest: int) -> ColumnTable:
    import pandas

    try:
        from pyarrow import parquet

        stated = parquet.read_metadata(io.BytesIO(data))
        # A few bytes may say that a value stands a billion times.
        if stated.num_columns > _MOST_COLUMNS or stated.num_rows * stated.num_columns > largest / 8:
            size = f"{stated.num_rows} rows of {stated.num_columns} columns"
            raise InputError(f"data: {path} holds {size}; cut the part to fit on out of it")
        frame = pandas.read_parquet(io.BytesIO(data))
    except ImportError:
        raise InputError(f"data: {path} is Parquet, which needs the package pyarrow; install it, or give CSV") from None
    except (OSError, ValueError, KeyError, NotImplementedError, MemoryError) as error:
        raise InputError(f"data: {path} is not Parquet: {_short(str(error))}") from None
    return ColumnTable(path, frame, np.arange(1, len(frame) + 1))


def _csv(path: Path, data: bytes, columns: list[str] | None) -> ColumnTable:
    import pandas

    if b"\n" not in data:
        data = data.replace(b"\r", b"\n")
    data = _SEPARATES.sub(rb"#\g<0>", data, count=1)
    try:
        if columns is None:
            data = _without_preamble(data)
        head = _units(_header(_tabbed(data), columns is not None))
        first, skipped, comments = head.first, head.skipped, head.comments
        separator = _separator(first)
        decimal = "," if separator == ";" or (separator == "\t" and _has_decimal_commas(head.data)) else "."
        if first.count(separator) >= _MOST_COLUMNS or len(columns or ()) > _MOST_COLUMNS:
            raise InputError(f"data: {path} has more than {_MOST_COLUMNS} columns; leave out what is not fitted on")
        header = [name.strip() for name in next(csv.reader([first], delimiter=separator), [])]
        names = columns or header
        if not header:
            raise InputError(f"data: {path} is not CSV: its first line is empty")
        twice = [name for name in names if names.count(name) > 1]
        if columns is None and _are_numbers(header):
            raise InputError(f"{path}: no header line; name its columns with `columns`")
        if twice:
            raise InputError(f"{path}: row 1: column {twice[0]!r} stands twice")
        with warnings.catch_warnings():
            # A row with more cells than the header would else be cut off with a mere warning.
            warnings.simplefilter("error", pandas.errors.ParserWarning)
            frame = pandas.read_csv(
                io.BytesIO(head.data),
                sep=separator,
                decimal=decimal,
                header=None,
                names=names,
                skiprows=skipped,
                index_col=False,
                skip_blank_lines=False,
                skipinitialspace=True,
                low_memory=False,
            )
    except (ValueError, csv.Error, pandas.errors.ParserWarning, OverflowError, MemoryError) as error:
        _refuse_preamble(path, data, columns is not None)
        raise InputError(f"data: {path} is not CSV: {_short(str(error))}") from None
    rows = np.arange(len(frame)) + 1 + skipped
    filled = frame.notna().any(axis=1).to_numpy()
    cells = next(csv.reader([head.units], delimiter=separator), [])
    units = of_columns(path, head.unit_row, names, cells) if head.units else None
    return ColumnTable(path, frame[filled], rows[filled], decimal, comments, units)


def _without_preamble(data: bytes) -> bytes:
    """Return the text with the lines above its header as comments, where the first line cannot name the columns.

    The header is the last line above the first two rows of numbers, or above their line of units, if it has a word of
    its own for each column. A first line that has one too stays the header: two of them are ambiguous.
    """
    lines = data.split(b"\n")
    if any(line.count(mark) >= _MOST_COLUMNS for line in lines[:_LOOKED] for mark in (b",", b";", b"\t")):
        return data  # refused by its number of columns
    cells = [_cells(line) for line in _tabbed(b"\n".join(lines[:_LOOKED])).split(b"\n")]
    told = [k for k, line in enumerate(cells) if line]
    rows = [_are_numbers(cells[k]) and len(cells[k]) > 1 for k in told]
    begin = next((i for i in range(len(told) - 1) if rows[i] and rows[i + 1]), 0)
    width = len(cells[told[begin]]) if told else 0
    above = told[:begin]
    if above and is_unit_line(cells[above[-1]]) and not _is_header(cells[above[0]], width):
        above = above[:-1]
    if len(above) < 2 or len(cells[told[begin + 1]]) != width:
        return data
    *preamble, header = above
    if _is_header(cells[preamble[0]], width) or not _is_header(cells[header], width):
        return data
    for k in range(header):
        lines[k] = b"#" + lines[k] if lines[k].strip() else lines[k]
    return b"\n".join(lines)


def _cells(line: bytes) -> list[str]:
    """Return the cells of a line, none of a blank one or a comment."""
    text = line.decode().strip("\r\n ")
    if not text.strip() or text[0] in "#%":
        return []
    return [cell.strip() for cell in next(csv.reader([text], delimiter=_separator(text)), [])]


def _is_header(cells: Sequence[str], width: int) -> bool:
    """Return whether cells name all columns, each by a word of its own."""
    return len(cells) == width == len(set(cells)) and all(cells) and not any(_are_numbers([cell]) for cell in cells)


def _refuse_preamble(path: Path, data: bytes, named: bool) -> None:
    """Say where the first line has fewer cells than the numbers below it, so that it cannot name their columns."""
    lines = [line.decode().strip() for line in data.splitlines()[:_LOOKED]]
    cells = [line.split(_separator(line)) for line in lines]
    told = [k for k, line in enumerate(lines) if line and line[0] not in "#%"]
    row = next((k for k in told if len(cells[k]) > 1 and _are_numbers(cells[k])), None)
    if named or row is None or len(cells[told[0]]) >= len(cells[row]):
        return
    wide = [k for k in told if k < row and len(cells[k]) == len(cells[row])]
    if not wide and len(cells[told[0]]) > 1:
        return
    first = f"row {told[0] + 1} is {_short(lines[told[0]])}, while row {row + 1} has {len(cells[row])} cells"
    header = f"row {wide[0] + 1} may be it, and " if wide else ""
    raise InputError(f"{path}: no header line: {first}; {header}lines above the header have to go, or to begin with #")


def _separator(line: str) -> str:
    """Return the delimiter of the cells of a line; beside others a comma is a decimal mark."""
    return next((mark for mark in (";", "\t") if mark in line), ",")


def _has_decimal_commas(data: bytes) -> bool:
    """Return whether numbers have commas and none has a point: beside points, commas part thousands."""
    return bool(re.search(rb"\d,\d", data)) and not re.search(rb"\d\.\d", data)


def _tabbed(data: bytes) -> bytes:
    """With tabs for blanks between cells, where the first line of numbers has nothing else, as by `numpy.savetxt`."""
    for line in io.BytesIO(data):
        text = line.decode().strip()
        if not text or text[0] in "#%":
            continue
        words = text.split()
        if _CELLS.search(text) or (len(words) == 1 and _are_numbers(words)):
            return data
        if _are_numbers(words):
            return re.sub(rb"(?<=[^ \r\n]) +(?=[^ \r\n])", b"\t", re.sub(rb"(?m)^ +| +(?=\r?$)", b"", data))
    return data


def _are_numbers(cells: Sequence[str]) -> bool:
    """Return whether cells, with either decimal mark, are numbers or gaps, and not all gaps."""
    filled = [cell for cell in cells if cell.strip().lower() not in _EMPTY]
    return bool(filled) and all(np.isfinite([_float(cell, "," if "," in cell else ".") for cell in filled]))


class _Head(NamedTuple):
    """The line that names the columns, how many lines to skip, the text without comments, and where these stood.

    units: the line of units, if there is one; unit_row: its number in the file
    """

    first: str
    skipped: int
    data: bytes
    comments: NDArray[np.intp]
    units: str = ""
    unit_row: int = 0


def _units(head: _Head) -> _Head:
    """With the line of units under the header, which is no row."""
    if head.units:
        return head
    number, begin, data = 0, 0, head.data
    while begin < len(data):
        end = data.find(b"\n", begin)
        end = len(data) if end < 0 else end
        number += 1
        if number > head.skipped and (line := data[begin:end].strip()):
            text = line.decode()
            if not is_unit_line(re.split(r"\t" if b"\t" in line else "[,;]", text)):
                return head
            comments = np.sort(np.append(head.comments, number))
            return head._replace(data=data[:begin] + data[end:], comments=comments, units=text, unit_row=number)
        begin = end + 1
    return head


def _header(data: bytes, named: bool) -> _Head:
    """Header line, and other lines above the numbers.

    named: whether the columns are named elsewhere; then the first line of data tells how cells are separated. A
    comment that has as many words as the numbers below it is their header, as `numpy.savetxt` writes it; where that is
    a line of units, the comment above it is.
    """
    if not data.lstrip(b" \t\r\n").startswith((b"#", b"%")) and not _COMMENT.search(data):
        first = data.split(b"\n", 1)[0].decode().strip("\r")
        return _Head(first, 0 if named else 1, data, np.zeros(0, np.intp))
    lines = data.splitlines()
    comments = np.array([k for k, line in enumerate(lines, start=1) if _COMMENT.match(line)], dtype=np.intp)
    data = _COMMENT.sub(b"", data)
    begin = next((k for k, line in enumerate(lines, start=1) if line.strip() and k not in set(comments[:1000])), 0)
    if not begin:
        return _Head("", 0, data, comments)
    first = lines[begin - 1].decode()
    if named:
        return _Head(first, begin - 1, data, comments)
    cells = first.split(_separator(first))
    above = [k for k in comments if k < begin]
    if above and _are_numbers(cells):
        words = [(k, lines[k - 1].decode().lstrip(" \t#%")) for k in above[-2:]]
        fitting = [(k, text) for k, text in words if len(text.split(_separator(text))) == len(cells)]
        row, last = fitting[-1] if fitting else (0, "")
        if len(fitting) == 2 and is_unit_line(re.split(r"[,;\t]", last)):
            return _Head(fitting[0][1], begin - 1, data, comments, last, int(row))
        if row == above[-1]:
            return _Head(last, begin - 1, data, comments)
    return _Head(first, begin, data, comments)


def _float(text: str, decimal: str) -> float:
    """The number that a cell holds, nan if it is none."""
    try:
        return float(text.replace(decimal, ".").replace("_", "?"))
    except ValueError:
        return float("nan")


def _short(text: str) -> str:
    line = (text.splitlines() or [""])[0]
    return repr(line if len(line) <= 80 else line[:77] + "...")


def _named(names: Any) -> str:
    return ", ".join(map(str, names))[:300]
