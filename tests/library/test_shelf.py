"""Entries are there as a whole or not at all, below the library's folder, whoever writes at the same time."""

from __future__ import annotations

import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shoal.errors import InputError
from shoal.shelf import NAME, Shelf, check_files, version_of

FEW = settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
WRITE = """
import sys
from pathlib import Path
from shoal.shelf import Shelf
shelf, who = Shelf(Path(sys.argv[1])), sys.argv[2]
for k in range(40):
    shelf.put("scenes", "both", {"both.yaml": f"{who} {k}".encode()})
    shelf.put("scenes", f"{who}-{k}", {f"{who}-{k}.yaml": b"own"})
"""


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    return Shelf(tmp_path / "library")


def put(shelf: Shelf, name: str, text: str = "x") -> str:
    return shelf.put("scenes", name, {f"{name}.yaml": text.encode()}).version


def test_a_name_stands_for_its_last_version_and_earlier_ones_stay(shelf: Shelf) -> None:
    first, second = put(shelf, "a", "1"), put(shelf, "a", "2")
    assert [entry.version for entry in shelf.entries("scenes")] == [second]
    assert shelf.versions("scenes", "a") == [first, second]
    old, now = shelf.find("scenes", f"a@{first}"), shelf.find("scenes", "a")
    assert old is not None
    assert now is not None
    assert (old.document.read_text(), now.document.read_text()) == ("1", "2")
    assert put(shelf, "a", "1") == first
    assert shelf.find("scenes", "a") == old
    shelf.remove("scenes", "a")
    assert shelf.find("scenes", f"a@{first}") is None
    assert not shelf.entries("scenes")


@FEW
@given(st.text(max_size=80))
def test_any_text_is_refused_or_names_an_entry_of_the_folder(tmp_path: Path, name: str) -> None:
    shelf = Shelf(tmp_path / "library")
    assert shelf.find("scenes", name) is None or NAME.fullmatch(name)
    if NAME.fullmatch(name):
        put(shelf, name)
        assert shelf.find("scenes", name) is not None
    else:
        with pytest.raises(InputError, match="name: ") as refusal:
            put(shelf, name)
        assert "\n" not in str(refusal.value)
    assert {path.name for path in tmp_path.iterdir()} <= {"library"}
    assert {path.name for path in shelf.root.glob("*")} <= {"scenes", ".lock"}


@FEW
@given(st.lists(st.text("ab/.\\\0~ é-", max_size=70), max_size=5))
def test_files_lie_below_their_entry_or_are_refused(tmp_path: Path, paths: list[str]) -> None:
    shelf, files = Shelf(tmp_path / "library"), {"a.yaml": b"x", **dict.fromkeys(paths, b"y")}
    try:
        check_files("a", files)
    except InputError:
        return  # each way to be wrong has a test of its own below
    entry = shelf.put("scenes", "a", files)
    assert entry.files() == files
    assert {path.name for path in tmp_path.iterdir()} == {"library"}


@pytest.mark.parametrize(
    "path",
    ["../a", "/etc/a", "a/../../b", "a//b", ".a", "a/.b", "a\\b", "a\nb", "x" * 80, "a/b/c/d/e", "", "~", "a.yaml/b"],
)
def test_paths_that_are_not_plain_are_refused(shelf: Shelf, path: str) -> None:
    with pytest.raises(InputError, match="files: "):
        shelf.put("scenes", "a", {"a.yaml": b"x", path: b"y"})
    assert not shelf.entries("scenes")


def test_links_are_not_followed_out_of_the_folder(shelf: Shelf, tmp_path: Path) -> None:
    version = put(shelf, "a")
    outside = tmp_path / "outside"
    (outside / version).mkdir(parents=True)
    (outside / version / "b.yaml").write_text("secret")
    (outside / "current").write_text(version)
    os.symlink(outside, shelf.root / "scenes" / "b")
    assert shelf.find("scenes", "b") is None
    with pytest.raises(InputError, match="link"):
        put(shelf, "b")
    document = shelf.root / "scenes" / "a" / version / "a.yaml"
    document.unlink()
    os.symlink(outside / version / "b.yaml", document)
    assert shelf.find("scenes", "a") is None
    (shelf.root / "scenes" / "a" / "current").write_text("../../../outside")
    assert shelf.find("scenes", "a") is None
    assert sorted(path.name for path in outside.iterdir()) == sorted([version, "current"])


def test_what_is_refused_leaves_nothing(shelf: Shelf) -> None:
    def refuse(document: Path) -> None:
        assert document.read_text() == "x"
        raise InputError("no")

    with pytest.raises(InputError, match="no"):
        shelf.put("scenes", "a", {"a.yaml": b"x"}, refuse)
    assert [path.name for path in shelf.root.rglob("*")] == []


def test_a_changed_file_is_noticed(shelf: Shelf) -> None:
    put(shelf, "a")
    (entry,) = shelf.entries("scenes")
    entry.document.write_text("changed")
    with pytest.raises(InputError, match="changed by hand"):
        entry.files()


def test_a_folder_that_cannot_be_written_to_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="SHOAL_LIBRARY: cannot write"):
        put(Shelf(tmp_path / "file"), "a")
    assert Shelf(tmp_path / "file").entries("scenes") == []


def test_two_processes_that_write_at_once_lose_nothing(shelf: Shelf) -> None:
    """Each of their versions of the same name is there, the name stands for one of them, and all other names are."""
    command = [sys.executable, "-c", WRITE, str(shelf.root)]
    running = [subprocess.Popen([*command, who]) for who in ("one", "two")]
    seen = set()
    while any(process.poll() is None for process in running):
        for entry in shelf.entries("scenes"):
            assert entry.files()  # raises where it is not whole
            seen.add(entry.name)
    assert [process.returncode for process in running] == [0, 0]
    names = {f"{who}-{k}" for who in ("one", "two") for k in range(40)}
    assert {entry.name for entry in shelf.entries("scenes")} == {"both", *names}
    versions = {version_of({"both.yaml": f"{who} {k}".encode()}) for who in ("one", "two") for k in range(40)}
    assert set(shelf.versions("scenes", "both")) == versions
    assert seen


def test_one_puts_while_another_removes(shelf: Shelf) -> None:
    def work(k: int) -> None:
        if k % 2:
            put(shelf, "a", str(k))
        else:
            try:
                shelf.remove("scenes", "a")
            except InputError:
                assert k >= 0  # it was not there

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(work, range(200)))
    for entry in shelf.entries("scenes"):
        assert entry.files()
    assert {path.name for path in shelf.root.glob("*")} <= {"scenes", ".lock"}
