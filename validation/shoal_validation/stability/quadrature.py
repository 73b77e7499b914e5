"""Element and quadrature against the mesh, each by an adaptive integrator: the remaining error is that of the mesh.

The reference is Exudyn's cable element with reduced quadrature on 16/32 elements by its trapezoidal rule,
step 2e-4 s: a beam without shear. Elements with shear (`solid`) cannot reach it where the rods are thick.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from shoal.engines.exudyn import ExudynEngine
from shoal.scene import load_scene
from shoal.trajectory import Array

from shoal_validation.stability.contract import Axis, Method, StabilityMap, Watched
from shoal_validation.stability.methods import CASADI_CVODES, EXUDYN, GAUSS
from shoal_validation.stability.steps import SIZE, TIMES

LAWS = ("plane-stress", "lame", "enhanced", "two-point")
KINDS: dict[str, dict[str, object]] = {
    "cable, full": {"element": "ancf-cable", "quadrature": "full"},
    "cable, reduced": {"element": "ancf-cable", "quadrature": "reduced"},
    "quintic": {"element": "ancf-quintic"},
    **{f"solid, {law}": {"element": "ancf-full", "law": law} for law in LAWS},
}


def _rods(fields: dict[str, object]) -> dict[str, object]:
    return {f"bodies.{rod}.{field}": value for rod in ("OA", "AB") for field, value in fields.items()}


def _by(name: str, method: Method, kind: str) -> Method:
    return replace(method, name=f"{name}, {kind}", changes={**method.changes, **_rods(KINDS[kind])})


ADAPTIVE = Method("gauss", GAUSS, {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-9})
OTHERS = (("exudyn", EXUDYN[0]), ("casadi", CASADI_CVODES))


@cache
def _reference(slenderness: float) -> Array:
    """Path of B [m], (times, 2)."""
    fields = {**_mesh(16), **_height(slenderness), **_rods(KINDS["cable, reduced"]), "solver.step": 2e-4}
    run = ExudynEngine().simulate(load_scene("flexible-double-pendulum").with_values(fields), TIMES)
    if not run.ok:
        raise RuntimeError(f"no reference for slenderness {slenderness:g}: {run.message}")
    return run.marker("B")


def _mesh(elements: int) -> dict[str, object]:
    return {"bodies.OA.elements": elements, "bodies.AB.elements": 2 * elements}


def _height(slenderness: float) -> dict[str, object]:
    return {"bodies.OA.height": 2.0 / slenderness, "bodies.AB.height": 2.0 / slenderness}


def _watched(elements: int, slenderness: float) -> Watched:
    fields = {**_mesh(elements), **_height(slenderness)}
    scene = load_scene("flexible-double-pendulum")
    return Watched(scene, fields, "B", TIMES, _reference(slenderness), SIZE)


MAP = StabilityMap(
    "quadrature",
    "Which mesh does each element need, which of them lock, and which have spurious modes?",
    "The quintic element needs half the mesh of the cubic ones, and thin rods need more elements than thick ones. "
    "Plane stress, Lame's law and two points are nowhere within a thousandth; the spurious modes of two points "
    "break no run here. No check of one run can see the error of a mesh: only a second mesh shows it.",
    Axis("elements of OA (AB has twice as many)", "", (1, 2, 4, 8)),
    Axis("length over thickness of AB", "", (20.0, 100.0, 500.0)),
    (
        *(_by("gauss", ADAPTIVE, kind) for kind in KINDS),
        *(_by(name, method, kind) for name, method in OTHERS for kind in ("cable, full", "cable, reduced")),
        replace(EXUDYN[0], name="exudyn, geometrically exact", engine=ExudynEngine(beam="geometrically-exact")),
    ),
    _watched,
    lambda *_: {"solver.step": 1e-4},
)
