"""`python -m shoal_validation.coverage.systematic [--machines N]`.

Draws N machines (40) with what is sought of them, gives each every fault that a suspect may be, one at a time, and
computes to first order how far the parameters go astray, over what the residual tells: the norm of the residual times
that of the parameter's row of the pseudo-inverse. Prints quantiles of that ratio, and how often the interval for
correlated noise alone, and the one widened for a systematic residual, hold the truth. Takes a minute and a half.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from shoal.engines import get_engine
from shoal.identification import Measurement, Problem
from shoal.identification.diagnostics.residual_tests import residual_tests
from shoal.identification.diagnostics.suspects.candidate import with_parameters
from shoal.identification.diagnostics.suspects.of_machine import of_machine
from shoal.identification.diagnostics.suspects.of_recordings import of_measurement
from shoal.identification.forward import ForwardModel
from shoal.identification.recording.observation import observe
from shoal.identification.uncertainty.covariance import blocks_of
from shoal.identification.uncertainty.linearisation import linearise, spread
from shoal.identification.uncertainty.sensitivity import sensitivity
from shoal.scene import Scene
from shoal.trajectory import Array

from shoal_validation.document import table
from shoal_validation.suspects.machines import FREE, MACHINES

SIZES = (1.5, 3.0, 20.0, 1000.0)
"""Of what a fault leaves in the residual, over the noise."""
_SHARE = 0.4
"""Of the lengths, densities and the friction: the chance to be sought."""
_CONDITION = 1e5


def model_of(rng: np.random.Generator) -> ForwardModel:
    """A machine with its sought parameters, on the record of itself."""
    data, sought, seen = MACHINES[int(rng.integers(len(MACHINES)))](rng)
    scene = Scene.parse(data, "machine")
    count = int(rng.choice([60, 200, 600]))
    parameters: dict[str, object] = {f"theta_{b}": {"path": f"initial.{b}.angle", **FREE} for b in sought}
    for number, body in enumerate(scene.bodies):
        if rng.random() < _SHARE:
            parameters[f"length_{body}"] = {"path": f"bodies.{body}.length", "lower": 0.1, "upper": 3.0}
        if number and rng.random() < _SHARE:
            free = {"path": f"bodies.{body}.density", "lower": 100.0, "upper": 2e4, "scale": "log"}
            parameters[f"density_{body}"] = free
    if rng.random() < _SHARE:
        parameters["friction"] = {"path": "joints.O.friction", "lower": 0.0, "upper": 10.0}
    channels = [{"marker": marker, "quantity": quantity} for marker, quantity in seen]
    source = {"kind": "engine", "stop": 1.0, "count": count}
    stated = {"name": "machine", "scene": "machine", "parameters": parameters, "channels": channels, "source": source}
    problem = Problem.parse(stated, "machine")
    times = np.arange(1, count + 1) * scene.solver.duration / count
    values = observe(get_engine("gauss").simulate(scene, times), tuple(problem.channels))[0]
    measurement = Measurement.single(times, tuple(problem.channels), values, "itself")
    return ForwardModel(problem, scene, get_engine("gauss"), measurement)


def astray(model: ForwardModel, rng: np.random.Generator) -> Iterator[tuple[float, float, bool, bool]]:
    """Return, for each fault, size and parameter: the size, the ratio, and whether either interval holds the truth."""
    values = [model.scene.value(p.path) for p in model.problem.parameters.values() if p.path]
    truth = model.parameters.to_vector(np.array(values))
    seen = sensitivity(model, truth)
    singular = np.linalg.svd(seen.jacobian * model.sizes(truth), compute_uv=False)
    if singular[-1] * _CONDITION < singular[0]:
        return
    basis = np.linalg.qr(seen.jacobian)[0]
    blocks = blocks_of(model, len(seen.residual))
    for effect in _effects(model, truth, seen.residual):
        own = effect - basis @ (basis.T @ effect)
        if np.linalg.norm(own) < 1e-4 * np.linalg.norm(effect):
            continue
        for size in SIZES:
            noise = rng.standard_normal(len(effect))
            wrong = size * np.sqrt(len(effect)) / np.linalg.norm(own) * rng.choice([-1, 1]) * effect + noise
            left = wrong - basis @ (basis.T @ wrong)
            at = linearise(seen.jacobian, left, model.sizes(truth), blocks, seen.error)
            tests = residual_tests(model, left, blocks, at.noise)
            excess = 0.0 if tests.white else np.sqrt(max(float(np.mean(left**2)) - 1.0, 0.0))
            wider = replace(at, systematic=excess * np.sqrt(len(left)))
            error, row = at.pseudo_inverse @ wrong, np.linalg.norm(at.pseudo_inverse, axis=1)
            for k in range(len(truth)):
                halves = [spread(lambda p, k=k: float(p[k]), truth, a).half for a in (at, wider)]  # type: ignore[misc]
                ratio = abs(error[k]) / (row[k] * np.linalg.norm(left))
                yield size, float(ratio), bool(abs(error[k]) <= halves[0]), bool(abs(error[k]) <= halves[1])


def _effects(model: ForwardModel, truth: Array, residual: Array) -> Iterator[Array]:
    """Return the first-order changes of the rows by each fault."""
    sought = {str(parameter.path) for parameter in model.problem.parameters.values()}
    for candidate in (*of_measurement(model), *of_machine(model)):
        if candidate.paths & sought:
            continue
        point = np.append(truth, candidate.vector(candidate.probes[0, 0]))
        effect = with_parameters(model, [candidate]).uncounted(point[None])[0] - residual
        if np.all(np.isfinite(effect)) and np.any(effect):
            yield effect


def main(arguments: list[str]) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.coverage.systematic", description=__doc__)
    parser.add_argument("--machines", type=int, default=40)
    chosen = parser.parse_args(arguments)
    found = []
    for seed in range(chosen.machines):
        rng = np.random.default_rng(seed)
        found += list(astray(model_of(rng), rng))
    numbers = np.array(found, dtype=float)
    rows = []
    for size in SIZES:
        mine = numbers[numbers[:, 0] == size]
        quantiles = [f"{q:.2f}" for q in np.quantile(mine[:, 1], (0.5, 0.8, 0.9, 0.95))]
        rows.append((f"{size:g}", str(len(mine)), *quantiles, *(f"{100 * np.mean(mine[:, k]):.1f} %" for k in (2, 3))))
    head = ("misfit over noise", "parameters", "median", "80 %", "90 %", "95 %", "noise alone covers", "widened covers")
    sys.stdout.write(table(head, rows) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
