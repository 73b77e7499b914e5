"""Worst case of a limit, or of a bound of a marker, as a scene of its own."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shoal.atomic_write import atomic_write
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.response.inputs import UncertainParameter
from shoal.response.limits import VerifiedRun
from shoal.response.limits.judge import show
from shoal.response.limits.limit import Limit
from shoal.response.machine import quantities
from shoal.response.result import Response
from shoal.scene import Scene
from shoal.scene.edited import as_yaml

SIDES = "lower", "upper"


@dataclass(frozen=True)
class Worst:
    """of: the limit, or MARKER.QUANTITY.lower or .upper; scene: with the values that lead there; shown: its run."""

    of: str
    scene: Scene
    shown: VerifiedRun

    def save(self, path: Path) -> None:
        """Write the scene as YAML. Raises ComputationError."""
        with atomic_write(path) as part:
            part.write_text(as_yaml(self.scene.model_dump(mode="json", exclude_unset=True)))


def worst(found: Response, of: str = "") -> list[Worst]:
    """Return the worst cases of one limit or bound, else of every limit, else of the widest bound. Raises InputError.

    The runs of limits have been verified as the study was asked to; that of a bound is verified here.
    """
    limits = [one.limit.text for one in found.limits]
    if of not in limits and (of or not limits):
        of, shown = _bound(found, of or _widest(found))
        return [_case(found, of, shown)]
    wanted = [of] if of else limits
    cases = {one.limit.text: one.shown for one in found.limits if one.shown is not None and one.limit.text in wanted}
    if not cases:
        raise InputError(f"worst: no run comes near {' or '.join(wanted)}, so that there is no worst case")
    return [_case(found, text, shown) for text, shown in cases.items()]


def require_case(of: str, limits: Sequence[Limit], scene: Scene, parameters: Sequence[UncertainParameter]) -> None:
    """Check that a study of a scene with limits has such a case, before it is made. Raises InputError."""
    texts = [one.text for one in limits]
    if not of or of in texts:
        return
    marker, quantity, side = _parts(of)
    known = quantities(scene.dimensions)
    if side not in SIDES or marker not in scene.markers or quantity not in known:
        raise _no_case(of, texts, scene)
    if random := [one.name for one in parameters if one.marginal.random]:
        raise InputError(
            f"worst-of: {of} is a bound, and {random[0]} has a distribution, so that there are none; name a limit"
        )


def _parts(of: str) -> tuple[str, str, str]:
    """Marker, quantity and side of a bound; a marker's name may have dots."""
    place, _, side = of.rpartition(".")
    marker, _, quantity = place.rpartition(".")
    return marker, quantity, side


def _no_case(of: str, limits: Iterable[str], scene: Scene) -> InputError:
    stated = ", ".join(limits) or "there are none"
    known = f"MARKER one of {', '.join(scene.markers)} and QUANTITY one of {', '.join(quantities(scene.dimensions))}"
    return InputError(
        f"worst-of: {of!r} is neither a limit of the study ({stated}) nor, of intervals, MARKER.QUANTITY.lower or "
        f".upper, with {known}"
    )


def _case(found: Response, of: str, shown: VerifiedRun) -> Worst:
    if shown.status != "ok":
        raise InputError(f"worst: the run of {of} is not borne out: {shown.message}")
    scene = found.stated.with_values(shown.values)
    titles = {one.limit.text: one.limit.title for one in found.limits}
    about = f"Worst case of {titles.get(of, of)} for {found.scene}: {shown.margin:.4g} at {shown.time:g} s."
    return Worst(of, scene.model_copy(update={"name": f"{found.scene}-worst", "description": about}), shown)


def _widest(found: Response) -> str:
    if found.bounds is None:
        raise InputError("worst: distributions have no worst case but that of a limit; state one with --limit")
    width = found.bounds.upper - found.bounds.lower
    sizes = {
        (marker, quantity): float(found.column(marker, quantity, width).max())
        for marker in found.markers
        for quantity in found.axes
    }
    marker, quantity = max(sizes, key=lambda key: sizes[key])
    return f"{marker}.{quantity}.lower"


def _bound(found: Response, of: str) -> tuple[str, VerifiedRun]:
    """The run that attains a bound, where that lies farthest out."""
    marker, rest, side = _parts(of)
    if found.bounds is None or side not in SIDES or marker not in found.markers or rest not in found.quantities:
        raise _no_case(of, (one.limit.text for one in found.limits), found.stated)
    above = side == "upper"
    bound = found.column(marker, rest, getattr(found.bounds, side))
    arguments = found.column(marker, rest, (found.bounds.at_upper if above else found.bounds.at_lower).T).T
    instant = int(np.argmax(bound) if above else np.argmin(bound))
    # The margin to a bound of zero is the quantity itself, with its sign.
    at_bound = Limit(of, marker, rest, above, 0.0)
    shown = show(at_bound, found.stated, found.times, get_engine(found.engine), found.inputs, arguments[instant])
    value = -shown.margin if above else shown.margin
    return of, VerifiedRun(**{**vars(shown), "margin": value})
