"""Linear models of a machine: x' = A x + B u, y = C x + D u of deviations from a state, for the design of controllers.

At rest, in a basis Z of the directions that the constraints leave free, Z' M Z = I, small motions dq = Z z obey
z'' + Z'D Z z' + Z'(K + sum lambda_k C_k,qq) Z z = Z' dQ/du u, with feedback by signals in K and D, and all derivatives
are exact. The states x are angles and places of the machine and their rates, if these describe all directions well,
else the amplitudes of its modes. About a motion, or where forces do not balance, see `moving_slopes`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
import scipy.linalg
from pydantic import ValidationError

from shoal.arguments import check, one_of
from shoal.errors import ComputationError, InputError
from shoal.findings import Concluded, Finding
from shoal.json_values import plain
from shoal.mechanics import plane
from shoal.mechanics.analysis import left_out
from shoal.mechanics.analysis import modes_findings as kinds
from shoal.mechanics.analysis.at_rest import begun
from shoal.mechanics.analysis.balance import BALANCED, Balance
from shoal.mechanics.analysis.damped import AT_MOST, Roots, small
from shoal.mechanics.analysis.evaluate import Evaluator, Probe
from shoal.mechanics.analysis.freedom import Metric
from shoal.mechanics.analysis.going_on import resting
from shoal.mechanics.analysis.modes import is_moving, refuse_rough
from shoal.mechanics.analysis.modes_findings import ModesStatus, status_of
from shoal.mechanics.analysis.moving_slopes import Probed, slopes
from shoal.mechanics.analysis.small_motions import BoundedMatrix
from shoal.mechanics.analysis.statics import seek
from shoal.mechanics.gaps import DRY
from shoal.mechanics.machine import Machine
from shoal.mechanics.margins import MARGINS, Margins, Required, margins, read_all
from shoal.mechanics.numerics.tile import Array
from shoal.mechanics.reach import span
from shoal.mechanics.simulate import simulate
from shoal.scene import DistributedForce, Force, PointMass, Revolute, Scene, SignalFunction, Slider, Thrust, Torque
from shoal.scene.formula import Measure, Node
from shoal.scene.signals import (
    SLIDING,
    TURNING,
    Constant,
    StateValue,
    Table,
    check_leaves,
    continuous_states,
    formula_of,
    is_of_time,
    refuse_sampled,
    written_out,
)

Complex = npt.NDArray[np.complex128]
ABOUT = ("equilibrium", "start", "trajectory")
WELL_POSED = 1e6
"""Condition of the measures that are states, by free direction, beyond which modes are taken in their place."""
DEPENDENT = 1e-6
"""A measure of which others leave a smaller part is none of a further direction."""
RATES = {"angle": "rate", "slide": "slide_rate", "position": "velocity", "distance": "distance_rate"}
COARSE = 1e-3
"""Differences that are apart by more of the largest entry are no derivatives."""
FAR = 1e-3
"""A zero beyond a thousand times the fastest pole is infinite."""
DOUBLE = 4.0 * float(np.sqrt(np.finfo(float).eps))
"""Poles of an open loop below this part of the largest are zero: round-off of a double root, as of two integrators."""
SAMPLES = 2001
"""Samples of a trajectory, between which no body makes half a turn."""
CLOSED = 1e-9
"""What joints may gape at a start that is at rest [m]."""


@dataclass(frozen=True, eq=False)
class LinearModel(Concluded):
    """A linear model: x' = A x + B u, y = C x + D u, of deviations from a state.

    a, b, c, d: A, B, C and D; states, inputs, outputs: names of x, u and y, states with their rates second; at: values
    of the outputs in the state that the model is about. poles [1/s]: eigenvalues of A, those that are zero within
    round-off as zeros. error: of A and C, relative to their largest entry. remarks: on the state that it is about.
    loop: of an open loop the signal where it is broken; closed_poles: then those of the closed one; required: margins.
    """

    scene: Scene
    about: str
    a: Array
    b: Array
    c: Array
    d: Array
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    at: Array
    error: float
    poles: Complex
    remarks: Sequence[Finding]
    loop: str = ""
    closed_poles: Complex | None = None
    required: Sequence[Required] = ()

    @cached_property
    def margins(self) -> Margins | None:
        """Stability margins of the open loop, None of a model of inputs and outputs."""
        if self.closed_poles is None:
            return None
        stable = bool(np.all(self.closed_poles.real < 0.0))
        return margins(self.a, self.b[:, 0], self.c[0], float(self.d[0, 0]), stable=stable)

    @property
    def findings(self) -> list[Finding]:  # type: ignore[override]
        """Findings about the state, and whether the machine leaves it; of an open loop whether the closed one does."""
        if self.margins is not None:
            return [*self._of_margins(self.margins), *self.remarks]
        found = []
        growing = self.poles[np.argmax(self.poles.real)] if len(self.poles) else 0.0
        if growing.real > 0.0:
            text = f"it does not stay there: a pole grows with exp(t * {growing.real:.4g}/s)"
            found.append(kinds.UNSTABLE_POLE.found(text, rate=float(growing.real)))
        return [*found, *self.remarks]

    def _of_margins(self, found: Margins) -> Iterator[Finding]:
        if not found.stable and self.closed_poles is not None:
            worst = float(np.max(self.closed_poles.real))
            yield kinds.LOOP_UNSTABLE.found(f"the closed loop is not stable: a pole has the real part {worst:.4g}/s")
        for one in self.required:
            if not one.holds(found):
                value = float(getattr(found, one.quantity))
                unit = MARGINS[one.quantity].replace("1", "")
                yield kinds.NOT_MET.found(f"{one.text} does not hold: it is {value:.4g} {unit}".rstrip(), value=value)

    @property
    def status(self) -> ModesStatus:
        """The worst status that the findings imply."""
        return status_of(self.findings)

    @property
    def ok(self) -> bool:
        """Return whether the model may be believed; an unstable one may."""
        return self.status is ModesStatus.OK

    @cached_property
    def zeros(self) -> Complex | None:
        """Transmission zeros [1/s], finite ones, of as many inputs as outputs; None of others (Emami-Naeini 1982)."""
        n, m = len(self.a), len(self.inputs)
        if m != len(self.outputs) or m == 0:
            return None
        pencil = np.block([[self.a, self.b], [self.c, self.d]])
        metric = np.zeros_like(pencil)
        metric[:n, :n] = np.eye(n)
        alpha, beta = scipy.linalg.eig(pencil, metric, right=False, homogeneous_eigvals=True)
        # Infinite ones are found at the root of round-off of their multiplicity, far above all poles.
        finite = np.abs(beta) > FAR * np.abs(alpha) / max(1.0, float(np.max(np.abs(self.poles), initial=0.0)))
        found = alpha[finite] / beta[finite]
        return np.asarray(found[np.lexsort([found.imag, found.real, np.abs(found)])])

    def response(self, frequencies: Array) -> Complex:
        """Return G(j w) = C (j w - A)^-1 B + D at frequencies w [rad/s], (frequencies, outputs, inputs)."""
        at = 1j * np.atleast_1d(frequencies)[:, None, None] * np.eye(len(self.a)) - self.a
        right = np.broadcast_to(self.b.astype(complex), (len(at), *self.b.shape))
        return np.asarray(self.c @ np.linalg.solve(at, right) + self.d)

    def to_json(self) -> dict[str, Any]:
        """Plain data, which `shoal linearize --json` prints."""
        zeros = self.zeros
        return {
            "status": str(self.status),
            "message": self.message,
            "advice": self.advice,
            "findings": [one.to_json() for one in self.findings],
            "about": self.about,
            "states": list(self.states),
            "inputs": list(self.inputs),
            "outputs": list(self.outputs),
            "A": self.a.tolist(),
            "B": self.b.tolist(),
            "C": self.c.tolist(),
            "D": self.d.tolist(),
            "at": self.at.tolist(),
            "error": self.error,
            "poles": [[one.real, one.imag] for one in self.poles.tolist()],
            "zeros": None if zeros is None else [[one.real, one.imag] for one in zeros.tolist()],
            **({"loop": self.loop, "margins": plain(self.margins.to_json())} if self.margins else {}),
        }

    def to_control(self) -> Any:
        """Return it as `StateSpace` of python-control. Raises InputError where that is not installed."""
        try:
            import control  # type: ignore[import-not-found, unused-ignore]
        except ImportError:
            raise InputError("to_control: needs python-control: pip install control") from None
        return control.ss(
            self.a,
            self.b,
            self.c,
            self.d,
            states=list(self.states),
            inputs=list(self.inputs),
            outputs=list(self.outputs),
        )


def linearize(
    scene: Scene,
    inputs: Sequence[str],
    outputs: Sequence[str] = (),
    *,
    about: Literal["equilibrium", "start", "trajectory"] = "equilibrium",
    time: float = 0.0,
    loop: str = "",
    require: Sequence[str] = (),
) -> LinearModel:
    """Return the linear model of a machine about its equilibrium, its start, or the state that it has moved to.

    inputs: names of signals, or of loads to whose torque or scale something is added [its unit]; outputs: formulas of
    measures and signals, by default the places that are states; time [s]: of loads and drives, and of the state of a
    trajectory. Raises InputError for what the scene does not have, ComputationError if there is no equilibrium or the
    motion fails.
    """
    one_of("about", about, ABOUT)
    check(time=time)
    if loop or require:
        return _open_loop(scene, loop, inputs, outputs, require, about, time)
    refuse_sampled(
        scene, "linear models are of continuous time; leave the controller out, and take its load as an input"
    )
    if about == "trajectory" and not time > 0.0:
        raise InputError(f"time: a trajectory is linearized at a time after 0 s, found {time:g}")
    opened, signals = _open(scene, inputs, time)
    places = [*_places(opened)]
    users = tuple(StateValue(name) for name in scene.states)
    rates = (Measure(RATES[one.kind], one.names) for one in places)
    asked = (*places, *rates, *users, *(_formula(opened, output) for output in outputs))
    evaluator = Evaluator(Machine.of(opened).probed(asked, time), one_sided=True)
    state = _state_of(scene, about, time)
    for pose in state.way:
        evaluator.remember(pose)
    probe, count = evaluator.probe(state.q, state.v if state.balance is None else None, time), len(places)
    if probe.kink:
        state.remarks.append(kinds.ON_A_KINK.found("a signal is where its derivative jumps: that on one side is taken"))
    if not state.modes.shape[1]:
        raise ComputationError(f"{scene.name}: nothing moves there: joints and contacts hold the machine")
    chosen, to = _states(probe.by_place[:count] @ state.modes)
    if not (chosen or outputs):
        raise InputError("outputs: missing; no places describe this machine, whose states are amplitudes of modes")
    names = [str(places[k]) for k in chosen] or [f"mode {k + 1}" for k in range(len(to))]
    speeds = [str(asked[count + k]) for k in chosen] or [f"rate of {name}" for name in names]
    kept = list(range(2 * count, 2 * count + len(users)))
    own = list(range(2 * count + len(users), len(asked))) if outputs else chosen
    if state.balance is not None:
        a, c, poles = _at_rest(state.balance, state, probe, to, own)
        if users:
            units = np.array([float(one.size) for one in continuous_states(scene).values()])
            a, c = (_in_units(part, len(to), units, rates) for part, rates in ((a, True), (c, False)))
        error = float(np.finfo(float).eps * np.linalg.cond(to)) if len(to) else 0.0
    elif chosen:
        probed = Probed(chosen, [*(count + k for k in chosen), *kept], own)
        smooth = [one.coulomb_speed for one in scene.joints.values() if isinstance(one, Revolute | Slider) and one.dry]
        narrow, sizes = min(smooth, default=np.inf), [one.size for one in continuous_states(scene).values()]
        found = slopes(evaluator, state.q, state.v, time, probed, span(scene), sizes, narrow)
        a, c, error, poles = found.a, found.c, found.error, None
        kind = kinds.BY_DIFFERENCES if error < COARSE else kinds.DIFFERENCES_PART
        state.remarks.append(kind.found(f"by differences, known to {error:.1g}", error=error))
    else:
        raise InputError("about: no angles and places of joints, bodies and markers describe this motion; add markers")
    # An input that acts on nothing is no constant of the model.
    acting = np.array([[name == one for one in signals] for name in evaluator.model.signal_names], dtype=float)
    acting, n, m = acting.reshape(-1, len(signals)), len(to), len(users)
    a = np.vstack([np.eye(2 * n + m)[n : 2 * n], a])
    massless = probe.by_rate[kept] @ (probe.force / evaluator.mass.diagonal()[:, None])
    return LinearModel(
        scene=scene,
        about=about,
        a=a,
        b=np.vstack([np.zeros((n, len(signals))), to @ (state.modes.T @ probe.force @ acting), massless @ acting]),
        c=c,
        d=probe.by_constants[own] @ acting,
        states=(*names, *speeds, *scene.states),
        inputs=tuple(inputs),
        outputs=tuple(outputs) or tuple(names),
        at=probe.value[own],
        error=error,
        poles=np.sort_complex(np.linalg.eigvals(a).astype(complex)) if poles is None else poles,
        remarks=state.remarks,
    )


def _open_loop(
    scene: Scene,
    loop: str,
    inputs: Sequence[str],
    outputs: Sequence[str],
    require: Sequence[str],
    about: Literal["equilibrium", "start", "trajectory"],
    time: float,
) -> LinearModel:
    """Return the open loop L, broken at a signal, about the state of the closed one.

    Of what enters behind the signal, minus what comes back to it: with d added to it, it is y = T d in the closed loop,
    and L = -T / (1 + T).
    """
    required = read_all(require)
    if not loop:
        raise InputError("require: margins are of a loop; name the signal where it is broken as `loop`")
    if inputs or outputs:
        raise InputError("loop: an open loop has one input and one output, the signal; leave out inputs and outputs")
    if loop not in scene.signals:
        raise InputError(f"loop: no signal {loop!r}; there are {', '.join(scene.signals) or 'none'}")
    inner, outer = (next(one for one in map(f"{name}{{}}".format, range(1, 1000)) if one not in scene.signals)
                    for name in ("returned", "entered"))  # fmt: skip
    signals = {**scene.signals, inner: scene.signals[loop], outer: SignalFunction(number=0.0)}
    signals[loop] = SignalFunction(expression=f"{inner} + {outer}")
    closed = linearize(scene.model_copy(update={"signals": signals}), [outer], [inner], about=about, time=time)
    back = 1.0 + float(closed.d[0, 0])
    if abs(back) < 1e-12:
        raise InputError(f"loop: {loop} depends on itself at once; break the loop elsewhere")
    a = closed.a - closed.b @ closed.c / back
    poles = np.sort_complex(np.linalg.eigvals(a).astype(complex))
    poles[np.abs(poles) <= DOUBLE * np.max(np.abs(poles), initial=0.0)] = 0.0
    return replace(
        closed, scene=scene, a=a, b=closed.b / back, c=-closed.c / back, d=-closed.d / back, inputs=(loop,),
        outputs=(loop,), poles=poles, loop=loop,
        closed_poles=closed.poles, required=required,
    )  # fmt: skip


class _State(NamedTuple):
    """A state to linearize about.

    modes: Z, (unknowns, n); way: poses on the way there, less than half a turn apart; balance: of forces at rest, None
    elsewhere
    """

    q: Array
    v: Array
    modes: Array
    way: Array
    balance: Balance | None
    remarks: list[Finding]


def _state_of(scene: Scene, about: str, time: float) -> _State:
    """Return the state that a model is about, with remarks on it."""
    dry = left_out.friction(scene, None)
    remarks = [kinds.FRICTION_LEFT_OUT.found(dry)] if dry else []
    if about == "equilibrium":
        equilibrium, balance = seek(scene, time, reactions=False)
        if not equilibrium.balanced:
            raise ComputationError(f"{scene.name}: no equilibrium to linearize about: {equilibrium.explanation}")
        balance.left_out = balance.left_out[:0]
        doubts = [kinds.ABOUT_DOUBTED.found(one.text) if one.kind.implies else one for one in equilibrium.findings]
        return _resting(
            balance, equilibrium.q, [*doubts, *(one for one in remarks if one.text not in equilibrium.message)]
        )
    model = begun(Machine.of(scene).model(time))
    evaluator = Evaluator(resting(model), one_sided=True)
    if about == "start" and not is_moving(evaluator, time):
        balance = Balance(evaluator, time, span(scene), sum(float(body.mass) for body in scene.bodies.values()))
        q, gap = balance.restore(evaluator.model.q0[:, 0].copy())
        if gap > CLOSED:
            raise ComputationError(f"{scene.name}: the joints cannot be closed at the start; they gape by {gap:.2g}")
        if names := [name for name, force in balance.hold(q).items() if not force]:
            raise ComputationError(
                f"{scene.name}: {', '.join(names)} touches without a force: no motion is linear there"
            )
        if balance.residual(view := balance.look(q)) <= BALANCED and not balance.restless(q, view):
            return _resting(balance, q, remarks)
    evaluator = Evaluator(model, one_sided=True)
    if evaluator.gaps.size and np.all(evaluator.gaps.kind == DRY):
        raise InputError(
            f"{evaluator.model.gap_fields[0]}: a joint that sticks has no linear model in motion or out of balance; "
            "take `stick: smooth`, or a state at rest"
        )
    if evaluator.model.gaps.size:
        raise InputError(f"{evaluator.model.gap_fields[0]}: linear models take one-sided constraints at rest only")
    q, v = (part[:, 0].copy() for part in (evaluator.model.q0, evaluator.model.v0))
    way = q[None]
    if about == "trajectory" and time > 0.0:
        run = simulate(scene, np.linspace(0.0, time, SAMPLES), whole=True)
        if not run.ok or run.states is None:
            raise ComputationError(f"{scene.name}: the motion to linearize about fails: {run.message}")
        way = run.states.q[..., 0]
        q, v = way[-1], run.states.v[-1, :, 0]
    # Unknowns whose rates are states of the user have no place.
    own = np.setdiff1d(np.arange(len(q)), evaluator.states)
    jacobian = evaluator.at(q, v, time).jacobian
    basis = Metric(evaluator.mass[own][:, own]).freedom(jacobian[:, own]).basis
    modes = np.zeros((len(q), basis.shape[1]))
    modes[own] = basis
    slope = [one.kind.code == kinds.FRICTION_LEFT_OUT.code for one in remarks]
    text = "dry friction is in it as the slope of its smoothed law: at rest it holds by coulomb / coulomb_speed"
    return _State(q, v, modes, way, None, [kinds.FRICTION_SMOOTHED.found(text)] if any(slope) else [])


def _resting(balance: Balance, q: Array, remarks: list[Finding]) -> _State:
    refuse_rough(balance.evaluator.model.scene, balance)
    view = balance.look(q)
    stiffness = balance.at_rest(q, view).matrix
    shapes = balance.spectrum_of(BoundedMatrix((stiffness + stiffness.T) / 2, abs(stiffness)), view, AT_MOST).shapes
    if shapes.shape[1] < (degrees := view.freedom.degrees - len(balance.evaluator.states)):
        text = f"it is of the lowest {shapes.shape[1]} of {degrees} modes"
        remarks.append(kinds.LOWEST_MODES.found(text))
    return _State(q, np.zeros_like(q), shapes, q[None], balance, remarks)


def _at_rest(balance: Balance, state: _State, probe: Probe, to: Array, own: list[int]) -> tuple[Array, Array, Complex]:
    """Return the rows of A of the rates and of states of the user, C, and the poles. to: states by modes."""
    view, evaluator = balance.look(state.q), balance.evaluator
    stiffness, damping = balance.at_rest(state.q, view).matrix.toarray(), evaluator.damping(state.q, t=balance.t)
    moved, users = state.modes @ np.linalg.inv(to), evaluator.states
    rows = np.vstack([to @ state.modes.T, np.eye(len(state.q))[users] / evaluator.weight])
    a = -rows @ np.hstack([stiffness @ moved, damping @ moved, stiffness[:, users]])
    c = np.hstack([probe.by_place[own] @ moved, probe.by_rate[own] @ moved, probe.by_rate[own][:, users]])
    paired = not (evaluator.follows or np.any(damping.data))
    return a, c, _poles(small(balance, state.q, view), 2 * len(to) + len(users), paired=paired)


def _in_units(matrix: Array, n: int, sizes: Array, rates: bool) -> Array:
    """Return A or C for states of the user in their units, from those over their sizes. rates: whether it is A."""
    matrix = matrix.copy()
    matrix[:, 2 * n :] /= sizes
    if rates:
        matrix[n:] *= sizes[:, None]
    return matrix


def _open(scene: Scene, inputs: Sequence[str], time: float) -> tuple[Scene, list[str]]:
    """Return the scene with a signal that is a number for each input, and the names of these."""
    signals, loads, names = dict(scene.signals), dict(scene.loads), []
    for name in inputs:
        if name in signals and name not in loads:
            signal = formula_of(signals[name])
            if not is_of_time(written_out(scene, signal)):
                raise InputError(
                    f"inputs: signals.{name} follows the motion; an input is a number or a function of time"
                )
            signals[name] = SignalFunction(number=float(signal(np.array([time]))[0]))
            names.append(name)
            continue
        field = _FIELDS.get(type(loads.get(name)), "")
        if not field:
            raise InputError(f"inputs: no signal {name!r}, nor a load with a torque or a scale; {_known(scene)}")
        function: SignalFunction = getattr(loads[name], field)
        if function.table is not None:
            raise InputError(f"inputs: loads.{name}.{field} is a table; make it a signal, which can be an input")
        own = next(one for one in map("input{}".format, range(1, 1000)) if one not in signals)
        before = function.expression or repr(function.number)
        loads[name] = loads[name].model_copy(update={field: SignalFunction(expression=f"({before}) + {own}")})
        signals[own] = SignalFunction(number=0.0)
        names.append(own)
    return scene.model_copy(update={"signals": signals, "loads": loads}), names


_FIELDS: dict[type, str] = {Torque: "torque", Thrust: "force", Force: "scale", DistributedForce: "scale"}


def _known(scene: Scene) -> str:
    acting = [name for name, load in scene.loads.items() if type(load) in _FIELDS]
    return f"there are {', '.join([*scene.signals, *acting]) or 'none'}"


def _formula(scene: Scene, text: str) -> Node:
    try:
        function = SignalFunction(expression=text)
        check_leaves(scene, "outputs", function)
    except ValidationError as error:
        raise InputError(f"outputs: {error.errors()[0]['msg'].removeprefix('Value error, ')}") from None
    except ValueError as error:
        raise InputError(str(error)) from None
    found = written_out(scene, function)
    if is_of_time(found) or isinstance(found, float | Constant | Table):
        raise InputError(f"outputs: {text!r} does not depend on the motion")
    return found


def _places(scene: Scene) -> Iterator[Measure]:
    """Yield what may be states: angles and slides of joints, then angles and places of bodies of the plane."""
    points = {name for name, body in scene.bodies.items() if isinstance(body, PointMass)}
    for name, joint in scene.joints.items():
        if isinstance(joint, TURNING) and not points & {joint.first.body, joint.second.body}:
            yield Measure("angle", (name,))
        if isinstance(joint, SLIDING):
            yield Measure("slide", (name,))
    for name in scene.bodies:
        if scene.dimensions == plane.DIMENSIONS and name not in points and name not in scene.joints:
            yield Measure("angle", (name,))
        if name not in scene.markers:
            yield from (Measure("position", (name, axis)) for axis in "xyz"[: scene.dimensions])
    for name in [one for one in scene.markers if one not in scene.bodies]:
        yield from (Measure("position", (name, axis)) for axis in "xyz"[: scene.dimensions])


def _states(slopes: Array) -> tuple[list[int], Array]:
    """Return which measures describe all modes, the first ones that do, and their slopes by the modes, (n, n).

    slopes: (measures, modes). None, and the unit matrix, where no measures do.
    """
    chosen, ways, n = list[int](), np.zeros((0, slopes.shape[1])), slopes.shape[1]
    for number, slope in enumerate(slopes):
        size = float(np.linalg.norm(slope))
        rest = slope - ways.T @ (ways @ slope)
        rest -= ways.T @ (ways @ rest)
        if len(chosen) < n and float(np.linalg.norm(rest)) > DEPENDENT * size:
            chosen.append(number)
            ways = np.vstack([ways, rest / np.linalg.norm(rest)])
    found = slopes[chosen]
    sizes = np.linalg.norm(found, axis=1, keepdims=True)
    if len(chosen) < n or (n and np.linalg.cond(found / sizes) > WELL_POSED):
        return [], np.eye(n)
    return chosen, found


def _poles(roots: Roots, count: int, *, paired: bool) -> Complex:
    """Return `count` poles [1/s], slowest first. paired: whether each root that grows has one that decays."""
    values = roots.values[np.abs(roots.values) > 0.0]
    found = [values, np.conj(values[values.imag > 0])]
    if paired:
        found.append(-values[values.imag == 0])
    poles = np.concatenate(found)
    poles = np.append(poles, np.zeros(max(count - len(poles), 0)))
    return np.asarray(poles[np.lexsort([-poles.imag, poles.real, np.round(np.abs(poles), 12)])])
