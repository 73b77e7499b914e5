"""No room for a result: one clear line, exit status 3, and the file that was there before stays whole."""

from __future__ import annotations

import os
import resource
import shlex
import stat
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from click.testing import CliRunner
from shoal.atomic_write import atomic_write
from shoal.cli import main
from shoal.errors import ComputationError

# Files may grow to so many bytes, which every process may decide for itself; a full disk says it with another word.
ROOM = 2000
PROGRAM = f"""
import resource, sys
from shoal.cli import main
sys.dont_write_bytecode = True
resource.setrlimit(resource.RLIMIT_FSIZE, ({ROOM}, {ROOM}))
main(sys.argv[1:])
"""


@contextmanager
def little_room() -> Iterator[None]:
    before, written = resource.getrlimit(resource.RLIMIT_FSIZE), sys.dont_write_bytecode
    # Python would cut its compiled modules off as well, and fail on them ever after.
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (ROOM, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        sys.dont_write_bytecode = written


def limited(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", PROGRAM, *arguments], capture_output=True, text=True, check=False)


@pytest.mark.parametrize("ending", ["csv", "html"])
def test_a_result_is_written_whole_or_not_at_all(ending: str, tmp_path: Path) -> None:
    out = tmp_path / f"result.{ending}"
    out.write_text("yesterday's")
    with little_room():
        ended = CliRunner().invoke(main, ["simulate", "flexible-double-pendulum", "--no-verify", "--out", str(out)])
    assert (ended.exit_code, ended.stdout) == (3, "")
    assert ended.stderr == f"shoal: out: {out} cannot be written: File too large\n"
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [(out.name, "yesterday's")]


@pytest.mark.parametrize("ending", ["csv", "json"])
def test_a_name_that_leaves_no_room_for_more_is_a_name(ending: str, tmp_path: Path) -> None:
    """255 bytes; what is written beside it first has a shorter one. One byte more is told."""
    out = tmp_path / f"{'a' * (254 - len(ending))}.{ending}"
    with atomic_write(out) as part:
        part.write_text("all")
    assert out.read_text() == "all"
    with (
        pytest.raises(ComputationError, match="cannot be written: File name too long"),
        atomic_write(out.with_stem("a" * 255)),
    ):
        pass
    assert [path.name for path in tmp_path.iterdir()] == [out.name]


def test_a_link_to_itself_is_no_file(tmp_path: Path) -> None:
    out = tmp_path / "loop.csv"
    out.symlink_to(out)
    ended = CliRunner().invoke(main, ["simulate", "single-pendulum", "--out", str(out)])
    assert (ended.exit_code, ended.stdout) == (2, "")
    assert ended.stderr == f"shoal: out: {out} cannot be written: Too many levels of symbolic links\n"
    with pytest.raises(ComputationError, match="symbolic links"), atomic_write(out):
        pass


def test_a_pipe_is_written_into_and_stays_one(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.csv"
    os.mkfifo(pipe)
    reader = subprocess.Popen(["cat", pipe], stdout=subprocess.PIPE)
    with atomic_write(pipe) as part:
        part.write_text("all of it")
    assert reader.communicate(timeout=10)[0] == b"all of it"
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_shell_may_close_the_output() -> None:
    command = f'{shlex.quote(sys.executable)} -c "from shoal.cli import main; main()" scenes single-pendulum >&-'
    ended = subprocess.run(["bash", "-c", command], capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_a_unit_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    out = tmp_path / "result.fmu"
    with little_room():
        ended = CliRunner().invoke(main, ["export-fmu", "single-pendulum", "--out", str(out)])
    assert (ended.exit_code, ended.stdout) == (3, ""), ended.exception
    assert len(ended.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_standard_output_on_a_full_disk() -> None:
    command = [sys.executable, "-c", "from shoal.cli import main; main()", "scenes", "single-pendulum"]
    with Path("/dev/full").open("w") as full:
        ended = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, text=True, check=False)
    assert (ended.returncode, ended.stderr) == (3, "shoal: cannot write: No space left on device\n")


def test_no_room_for_a_kernel_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Machine code is larger than the room; the line names the folder and what chooses another."""
    import shoal.mechanics  # noqa: F401 - kernels are compiled its way
    from numba.core import config

    monkeypatch.setattr(config, "CACHE_DIR", str(tmp_path / "cache"))
    (tmp_path / "some.py").write_text("from numba import njit\n@njit(cache=True)\ndef twice(x):\n    return 2 * x\n")
    monkeypatch.syspath_prepend(tmp_path)
    from some import twice

    with (
        little_room(),
        pytest.raises(ComputationError, match=r"^compiled kernels cannot be kept in .*/cache: File too"),
    ):
        twice(1.5)


@pytest.mark.slow
def test_no_room_for_the_kernels_of_a_flow(tmp_path: Path) -> None:
    """The process that prepares the workers says why as well."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path / "cache"), "SHOAL_HOME": str(tmp_path / "home")}
    program = PROGRAM.replace("main(sys.argv", "sys.argv[0] = ''; main(sys.argv").replace(
        f"{ROOM}, {ROOM}", "300_000, -1"
    )
    command = [sys.executable, "-c", program, "run", "forward", "--json"]
    ended = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (ended.returncode, ended.stdout) == (3, "")
    assert ended.stderr.splitlines()[-1].startswith(f"shoal: compiled kernels cannot be kept in {tmp_path / 'cache'}: ")
    assert "Traceback" not in ended.stderr


@pytest.mark.slow
def test_a_checkpoint_on_a_full_disk(tmp_path: Path) -> None:
    """The run ends with a line that names the file; what is kept so far is read again."""
    kept = tmp_path / "kept"
    command = ("identify", "paper-case-1", "--method", "least-squares", "--checkpoint", str(kept))
    ended = limited(*command)
    assert (ended.returncode, ended.stdout) == (3, "")
    line = f"shoal: checkpoint: {kept} cannot be written: File too large"
    assert ended.stderr == f"{line}\n"
    assert kept.stat().st_size <= ROOM
    again = limited(*command)
    assert again.stderr.splitlines()[-1] == line


def test_what_fails_otherwise_leaves_nothing(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"

    def fails() -> None:
        with atomic_write(target) as path:
            path.write_text("half")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fails()
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ComputationError, match=r"out: .* cannot be written"), atomic_write(target / "b.txt") as path:
        path.write_text("x")
    with atomic_write(target) as path:
        path.write_text("all")
    assert target.read_text() == "all"
