"""Campbell diagram: the frequencies of a machine over the speed at which it turns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from shoal.arguments import check, one_of
from shoal.errors import ComputationError, InputError
from shoal.findings import Concluded, Finding, Kind
from shoal.mechanics.analysis import left_out
from shoal.mechanics.analysis import modes_findings as kinds
from shoal.mechanics.analysis.going_on import as_stated
from shoal.mechanics.analysis.modes import ABOUT, Modes, modes_at_rest, modes_of_motion, refuse_contacts
from shoal.mechanics.analysis.modes_findings import ModesStatus, status_of
from shoal.mechanics.analysis.steady import steady_motion
from shoal.mechanics.machine import Machine
from shoal.scene import Scene

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, eq=False)
class Campbell(Concluded):
    """Modes at speeds [rad/s] of the body that turns fastest at the start, whose rates are scaled to each.

    modes: at each speed, None where there is no steady motion; reasons: why not, by speed
    """

    scene: Scene
    about: str
    speeds: tuple[float, ...]
    modes: tuple[Modes | None, ...]
    reasons: dict[float, str]

    @property
    def ok(self) -> bool:
        """Return whether modes are known at all speeds; a motion that grows is an answer here."""
        return self.status is ModesStatus.OK

    @property
    def status(self) -> ModesStatus:
        """The worst status that the findings imply."""
        return status_of(self.findings)

    @property
    def findings(self) -> list[Finding]:  # type: ignore[override]
        """Reasons not to trust the modes at some speeds, one of a kind, and the speeds at which a motion grows."""
        found: dict[Kind, list[tuple[float, Finding]]] = {}
        grows = {}
        for speed, one in zip(self.speeds, self.modes, strict=True):
            doubts = [kinds.NO_STEADY_MOTION.found(self.reasons[speed])] if one is None else one.findings
            for doubt in doubts:
                if doubt.kind is kinds.GROWS and one is not None:
                    grows[f"{speed:g}"] = next(mode.movers for mode in one.modes if mode.kind == "unstable")
                elif doubt.kind.implies:
                    found.setdefault(doubt.kind, []).append((speed, doubt))
        result = []
        for each in found.values():
            (speed, first), at = each[0], ", ".join(f"{speed:g}" for speed, _ in each)
            result.append(replace(first, text=f"at {at} rad/s: {first.text}", numbers=first.numbers | {"speed": speed}))
        if grows:
            movers = "; ".join(dict.fromkeys(grows.values()))
            result.append(kinds.GROWS_AT.found(f"a motion grows at {', '.join(grows)} rad/s, of {movers}"))
        return result

    @property
    def critical_speeds(self) -> list[float]:
        """Speeds [rad/s] at which a forward whirl has the frequency of the rotation, interpolated linearly."""
        found: list[float] = []
        whirls = [
            [mode.eigenvalue.imag for mode in one.modes if mode.whirl == "forward"] if one else [] for one in self.modes
        ]
        for k, ends in enumerate(zip(self.speeds, self.speeds[1:], strict=False)):
            for pair in zip(whirls[k], whirls[k + 1], strict=False):
                before, after = (frequency - speed for frequency, speed in zip(pair, ends, strict=True))
                if before * after < 0.0 or after == 0.0:
                    found.append(ends[0] + (ends[1] - ends[0]) * before / (before - after))
        return sorted(found)

    def to_pandas(self) -> pd.DataFrame:
        """A row a speed and mode, with the columns of `Modes.to_pandas`."""
        import pandas as pd

        tables = {speed: one.to_pandas() for speed, one in zip(self.speeds, self.modes, strict=True) if one is not None}
        return pd.concat(tables, names=["speed"]) if tables else pd.DataFrame()

    def to_json(self) -> dict[str, Any]:
        """Plain data, which `shoal modes --speeds ... --json` prints."""
        return {
            "status": str(self.status),
            "message": self.message,
            "advice": self.advice,
            "findings": [one.to_json() for one in self.findings],
            "about": self.about,
            "critical_speeds": self.critical_speeds,
            "speeds": [
                (one.to_json() if one else {"status": "moving", "message": self.reasons[speed], "modes": []})
                | {"speed": speed}
                for speed, one in zip(self.speeds, self.modes, strict=True)
            ],
        }


def campbell(
    scene: Scene,
    speeds: Sequence[float],
    *,
    about: Literal["equilibrium", "start"] = "equilibrium",
    count: int = 10,
) -> Campbell:
    """The `count` lowest modes at each speed [rad/s], the rates of the start scaled to it; at speed 0 at rest.

    Raises InputError where nothing turns at the start, or a drive says how fast.
    """
    one_of("about", about, ABOUT)
    check(count=count)
    speeds = tuple(map(float, speeds))
    if not speeds or not all(np.isfinite(speed) and speed >= 0 for speed in speeds):
        raise InputError(f"speeds: give speeds of at least 0 rad/s, found {', '.join(map(str, speeds)) or 'none'}")
    evaluator, placement = as_stated(scene), Machine.of(scene).placement
    refuse_contacts(evaluator)
    q, v = (part[:, 0].copy() for part in (evaluator.model.q0, evaluator.model.v0))
    if any(speeds):
        if np.max(np.abs(v), initial=0.0) <= left_out.STILL:
            raise InputError(
                "speeds: nothing turns at the start; state what turns and about which axis, such as "
                f"initial.{next(iter(scene.bodies))}.{'rate: 1' if scene.dimensions == 2 else 'spin: [1, 0, 0]'}"
            )
        if driven := left_out.driving(evaluator, q, 0.0):
            raise InputError(
                f"speeds: the drive {driven[0]} says how fast the machine turns; change it by --set instead"
            )
    found: list[Modes | None] = []
    reasons: dict[float, str] = {}
    begin, rates, begun = q, v, 0.0
    for speed in speeds:
        try:
            if speed == 0.0:
                found.append(modes_at_rest(scene, about=about, count=count, leave_unstable=False))
                continue
            if not begun:
                begun = steady_motion(scene, placement, evaluator, q, v, 0.0, seek=about == "equilibrium").speed
                if not begun:
                    raise InputError("speeds: the start advances and nothing turns; state a spin in initial")
            if about == "start":
                begin, rates = q, v * (speed / begun)
            else:
                rates = rates * (speed / begun)
            one, motion = modes_of_motion(scene, evaluator, begin, rates, about=about, time=0.0, count=count)
            if about != "start":
                begin, rates, begun = motion.q, motion.v, motion.speed
            found.append(one)
        except ComputationError as error:
            found.append(None)
            reasons[speed] = str(error).removeprefix(f"{scene.name}: ")
            if about != "start":
                begin, rates, begun = q, v, 0.0
    return Campbell(scene, about, speeds, tuple(found), reasons)
