"""Limits, which must not be exceeded, and requirements, which must hold: MARKER.QUANTITY < NUMBER, or >.

Of a joint, or of the whole machine as well. A limit states what must not happen, a requirement the opposite. Margins
are positive as long as the quantity lies on the side that is required; their errors are the distances of the second
runs of a verified run.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from shoal.engines.contract import Engine
from shoal.engines.deviation import Deviation, by_source
from shoal.engines.verification import Verification
from shoal.error_budget import ErrorBudget
from shoal.errors import InputError
from shoal.response.limits.quantities import MARKERS, UNITS, check, engine_for, quantity_over_time, with_bodies
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

FORM = '"MARKER.QUANTITY < NUMBER", "JOINT.QUANTITY < NUMBER" or "energy < NUMBER", with <, > and abs(...)'
_EXPRESSION = re.compile(r"^\s*(abs\()?\s*(?:([^\s()<>]+)\.)?(\w+)\s*(\))?\s*(<|>)=?\s*(\S+)\s*$")


@dataclass(frozen=True)
class Limit:
    """Limit that is exceeded where a quantity lies beyond a bound: above it or below it, its absolute value or itself.

    text: as the user states it; place: a marker, a joint, or empty for the whole machine, as the quantity has it;
    above: whether it is exceeded above the bound; stated: as what must not happen, or as what is required
    """

    text: str
    place: str
    quantity: str
    above: bool
    bound: float
    absolute: bool = False
    stated: Literal["limit", "requirement"] = "limit"

    @property
    def is_required(self) -> bool:
        """Return whether the text is what must hold, not what must not happen."""
        return self.stated == "requirement"

    @property
    def required(self) -> str:
        """Required condition."""
        return self.text if self.is_required else self._on_side(not self.above)

    @property
    def excluded(self) -> str:
        """Excluded condition."""
        return self._on_side(self.above) if self.is_required else self.text

    @property
    def title(self) -> str:
        """The name of a limit or a requirement with the side that is required, for what is said of it."""
        if self.is_required:
            return f"requirement {self.text}"
        return f"limit {self.text} (must not happen; required: {self.required})"

    def verdict(self, kept: bool | None) -> str:
        """Describe a decision in words; kept: whether no interval values exceed the limit, None if undecided."""
        if self.is_required:
            return {True: "holds", False: "is violated", None: "is not decided"}[kept]
        return {True: "is kept", False: "is exceeded", None: "is not decided"}[kept]

    @property
    def event(self) -> str:
        """Verb for the event that has a probability."""
        return "is violated" if self.is_required else "is exceeded"

    def _on_side(self, above: bool) -> str:
        named = f"{self.place}.{self.quantity}" if self.place else self.quantity
        return f"{f'abs({named})' if self.absolute else named} {'>' if above else '<'} {self.bound:.12g}"

    @property
    def unit(self) -> str:
        """Unit of the bound and the margin."""
        return UNITS[self.quantity]

    @property
    def is_dynamic(self) -> bool:
        """Return whether the quantity takes masses and loads beside the motion of a marker."""
        return self.quantity not in {**MARKERS[2], **MARKERS[3]}

    def scene(self, scene: Scene) -> Scene:
        """Return the scene with the markers that the margins take."""
        return with_bodies(scene, self.quantity) if self.is_dynamic else scene

    def engine(self, engine: Engine, scene: Scene) -> Engine:
        """Return an engine whose trajectories give the margins. Raises InputError."""
        return engine_for(engine, scene, self.quantity) if self.is_dynamic else engine

    def instants(self, times: Array) -> Array:
        """Return the instants of a trajectory for margins at `times` [s]: angles are counted from the start."""
        return np.append(0.0, times) if self.is_dynamic and times[0] > 0.0 else times

    def tightened(self, off: float) -> Limit:
        """The limit that is exceeded by so much less, in its unit."""
        return replace(self, bound=self.bound - off if self.above else self.bound + off)

    def margin(self, of: Array) -> Array:
        """Return the distance of the quantity from the bound, negative beyond it."""
        value = np.abs(of) if self.absolute else of
        return np.asarray(self.bound - value if self.above else value - self.bound)

    def margins(self, motion: Trajectory, scene: Scene, values: Mapping[str, Array]) -> Array:
        """Return the margins of every lane at every instant, (lanes, instants). Raises InputError.

        scene: that of the motion, see `scene`; values: of its lanes by path
        """
        if not self.is_dynamic:
            return self.margin(_quantity(motion, self.place, self.quantity).T)
        try:
            return self.margin(quantity_over_time(motion, scene, values, self.quantity, self.place).T)
        except InputError as error:
            # What mechanics says of load cells it says of channels.
            field = "require" if self.is_required else "limit"
            raise InputError(f"{field}: {self.text}: {str(error).removeprefix('channels: ')}") from None


def limit(text: str, scene: Scene) -> Limit:
    """Return the limit of an excluded condition such as "B.y < 1". Raises InputError."""
    return _read("limit", text, scene)


def requirement(text: str, scene: Scene) -> Limit:
    """Return the limit whose opposite is a required condition such as "B.y > 1". Raises InputError."""
    found = _read("require", text, scene)
    return replace(found, above=not found.above, stated="requirement")


def read_limits(limits: Iterable[str], requirements: Iterable[str], scene: Scene) -> list[Limit]:
    """Limits, then requirements. Raises InputError, also for a text that is stated as both."""
    found = [limit(text, scene) for text in limits]
    for text in requirements:
        one = requirement(text, scene)
        if any(one.text == other.text and not other.is_required for other in found):
            raise InputError(
                f"require: {one.text}: is stated as a limit, too, which says that it must not happen; leave one out"
            )
        found.append(one)
    return found


def _read(field: str, text: str, scene: Scene) -> Limit:
    """Parse a condition. Raises InputError."""
    found = _EXPRESSION.match(text)
    if found is None or bool(found[1]) != bool(found[4]):
        raise InputError(f"{field}: {text!r} is not {FORM}")
    _, place, quantity, _, sign, number = found.groups()
    try:
        check(place or "", quantity, scene)
    except InputError as error:
        raise InputError(f"{field}: {text}: {error}") from None
    try:
        bound = float(number)
    except ValueError:
        bound = float("nan")
    if not np.isfinite(bound):
        raise InputError(f"{field}: {text}: {number!r} is no finite number; write {FORM}")
    return Limit(text.strip(), place or "", quantity, sign == ">", bound, bool(found[1]))


def _quantity(motion: Trajectory, marker: str, quantity: str) -> Array:
    """Return a kinematic quantity of a marker, (instants, lanes). Raises InputError."""
    k = motion.markers.index(marker)
    if quantity in motion.axes:
        return np.asarray(motion.points[:, k, motion.axes.index(quantity)])
    if quantity == "angle":
        return np.asarray(motion.angles[:, k])
    if motion.velocities is None or motion.rates is None:
        raise InputError(f"limit: engine {motion.engine} does not give {quantity}; there are x, y, angle")
    if quantity == "rate":
        return np.asarray(motion.rates[:, k])
    velocity = motion.velocities[:, k]
    return np.asarray(
        np.linalg.norm(velocity, axis=1) if quantity == "speed" else velocity[:, motion.axes.index(quantity[1])]
    )


@dataclass(frozen=True, eq=False)
class MarginErrors:
    """Known errors of the margins of one run.

    budget: the largest over time, by source; over_time: their sum, (instants,)
    """

    budget: ErrorBudget
    over_time: Array = field(default_factory=lambda: np.zeros(1))

    @property
    def unknown(self) -> bool:
        """Return whether they were looked for, and one could not be estimated."""
        return bool(self.budget.unknown)


def margin_errors(limit: Limit, verification: Verification | None, instants: int) -> MarginErrors:
    """Return the errors of a limit's quantity at the last instants of a run; none are known of one that failed."""
    if verification is None:
        return MarginErrors(ErrorBudget({}, limit.unit), np.zeros(instants))
    bending = any(any(one.scenes[0].flexible_rods) for one in verification.deviations)
    found = by_source(verification.deviations, lambda one: _error(limit, one, bending)[-instants:])
    largest: dict[str, float | None] = {source: float(error.max()) for source, error in found.items()}
    lacking = dict.fromkeys(verification.errors.unknown)
    over_time = sum(found.values(), np.zeros(instants))
    return MarginErrors(ErrorBudget({**lacking, **largest}, limit.unit), over_time)


def _error(limit: Limit, deviation: Deviation, bending: bool) -> Array:
    """Return the error of one source, (instants,). bending: whether the machine has flexible rods"""
    motion = deviation.one
    columns = (*motion.axes, "angle") if len(motion.axes) == 2 else tuple(motion.axes)
    if limit.quantity in columns:
        column = columns.index(limit.quantity)
        return np.asarray(deviation.of_markers()[:, motion.markers.index(limit.place), column])
    # The quantity itself, as the margins of its absolute value hide a change of sign.
    plain = replace(limit, absolute=False, above=True, bound=0.0)

    def quantity(run: Trajectory, scene: Scene) -> Array:
        return np.asarray(plain.margins(run, scene, {})[0])

    if deviation.source == "theory" and limit.is_dynamic and bending:
        # Rigid rods give no forces of flexible ones: what is left out is taken as the same share of the quantity.
        if not any(deviation.scenes[0].flexible_rods):
            return np.zeros(len(motion.times))
        return np.asarray(deviation.factor * np.maximum.accumulate(np.abs(quantity(motion, deviation.scenes[0]))))
    return deviation.of(quantity)
