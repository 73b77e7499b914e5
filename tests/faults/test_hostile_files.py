"""Scene files that somebody made to do harm: refused in one line, with exit status 2, little time and little memory."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.scene.load import LARGEST, load_scene, scene_library

SECONDS = 5.0
"""Of processor time; a tenth of a second is used."""
MEBIBYTES = 200
PENDULUM = (scene_library() / "single-pendulum.yaml").read_text(encoding="utf-8")
LEVELS = range(1, 40)


def torque(expression: str) -> str:
    """A pendulum driven by a function of time."""
    return f"{PENDULUM}loads: {{m: {{kind: torque, at: {{body: OA, point: end}}, torque: '{expression}'}}}}\n"


def tenfold(k: int, what: str) -> str:
    return f"a{k}: &a{k} {what.replace('*', ', '.join([f'*a{k - 1}'] * 10))}\n"


HOSTILE = {
    "lists-of-aliases": ("a0: &a0 [x]\n" + "".join(tenfold(k, "[*]") for k in LEVELS), "values"),
    "merged-aliases": ("a0: &a0 {x: 1}\n" + "".join(tenfold(k, "{<<: [*]}") for k in LEVELS), "values"),
    "an-alias-within-itself": ("a: &a [*a]", "stands within"),
    "deep-brackets": ("[" * 1_000_000, "nested deeper"),
    "deep-braces": ("{a: " * 200_000, "nested deeper"),
    "deep-dashes": ("- " * 500_000, "nested deeper"),
    "deep-keys": ("? " * 500_000, "nested deeper"),
    "large": ("a: " + "x" * 50_000_000, "larger than"),
    "nan": (PENDULUM.replace("mass: 1.0", "mass: .nan"), "finite"),
    "infinity": (PENDULUM.replace("mass: 1.0", "mass: 1e999"), "mass"),
    "python": (PENDULUM + "x: !!python/object/apply:os.system [id]\n", "constructor"),
    "a-million-digits": (PENDULUM.replace("mass: 1.0", "mass: " + "9" * 1_000_000), "a number of"),
    "base-sixty": ("a: " + "1:" * 400_000 + "1", "a number of"),
    "hexadecimal": (PENDULUM.replace("mass: 1.0", "mass: 0x" + "f" * 900_000), "a number of"),
    "a-tower-of-powers": (torque("9**9**9**9*t"), "finite"),
    "too-fast": (torque("sin(1e12*t)"), "varies too fast"),
    "long-expression": (torque("+".join("t" * 300)), "longer than"),
    "code": (torque('__import__("os").system("id")'), "torque"),
    "attributes": (torque("t.__class__"), "torque"),
}


@pytest.fixture(scope="module", autouse=True)
def _warm() -> None:
    """What the first simulation loads is start-up."""
    CliRunner().invoke(main, ["simulate", "single-pendulum", "--at", "0.01"])


@pytest.fixture
def _little_memory() -> Iterator[None]:
    """Memory beyond the limit is a MemoryError, which is no line of ours."""
    kind = resource.RLIMIT_DATA
    before = resource.getrlimit(kind)
    used = int(next(x for x in Path("/proc/self/status").read_text().splitlines() if x.startswith("VmData")).split()[1])
    resource.setrlimit(kind, (used * 1024 + MEBIBYTES * 2**20, before[1]))
    yield
    resource.setrlimit(kind, before)


@pytest.mark.usefixtures("_little_memory")
@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_scene(name: str, tmp_path: Path) -> None:
    text, word = HOSTILE[name]
    path = tmp_path / f"{name}.yaml"
    path.write_text(text, encoding="utf-8")
    begin = time.process_time()
    result = CliRunner().invoke(main, ["simulate", str(path)])
    assert time.process_time() - begin < SECONDS
    assert (result.exit_code, result.stdout) == (2, ""), result.exception
    assert len(result.stderr.splitlines()) == 1
    assert len(result.stderr) < 500
    assert word in result.stderr


def test_neither_a_pipe_nor_a_device_is_read(tmp_path: Path) -> None:
    """A pipe would never end, and neither would /dev/zero."""
    os.mkfifo(tmp_path / "pipe.yaml")
    (tmp_path / "zero.yaml").symlink_to("/dev/zero")
    for name in ("pipe.yaml", "zero.yaml"):
        result = CliRunner().invoke(main, ["simulate", str(tmp_path / name)])
        assert result.exit_code == 2
        assert "not a file" in result.stderr


@pytest.mark.parametrize("what", ["pipe", "zero", "folder"])
def test_a_recording_that_is_no_file_is_not_read(what: str, tmp_path: Path) -> None:
    """The description of a recording too: nobody writes into the pipe."""
    path = tmp_path / f"{what}.yaml"
    {"pipe": os.mkfifo, "zero": lambda p: p.symlink_to("/dev/zero"), "folder": Path.mkdir}[what](path)
    result = CliRunner().invoke(main, ["identify", "kaheman-single", "--data", str(path)])
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr == f"shoal: {path}: cannot be read: not a file\n"


SIGNALLED = """name: s
bodies: {OA: {kind: rigid-rod, length: 1.0, mass: 1.0}}
joints: {O: {first: {body: ground, point: [0, 0]}, second: {body: OA}}}
markers: {A: {body: OA, point: end}}
initial: {OA: {angle: 0.1}}
"""
TORQUE = "loads: {m: {kind: torque, at: {body: OA}, torque: {path: pipe.csv, column: x}}}"


def test_no_option_or_field_waits_for_a_pipe(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody writes into it, and no time limit would end the wait."""
    monkeypatch.chdir(tmp_path)
    for name in ("pipe.csv", "pipe.json", "pipe.bin"):
        os.mkfifo(name)
    Path("signal.yaml").write_text(SIGNALLED + TORQUE)
    Path("from.yaml").write_text(SIGNALLED.replace("OA: {angle: 0.1}", "from: pipe.json"))
    for arguments in (
        ["identify", "kaheman-single", "--data", "pipe.csv", "--time-limit", "5"],
        ["identify", "kaheman-single", "--values", "pipe.json"],
        ["simulate", "signal.yaml"],
        ["simulate", "from.yaml"],
        ["uncertain", "single-pendulum", "--vary", "initial.OA.angle~empirical(pipe.csv)"],
        ["uncertain", "single-pendulum", "--vary", "initial.OA.angle=0:1", "--checkpoint", "pipe.bin"],
    ):
        result = CliRunner().invoke(main, arguments)
        assert (result.exit_code, result.stdout) == (2, ""), (arguments, result.exception)
        assert len(result.stderr.splitlines()) == 1
        assert "cannot be read: a pipe, which may never end; save it to a file first" in result.stderr, result.stderr


def test_what_is_just_not_too_much_is_read(tmp_path: Path) -> None:
    """A table of the most rows, a scene that uses aliases, and a file of the largest size."""
    rows = ", ".join(f"[{k / 1000:.3f}, {k % 7}.25]" for k in range(20_000))
    path = tmp_path / "table.yaml"
    path.write_text(torque("0").replace("torque: '0'", f"torque: {{table: [{rows}], smooth: false}}"))
    assert len(load_scene(str(path)).loads["m"].torque.table) == 20_000  # type: ignore[union-attr, arg-type]
    aliased = PENDULUM.replace("mass: 1.0", "mass: &m 1.0").replace("inertia: 0.0", "inertia: *m")
    path.write_text(aliased + "#" * (LARGEST - len(aliased)))
    assert load_scene(str(path)).bodies["OA"].inertia == 1.0  # type: ignore[union-attr]
    path.write_text(aliased + "#" * (LARGEST - len(aliased) + 1))
    assert CliRunner().invoke(main, ["simulate", str(path)]).exit_code == 2
