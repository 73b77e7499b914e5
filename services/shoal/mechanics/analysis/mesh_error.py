"""Errors of equilibria, modes and reactions: the same computation on a finer mesh and with shear, compared.

The error of the mesh follows by Richardson extrapolation, from twice as many elements of all bodies.

The error of the finer of two meshes is d / (f - 1), with their distance d and the factor f by which it falls with each
doubling. Factors above that of second order are not used, though cables and quintic elements converge faster: an
estimate is rather too large than too small. A distance that fell by more is not used either: errors of second and of
higher order with opposite signs, as of a tapered cable, cancel on some mesh, where the distance is small by chance.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal, TypeVar

import numpy as np

from shoal.errors import ShoalError
from shoal.mechanics.analysis.campbell import Campbell, campbell
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.modes import Modes, modes
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.numerics.tile import Array
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


def estimates(
    found: Sequence[T | None],
    scene: Scene,
    run: Callable[[str, Scene], Sequence[T | None]],
    apart: Callable[[T, T], Array | float | None],
    *,
    exact: bool = True,
) -> list[dict[str, Any]]:
    """Return the errors of each of some results, by source: their distances from those of more careful runs.

    These are on a finer mesh, and with the shear and inertia that slender rods lack. A source that the scene does not
    have is left out; None where the run fails, or has no such result. run: computes the results again, of a source and
    its scene; apart: distance of two, None where they cannot be compared; exact: see `stouter`
    """
    errors: list[dict[str, Any]] = [{} for _ in found]
    for source, other, worth in (
        ("mesh", finer(scene), 1.0 + beyond(1.0)),
        ("theory", stouter(scene, exact=exact), 1.0),
    ):
        if other is None:
            continue
        try:
            second = run(source, other)
        except ShoalError:
            second = [None] * len(found)
        for one, two, by_source in zip(found, second, errors, strict=True):
            away = None if one is None or two is None else apart(one, two)
            by_source[source] = None if away is None else worth * away
    return errors


def of_equilibrium(found: Equilibrium, scene: Scene) -> Equilibrium:
    """A place of rest of a scene with how far its markers are from the limit of ever finer meshes, about [m].

    And how far from where rods with shear rest, or, in space, rods that are softer by what shear is worth.
    """
    if not found.ok:
        return found
    if not any(scene.flexible_rods):
        return replace(found, estimates={})

    def run(_: str, other: Scene) -> list[Equilibrium | None]:
        second = statics(other, found.time, reactions=False)
        return [second if second.ok else None]

    (errors,) = estimates([found], scene, run, apart)
    return replace(found, estimates=errors)


def apart(one: Equilibrium, other: Equilibrium) -> float:
    """The largest distance of a marker [m]."""
    return float(np.max(np.linalg.norm(one.points - other.points, axis=1)))


def of_modes(found: Modes, scene: Scene) -> Modes:
    """Modes of a scene, each with how far its eigenvalue is about from the limit of ever finer meshes, relative.

    And how far from that with the shear and the rotary inertia that slender rods leave out.
    """
    if not found.ok:
        return found

    def run(_: str, other: Scene) -> list[Modes | None]:
        second = modes(other, about=_about(found.about), count=len(found.modes))
        return [second if second.ok else None]

    (errors,) = estimates([found], scene, run, _gaps)
    return replace(found, estimates=errors)


def of_campbell(found: Campbell, scene: Scene) -> Campbell:
    """The same at every speed of a Campbell diagram."""
    if not found.ok:
        return found
    count = max((len(one.modes) for one in found.modes if one), default=1)

    def run(_: str, other: Scene) -> Sequence[Modes | None]:
        return campbell(other, found.speeds, about=_about(found.about), count=count).modes

    pairs = zip(found.modes, estimates(found.modes, scene, run, _gaps), strict=True)
    return replace(found, modes=tuple(one and replace(one, estimates=errors) for one, errors in pairs))


def _about(about: str) -> Literal["equilibrium", "start"]:
    return "start" if about == "start" else "equilibrium"


def _gaps(found: Modes, second: Modes) -> Array | None:
    """Return the relative distances of the eigenvalues from those of a second run; None where it has fewer modes."""
    if len(second.modes) < len(found.modes):
        return None
    pairs = zip(found.modes, second.modes, strict=False)
    return np.array([_apart(one.eigenvalue, other.eigenvalue) for one, other in pairs])


def _apart(one: complex, other: complex) -> float:
    """Return the relative distance of two eigenvalues."""
    return abs(one - other) / (abs(other) or abs(one) or 1.0)
