"""Eigenfrequencies and shapes of small motions about a state at rest, or about a steady motion (see `steady`).

In a basis Z of the directions that the constraints leave free, Z' M Z = I, small motions obey
y'' + Z' D Z y' + Z' (K + sum lambda_k C_k,qq) Z y = 0 with the lambda that hold the state. About a state that is not an
equilibrium these are the motions relative to its fall. Dry friction is left out.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt

from shoal.arguments import check, one_of
from shoal.error_budget import ErrorBudget
from shoal.errors import ComputationError, InputError
from shoal.findings import Concluded, Finding
from shoal.json_values import plain
from shoal.mechanics.affine import points
from shoal.mechanics.analysis import left_out
from shoal.mechanics.analysis import modes_findings as kinds
from shoal.mechanics.analysis.at_rest import at_start
from shoal.mechanics.analysis.balance import BALANCED, Balance
from shoal.mechanics.analysis.damped import small
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.going_on import as_stated
from shoal.mechanics.analysis.modes_findings import ModesStatus, status_of
from shoal.mechanics.analysis.movers import movers
from shoal.mechanics.analysis.singular import crossing
from shoal.mechanics.analysis.small_motions import hides, pull
from shoal.mechanics.analysis.statics import seek
from shoal.mechanics.analysis.steady import EXACT, NotSteadyError, Steady, steady_motion
from shoal.mechanics.analysis.whirl import whirls
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.machine import Machine
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.scene import Scene

if TYPE_CHECKING:
    import pandas as pd

Complex = npt.NDArray[np.complex128]
ABOUT = ("equilibrium", "start")
COARSE = 0.5
"""An eigenvalue whose known error is above this part of it is not known."""
MOVED = 1e-6
"""A place farther from the start than this part of the machine's size is another."""
RELATIVE = "of the eigenvalue"
"""Unit of its errors."""


@dataclass(frozen=True, eq=False)
class Eigenmode:
    """One small motion, shape * exp(eigenvalue * t).

    eigenvalue [1/s]: imaginary part the frequency of the oscillation [rad/s], real part its growth. shape: displacement
    of the coordinates, real and with shape' M shape = 1 where nothing is damped, (unknowns,). points: displacement
    of the markers, (markers, d); angles: their turns, (markers,). hidden: whether the eigenvalue is 0
    within round-off that may hide a motion that matters. whirl: of a machine that turns, forward, backward
    or none; rotating: whether the eigenvalue is that in the turning frame, as the motion has several at rest. movers:
    the bodies that it moves, of an unstable one.
    """

    eigenvalue: complex
    shape: Complex
    points: Complex
    angles: Complex
    hidden: bool = False
    whirl: str = ""
    rotating: bool = False
    movers: str = ""

    @property
    def angular_frequency(self) -> float:
        """Frequency without the damping [rad/s]; 0 for motions that do not oscillate."""
        return abs(self.eigenvalue) if self.eigenvalue.imag > 0 else 0.0

    @property
    def frequency(self) -> float:
        """The same in Hz."""
        return self.angular_frequency / (2 * np.pi)

    @property
    def damped_frequency(self) -> float:
        """Frequency of the oscillation with its damping [Hz]."""
        return self.eigenvalue.imag / (2 * np.pi)

    @property
    def damping_ratio(self) -> float:
        """Damping over critical damping; 1 for motions that creep back, negative for those that grow."""
        return 0.0 - self.eigenvalue.real / abs(self.eigenvalue) if self.eigenvalue else 0.0

    @property
    def frame(self) -> str:
        """The frame that the eigenvalue is stated in: fixed or rotating."""
        return "rotating" if self.rotating else "fixed"

    @property
    def kind(self) -> str:
        """Return the kind of motion; that of a mode whose restoring force round-off hides is indeterminate."""
        if self.eigenvalue.real > 1e-9 * abs(self.eigenvalue):
            return "unstable"
        if not self.eigenvalue:
            return "untold" if self.hidden else "free"
        return "oscillating" if self.eigenvalue.imag > 0 else "creeping"


@dataclass(frozen=True, eq=False)
class Modes(Concluded):
    """The lowest modes about a state q, slowest first (unstable ones before all). balanced: whether forces balance.

    remarks: on the state that they are about. speed: of the steady motion that they are about [rad/s], None at rest.
    estimates: relative errors of the eigenvalues by source, (modes,): how far each is from
    the limit of ever finer meshes, and from that with shear and rotary inertia, None where not known; None where
    none were looked for
    """

    scene: Scene
    about: str
    balanced: bool
    remarks: Sequence[Finding]
    q: Array
    markers: tuple[str, ...]
    modes: tuple[Eigenmode, ...]
    speed: float | None = None
    estimates: Mapping[str, Array | None] | None = None

    @property
    def errors(self) -> tuple[ErrorBudget, ...]:
        """Known errors of each eigenvalue, relative; of a rigid machine without rods, nothing is left out."""
        if self.estimates is None:
            return (ErrorBudget({}, RELATIVE),) * len(self.modes)
        digits = float(np.finfo(float).eps) if self.speed is None else EXACT
        sources = self.estimates or {"rounding": np.full(len(self.modes), digits)}
        return tuple(
            ErrorBudget({name: None if each is None else float(each[k]) for name, each in sources.items()}, RELATIVE)
            for k in range(len(self.modes))
        )

    @property
    def mesh_errors(self) -> tuple[float, ...]:
        """Relative errors of the mesh, one for each mode; empty if not known."""
        found = None if self.estimates is None else self.estimates.get("mesh")
        return () if found is None else tuple(found.tolist())

    @property
    def ok(self) -> bool:
        """Return whether the modes may be believed, and none grows."""
        return self.status is ModesStatus.OK

    @property
    def status(self) -> ModesStatus:
        """The worst status that the findings imply."""
        return status_of(self.findings)

    @property
    def findings(self) -> list[Finding]:  # type: ignore[override]
        """Findings about the modes, which name those that are concerned, and about their state."""
        found = []
        if not self.balanced and self.about != "start":
            found.append(kinds.UNBALANCED.found("the forces do not balance"))
        growing = next((mode for mode in self.modes if mode.kind == "unstable"), None)
        if growing is not None:
            rate = growing.eigenvalue.real
            text = f"it does not stay there: a motion of {growing.movers} grows with exp(t * {rate:.4g}/s)"
            found.append(kinds.GROWS.found(text, rate=rate))
        hidden = [number for number, mode in enumerate(self.modes, 1) if mode.kind == "untold"]
        coarse = [number for number, error in enumerate(self.mesh_errors, 1) if error > COARSE]
        unknown = [number for number, error in enumerate(self.errors, 1) if (error.total or 0.0) > COARSE]
        unknown = [number for number in unknown if number not in coarse]
        for numbers, kind, text in (
            (hidden, kinds.INDETERMINATE, "round-off hides whether anything holds {}"),
            (coarse, kinds.COARSE, "the mesh is too coarse for {}"),
            (unknown, kinds.BEYOND_THEORY, "slender rods leave out too much of {}: shear and rotary inertia"),
        ):
            if numbers:
                found.append(kind.found(text.format(_named(numbers)), first=numbers[0], count=len(numbers)))
        return [*found, *self.remarks]

    @property
    def frequencies(self) -> Array:
        """Frequencies without damping [Hz], (modes,)."""
        return np.array([mode.frequency for mode in self.modes])

    def to_pandas(self) -> pd.DataFrame:
        """A row a mode, lowest first: kind, frequencies [Hz], damping ratio, growth [1/s], relative errors."""
        import pandas as pd

        rows = [
            {
                "kind": mode.kind,
                "frequency": mode.frequency,
                "damped_frequency": mode.damped_frequency,
                "damping_ratio": mode.damping_ratio,
                "growth": mode.eigenvalue.real,
                "mesh_error": self.mesh_errors[number] if self.mesh_errors else np.nan,
                "whirl": mode.whirl,
                "frame": mode.frame,
                "error": np.nan if (error := self.errors[number].total) is None else error,
            }
            for number, mode in enumerate(self.modes)
        ]
        return pd.DataFrame(rows, index=pd.RangeIndex(1, len(rows) + 1, name="mode"))

    def to_json(self) -> dict[str, Any]:
        """Plain data, which `shoal modes --json` prints."""
        return {
            "status": str(self.status),
            "message": self.message,
            "advice": self.advice,
            "findings": [one.to_json() for one in self.findings],
            "about": self.about,
            "balanced": self.balanced,
            "speed": self.speed,
            "modes": [
                {
                    "kind": mode.kind,
                    "frequency": mode.frequency,
                    "angular_frequency": mode.angular_frequency,
                    "damped_frequency": mode.damped_frequency,
                    "damping_ratio": mode.damping_ratio,
                    "growth": mode.eigenvalue.real,
                    "whirl": mode.whirl,
                    "frame": mode.frame,
                    "mesh_error": self.errors[number].estimates.get("mesh"),
                    "theory_error": self.errors[number].estimates.get("theory"),
                    "error": self.errors[number].total,
                    "shape": {
                        name: {
                            **{f"d{axis}": _two(part) for axis, part in zip("xyz", mode.points[k], strict=False)},
                            "dangle": _two(mode.angles[k]),
                        }
                        for k, name in enumerate(self.markers)
                    },
                }
                for number, mode in enumerate(self.modes)
            ],
        }


def modes(
    scene: Scene,
    *,
    about: Literal["equilibrium", "start"] = "equilibrium",
    time: float = 0.0,
    count: int = 10,
    leave_unstable: bool = True,
) -> Modes:
    """The lowest modes about the equilibrium, or about the start of the scene, with loads and drives at time [s].

    Where the start moves, they are those about its steady motion; where it moves otherwise, those at rest, which are
    not the answer (see `Modes.status`). Raises InputError if the scene cannot be modelled, ComputationError if there
    is no equilibrium, it is singular, or small motions about a steady one are periodic in time.
    """
    one_of("about", about, ABOUT)
    check(time=time, count=count)
    evaluator, moving = (at_start if about == "start" else as_stated)(scene, horizon=time), list[Finding]()
    if is_moving(evaluator, time):
        refuse_contacts(evaluator)
        q, v = (part[:, 0].copy() for part in (evaluator.model.q0, evaluator.model.v0))
        try:
            return modes_of_motion(scene, evaluator, q, v, about=about, time=time, count=count)[0]
        except NotSteadyError as error:
            why = str(error).removeprefix(f"{scene.name}: ")
            moving = [kinds.MOVING.found(f"{why}; these modes are those at rest", *_but_for_gravity(scene, about))]
    found = modes_at_rest(scene, about=about, time=time, count=count, leave_unstable=leave_unstable)
    return replace(found, remarks=[*moving, *found.remarks])


def _but_for_gravity(scene: Scene, about: str) -> list[str]:
    """Return advice for a motion that only gravity keeps from being steady, as of a horizontal flexible shaft."""
    if not np.any(scene.gravity):
        return []
    try:
        weightless = scene.with_values({"gravity": [0.0] * scene.dimensions})
        evaluator = as_stated(weightless)
        q, v = (part[:, 0].copy() for part in (evaluator.model.q0, evaluator.model.v0))
        steady_motion(weightless, Machine.of(weightless).placement, evaluator, q, v, 0.0, seek=about == "equilibrium")
    except (ComputationError, InputError):
        return []
    zeros = ",".join("0" * scene.dimensions)
    shaft = " (or take element ancf-cable for a shaft)" if scene.flexible_rods and scene.dimensions == 3 else ""
    return [f"gravity alone acts against it: it is steady with --set gravity=[{zeros}]{shaft}"]


def refuse_contacts(evaluator: Evaluator) -> None:
    """Raises InputError for machines with one-sided constraints or states, of which steady motions know nothing."""
    if evaluator.model.gaps.size:
        raise InputError(f"{evaluator.model.gap_fields[0]}: steady motions take no one-sided constraints")
    for name in evaluator.model.scene.states:
        raise InputError(
            f"states.{name}: modes about steady motions take signals, but no states yet; "
            "`linearize` with about: start does"
        )


def is_moving(evaluator: Evaluator, time: float) -> bool:
    """Return whether the start has rates or a drive moves at time [s]."""
    q, v = evaluator.model.q0[:, 0], evaluator.model.v0[:, 0]
    return bool(np.max(np.abs(v), initial=0.0) > left_out.STILL or left_out.driving(evaluator, q, time))


def modes_at_rest(
    scene: Scene, *, about: str = "equilibrium", time: float = 0.0, count: int = 10, leave_unstable: bool = True
) -> Modes:
    """The lowest modes of a machine at rest, of whose start the rates are left out."""
    if about == "equilibrium":
        equilibrium, balance = seek(scene, time, leave_unstable=leave_unstable, reactions=False)
        if not equilibrium.balanced:
            raise ComputationError(f"{scene.name}: no equilibrium to vibrate about: {equilibrium.explanation}")
        balance.left_out = balance.left_out[:0]
        remarks = [kinds.ABOUT_DOUBTED.found(one.text) if one.kind.implies else one for one in equilibrium.findings]
        return _modes(balance, scene, equilibrium.q, count, "equilibrium", remarks)
    evaluator = at_start(scene, horizon=time)
    balance = _balance(scene, evaluator, time)
    q, gap = balance.restore(evaluator.model.q0[:, 0].copy())
    if gap > 1e-9:
        raise ComputationError(f"{scene.name}: the joints cannot be closed at the start; they gape by {gap:.2g}")
    return _modes(balance, scene, q, count, "start", _friction(scene))


def modes_of_motion(
    scene: Scene, evaluator: Evaluator, q: Array, v: Array, *, about: str, time: float, count: int
) -> tuple[Modes, Steady]:
    """The lowest modes about the steady motion that begins at coordinates q with rates v, and that motion."""
    placement = Machine.of(scene).placement
    motion = steady_motion(scene, placement, evaluator, q, v, time, seek=about == "equilibrium")
    metric, freedom = motion.metric, motion.here().freedom
    if names := crossing(evaluator, metric, freedom, motion.q, time):
        raise ComputationError(_singular(scene, names))
    at, turning = _seen(scene, placement, evaluator, motion.q)
    told = tuple(
        _named_movers(
            Eigenmode(one.value, one.shape, at @ one.shape, turning @ one.shape, False, one.whirl, one.rotating), scene
        )
        for one in whirls(motion, placement)[:count]
    )
    axis = ", ".join(f"{part:.4g}" for part in np.round(motion.axis, 9) + 0.0)
    how = f"at {motion.speed:.6g} rad/s about ({axis})" if motion.speed else "that advances"
    remarks = [kinds.STEADY_MOTION.found(f"about the steady motion {how}", speed=motion.speed)]
    if motion.moved > MOVED * span(scene):
        text = f"its place is {motion.moved:.2g} m from the start"
        remarks.append(kinds.ELSEWHERE.found(text, distance=float(motion.moved)))
    if any(mode.rotating for mode in told):
        remarks.append(kinds.TURNING_FRAME.found("frequencies of frame rotating are those in the turning frame"))
    remarks += _friction(scene)
    markers = tuple(scene.markers)
    return Modes(scene, about, True, remarks, motion.q, markers, told, speed=motion.speed), motion


def _friction(scene: Scene) -> list[Finding]:
    dry = left_out.friction(scene, None)
    return [kinds.FRICTION_LEFT_OUT.found(dry)] if dry else []


def _balance(scene: Scene, evaluator: Evaluator, time: float) -> Balance:
    mass = sum(float(body.mass) for body in scene.bodies.values())
    return Balance(evaluator, time, span(scene), mass)


def _modes(balance: Balance, scene: Scene, q: Array, count: int, about: str, remarks: list[Finding]) -> Modes:
    evaluator, time = balance.evaluator, balance.t
    free = balance.look(q).freedom
    if idle := [name for name, force in balance.hold(q).items() if not force]:
        raise ComputationError(
            f"{scene.name}: {', '.join(idle)} touches without a force: small motions open and close it; they have no "
            "frequencies"
        )
    refuse_rough(scene, balance)
    view = balance.look(q)
    if names := crossing(evaluator, balance.metric, free, q, time):
        raise ComputationError(_singular(scene, names))
    roots = small(balance, q, view, count)
    squares = np.abs(roots.values) ** 2
    hidden = [
        not value and hides(level**2, squares, pull(scene))
        for value, level in zip(roots.values, roots.levels, strict=True)
    ]
    at, turning = _seen(scene, Machine.of(scene).placement, evaluator, q)
    told = tuple(
        _named_movers(Eigenmode(complex(value), shape, at @ shape, turning @ shape, unknown), scene)
        for value, shape, unknown in list(zip(roots.values, roots.shapes.T, hidden, strict=True))[:count]
    )
    balanced = balance.residual(view) <= BALANCED
    return Modes(scene, about, balanced, remarks, q, tuple(scene.markers), told)


def refuse_rough(scene: Scene, balance: Balance) -> None:
    """Raises ComputationError where closed contacts have friction: small motions stick to them."""
    if names := balance.rough:
        raise ComputationError(
            f"{scene.name}: {', '.join(names)} has friction, and small motions that stick or roll are not known yet; "
            "leave mu and rolling out of contacts that slide without"
        )


def _named_movers(mode: Eigenmode, scene: Scene) -> Eigenmode:
    """Name the bodies that an unstable mode moves."""
    if mode.kind != "unstable":
        return mode
    return replace(mode, movers=movers(Machine.of(scene).placement, span(scene), mode.shape))


def _seen(scene: Scene, placement: Placement, evaluator: Evaluator, q: Array) -> tuple[Array, Array]:
    """Displacements and turns of the markers by the coordinates, (markers, d, unknowns) and (markers, unknowns)."""
    unknowns = evaluator.model.unknowns
    at = points([placement.point(scene, side) for side in scene.markers.values()], unknowns).matrix
    lines = points([placement.direction(scene, side) for side in scene.markers.values()], unknowns)
    return at, lines.turning(q)


def _singular(scene: Scene, names: tuple[str, ...]) -> str:
    return (
        f"{scene.name}: no small motions about a singular place: "
        f"there {', '.join(names)} may move in more ways than beside it"
    )


def _named(numbers: list[int]) -> str:
    """Modes by number."""
    return f"mode{'s' if len(numbers) > 1 else ''} {', '.join(map(str, numbers))}"


def _two(value: complex) -> Any:
    """A real number, or real and imaginary part."""
    value = complex(value)
    return plain(value.real) if value.imag == 0 else plain([value.real, value.imag])
