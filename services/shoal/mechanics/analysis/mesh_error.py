"""Errors of places of rest and modes: the same computation on a finer mesh and with shear, compared.

The error of the mesh follows by Richardson extrapolation, from twice as many elements of all bodies.

The error of the finer of two meshes is d / (f - 1), with their distance d and the factor f by which it falls with each
doubling. Factors above that of second order are not used, though cables and quintic elements converge faster: an
estimate is rather too large than too small. A distance that fell by more is not used either: errors of second and of
higher order with opposite signs, as of a tapered cable, cancel on some mesh, where the distance is small by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Literal, TypeVar

import numpy as np

from shoal.errors import ShoalError
from shoal.mechanics.analysis.campbell import Campbell, campbell
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.modes import Modes, modes
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene
from shoal.scene.refined import refined
from shoal.scene.shear import stouter

T = TypeVar("T")

FALLS = (2.0, 4.0)
"""Between these factors the distance of two meshes is taken to fall with each doubling: at most as at order two."""
UNSEEN = 3.0
"""The factor while only one distance is known."""


def finer(scene: Scene) -> Scene | None:
    """The scene with twice the elements or modes of its flexible rods; None if there are none."""
    twice = refined(scene, 2)
    return scene.with_values(twice) if twice else None


def beyond(gap: float, last: float = np.nan) -> float:
    """Estimate the error of the finer of two meshes.

    gap: distance of the two; last: distance of the coarser one from one of half its elements, nan if not known
    """
    if not np.isfinite(last):
        return gap / (UNSEEN - 1.0)
    fall = float(np.clip(last / gap if gap > 0 else np.inf, *FALLS))
    return max(gap, last / FALLS[1]) / (fall - 1.0)


def second_runs(scene: Scene, run: Callable[[str, Scene], T], *, exact: bool = True) -> dict[str, T | None]:
    """Return a computation by source of error: on a finer mesh, and with the shear and inertia that slender rods lack.

    A source that the scene does not have is left out; None where a computation fails. run: of a source and its scene;
    exact: see `stouter`
    """
    found: dict[str, T | None] = {}
    for source, other in (("mesh", finer(scene)), ("theory", stouter(scene, exact=exact))):
        if other is not None:
            try:
                found[source] = run(source, other)
            except ShoalError:
                found[source] = None
    return found


def of_equilibrium(found: Equilibrium, scene: Scene) -> Equilibrium:
    """A place of rest of a scene with how far its markers are from the limit of ever finer meshes, about [m].

    And how far from where rods with shear rest, or, in space, rods that are softer by what shear is worth.
    """
    if not found.ok:
        return found
    if not any(scene.flexible_rods):
        return replace(found, estimated=True)
    runs = second_runs(scene, lambda _, other: statics(other, found.time, reactions=False))
    gaps = {source: apart(found, other) if other is not None and other.ok else None for source, other in runs.items()}
    gap = gaps.get("mesh")
    return replace(
        found,
        mesh_error=None if gap is None else gap + beyond(gap),
        theory_error=gaps.get("theory"),
        not_estimated=tuple(source for source, away in gaps.items() if away is None),
        estimated=True,
    )


def apart(one: Equilibrium, other: Equilibrium) -> float:
    """The largest distance of a marker [m]."""
    return float(np.max(np.linalg.norm(one.points - other.points, axis=1)))


def of_modes(found: Modes, scene: Scene) -> Modes:
    """Modes of a scene, each with how far its eigenvalue is about from the limit of ever finer meshes, relative.

    And how far from that with the shear and the rotary inertia that slender rods leave out.
    """
    if not found.ok:
        return found
    return _with_errors([found], scene, lambda other: [_modes(found, other)])[0] or found


def of_campbell(found: Campbell, scene: Scene) -> Campbell:
    """The same at every speed of a Campbell diagram."""
    if not found.ok:
        return found
    count = max((len(one.modes) for one in found.modes if one), default=1)

    def run(other: Scene) -> Sequence[Modes | None]:
        return campbell(other, found.speeds, about=_about(found.about), count=count).modes

    return replace(found, modes=tuple(_with_errors(found.modes, scene, run)))


def _modes(found: Modes, scene: Scene) -> Modes | None:
    """Those of another scene; None where it has none."""
    second = modes(scene, about=_about(found.about), count=len(found.modes))
    return second if second.ok else None


def _about(about: str) -> Literal["equilibrium", "start"]:
    return "start" if about == "start" else "equilibrium"


def _with_errors(
    found: Sequence[Modes | None], scene: Scene, run: Callable[[Scene], Sequence[Modes | None]]
) -> list[Modes | None]:
    """Modes with the errors of their eigenvalues. run: those of another scene, in the same order"""
    runs = second_runs(scene, lambda _, other: run(other))
    told = list[Modes | None]()
    for number, one in enumerate(found):
        if one is None:
            told.append(None)
            continue
        gaps = {source: _gaps(one, second[number] if second else None) for source, second in runs.items()}
        told.append(
            replace(
                one,
                mesh_errors=tuple(gap + beyond(gap) for gap in gaps.get("mesh", ())),
                theory_errors=gaps.get("theory", ()),
                not_estimated=tuple(source for source, errors in gaps.items() if not errors),
                estimated=True,
            )
        )
    return told


def _gaps(found: Modes, second: Modes | None) -> tuple[float, ...]:
    """Return the relative distances of the eigenvalues from those of a second run; none where it has fewer modes."""
    if second is None or len(second.modes) < len(found.modes):
        return ()
    pairs = zip(found.modes, second.modes, strict=False)
    return tuple(_apart(one.eigenvalue, other.eigenvalue) for one, other in pairs)


def _apart(one: complex, other: complex) -> float:
    """Return the relative distance of two eigenvalues."""
    return abs(one - other) / (abs(other) or abs(one) or 1.0)
