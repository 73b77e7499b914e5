"""The fitted values of one recording carried to another scene or problem."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shoal.arguments import brief
from shoal.errors import InputError
from shoal.read_estimate import checked_joint, read_estimate
from shoal.scene import expression

if TYPE_CHECKING:
    from shoal.identification.estimate import Estimate
    from shoal.identification.parametrization import Parametrization
    from shoal.identification.problem import Problem
    from shoal.identification.uncertainty.intervals import Value
    from shoal.scene import Scene
    from shoal.trajectory import Array


_NOTHING: dict[str, Any] = {"parameters": {}, "covariance": np.zeros((0, 0)), "ties": {}, "constants": {}}
"""A joint distribution of nothing."""


@dataclass(frozen=True)
class Carried:
    """Transferred estimate: values, covariance and ties that other commands use.

    values: by path in the scene, ties evaluated; parameters: by name; left: what is not carried, and why
    uncertainties: joint errors of fields, one standard deviation along each direction that is left open
    unknown: fields whose values the recording did not determine
    source: where it comes from; trusted: whether its verdict is an answer
    """

    values: Mapping[str, float]
    parameters: Mapping[str, float] = field(default_factory=dict)
    left: Mapping[str, str] = field(default_factory=dict)
    uncertainties: tuple[Mapping[str, float], ...] = ()
    unknown: tuple[str, ...] = ()
    source: str = "values"
    trusted: bool = True

    def notes(self) -> list[str]:
        """Note that goes with these values where they are set."""
        notes = []
        if not self.trusted:
            notes.append(f"{self.source}: the verdict on these values is that they cannot be trusted")
        if self.unknown:
            notes.append(f"{self.source}: not known from what was measured: {', '.join(self.unknown)}")
        if self.left:
            notes.append(f"{self.source}: left out: {', '.join(f'{name} ({why})' for name, why in self.left.items())}")
        return notes

    def set_in(self, scene: Scene, values: Mapping[str, Any] | None = None) -> Scene:
        """The scene with them set, then with `values`, which win. Raises InputError that names the source."""
        found = {path: number for path, number in self.values.items() if path not in (values or {})}
        try:
            scene = scene.with_values(found) if found else scene
        except InputError as error:
            raise InputError(f"values: {self.source}: {error}") from None
        return scene.with_values(values) if values else scene

    def into(
        self, problem: Problem, values: Mapping[str, Any] | None = None
    ) -> tuple[Problem, dict[str, Any], list[str]]:
        """A problem that starts from them, the fields of its scene to set, `values` among them, and notes.

        What the problem seeks becomes its start, within its bounds; what it ties it computes. What is set is known as
        well as it was found, unless the problem says how well. Raises InputError, also where it was not found at all.
        """
        sought, started, notes = dict(problem.parameters), [], replace(self, unknown=()).notes()
        for name, parameter in problem.parameters.items():
            known = self.parameters.get(name) if parameter.path is None else self.values.get(parameter.path)
            if known is None or (parameter.path or "") in (values or {}):
                continue
            start = float(np.clip(known, parameter.lower, parameter.upper))
            if start != known:
                notes.append(
                    f"{self.source}: {name} = {known:.6g} is beyond its bounds; the search starts at {start:g}"
                )
            sought[name] = parameter.model_copy(update={"start": start})
            started.append(name)
        fitted = {parameter.path for parameter in problem.parameters.values()} | {*problem.ties}
        fixed = {p: x for p, x in self.values.items() if p not in fitted and p not in (values or {})}
        if unknown := [path for path in self.unknown if path in fixed]:
            raise InputError(
                f"values: {self.source}: {', '.join(unknown)}: not known from what was measured; this problem takes "
                "it as known; seek it here too, or state it (--set)"
            )
        Carried(fixed, source=self.source).set_in(problem.load_scene())
        if started:
            notes.append(f"{self.source}: the search starts from {', '.join(started)}")
        changed = problem.model_copy(update={"parameters": sought})
        if fixed:
            there = {path for path in fixed if path not in problem.uncertain}
            together = [{p: x for p, x in entry.items() if p in there and x} for entry in self.uncertainties]
            all_ = (*problem.uncertainties, *(entry for entry in together if entry))
            changed = changed.model_copy(update={"uncertainties": all_})
            sizes = changed.uncertain
            listed = ", ".join(
                f"{path} = {number:.6g}" + (f" +- {sizes[path]:.2g}" if path in sizes else "")
                for path, number in fixed.items()
            )
            notes.append(f"{self.source}: taken as known: {listed}")
        if not started and not fixed and self.values:
            notes.append(f"{self.source}: nothing of it is used")
        return changed, {**fixed, **(values or {})}, notes


def _unknown(joint: Mapping[str, Any]) -> tuple[str, ...]:
    """Fields of a scene that a joint distribution, see `joint`, says nothing of."""
    open_ = {name: one["path"] for name, one in joint["parameters"].items() if not one["known"]}
    tied = [path for path, text in joint["ties"].items() if expression.names(text) & {*open_}]
    return (*(path for path in open_.values() if path), *tied)


def _uncertainties(joint: Mapping[str, Any]) -> tuple[dict[str, float], ...]:
    """Changes of the fields of a scene along independent directions of a joint distribution, see `joint`."""
    known, covariance = joint["parameters"], joint["covariance"]
    size = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    whole = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(whole, whole))
    moves = (size[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))).T

    def fields(move: Array) -> dict[str, float]:
        numbers = {
            name: one["value"] * float(np.exp(d / one["value"])) if one["logarithmic"] else one["value"] + float(d)
            for (name, one), d in zip(known.items(), move, strict=True)
        }
        named = numbers | joint["constants"]
        tied = {path: float(expression.evaluate(text, named)) for path, text in joint["ties"].items()}
        return {one["path"]: numbers[name] for name, one in known.items() if one["path"]} | tied

    sides = [(fields(move), fields(-move)) for move in moves]
    return tuple({path: (up[path] - down[path]) / 2 for path in up} for up, down in sides)


def fitted(parameters: Parametrization, point: Array) -> tuple[dict[str, float], dict[str, str]]:
    """The fields of the scene that an answer sets in any recording, by path, and what it leaves out, with the reason.

    point: (components,)
    """
    problem, left = parameters.problem, dict[str, str]()
    own = {entry.key for entry in parameters.entries.values() if entry.recording is not None}
    for name, entry in parameters.entries.items():
        if entry.recording is not None:
            left[name] = f"of recording {entry.recording}"
        elif entry.parameter.of_measurement:
            left[name] = "of the measurement"
    for path, text in problem.ties.items():
        if used := sorted(expression.names(text) & own):
            left[path] = f"depends on {used[0]} of each recording"
    paths = {parameter.path for name, parameter in problem.parameters.items() if name in own} | {
        path for path in problem.ties if path in left
    }
    found = parameters.scene_values(point[None], parameters.recordings[0])
    return {path: float(numbers[0]) for path, numbers in found.items() if path not in paths}, left


def joint(parameters: Parametrization, point: Array, covariance: Array, values: Mapping[str, Value]) -> dict[str, Any]:
    """Joint distribution of an answer for use elsewhere, as plain data.

    Of every parameter that is of the machine and of all recordings its path (None if it stands in ties only), value,
    whether its logarithm is the normal variable, and whether it is known; their covariance in their own units; ties of
    them, and the constants that these name.

    point: (components,); covariance: (components, components)
    """
    problem, (_, left) = parameters.problem, fitted(parameters, point)
    kept = [k for k, name in enumerate(parameters.names) if name not in left]
    ties = {path: text for path, text in problem.ties.items() if path not in left}
    entries = list(parameters.entries.values())
    described: dict[str, Any] = {
        parameters.names[k]: {
            "path": entries[k].parameter.path,
            "value": float(parameters.to_values(point)[k]),
            "logarithmic": bool(parameters.logarithmic[k]),
            "known": values[parameters.names[k]].identifiable,
        }
        for k in kept
    }
    used = set().union(*(expression.names(text) for text in ties.values())) if ties else set()
    return {
        "parameters": described,
        "covariance": covariance[np.ix_(kept, kept)].tolist(),
        "ties": ties,
        "constants": {name: float(x) for name, x in parameters.constants.items() if name in used},
    }


def of_estimate(estimate: Estimate) -> Carried:
    """Return the transferred values of an estimate."""
    known = {name: value.value for name, value in estimate.parameters.items()}
    parts = checked_joint(estimate.joint, "values", estimate.problem)
    return Carried(
        estimate.values,
        known,
        estimate.left_out,
        _uncertainties(parts),
        _unknown(parts),
        f"estimate of {estimate.problem}",
        estimate.verdict.trusted,
    )


def carried(found: Estimate | Path | str) -> Carried:
    """Return the transferred values of an estimate, or of the JSON file of one. Raises InputError."""
    from shoal.identification.estimate import Estimate

    if isinstance(found, str | Path):
        return read_values(found)
    if not isinstance(found, Estimate):
        raise InputError(
            f"values: needs fields of a scene by path, an estimate or the JSON file of one, found {brief(found)}"
        )
    return of_estimate(found)


def read_values(path: Path | str) -> Carried:
    """Return the values of an estimate written by `identify --json` or `--out FILE.json`. Raises InputError."""
    path = Path(path)
    data = read_estimate(path, "values", "values")
    values, left = data["values"], data["left_out"]
    for name, number in values.items():
        if not _is_number(number):
            raise InputError(f"values: {path}: {name}: a finite number is needed, found {str(number)[:60]!r}")
    known = {
        str(name): float(value["value"])
        for name, value in data["parameters"].items()
        if isinstance(value, dict) and _is_number(value.get("value"))
    }
    numbers = {str(name): float(number) for name, number in values.items()}
    reasons = {str(name): str(why) for name, why in left.items()}
    parts = checked_joint(data["joint"], "values", path) if "joint" in data else _NOTHING
    trusted = data.get("status") == "ok"
    return Carried(numbers, known, reasons, _uncertainties(parts), _unknown(parts), path.name, trusted)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(value))
