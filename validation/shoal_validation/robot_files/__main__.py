"""`python -m shoal_validation.robot_files MIRRORS [--urdf N] [--mjcf N] [--only TEXT] [--out FILE]`.

Imports public robot files (100 of URDF, 200 of MJCF) of the repositories whose mirrors are in a folder, and prints how
many are imported, why others are not, and how far they are from MuJoCo after 0.3 s.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from collections import Counter
from dataclasses import asdict
from pathlib import Path

from shoal.home import prepare_kernel_cache

from shoal_validation.document import table
from shoal_validation.robot_files.corpus import choose, unpack
from shoal_validation.robot_files.trial import NEAR, Trial, trial


def main(arguments: list[str]) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.robot_files", description=__doc__)
    parser.add_argument("mirrors", type=Path, help="a folder with OWNER+NAME/repo, or one already unpacked")
    parser.add_argument("--urdf", type=int, default=100)
    parser.add_argument("--mjcf", type=int, default=200)
    parser.add_argument("--only", default="", help="files whose path has this text")
    parser.add_argument("--out", type=Path, help="a file of JSON with every trial")
    chosen = parser.parse_args(arguments)
    prepare_kernel_cache()
    with tempfile.TemporaryDirectory() as made:
        folder = chosen.mirrors if not list(chosen.mirrors.glob("*+*/repo")) else Path(made)
        if folder == Path(made):
            unpack(chosen.mirrors, folder)
        trials = []
        for kind, count in (("urdf", chosen.urdf), ("mjcf", chosen.mjcf)):
            for path in choose(folder, count, kind):
                if chosen.only in str(path):
                    trials.append((kind, trial(path, folder)))
                    one = trials[-1][1]
                    print(one.outcome, one.distance, one.file, one.why or one.compared, file=sys.stderr, flush=True)
    if chosen.out:
        chosen.out.write_text(json.dumps([asdict(one) | {"kind": kind} for kind, one in trials], indent=1))
    print("\n\n".join(summary(trials)))


def summary(trials: list[tuple[str, Trial]]) -> list[str]:
    """Return tables: outcomes and their reasons by kind of file, and the distances."""
    outcomes = Counter((kind, one.outcome, one.why) for kind, one in trials)
    rows = [[kind, outcome, why or "-", str(count)] for (kind, outcome, why), count in sorted(outcomes.items())]
    parts = [table(["file", "outcome", "reason", "files"], rows)]
    moved = [(kind, one) for kind, one in trials if one.outcome == "imported"]
    near = Counter((kind, one.compared) for kind, one in moved if one.distance is not None and one.distance < NEAR)
    far = [(one.file, one.distance) for _, one in moved if one.distance is not None and one.distance >= NEAR]
    other = Counter((kind, one.compared) for kind, one in moved if one.distance is None)
    rows = [[kind, f"within {NEAR:g} m: {how}", str(count)] for (kind, how), count in sorted(near.items())]
    rows += [[kind, why, str(count)] for (kind, why), count in other.most_common()]
    parts.append(table(["file", "motion beside MuJoCo's", "files"], rows))
    if far:
        parts.append(table(["file", "apart [m]"], [[file, f"{distance:.2g}"] for file, distance in far]))
    return parts


if __name__ == "__main__":
    main(sys.argv[1:])
