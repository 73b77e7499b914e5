"""Plan of the demo: cases, methods, meshes and engines."""

from __future__ import annotations

from typing import Any

from shoal_flows.jobs import Cell

CASES = {
    "paper-case-1": "flexible-double-pendulum",
    "paper-case-2": "flexible-double-pendulum-case-2",
}
"""Problem of each case, and the scene that the engines are compared on."""

SAME_MESH = {case: f"{case}-same-mesh" for case in CASES}
"""The same case with data from the very mesh that is fitted."""

TITLES = {"paper-case-1": "Case 1", "paper-case-2": "Case 2"}
TITLES |= {SAME_MESH[case]: f"{title}, same mesh" for case, title in TITLES.items()}

SWARMS = ("afsa", "iafsa-printed", "iafsa", "iafsa-unseeded")
METHODS = ("least-squares", *SWARMS, "casadi")
SLOWEST_FIRST = ("iafsa-printed", "casadi", "afsa", "iafsa", "iafsa-unseeded", "least-squares")
SEED = 0

MESHES = (
    ("2/4 full", 2, "full", 5e-4),
    ("2/4 reduced", 2, "reduced", 4e-4),
    ("4/8 reduced", 4, "reduced", 2e-4),
    ("8/16 reduced", 8, "reduced", 1e-4),
)
"""Label, elements on OA (twice as many on AB), quadrature, and a step [s] below the explicit stability limit."""


def method_cells(case: str) -> list[Cell]:
    """Every method once, on the problem's own mesh."""
    return [Cell(case, method, SEED) for method in METHODS]


def mesh_cells(case: str) -> list[Cell]:
    """Least squares on every mesh."""
    return [
        Cell(case, "least-squares", SEED, values=mesh_values(elements, quadrature, step), label=label)
        for label, elements, quadrature, step in MESHES
    ]


def same_mesh_cells(case: str) -> list[Cell]:
    """On the mesh of the data, as the paper must have done: least squares and the swarms.

    Least squares have a step that leaves nothing but the mesh to matter; for the thousands of runs of a swarm one near
    the stability limit will do, whose error of some micrometres is far below what a swarm reaches.
    """
    return [
        Cell(SAME_MESH[case], method, SEED, values={"solver.integrator": "leapfrog", "solver.step": step})
        for method, step in (("least-squares", 2e-5), *((swarm, 4e-4) for swarm in SWARMS))
    ]


def mesh_values(elements: int, quadrature: str, step: float) -> dict[str, Any]:
    """The fields of the scene that make a mesh."""
    return {
        "bodies.OA.elements": elements,
        "bodies.AB.elements": 2 * elements,
        "bodies.OA.quadrature": quadrature,
        "bodies.AB.quadrature": quadrature,
        "solver.step": step,
    }
