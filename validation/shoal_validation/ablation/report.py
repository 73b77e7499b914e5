"""Report of the ablations: pictures and Markdown tables from the measured arrays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from shoal.trajectory import Array

from shoal_validation.ablation.charts import MARKS, Panel, draw
from shoal_validation.ablation.dynamics import ROUND_OFF, Steps
from shoal_validation.ablation.factorial import Effect, combinations, effects, label
from shoal_validation.ablation.inverse import BUDGET, CLOSE, TARGET, Searches
from shoal_validation.document import table


def draw_dynamics(results: list[Steps], file: Path) -> None:
    """Error of the acceleration on both machines, one column each."""
    panels = []
    for machine in dict.fromkeys(result.machine for result in results):
        values = {result.swarm: result.error for result in results if result.machine == machine}
        words = f"{machine.replace('-', ' ')}, {results[0].steps} steps"
        panels.append(Panel(values, words, "relative error of the acceleration", "change of log10 error"))
    first = panels[0]
    draw(panels, f"Least error of the acceleration, {first.title}: {_seeded(first.values)}", file)


def draw_inverse(results: list[Searches], file: Path) -> None:
    """Evaluations to the target and error at the end."""
    spent = Panel(
        {result.swarm: result.evaluations for result in results},
        f"to a fitness of {TARGET:g} m²",
        "evaluations (runs of the whole record)",
        "change of log10 evaluations",
        float(BUDGET),
        "budget, target missed",
    )
    error = Panel(
        {result.swarm: result.error for result in results},
        "error at the end of the search",
        "largest error of an angle [rad]",
        "change of log10 error",
    )
    draw([spent, error], f"Fewest evaluations {spent.title}: {_seeded(spent.values)}", file)


def _seeded(values: dict[str, Array]) -> str:
    """The best combination of the other parts with and without the traditional seed, medians over the seeds."""

    def best(table: Array) -> str:
        return f"{float(f'{np.min(np.median(table, axis=-1)):.2g}'):g}"

    found = (f"{MARKS[swarm][2]} {best(table[1])} with the traditional seed, {best(table[0])} without"
             for swarm, table in values.items())  # fmt: skip
    return "; ".join(found)


def dynamics_table(results: list[Steps]) -> str:
    """Main effects of the parts, with the cost in time."""
    head = ("machine, swarm", "part", "error of a, factor", "path error, factor", "evaluations, factor",
            "time, factor", "earns its cost")  # fmt: skip
    rows = []
    for result in results:
        name = f"{result.machine.removesuffix('-double-pendulum')}, {MARKS[result.swarm][2]}"
        measured = (result.error, np.maximum(result.path, ROUND_OFF), result.evaluations, result.seconds)
        changes = zip(*(effects(np.log10(values)) for values in measured), strict=True)
        rows += [(name, row[0].part, *map(_factor, row), _verdict(row[0], row[-1])) for row in changes]
    return table(head, rows)


def inverse_table(results: list[Searches]) -> str:
    """Every combination, then the main effects."""
    head = ["parts on"]
    for result in results:
        words = MARKS[result.swarm][2]
        head += [f"{words}: success", "median evaluations", "reached", "median error [rad]"]
    rows = []
    for combination in combinations():
        place = tuple(map(int, combination))
        row = [f"`{label(combination)}`"]
        for result in results:
            reached = result.reached[place]
            row += [f"{result.success[place]:.0%}", f"{np.median(result.evaluations[place]):.0f}"]
            row += [f"{np.mean(reached):.0%}", f"{np.median(result.error[place]):.1e}"]
        rows.append(row)
    return table(head, rows) + "\n\n" + _inverse_effects(results)


def _inverse_effects(results: list[Searches]) -> str:
    head = ("swarm", "part", f"evaluations to {TARGET:g} m², factor", f"success (< {CLOSE:g} rad), points",
            "earns its cost")  # fmt: skip
    rows = []
    for result in results:
        dearer = effects(np.log10(result.evaluations))
        surer = effects(np.where(result.error < CLOSE, 100.0, 0.0))
        for cost, gain in zip(dearer, surer, strict=True):
            points = f"{gain.mean:+.0f} ({gain.lower:+.0f} to {gain.upper:+.0f})"
            good, bad = cost.falls or gain.rises, cost.rises or gain.falls
            verdict = "mixed" if good and bad else "yes" if good else "harmful" if bad else "no"
            rows.append((MARKS[result.swarm][2], cost.part, _factor(cost), points, verdict))
    return table(head, rows)


def _factor(effect: Effect) -> str:
    middle, lower, upper = (_number(10.0**x) for x in (effect.mean, effect.lower, effect.upper))
    return middle if lower == upper else f"{middle} ({lower} to {upper})"


def _number(x: float) -> str:
    return f"{x:.2f}" if x >= 0.05 else f"{x:.0e}"


def _verdict(error: Effect, seconds: Effect) -> str:
    """Beyond chance, and by more than it costs in time."""
    if error.rises:
        return "harmful"
    return "yes" if error.falls and -error.mean > seconds.mean else "no"
