"""How far what is computed of a machine is off for its mesh: by the same once more, on twice as many elements of all.

Two meshes differ by less than the coarser one is off, as the finer one is off, too: by d / (f - 1), where d is how far
they differ and f the factor by which that falls with each doubling. No factor above that of second order is believed,
though cables and quintic elements converge faster: an error is rather told too large than too small. Nor is a distance
that fell by more: an error of second order and a faster one of the other sign, such as a tapered cable has, cancel on
some mesh, and the distance is small there by chance.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from shoal.mechanics.analysis.campbell import Campbell, campbell
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.mechanics.analysis.modes import Modes, modes
from shoal.mechanics.analysis.statics import statics
from shoal.scene import Scene
from shoal.scene.refined import refined

FALLS = (2.0, 4.0)
"""Between these factors the distance of two meshes is taken to fall with each doubling: at most as at order two."""
UNSEEN = 3.0
"""The factor while only one distance is known."""


def finer(scene: Scene) -> Scene | None:
    """The scene with twice the elements or modes of its flexible rods; None if there are none."""
    twice = refined(scene, 2)
    return scene.with_values(twice) if twice else None


def beyond(gap: float, last: float = np.nan) -> float:
    """How far the finer of two meshes is from the limit of ever finer ones.

    gap: how far the two differ; last: how far the coarser one differs from one of half its elements, nan if not known
    """
    if not np.isfinite(last):
        return gap / (UNSEEN - 1.0)
    fall = float(np.clip(last / gap if gap > 0 else np.inf, *FALLS))
    return max(gap, last / FALLS[1]) / (fall - 1.0)


def of_equilibrium(found: Equilibrium, scene: Scene) -> Equilibrium:
    """A place of rest of a scene with how far its markers are from the limit of ever finer meshes, about [m]."""
    second = None if not found.ok or (fine := finer(scene)) is None else statics(fine, found.time)
    if second is None or not second.ok:
        return found
    gap = apart(found, second)
    return replace(found, mesh_error=gap + beyond(gap))


def apart(one: Equilibrium, other: Equilibrium) -> float:
    """The largest distance of a marker [m]."""
    return float(np.max(np.linalg.norm(one.points - other.points, axis=1)))


def of_modes(found: Modes, scene: Scene) -> Modes:
    """Modes of a scene, each with how far its eigenvalue is about from the limit of ever finer meshes, relative."""
    if not found.ok or (fine := finer(scene)) is None:
        return found
    second = modes(fine, about="start" if found.about == "start" else "equilibrium", count=len(found.modes))
    return _of(found, second) if second.ok else found


def of_campbell(found: Campbell, scene: Scene) -> Campbell:
    """The same at every speed of a Campbell diagram."""
    if not found.ok or (fine := finer(scene)) is None:
        return found
    count = max((len(one.modes) for one in found.modes if one), default=1)
    second = campbell(fine, found.speeds, about="start" if found.about == "start" else "equilibrium", count=count)
    pairs = zip(found.modes, second.modes, strict=True)
    return replace(found, modes=tuple(one and (_of(one, other) if other else one) for one, other in pairs))


def _of(found: Modes, second: Modes) -> Modes:
    """Modes with the errors that follow from those on a finer mesh."""
    if len(second.modes) < len(found.modes):
        return found
    pairs = zip(found.modes, second.modes, strict=False)
    gaps = (_apart(one.eigenvalue, other.eigenvalue) for one, other in pairs)
    return replace(found, mesh_errors=tuple(gap + beyond(gap) for gap in gaps))


def _apart(one: complex, other: complex) -> float:
    """How far two eigenvalues are apart, relative."""
    return abs(one - other) / (abs(other) or abs(one) or 1.0)
