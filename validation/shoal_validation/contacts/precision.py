"""`python -m shoal_validation.contacts.precision [--quick] [--only CASE] [--redraw]`.

Measures what an error costs through impacts: a pendulum with a stop, eight balls, a slider-crank with play in its
guide; ours by dop853, rk4 and leapfrog, Exudyn and MuJoCo with three stiffnesses for each step, time stepping by Moreau
and Jean. Errors of peers do not fall steadily with the step, as impacts begin anywhere within one: each point is the
worst of three neighbouring steps, and the median of their times. Ours is the time of a whole call, the median of nine;
that of peers is that of their time loop alone. Time stepping is written in Python: its cost is a step of our leapfrog
each. A whole run writes chart and table to docs.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from shoal.home import prepare_kernel_cache

from shoal_validation.document import publish, table

NAME = "contacts-precision"
TOLERANCES = tuple(10.0**-k for k in range(3, 13))
STEPS = (300, 1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000)
"""Numbers of fixed steps."""
STIFF = (0.25, 1.0, 4.0)
"""Steps that the springs are made for, over the step taken: stiffness ~ 1 / square."""
NEIGHBOURS = (1.0, 1.05, 1.11)
LONGEST = 3.0
"""No finer steps after a run as long as that [s]."""
REPEATS = 9
ERRORS = (1e-2, 3e-3, 1e-3, 1e-4, 1e-6)
OURS = ("dop853", "rk4", "leapfrog")
LOOKS: dict[str, dict[str, Any]] = {
    "dop853": {"color": "#0072B2", "marker": "o"}, "rk4": {"color": "#56B4E9", "marker": "v"},
    "leapfrog": {"color": "#009E73", "marker": "^"}, "Exudyn": {"color": "#D55E00", "marker": "s"},
    "MuJoCo": {"color": "#4D4D4D", "marker": "P"}, "Moreau-Jean": {"color": "#CC79A7", "marker": "D"},
}  # fmt: skip


@dataclass(frozen=True)
class Point:
    """A setting of a method on a case: its error, and its time [s]."""

    case: str
    method: str
    setting: str
    error: float
    seconds: float


def measure(quick: bool, only: str | None) -> Iterator[Point]:
    """Yield all points, or those of one case; those of failed runs are left out."""
    from shoal_validation.contacts.cases import CASES

    for case in (make() for name, make in CASES.items() if only in (None, name)):
        yield from _ours(case, quick)
        yield from _peers(case, quick)


def _ours(case: Any, quick: bool) -> Iterator[Point]:
    from shoal_validation.contacts.peers import ours

    settings: list[tuple[str, dict[str, Any], str]] = [
        ("dop853", {"relative_tolerance": one}, f"tolerance {one:.0e}") for one in TOLERANCES[:: 4 if quick else 1]
    ]
    settings += [(method, {"integrator": method, "step": case.time / count}, f"{count} steps")
                 for method in OURS[1:] for count in STEPS[: 2 if quick else 5]]  # fmt: skip
    for method, solver, text in settings:
        runs = [ours(case, **solver) for _ in range(2 if quick else REPEATS + 1)][1:]
        if runs[0].ok:
            error = case.error(runs[0].angles, runs[0].places)
            yield Point(case.name, method, text, error, float(np.median([run.seconds for run in runs])))


def _peers(case: Any, quick: bool) -> Iterator[Point]:
    from shoal_validation.contacts.peers import PEERS, ours

    loop = _step_of_leapfrog(case, ours)
    for peer, run in PEERS.items():
        for stiff in STIFF if peer != "Moreau-Jean" else (1.0,):
            for count in STEPS[: 3 if quick else None]:
                given = () if peer == "Moreau-Jean" else (stiff,)
                found = [run(case, round(part * count), *given) for part in NEIGHBOURS]
                if not all(one.ok for one in found):
                    continue
                error = max(case.error(one.angles, one.places) for one in found)
                seconds = float(np.median([one.seconds for one in found]))
                cost = count * loop if peer == "Moreau-Jean" else seconds
                springs = "" if peer == "Moreau-Jean" else f", springs for {stiff:g} steps"
                yield Point(case.name, peer, f"{count} steps{springs}", error, cost)
                if seconds > LONGEST:
                    break


def _step_of_leapfrog(case: Any, ours: Any) -> float:
    """Return the time of one step of our leapfrog [s], from two runs of different lengths."""

    def seconds(count: int) -> float:
        return float(np.median([ours(case, integrator="leapfrog", step=case.time / count).seconds for _ in range(5)]))

    ours(case, integrator="leapfrog", step=case.time / 3000)
    return (seconds(30_000) - seconds(3000)) / 27_000


def cheapest(points: Sequence[Point], case: str, methods: Sequence[str], error: float) -> Point | None:
    """Return the cheapest point of some methods that is within an error."""
    within = [one for one in points if one.case == case and one.method in methods and one.error <= error]
    return min(within, key=lambda one: one.seconds, default=None)


def costs(points: Sequence[Point]) -> str:
    """Return the cost of errors by case: ours in ms, peers in ms and times ours."""
    peers = ("Exudyn", "MuJoCo", "Moreau-Jean")
    rows = []
    for case in dict.fromkeys(one.case for one in points):
        for error in ERRORS:
            best = cheapest(points, case, OURS, error)
            row = [
                case,
                f"{error:.0e}",
                "not reached" if best is None else f"{1e3 * best.seconds:.2g} ms: {best.method}, {best.setting}",
            ]
            for peer in peers:
                found = cheapest(points, case, (peer,), error)
                if found is None or best is None:
                    row.append("not reached")
                else:
                    row.append(
                        f"{1e3 * found.seconds:.3g} ms, {found.seconds / best.seconds:.0f} times: {found.setting}"
                    )
            rows.append(row)
    return table(("case", "error [rad; of balls m]", "ours", *peers), rows)


def draw(points: Sequence[Point], path: Path) -> None:
    """Draw error against time by case; lower left is better."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    names = list(dict.fromkeys(one.case for one in points))
    figure, axes = plt.subplots(len(names), 1, figsize=(8.6, 4.4 * len(names)), layout="constrained", squeeze=False)
    for axis, case in zip(axes[:, 0], names, strict=True):
        for method, look in LOOKS.items():
            own = sorted(
                (one for one in points if one.case == case and one.method == method), key=lambda one: one.seconds
            )
            if not own:
                continue
            errors = np.maximum([one.error for one in own], 1e-14)
            seconds = np.array([one.seconds for one in own])
            axis.loglog(seconds, errors, linestyle="none", markersize=3.5, alpha=0.35, **look)
            best = np.minimum.accumulate(errors)
            kept = np.concatenate([[True], best[1:] < best[:-1]])
            axis.loglog(seconds[kept], best[kept], markersize=6, label=method, drawstyle="steps-post", **look)
        axis.set_title(_message(points, case), loc="left", fontsize=10.5)
        axis.set_ylabel("error [m]" if case == "balls" else "error of an angle [rad]")
        axis.grid(alpha=0.25)
        axis.legend(ncols=3, frameon=False, fontsize=8.5)
    axes[-1, 0].set_xlabel("processor time [s]: ours of a whole call, peers of a time loop")
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _message(points: Sequence[Point], case: str) -> str:
    ours, peers = (cheapest(points, case, of, 3e-3) for of in (OURS, ("Exudyn", "MuJoCo")))
    if ours is None or peers is None:
        return case
    return f"{case}: within 3e-3 {peers.method} takes {peers.seconds / ours.seconds:.0f} times our call"


def main(arguments: list[str]) -> None:
    """Measure, draw, write."""
    parser = argparse.ArgumentParser("python -m shoal_validation.contacts.precision", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="few settings, one repeat; nothing is written")
    parser.add_argument(
        "--only", metavar="CASE", help="pendulum, balls or guide; the others stay as they were measured"
    )
    parser.add_argument("--redraw", action="store_true", help="chart and table from the data of docs/charts")
    chosen = parser.parse_args(arguments)
    prepare_kernel_cache()
    from shoal_validation.work_precision.data import machine_facts

    data = Path("docs/charts") / f"{NAME}.json"
    known = json.loads(data.read_text(encoding="utf-8")) if chosen.redraw or chosen.only else {"points": []}
    points = [Point(**one) for one in known["points"] if one["case"] != chosen.only]
    facts, begin = known["machine"] if chosen.redraw else machine_facts(), time.monotonic()
    for point in () if chosen.redraw else measure(chosen.quick, chosen.only):
        points.append(point)
        sys.stderr.write(f"{time.monotonic() - begin:6.1f} s {point}\n")
    text = f"Measured on {', '.join(f'{key} {value}' for key, value in facts.items())}.\n\n{costs(points)}"
    if chosen.quick:
        sys.stdout.write(text + "\n")
        return
    data.write_text(json.dumps({"machine": facts, "points": [asdict(one) for one in points]}, indent=1) + "\n",
                    encoding="utf-8")  # fmt: skip
    draw(points, data.with_suffix(".png"))
    publish(Path("docs/contact-checks.md"), {NAME: text})


if __name__ == "__main__":
    main(sys.argv[1:])
