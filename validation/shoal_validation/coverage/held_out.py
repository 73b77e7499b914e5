"""`python -m shoal_validation.coverage.held_out DATA [--every N]`.

Fits windows of the recordings of real machines in the folder DATA (Kaheman's single and double pendulum, the filmed
ones of IBM), each all along its recording, holds out the last fifth of every window and prints how many of these are
predicted as well as the estimate states. --every N takes every N-th window; all of them take an hour.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from shoal.errors import ComputationError, InputError
from shoal.identification import Problem, identify, load_problem

from shoal_validation.document import table

_SETS = (
    ("kaheman-single", "multiarm_kaheman/single_1kHz.csv.gz", 2.5, np.arange(0.0, 52.0, 2.5)),
    ("kaheman-double", "multiarm_kaheman/double_1kHz.csv.gz", 1.0, np.arange(0.0, 78.0, 3.0)),
    *(("ibm-double-pendulum", f"ibm_double_pendulum/{run}.csv.gz", 1.0, np.arange(0.0, 15.0, 3.0)) for run in range(5)),
)
"""Problem, file, length of a window [s] and where windows begin [s]."""
_HELD = 0.2
"""Of a window, at its end."""


def outcomes(data: Path, every: int) -> Iterator[tuple[str, bool | None, float]]:
    """Of each window: the problem, whether it is predicted as stated, and the worst RMS over its limit."""
    windows = [(name, file, length, begin) for name, file, length, begins in _SETS for begin in begins.tolist()]
    for name, file, length, begin in windows[::every]:
        stated = load_problem(name).model_dump(mode="json", exclude_none=True)
        stated["source"] |= {"start": begin, "duration": length}
        held = (begin + (1.0 - _HELD) * length, begin + length)
        try:
            found = identify(Problem.parse(stated, name), data=str(data / file), hold_out=[held])
        except (InputError, ComputationError):
            continue
        for one in found.prediction:
            yield name, one.inside, max((c.rms / c.limit for c in one.channels), default=np.nan)


def main(arguments: list[str]) -> None:
    """Predict and print."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.coverage.held_out", description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--every", type=int, default=1)
    chosen = parser.parse_args(arguments)
    found = list(outcomes(chosen.data, chosen.every))
    rows = []
    for name in dict.fromkeys(name for name, _, _ in found):
        mine = [(inside, ratio) for problem, inside, ratio in found if problem == name]
        told = [ratio for inside, ratio in mine if inside is not None]
        inside = sum(inside is True for inside, _ in mine)
        middle, largest = (f"{x:.2f}" for x in (np.median(told), np.max(told))) if told else ("", "")
        rows.append((name, str(len(mine)), str(len(mine) - len(told)), str(inside), middle, largest))
    head = ("problem", "windows", "no limit told", "inside", "median RMS over limit", "largest")
    sys.stdout.write(table(head, rows) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
