"""Actuators of a scene: templates that become signals, states, a load and the inertia of a rotor.

An actuator NAME is the signal NAME, what it exerts at its joint, and the load NAME, which follows that. Its numbers are
signals, NAME_kp and so on, which are swept and identified like these. A gear is embedded, as it is in the rotor's
inertia too.
"""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from shoal.scene.joints import GROUND
from shoal.scene.record import Formula, NonNegative, Positive, Record

Parts = tuple[dict[str, Any], dict[str, Any]]
"""Signals and states by name."""
_MEASURES = {"revolute": ("angle", "rate"), "slider": ("slide", "slide_rate")}


class Actuator(Record):
    """What all actuators share: a joint, the rotor behind a gear, and limits of the torque or the force."""

    joint: str
    """The revolute joint, or the slider, at which it acts."""
    gear: float = 1.0
    """Turns of the rotor for one of the joint [1; of a slider 1/m]."""
    rotor: NonNegative = 0.0
    """Moment of inertia of the rotor [kg m^2]."""
    limit: Positive | None = None
    """Largest torque at the joint [N m; of a slider N]."""
    speed: Positive | None = None
    """Speed of the joint at which no torque is left in its sense, down to which it falls from `stall` [rad/s; m/s]."""
    stall: Positive | None = None
    """Torque at standstill of the line that ends at `speed`, by default `limit` [N m; N]."""

    @model_validator(mode="after")
    def _has_a_line(self) -> Actuator:
        if self.speed is not None and self.limit is None and self.stall is None:
            raise ValueError("speed: is the end of a line of torque over speed, which needs a `limit` or `stall`")
        if self.stall is not None and self.speed is None:
            raise ValueError("stall: is the beginning of a line of torque over speed, which needs its end, `speed`")
        if not self.gear:
            raise ValueError("gear: 0 moves nothing")
        return self

    def law(self, name: str, place: str, rate: str) -> tuple[dict[str, Any], dict[str, Any], str]:
        """Return signals, states and the torque at the joint, a formula, before its limits."""
        raise NotImplementedError

    def formulas(self, name: str, place: str, rate: str) -> Parts:
        """Return the signals and states of an actuator of this name. place, rate: measures of its joint."""
        signals, states, output = self.law(name, place, rate)
        lines = []
        if self.speed is not None:
            stall = f"{name}_stall"
            signals |= {stall: self.stall or self.limit, f"{name}_speed": self.speed}
            lines = [f"{stall}*max(1 {sign} {rate}/{name}_speed, 0)" for sign in "+-"]
        if self.limit is not None:
            signals[f"{name}_limit"] = self.limit
            lines = [f"min({name}_limit, {line})" for line in lines] or [f"{name}_limit"] * 2
        if lines:
            signals[f"{name}_wanted"] = output
            output = f"min(max({name}_wanted, -{lines[0]}), {lines[1]})"
        return {**signals, name: output}, states


class Motor(Actuator):
    """A motor whose torque is given."""

    kind: Literal["motor"] = "motor"
    torque: Formula
    """Torque of the rotor [N m], a formula of time, measures and signals."""

    def law(self, name: str, place: str, rate: str) -> tuple[dict[str, Any], dict[str, Any], str]:
        """See `Actuator`."""
        return {f"{name}_torque": self.torque}, {}, f"{self.gear!r}*{name}_torque"


class DcMotor(Actuator):
    """A motor with brushes, or one without in the axis of its torque: L di/dt = u - R i - k N rate, torque N k i."""

    kind: Literal["dc-motor"] = "dc-motor"
    voltage: Formula
    """Voltage u [V], a formula of time, measures and signals, also of NAME_current, its current [A]."""
    resistance: Positive
    """Resistance R [ohm]."""
    constant: Positive
    """Torque per current, which is the voltage per speed of the rotor, k [N m/A]."""
    inductance: NonNegative = 0.0
    """Inductance L [H]; without one the current follows at once."""

    def law(self, name: str, place: str, rate: str) -> tuple[dict[str, Any], dict[str, Any], str]:
        """See `Actuator`."""
        current, k = f"{name}_current", f"{name}_constant"
        signals: dict[str, Any] = {
            f"{name}_voltage": self.voltage,
            f"{name}_resistance": self.resistance,
            k: self.constant,
        }
        driving, torque = f"{name}_voltage - {self.gear!r}*{k}*{rate}", f"{self.gear!r}*{k}*{current}"
        if not self.inductance:
            return {**signals, current: f"({driving})/{name}_resistance"}, {}, torque
        law = f"({driving} - {name}_resistance*{current})/{name}_inductance"
        return {**signals, f"{name}_inductance": self.inductance}, {current: {"rate": law}}, torque


class Servo(Actuator):
    """A drive that holds a place or a speed: kp (position - place) + kd (velocity - rate)."""

    kind: Literal["servo"] = "servo"
    position: Formula | None = None
    """Wanted angle or place of the joint [rad; m], a formula."""
    velocity: Formula | None = None
    """Wanted speed [rad/s; m/s], a formula; beside a position by default 0."""
    kp: NonNegative | None = None
    """Torque by the error of the position [N m/rad; N/m]."""
    kd: NonNegative = 0.0
    """Torque by the error of the speed [N m s/rad; N s/m]."""

    @model_validator(mode="after")
    def _follows_something(self) -> Servo:
        if (self.position is None) != (self.kp is None):
            raise ValueError("kp: is of an error of `position`; state both or none")
        if self.position is None and (self.velocity is None or not self.kd):
            raise ValueError("position: missing, with `kp`, or `velocity` with `kd`")
        return self

    def law(self, name: str, place: str, rate: str) -> tuple[dict[str, Any], dict[str, Any], str]:
        """See `Actuator`."""
        signals, parts = dict[str, Any](), []
        if self.position is not None:
            signals |= {f"{name}_position": self.position, f"{name}_kp": self.kp}
            parts.append(f"{name}_kp*({name}_position - {place})")
        if self.kd:
            signals |= {f"{name}_velocity": self.velocity or 0.0, f"{name}_kd": self.kd}
            parts.append(f"{name}_kd*({name}_velocity - {rate})")
        return signals, {}, " + ".join(parts)


AnyActuator = Annotated[Motor | DcMotor | Servo, Field(discriminator="kind")]


def acting(name: str, actuator: Actuator, joints: dict[str, Any]) -> tuple[Parts, dict[str, Any], dict[str, Any]]:
    """Return the signals and states of an actuator, its load, and its joint with the rotor. Raises ValueError."""
    joint = joints.get(actuator.joint)
    if not isinstance(joint, dict):
        raise ValueError(
            f"actuators.{name}.joint: no joint {actuator.joint!r}; there are {', '.join(joints) or 'none'}"
        )
    kind = joint.get("kind", "revolute")
    if kind not in _MEASURES:
        raise ValueError(f"actuators.{name}.joint: {actuator.joint} is {kind}; actuators are of revolute and slider")
    place, rate = (f'{measure}("{actuator.joint}")' for measure in _MEASURES[kind])
    parts = actuator.formulas(name, place, rate)
    inertia = actuator.gear**2 * actuator.rotor
    turned = {**joint, "armature": joint.get("armature", 0.0) + inertia} if inertia else joint
    if kind == "slider":
        return parts, {"kind": "thrust", "joint": actuator.joint, "force": name}, turned
    load = {"kind": "torque", "at": joint.get("second"), "torque": name}
    load |= {"axis": joint["axis"]} if "axis" in joint else {}
    first = joint.get("first")
    held = not isinstance(first, dict) or first.get("body") == GROUND
    return parts, load if held else {**load, "reaction": first}, turned
