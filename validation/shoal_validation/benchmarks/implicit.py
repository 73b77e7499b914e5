"""Implicit steps: stiff rods beside Exudyn, and how the cost grows with the number of elements.

Stiff rods: the flexible double pendulum with moduli of ten thousand times the paper's, whose stable explicit step is
some microseconds. Both solvers take generalized-alpha with kept factors (modified Newton); every row is within 1 mm of
the converged beam or says how far it is. `loop` is the march alone, `call` what a user calls.

Growth: a cable of elements of one length, marched by leapfrog and by generalized-alpha; processor time per element and
step, the least of some runs, as the longest take seconds. An implicit step counts its iterations.
"""

from __future__ import annotations

import argparse
import itertools
import statistics
import time
from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from shoal.engines import get_engine
from shoal.engines.exudyn import ExudynEngine
from shoal.scene import Rod, Scene, load_scene

from shoal_validation.benchmarks.forward import exudyn_loop, prepare
from shoal_validation.benchmarks.timing import median_time

STIFFER = 1e4
RADIUS = 0.8
MESHES = ((1, 1), (2, 4))
"""Cables of reduced quadrature on both rods."""
STEPS = (0.02, 0.01, 0.005)
"""Exudyn's steps end with the sampling interval, 0.01 s."""
ELEMENTS = (100, 1000, 10_000)
REPEATS = 15


class StiffRow(NamedTuple):
    """A solver on a mesh with a step [s]: distance from the converged beam [m], loop and whole call [s]."""

    solver: str
    mesh: str
    step: float
    error: float
    loop: float
    call: float


class GrowthRow(NamedTuple):
    """An integrator on a number of elements: evaluations a step, seconds per element and step."""

    integrator: str
    elements: int
    evaluations: float
    seconds: float


def stiff_scene(mesh: tuple[int, ...], step: float, element: str = "ancf-cable") -> Scene:
    """The stiff double pendulum by generalized-alpha; mesh: elements of both rods."""
    scene = load_scene("flexible-double-pendulum")
    values: dict[str, Any] = {"solver.integrator": "generalized-alpha", "solver.step": step}
    values["solver.spectral_radius"] = RADIUS
    for (name, body), elements in zip(scene.bodies.items(), mesh, strict=True):
        assert isinstance(body, Rod)
        assert body.youngs_modulus is not None
        quadrature = "reduced" if element == "ancf-cable" else "full"
        own = {"element": element, "elements": elements, "quadrature": quadrature}
        own["youngs_modulus"] = STIFFER * body.youngs_modulus
        values |= {f"bodies.{name}.{field}": value for field, value in own.items()}
    return scene.with_values(values)


def stiff(repeats: int = REPEATS) -> Iterator[StiffRow]:
    """Both solvers on all meshes and steps."""
    ours, exudyn = get_engine("gauss"), ExudynEngine(modified_newton=True, integrator="generalized-alpha")
    fine = stiff_scene((2, 4), 1e-4, "ancf-quintic")
    times = np.linspace(0.0, fine.solver.duration, 51)[1:]
    truth = ours.simulate(fine, times).points

    def error(points: Any) -> float:
        return float(np.max(np.linalg.norm(points - truth, axis=2)))

    for mesh, step in itertools.product(MESHES, STEPS):
        name = "/".join(map(str, mesh))
        scene = stiff_scene(mesh, step)
        run = ours.simulate(scene, times)
        loop = median_time(prepare(scene, {}), repeats)
        call = median_time(partial(ours.simulate, scene, times), repeats)
        yield StiffRow("ours", name, step, error(run.points), loop, call)
        if step > times[0]:
            continue
        run = exudyn.simulate(scene, times)
        loop = statistics.median(exudyn_loop(exudyn, scene) for _ in range(repeats))
        call = median_time(partial(exudyn.simulate, scene, times), repeats)
        yield StiffRow("Exudyn", name, step, error(run.points), loop, call)


def cable(elements: int, integrator: str, step: float, steps: int) -> Scene:
    """A cable of elements of 0.1 m that falls from 0.3 rad above the horizontal."""
    rod = {"kind": "rod", "height": 0.01, "width": 0.01, "density": 5000.0, "youngs_modulus": 1e8}
    solver = {"integrator": integrator, "step": step, "duration": step * steps, "samples": 1, "energy_tolerance": 1.0}
    return Scene.parse(
        {
            "name": "cable",
            "bodies": {"A": {**rod, "element": "ancf-cable", "elements": elements, "length": 0.1 * elements}},
            "joints": {"O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "A", "point": "start"}}},
            "markers": {"tip": {"body": "A", "point": "end"}},
            "initial": {"A": {"angle": 0.3}},
            "solver": solver,
        }
    )


def growth(sizes: tuple[int, ...] = ELEMENTS, repeats: int = 7) -> Iterator[GrowthRow]:
    """The cost per element and step."""
    for integrator, step, work in (("leapfrog", 1e-4, 2e6), ("generalized-alpha", 1e-3, 2e5)):
        for elements in sizes:
            steps = max(20, round(work / elements))
            scene = cable(elements, integrator, step, steps)
            march, taken = prepare(scene, {}), []
            march()
            for _ in range(repeats):
                begin = time.process_time()
                march()
                taken.append(time.process_time() - begin)
            run = get_engine("gauss").simulate(scene)
            yield GrowthRow(integrator, elements, run.model["evaluations"] / run.steps, min(taken) / (steps * elements))


def main() -> None:
    """Measure and print."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    for row in stiff():
        print(  # noqa: T201 - a command
            f"{row.solver:7s} {row.mesh} step {row.step:g} s: {row.error:.1e} m off, loop {row.loop * 1e3:.3f} ms, "
            f"call {row.call * 1e3:.3f} ms",
            flush=True,
        )
    for line in growth():
        print(  # noqa: T201 - a command
            f"{line.integrator:18s} {line.elements:6d} elements: {line.evaluations:.2f} evaluations a step, "
            f"{line.seconds * 1e9:.1f} ns per element and step",
            flush=True,
        )


if __name__ == "__main__":
    main()
