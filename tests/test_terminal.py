"""What a command prints fits 80 columns on a terminal, is plain in a log file, and a mistake is one line."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import socket
import struct
import subprocess
import sys
import termios
from collections.abc import Callable
from functools import cache
from io import StringIO
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from rich.console import Console
from shoal.cli import main
from shoal.compile import progress
from shoal.doctor import Check
from shoal.engines import get_engine
from shoal.engines.compare import compare
from shoal.engines.sweep import sweep
from shoal.identification import Estimate, identify, load_problem
from shoal.identification.design import design
from shoal.mechanics import warm
from shoal.mechanics.analysis.campbell import campbell
from shoal.mechanics.analysis.modes import modes
from shoal.mechanics.analysis.reactions import reactions
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.runs import Runs
from shoal.scene import Scene, load_scene
from shoal.selection import Selection, select
from shoal.terminal import screen, tables

WIDTH = 80
CONTROL = re.compile(r"[\x00-\x09\x0b-\x1f\x7f]")
PENDULUM, DOUBLE = "single-pendulum", load_scene("rigid-double-pendulum")
SPATIAL = DOUBLE.with_values({"dimensions": 3})
ROTOR = Scene.parse(
    {
        "name": "rotor",
        "gravity": [0.0, 0.0],
        "bodies": {"disc": {"kind": "rigid-body", "mass": 2.0, "inertia": 0.1}},
        "loads": {
            name: {"kind": "spring", "first": {"body": "ground", "point": place}, "second": {"body": "disc"},
                   "stiffness": 1e4 / 3}
            for name, place in {"x": [1.0, 0.0], "y": [0.0, 1.0]}.items()
        },
        "markers": {"m": {"body": "disc"}},
        "initial": {"disc": {"position": [0.0, 0.0], "rate": 100.0}},
    }
)  # fmt: skip
ANGLES = {path: np.array([0.1, 1.0]) for path in ("initial.OA.angle", "initial.AB.angle")}


@cache
def chosen() -> Selection:
    return select(load_scene("flexible-double-pendulum"), 0.1, [0.1])


@cache
def found() -> Estimate:
    return identify(load_problem("paper-case-1"), method="least-squares")


def squeezed() -> None:
    scene = load_scene("andrews-squeezer")
    tables.trajectory_table(get_engine("gauss").simulate(scene, [1e-3]), scene)
    tables.reactions_table(reactions(scene, [1e-3]))


TABLES: dict[str, Callable[[], None]] = {
    "trajectory, reactions": squeezed,
    "selection": lambda: tables.selection_table(chosen()),
    "sweep": lambda: tables.sweep_table(sweep(DOUBLE, ANGLES, get_engine("gauss"), 0.1)),
    "comparison": lambda: tables.comparison_table(compare(DOUBLE, ["gauss", "casadi"], [0.1])),
    "equilibrium": lambda: tables.equilibrium_table(statics(DOUBLE)),
    "modes": lambda: tables.modes_table(modes(DOUBLE)),
    "modes of a rotor": lambda: tables.modes_table(modes(ROTOR)),
    "Campbell diagram": lambda: tables.modes_table(campbell(ROTOR, [0.0, 123.456])),
    "sweep in space": lambda: tables.sweep_table(sweep(SPATIAL, ANGLES, get_engine("gauss"), 0.1)),
    "comparison in space": lambda: tables.comparison_table(compare(SPATIAL, ["gauss", "tree"], [0.1])),
    "equilibrium in space": lambda: tables.equilibrium_table(statics(SPATIAL)),
    "reactions in space": lambda: tables.reactions_table(reactions(SPATIAL, [0.1])),
    "modes in space": lambda: tables.modes_table(modes(SPATIAL)),
    "estimate": lambda: tables.estimate_table(found()),
    "design": lambda: tables.design_table(design(load_problem("paper-case-1"), noise=1e-3)),
}
PROSE: dict[str, Callable[[], None]] = {
    "doctor": lambda: tables.doctor_table([Check("MLflow server", False, "does not answer", "start it " * 12)]),
    "listing": lambda: screen.listing("scenes", {"flexible-double-pendulum-hanging": "a description " * 12}),
}


def printed(draw: Callable[[], None], monkeypatch: pytest.MonkeyPatch, width: int, *, log: bool = False) -> str:
    """What a table prints on a terminal of a width, or in a log file."""
    stream = StringIO()
    kind = None if log else True
    monkeypatch.setattr(screen, "out", Console(file=stream, width=width, force_terminal=kind, highlight=False))
    draw()
    return stream.getvalue()


def lines(text: str) -> int:
    """Lines of tables below their rulers, up to the next line that is blank."""
    counts = [0, 0]
    below = False
    for line in text.splitlines():
        below = ("─" in line or below) and bool(line.strip())
        counts[below] += 1
    return counts[True]


@pytest.mark.parametrize("what", [*TABLES, *PROSE])
@pytest.mark.by_day(3)
def test_table_fits_a_terminal_and_a_log_file(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    draw = (TABLES | PROSE)[what]
    text = re.sub(r"\x1b\[[0-9;]*m", "", printed(draw, monkeypatch, WIDTH))
    assert max(map(len, text.splitlines())) <= WIDTH
    assert CONTROL.search(text) is None
    logged = printed(draw, monkeypatch, WIDTH, log=True)
    assert CONTROL.search(logged) is None


@pytest.mark.parametrize("what", TABLES)
@pytest.mark.by_day(3)
def test_no_row_is_folded(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A table has as many lines below its headings as with more room."""
    few, many = (lines(printed(TABLES[what], monkeypatch, width)) for width in (WIDTH, 200))
    assert few == many
    assert few > 0


@pytest.mark.parametrize("what", TABLES)
@pytest.mark.by_day(3)
def test_no_number_is_broken_on_a_narrow_terminal(what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What has no room beside each other stands below each other: no number of the wide table is broken."""
    wide, narrow = (printed(TABLES[what], monkeypatch, width, log=True) for width in (200, 40))
    below = re.split(r"\n\s*\n", wide[wide.index("─") :])[0]
    numbers = re.findall(r"(?<![\w.])-?\d+\.\d+(?:e[-+]\d+)?(?![\w.])", below)
    assert set(numbers) <= set(re.findall(r"-?\d+\.\d+(?:e[-+]\d+)?", narrow))


def test_a_rejected_run_shows_no_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not even plausible ones."""
    scene = DOUBLE.with_values({"solver.step": 0.5, "solver.integrator": "rk4"})
    run = get_engine("gauss").simulate(scene, [2.0])
    assert not run.ok
    text = printed(lambda: tables.trajectory_table(run, scene), monkeypatch, WIDTH, log=True)
    assert "no places are shown, as the run is rejected" in text
    assert f"status {run.status[0]}" in text
    assert " marker " not in text


def test_numbers_have_their_units(monkeypatch: pytest.MonkeyPatch) -> None:
    """Brackets are no markup."""
    estimated = printed(TABLES["estimate"], monkeypatch, WIDTH, log=True)
    for words in ("theta1 [rad] ", " m (RMS for each channel), ", " m², RMS ", " m for each place or angle; "):
        assert words in estimated
    assert "OA.angle [rad]" in printed(TABLES["sweep"], monkeypatch, WIDTH, log=True)


@pytest.mark.parametrize("command", [[], *([name] for name in main.list_commands(click.Context(main)))])
def test_help_fits(command: list[str]) -> None:
    result = CliRunner().invoke(main, [*command, "--help"], env={"COLUMNS": str(WIDTH)})
    assert result.exit_code == 0
    assert max(map(len, result.stdout.splitlines())) <= WIDTH


COMMAND = [str(Path(sys.executable).with_name("shoal")), "simulate", PENDULUM, "--at", "0.1", "--no-verify"]
COMMAND += ["--engine", "exudyn"]  # nothing has to be compiled or loaded for it


def test_a_command_into_a_file_shows_no_progress() -> None:
    done = subprocess.run(COMMAND, capture_output=True, text=True, check=True)
    assert CONTROL.search(done.stdout) is None
    assert done.stderr == ""


def test_a_command_on_a_real_terminal_stays_within_it() -> None:
    """Its progress and its answer."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, WIDTH, 0, 0))
    environment = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "NO_COLOR")} | {"TERM": "xterm"}
    with subprocess.Popen(COMMAND, stdin=theirs, stdout=theirs, stderr=theirs, env=environment) as running:
        os.close(theirs)
        seen = b""
        while piece := _read(ours):
            seen += piece
    os.close(ours)
    assert running.returncode == 0
    text = re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", seen.decode())
    assert "status ok" in text
    assert "simulating" in text
    assert max(len(line) for part in text.split("\n") for line in part.split("\r")) <= WIDTH


def _read(terminal_end: int) -> bytes:
    try:
        return os.read(terminal_end, 65536)
    except OSError:  # the other end is closed
        return b""


FIND = """
name: find
scene: single-pendulum
parameters: {angle: {path: initial.OA.angle, lower: -3.0, upper: 3.0}}
channels: [{marker: A, quantity: x, column: x}, {marker: A, quantity: y, column: y}]
source: {kind: file}
"""
FILES = {
    "find.yaml": FIND,
    "unit.yaml": FIND.replace("column: x", "column: x, unit: deg"),
    "path.yaml": FIND.replace("OA.angle", "OB.angle"),
    "bounds.yaml": FIND.replace("-3.0", "4.0"),
    "marker.yaml": FIND.replace("marker: A, quantity: y", "marker: Z, quantity: y"),
    "text.yaml": "hello",
    "broken.yaml": "a: [1",
    "nothing.yaml": "",
    "empty.csv": "t,x,y\n",
    "nan.csv": "t,x,y\n0,nan,0\n0.1,nan,0.1\n0.2,nan,0.2\n",
    "other.json": "{}",
}
MISTAKES = {
    "simulate missing.yaml": "missing.yaml",
    "simulate no-such-scene": "one of andrews-squeezer",
    "simulate folder": "one of andrews-squeezer",
    "simulate text.yaml": "a mapping of fields",
    "simulate broken.yaml": "line 2",
    "simulate nothing.yaml": "a mapping of fields",
    f"simulate {PENDULUM} --set bodies.OA.maas=1": "bodies.OA has kind, mass",
    f"simulate {PENDULUM} --set bodies.OA.mass=-1": "greater than 0",
    f"simulate {PENDULUM} --set initial.OA.angle=90": "in degrees?",
    f"simulate {PENDULUM} --set bodies": "PATH=VALUE",
    f"simulate {PENDULUM} --engine ode45": "there are gauss",
    f"simulate {PENDULUM} --at a,b": "such as 0.1,0.2,0.5",
    f"simulate {PENDULUM} --at nan": "finite times in s",
    f"simulate {PENDULUM} --tolerance -1": "above 0 m",
    f"simulate {PENDULUM} --out x.pdf": "use one of .html",
    f"simulate {PENDULUM} --out missing/x.png": "does not exist",
    f"simulate {PENDULUM} --out folder": "is a directory",
    "simulate": "shoal simulate --help",
    f"simulat {PENDULUM}": "Did you mean 'simulate'?",
    "identify find.yaml": "--data FILE",
    "identify find.yaml --data missing.csv": "missing.csv",
    "identify find.yaml --data folder": "Is a directory",
    "identify find.yaml --data empty.csv": "at least 3",
    "identify find.yaml --data nan.csv": "column 'x' has no sample",
    "identify unit.yaml --data nan.csv": "one of m, cm, mm",
    "identify path.yaml --data nan.csv": "initial has OA",
    "identify bounds.yaml --data nan.csv": "not below upper",
    "identify marker.yaml --data nan.csv": "there are A",
    "identify paper-case-1 --method newton": "there are auto",
    "identify paper-case-1 --time-limit 0": "--time-limit: needs a time above 0 s, found 0",
    "report other.json": "--out FILE.json",
    f"sweep {PENDULUM} --vary initial.OA.angle=0:1": "such as initial.OA.angle=0:1.5:31",
    f"reactions {PENDULUM}": "--at",
    f"sweep {PENDULUM} --vary bodies.OA.mass=1:2:3 --at=-1": "--at: needs a time of at least 0 s, found -1",
    f"sweep {PENDULUM} --vary bodies.OA.mass=1:2:3 --at=nan": "--at: needs a time of at least 0 s, found nan",
    f"uncertain {PENDULUM} --vary bodies.OA.mass=1:2 --limit A.x>2 --limit-method foo": "there are auto, form",
    f"uncertain {PENDULUM} --vary bodies.OA.mass=1:2 --worst w.yaml --worst-of B.x.upper": "MARKER.QUANTITY.lower",
    "design paper-case-1 --noise 1e-3 --parameter foo": "there are theta1, theta2",
    "design paper-case-1 --noise 1e-3 --rate 0": "--rate: needs a frequency above 0 Hz, found 0",
    "scenes missing": "missing: no such scene or problem; see `shoal scenes`",
}


@pytest.mark.parametrize(("command", "advice"), MISTAKES.items(), ids=MISTAKES)
def test_a_mistake_is_one_line_that_says_what_is_right(
    command: str, advice: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Told before anything is compiled or simulated: nobody waits half a minute to hear of a misprint."""

    def wait(*_: Any, **__: Any) -> None:
        raise AssertionError("compiled or simulated first")

    monkeypatch.setattr(warm, "warm_for", wait)
    monkeypatch.setattr(Runs, "run", wait)
    monkeypatch.chdir(tmp_path)
    Path("folder").mkdir()
    for name, text in FILES.items():
        Path(name).write_text(text)
    result = CliRunner().invoke(main, command.split(), prog_name="shoal")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("shoal: ")
    assert result.stderr.count("\n") == 1
    assert advice in result.stderr


def test_a_port_in_use_is_one_line() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        result = CliRunner().invoke(main, ["serve", "gauss", "--port", str(taken.getsockname()[1])])
    assert result.exit_code == 2
    assert "Address already in use; choose another with --port" in result.stderr
    assert result.stderr.count("\n") == 1


def test_who_waits_for_the_compiler_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    heard = Console(file=StringIO(), width=80)
    monkeypatch.setattr(screen, "err", heard)
    with screen.working("simulating"):
        progress.report("  march of Leapfrog, single: 9.1 s")
    progress.report("  nobody listens")
    assert heard.file.getvalue() == "  march of Leapfrog, single: 9.1 s\n"  # type: ignore[attr-defined]


def test_no_table_breaks_a_word_at_any_width(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers and names of any length, drawn at random: every word stands whole in one line."""
    rng = np.random.default_rng(20)
    for _ in range(60):
        columns = int(rng.integers(1, 9))
        words = [
            [
                " ".join(f"{rng.normal() * 10.0 ** rng.integers(-12, 12):.{rng.integers(1, 9)}g}" for _ in range(count))
                for count in rng.integers(1, 4, columns)
            ]
            for _ in range(int(rng.integers(1, 4)))
        ]

        def draw(rows: list[list[str]] = words) -> None:
            table = screen.table("title", *(f"torque of {k} [N m]" for k in range(len(rows[0]))))
            for row in rows:
                table.add_row(*row)
            screen.out.print(table)

        text = printed(draw, monkeypatch, int(rng.integers(20, 140)), log=True)
        assert {word for row in words for cell in row for word in cell.split()} <= {*text.split()}
