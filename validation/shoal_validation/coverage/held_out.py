"""`python -m shoal_validation.coverage.held_out DATA [--record FILE] [--every N] [--page FILE]`.

Fits windows of the recordings of real machines in the folder DATA (Kaheman's single and double pendulum, the filmed
ones of IBM), each all along its recording, holds out the last fifth of every window and counts how many of these are
predicted as well as the estimate states. Each window is printed as it is done; --record keeps it in a file, so that the
study goes on where it was stopped. --every N takes every N-th window; all of them take an hour. The table goes to
standard output and, of all windows, into docs/verdict-charts.md.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from shoal.errors import ShoalError
from shoal.identification import Problem, identify, load_problem

from shoal_validation.document import publish, table
from shoal_validation.resumed import Found, resumed

_SETS = (
    ("kaheman-single", "multiarm_kaheman/single_1kHz.csv.gz", 2.5, np.arange(0.0, 52.0, 2.5)),
    ("kaheman-double", "multiarm_kaheman/double_1kHz.csv.gz", 1.0, np.arange(0.0, 78.0, 3.0)),
    *(("ibm-double-pendulum", f"ibm_double_pendulum/{run}.csv.gz", 1.0, np.arange(0.0, 15.0, 3.0)) for run in range(5)),
)
"""Problem, file, length of a window [s] and where windows begin [s]."""
_HELD = 0.2
"""Of a window, at its end."""
_SHOWN = {
    "kaheman-single": "single pendulum of Kaheman et al., 2.5 s",
    "kaheman-double": "double pendulum of Kaheman et al., 1 s",
    "ibm-double-pendulum": "filmed double pendulums of IBM, 1 s",
}


def cases() -> dict[str, tuple[str, str, float, float]]:
    """By its name, each window: problem, file, length and begin [s]."""
    return {
        f"{name} {file} {begin:g}": (name, file, length, begin)
        for name, file, length, begins in _SETS
        for begin in begins.tolist()
    }


def predicted(name: str, data: Path, length: float, begin: float) -> Found:
    """Fit all but the end of a window and predict that.

    inside: whether it is predicted as stated, None where no limit is told; why: why not; ratio: the worst RMS over its
    limit; plain: the worst over what noise and covariance alone expect; verdict; error: why nothing was found
    """
    stated = load_problem(name).model_dump(mode="json", exclude_none=True)
    stated["source"] |= {"start": begin, "duration": length}
    held = (begin + (1.0 - _HELD) * length, begin + length)
    try:
        found = identify(Problem.parse(stated, name), data=str(data), hold_out=[held])
    except ShoalError as error:
        return {"error": str(error)}
    (one,) = found.prediction
    ratios = [(c.rms / c.limit, c.rms / c.expected) for c in one.channels] if one.inside is not None else []
    worst, plain = np.max(ratios, axis=0).tolist() if ratios else (None, None)
    return {"inside": one.inside, "why": one.why, "ratio": worst, "plain": plain, "verdict": str(found.verdict)}


def report(found: list[tuple[str, Found]]) -> str:
    """The table: what could not be fitted, or has no limit, does not count as inside."""
    rows, inside, windows = [], 0, 0
    for name, shown in _SHOWN.items():
        mine = [one for key, one in found if key.startswith(f"{name} ")]
        told = [one["ratio"] for one in mine if one.get("ratio") is not None]
        held = sum(one.get("inside") is True for one in mine)
        inside, windows = inside + held, windows + len(mine)
        middle, largest = (f"{x:.2f}" for x in (np.median(told), np.max(told))) if told else ("", "")
        unfitted = sum("error" in one for one in mine)
        silent = len(mine) - unfitted - len(told)
        rows.append((shown, str(len(mine)), str(held), str(silent), str(unfitted), middle, largest))
    head = ("recording", "windows", "inside", "no limit", "not fitted", "median RMS over limit", "largest")
    return f"{table(head, rows)}\n\n{inside} of {windows} are inside, {100 * inside / max(windows, 1):.0f} %."


def main(arguments: list[str]) -> None:
    """Predict and write."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.coverage.held_out", description=__doc__)
    parser.add_argument("data", type=Path)
    parser.add_argument("--record", type=Path, help="file of the windows that are done")
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--page", type=Path, default=Path("docs/verdict-charts.md"))
    chosen = parser.parse_args(arguments)

    def study(key: str) -> Found:
        name, file, length, begin = every[key]
        return predicted(name, chosen.data / file, length, begin)

    every = cases()
    found = list(resumed(list(every)[:: chosen.every], study, chosen.record))
    text = report(found)
    if chosen.every == 1:
        publish(chosen.page, {"held-out": text})
    else:
        sys.stdout.write(f"{text}\n")


if __name__ == "__main__":
    main(sys.argv[1:])
