"""The words of each command, in one file each: `make golden` writes tests/golden/COMMAND.txt, which is compared here.

Numbers are left out, and so is all space but a blank: other tests assert codes and numbers.
"""

from __future__ import annotations

import re
from pathlib import Path
from unittest.mock import patch

import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.terminal import screen

GOLDEN = Path(__file__).parent / "golden"
SHORT = "--set solver.duration=0.1"
COMMANDS = {
    "simulate": (
        f"single-pendulum {SHORT}",
        "single-pendulum --at 0.1 --no-verify",
        f"single-pendulum {SHORT} --tolerance 1e-3",
        "single-pendulum --set solver.integrator=rk4 --set solver.step=0.3 --set solver.energy_tolerance=1e-9",
        "single-pendulum --set solver.integrator=dop853 --set solver.max_steps=3",
        "single-pendulum --set solver.step=-1",
        "single-pendulum --at 0.2,0.1",
        "single-pendulum --tolerance 1e-3 --no-verify",
        "single-pendulums",
    ),
    "statics": (
        "single-pendulum",
        "single-pendulum --set initial.OA.angle=1.5707963267948966",
        "single-pendulum --time -1",
    ),
    "modes": (
        "single-pendulum",
        "single-pendulum --about start",
        "single-pendulum --set initial.OA.rate=1",
        "single-pendulum --speeds 0,1",
        "single-pendulum --about noon",
    ),
    "linearize": ("andrews-squeezer --inputs motor --about start", "single-pendulum --inputs motor"),
    "reactions": ("single-pendulum --at 0.1", "single-pendulum --at -1"),
    "sweep": (
        f"single-pendulum --vary initial.OA.angle=0:1:3 {SHORT}",
        "single-pendulum --vary initial.OA.angle=0:1",
    ),
    "compare": (f"single-pendulum --engines gauss {SHORT}", "single-pendulum --engines gauss,other"),
    "uncertain": (
        f"single-pendulum --vary initial.OA.angle=0.1:0.2 {SHORT}",
        f"single-pendulum --vary initial.OA.angle=0.1:0.2 --limit 'A.y<-0.9' {SHORT}",
        "single-pendulum --vary initial.OA.angle=0.2:0.1",
        "single-pendulum --vary initial.OA.angle=0.1:0.2 --target 0.1",
    ),
    "identify": ("paper-case-1 --hold-out 1", "paper-case-1 --seed -1", "paper-case-0"),
    "design": ("paper-case-1 --noise -1",),
    "export": ("single-pendulum --to step",),
}
"""Arguments of each command; its help is written as well."""


def words(command: str) -> str:
    """Return what a command prints for its arguments, without numbers."""
    parts = []
    for line in ("--help", *COMMANDS[command]):
        arguments = [one.strip("'") for one in line.split()]
        with patch.object(screen.out, "_width", 200):  # where no number is so long that a heading folds
            run = CliRunner().invoke(main, [command, *arguments], prog_name="shoal", terminal_width=80)
        said = [one for one in run.stderr.splitlines() if one.startswith(("shoal:", "note"))]
        text = "\n".join([run.stdout, *said])
        parts.append(f"$ shoal {command} {line}\n{_plain(text)}\nexit status {run.exit_code}\n")
    return "\n".join(parts)


def _plain(text: str) -> str:
    text = re.sub(r"(?<![\w.])[-+]?\d[\d.]*(e[-+]?\d+)?(?!\w)", "#", text)
    lines = (re.sub(r"[\s─━┏┓┗┛┡┩┃│└┘┴┬┼┳╇]+", " ", line).strip() for line in text.splitlines())
    return "\n".join(filter(None, lines))


@pytest.mark.parametrize("command", COMMANDS)
def test_the_words_of_a_command_are_those_of_its_file(command: str) -> None:
    assert words(command) == (GOLDEN / f"{command}.txt").read_text(), "`make golden` writes the files anew"


if __name__ == "__main__":
    GOLDEN.mkdir(exist_ok=True)
    for name in COMMANDS:
        (GOLDEN / f"{name}.txt").write_text(words(name))
