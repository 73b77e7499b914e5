"""The method a user gets who does not choose: by how fast a deviation grows in the record, and by what a fit leaves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from shoal.errors import InputError
from shoal.identification.conventions import GROSS, SEVERAL
from shoal.identification.forward import ForwardModel, Progress
from shoal.identification.methods.growth import FRACTAL, LARGE, growth, swings
from shoal.identification.methods.lanes import Descent, descend_many, differentiate_many, differing, distinct
from shoal.identification.methods.least_squares import PATIENCE, differentiate, from_starts
from shoal.identification.methods.multiple_shooting import multiple_shooting
from shoal.identification.methods.outcome import Outcome
from shoal.identification.methods.progressive import extend
from shoal.identification.methods.starts import scatter, starting_points
from shoal.identification.recording.units import of_channels
from shoal.trajectory import Array

_SWINGS = 3
"""A record that swings more often may be fitted with another phase: false minima."""
_FACTOR, _ELSEWHERE, _DESCENTS, _DIPS = 5.0, 31, 6, 3
"""Positive quantities are tried within this factor, others all over their bounds, at so many points; the best of them
are followed, first so many of those that are lower than their neighbours."""
_SAME = 1e-9
"""Relative change of the squares that is none: of motions that differ by round-off."""
_LINE, _WIDTH, _LOOKED_AT = 41, 0.05, 2
"""Points of the line on which false minima are sought, its half by the box, and the dips that are followed."""


def auto(model: ForwardModel, rng: np.random.Generator, progress: Progress) -> Outcome:
    """Least squares where deviations stay small, else a progressive horizon; then a look for false minima near by.

    A fit that leaves more than noise is followed by the next method, progressive horizon and then multiple shooting.
    """
    starts = starting_points(model)
    first = differentiate_many(model, starts)
    # The growth is that of the start which fits best: it is nearest to the motion that was measured.
    grown = growth(model, first[1][int(np.argmin(model.cost(first[0])))])
    methods: dict[str, Callable[[], Outcome]] = {
        "least-squares": lambda: from_starts(model, starts, first, progress),
        "progressive": lambda: extend(model, starts, progress),
        "multiple-shooting": lambda: multiple_shooting(model, rng, progress),
    }
    if grown > LARGE:
        del methods["least-squares"]
    reason = f"a deviation grows {max(grown, 1.0):.2g}-fold over {model.measurement.end:.3g} s"
    outcome = _first_that_explains(model, methods, reason)
    if np.isfinite(outcome.fitness):
        outcome = _elsewhere(model, outcome, progress)
    if swings(model) < _SWINGS or grown > FRACTAL or not np.isfinite(outcome.fitness):
        return outcome
    # What looked like a false minimum may be the true one.
    return outcome.joined(model, false_minima(model, outcome.point), "a false minimum near by")


def _first_that_explains(model: ForwardModel, methods: dict[str, Callable[[], Outcome]], reason: str) -> Outcome:
    """The outcome of the first method whose fit explains the data, else the best of all, with the way there."""
    found: list[Outcome] = []
    steps: list[str] = []
    for name, search in methods.items():
        try:
            outcome = search()
        except InputError as refusal:
            if not found:
                raise
            steps.append(f"not {name} ({str(refusal).partition('; use')[0].removeprefix('method: ')})")
            continue
        steps.append(f"{name}: {reason}")
        found.append(outcome)
        if explained(model, outcome):
            break
        left = f"{np.sqrt(outcome.fitness / model.rows.things):.2g} {of_channels(model.measurement)}"
        reason = f"the fit before left {left.rstrip()}"
    best = min(found, key=lambda outcome: outcome.fitness)
    ends = [(o.point, o.fitness) for o in found if o is not best] + [m for o in found for m in o.minima]
    apart = [(point, fitness) for point, fitness in ends if np.any(differing(model, point, best.point))]
    return replace(best, minima=apart, choice="; then ".join(steps))


def _elsewhere(model: ForwardModel, outcome: Outcome, progress: Progress) -> Outcome:
    """The outcome, or where descents end from other values, of what is no initial state where the data are explained.

    A modulus, a mass or a length that is wrong by a factor leads a fit to a false minimum with every pose, and a small
    motion on a large one hides it in the noise; a centre of mass on either side of a radius of gyration swings alike.
    So they are looked at even where the fit explains the data, all but what the channels follow in proportion.
    """
    states, proportional = model.parameters.initial, model.parameters.proportional
    # Where nothing is explained they may be wrong as well: from the first samples a fast motion looks like a slow one.
    free = ~states & ~proportional if explained(model, outcome) else np.ones_like(states)
    points, dips = _others(model, outcome.point, np.flatnonzero(free))
    if not len(points):
        return outcome
    span = np.where(_wide(model, outcome.point), 2 * np.abs(outcome.point), model.upper - model.lower)
    spacing = np.where(model.parameters.logarithmic, 2 * np.log(_FACTOR), span) / _ELSEWHERE
    chosen = [outcome.point]
    for point in [*dips[:_DIPS], *points]:
        if len(chosen) <= _DESCENTS and all(np.max((np.abs(point - p) / spacing)[free]) > 1.0 for p in chosen):
            chosen.append(point)
    ends = distinct(model, descend_many(model, np.array(chosen), progress, patience=PATIENCE))
    names = ", ".join(model.names[k] for k in np.flatnonzero(free))
    found = outcome.joined(model, ends, f"from other values of {names}")
    if found.point is outcome.point:
        return found
    rows = [(len(outcome.iterations) + i, value, mean) for i, value, mean in ends[0].rows]
    return replace(found, iterations=[*outcome.iterations, *rows])


def _others(model: ForwardModel, point: Array, free: npt.NDArray[np.intp]) -> tuple[Array, Array]:
    """Other values of these parameters within the bounds, and those among them where the fitness dips, the best first.

    Each is varied alone and all together, by factors or, the nearer to the point the closer, from bound to bound; where
    bounds are far away beside a value, between multiples of it, too. Before these dips are the edges of what changes
    nothing at the point.
    """
    logarithmic = model.parameters.logarithmic
    reach = np.minimum(np.log(_FACTOR), (model.upper - model.lower) / 2)

    def moved(shifts: Array, most: Array | float = np.inf) -> Array:
        far = np.minimum(np.where(shifts < 0.0, point - model.lower, model.upper - point), most)
        ways = np.where(logarithmic, reach * shifts, far * np.abs(shifts) * shifts)
        return np.asarray(np.clip(point + ways, model.lower, model.upper))

    unit, shifts = np.eye(len(point)), np.linspace(-1.0, 1.0, _ELSEWHERE)[:, None]
    wide = _wide(model, point)
    # Twice as many, in two lines that overlap.
    closer, between = 0.5 * shifts, np.where(shifts < 0.0, shifts - 1.0, shifts + 1.0) / 2
    lines = [moved(shifts * unit[k]) for k in free]
    lines += [moved(part * unit[k], _FACTOR * np.abs(point)) for k in free if wide[k] for part in (closer, between)]
    lines += [moved(part * unit[k]) for k in free if model.parameters.initial[k] for part in (closer, between)]
    together = np.zeros((len(free) * _ELSEWHERE if len(free) > 1 else 0, len(point)))
    together[:, free] = 2 * scatter(len(together), len(free)) - 1
    points = np.concatenate([*lines, moved(together)]) if lines else together
    values = model.fitness(points) if len(points) else np.empty(0)
    along = np.pad(values[: len(lines) * _ELSEWHERE].reshape(-1, _ELSEWHERE), ((0, 0), (1, 1)), constant_values=np.inf)
    lower = (along[:, 1:-1] < along[:, :-2]) & (along[:, 1:-1] < along[:, 2:])
    dips = np.flatnonzero(lower)
    near = along[:, _ELSEWHERE // 2 : _ELSEWHERE // 2 + 3]
    unseen = [k for k, row in zip(free, near, strict=False) if np.ptp(row) <= _SAME * np.max(row)]
    edges = [_edges(model, point, k) for k in unseen]
    return points[np.argsort(values, kind="stable")], np.concatenate(
        [*edges, points[dips[np.argsort(values[dips], kind="stable")]]]
    )


def _edges(model: ForwardModel, point: Array, parameter: int) -> Array:
    """Values of a parameter, evenly from bound to bound, at which the data begin to depend on it; none if nowhere.

    Friction of a contact that sticks changes nothing: no descent leaves there, and just beyond it the fit may be worse.
    """
    points = np.tile(point, (_ELSEWHERE, 1))
    points[:, parameter] = np.linspace(model.lower[parameter], model.upper[parameter], _ELSEWHERE)
    values, here = np.split(model.fitness(np.concatenate([points, point[None]])), [_ELSEWHERE])
    same = np.pad(np.abs(values - here) <= _SAME * here, 1)
    return points[~same[1:-1] & (same[:-2] | same[2:])]


def _wide(model: ForwardModel, point: Array) -> npt.NDArray[np.bool_]:
    """Parameters sought as they are whose bounds are far away beside their values."""
    size = np.abs(point)
    far = model.upper - model.lower > _FACTOR**2 * size
    return np.asarray(~model.parameters.logarithmic & far & (size > 0.0))


def explained(model: ForwardModel, outcome: Outcome) -> bool:
    """Return whether a fit leaves no more than noise, as stated or as the data show it, or little of what was
    measured.
    """
    rows = len(model.rows.time)
    left = np.sqrt(outcome.fitness * model.rows.samples / rows)
    if model.rows.noise is not None:
        return bool(left <= SEVERAL * model.rows.noise)
    noise = float(np.max(np.nan_to_num(model.rows.estimated * model.rows.weight)))
    return bool(left <= max(GROSS * model.rows.signal, SEVERAL * noise))


def false_minima(model: ForwardModel, point: Array) -> list[Descent]:
    """Local minima near an answer: where descents end from the dips on a line along the direction the data fix least.

    The direction is the last singular vector of the Jacobian in parameters relative to their ranges. One call for the
    line, and one for each step of all descents.
    """
    span = model.upper - model.lower
    _, jacobian = differentiate(model, point)
    direction = np.linalg.svd(np.linalg.qr(jacobian * span, mode="r"))[2][-1]
    reach = _WIDTH / np.max(np.abs(direction))
    line = point + np.linspace(-reach, reach, _LINE)[:, None] * direction * span
    values = model.fitness(np.clip(line, model.lower, model.upper))
    inner = np.arange(1, _LINE - 1)
    dips = inner[(values[inner] < values[inner - 1]) & (values[inner] < values[inner + 1]) & (inner != _LINE // 2)]
    if not dips.size:
        return []
    lowest = dips[np.argsort(values[dips])][:_LOOKED_AT]
    descents = descend_many(model, np.clip(line[lowest], model.lower, model.upper))
    return [d for d in distinct(model, descents) if d.converged]
