"""Controllers and actuators of a scene: templates that become its other parts when the scene is read.

A controller NAME is the signal NAME, its output. Its gains are signals that are numbers, NAME_kp and so on, which are
swept and identified like these; its memory are states. With `sampled` both are sampled.
"""

from __future__ import annotations

import re
from typing import Annotated, Any, Literal

from pydantic import Field, TypeAdapter, ValidationError, model_validator

from shoal.scene.actuators import Actuator, AnyActuator, acting
from shoal.scene.record import Formula, Positive, Record, one_line
from shoal.scene.sampled import Sampling

_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
Formulas = tuple[dict[str, Any], dict[str, Any]]
"""Signals and states by name."""


def _sample(sampled: Sampling, formula: str, *, measured: bool = False, late: bool = False) -> dict[str, Any]:
    """Return a sampled signal; measured: with the quantum, late: with the delay of a controller."""
    instants = sampled.model_dump(exclude={"quantum", "delay"})
    finely = {"quantum": sampled.quantum} if measured else {}
    return {"sample": formula, **instants, **finely, **({"delay": sampled.delay} if late else {})}


def _next(sampled: Sampling, formula: str, start: float = 0.0) -> dict[str, Any]:
    """Return a sampled state."""
    return {"next": formula, **sampled.model_dump(include={"period", "first"}), "start": start}


class Pid(Record):
    """A PID controller: kp error + ki times its integral + kd times its rate, within limits."""

    kind: Literal["pid"] = "pid"
    of: Formula
    """The error, a formula of measures and signals."""
    kp: float = 0.0
    """Gain of the error [1]."""
    ki: float = 0.0
    """Gain of its integral [1/s]."""
    kd: float = 0.0
    """Gain of its rate [s]."""
    rate: Formula | None = None
    """The rate of the error, a formula such as `-rate(hinge)`; left out it is the filtered difference of the error."""
    filter: Positive | None = None
    """Time constant of a filter of the rate [s]."""
    limits: tuple[float, float] | None = None
    """Smallest and largest output [1]."""
    tracking: Positive | None = None
    """Time constant [s] with which the integral is brought back from a limit: anti-windup by back-calculation."""
    start: float = 0.0
    """Integral part at the start [1]."""
    sampled: Sampling | None = None
    """Its instants, if it is sampled."""

    @model_validator(mode="after")
    def _complete(self) -> Pid:
        if self.kd and self.rate is None and self.filter is None and self.sampled is None:
            raise ValueError(
                "kd: state the `rate` of the error, a formula, or a `filter`, the time constant of its rate"
            )
        if self.limits is not None and not self.limits[0] < self.limits[1]:
            raise ValueError(f"limits: must increase, found {self.limits[0]:g} and {self.limits[1]:g}")
        if self.tracking is not None and (self.limits is None or not self.ki):
            raise ValueError("tracking: is of an integral, `ki`, behind `limits`")
        return self

    def formulas(self, name: str) -> Formulas:
        """Return the signals and states that a controller of this name is."""
        if self.sampled is not None:
            return self._sampled(name, self.sampled)
        signals: dict[str, Any] = {f"{name}_error": self.of, f"{name}_kp": self.kp}
        states: dict[str, Any] = {}
        parts = [f"{name}_kp*{name}_error"]
        if self.ki:
            signals[f"{name}_ki"] = self.ki
            back = f" + ({name} - {name}_wanted)/{self.tracking!r}" if self.tracking is not None else ""
            states[f"{name}_integral"] = {"rate": f"{name}_ki*{name}_error{back}", "start": self.start}
            parts.append(f"{name}_integral")
        if self.kd:
            signals[f"{name}_kd"] = self.kd
            signals[f"{name}_rate"] = (
                f"({name}_error - {name}_filter)/{self.filter!r}" if self.rate is None else self.rate
            )
            late = f"{name}_error" if self.rate is None else f"{name}_rate"
            if self.filter is not None:
                states[f"{name}_filter"] = {"rate": f"({late} - {name}_filter)/{self.filter!r}"}
            filtered = self.rate is not None and self.filter is not None
            parts.append(f"{name}_kd*{name}_{'filter' if filtered else 'rate'}")
        output = " + ".join(parts)
        if self.limits is not None:
            signals[f"{name}_wanted"] = output
            output = f"min(max({name}_wanted, {self.limits[0]!r}), {self.limits[1]!r})"
        return {**signals, name: output}, states

    def _sampled(self, name: str, sampled: Sampling) -> Formulas:
        """Return the same, sampled: the integral by forward, rates by backward differences (Astrom and Hagglund 2006).

        The difference of the error is 0 at the first instant.
        """
        period, error, states = sampled.period, f"{name}_error", dict[str, Any]()
        signals: dict[str, Any] = {error: _sample(sampled, self.of, measured=True), f"{name}_kp": self.kp}
        parts = [f"{name}_kp*{error}"]
        if self.ki:
            signals[f"{name}_ki"] = self.ki
            parts.append(f"{name}_integral")
        if self.kd:
            signals[f"{name}_kd"], late = self.kd, self.filter or 0.0
            if self.rate is None:
                states[f"{name}_last"] = _next(sampled, error)
                states[f"{name}_begun"] = _next(sampled, "1")
                change = f"{name}_begun*({error} - {name}_last)"
            else:
                change = f"{period!r}*({self.rate})" if late else f"({self.rate})"
            rate = change if self.rate is not None and not late else f"({change})/{period + late!r}"
            if late:
                states[f"{name}_filter"] = _next(sampled, f"{name}_rate")
                rate = f"({late!r}*{name}_filter + {change})/{period + late!r}"
            signals[f"{name}_rate"] = _sample(sampled, rate)
            parts.append(f"{name}_kd*{name}_rate")
        output = " + ".join(parts)
        if self.limits is not None:
            signals[f"{name}_wanted"] = _sample(sampled, output)
            output = f"min(max({name}_wanted, {self.limits[0]!r}), {self.limits[1]!r})"
        if self.ki:
            back = f" + {period!r}*({output} - {name}_wanted)/{self.tracking!r}" if self.tracking is not None else ""
            integral = f"{name}_integral + {period!r}*{name}_ki*{error}{back}"
            states[f"{name}_integral"] = _next(sampled, integral, self.start)
        return {**signals, name: _sample(sampled, output, late=True)}, states


class StateFeedback(Record):
    """State feedback, -gain (x - about), as of a linear-quadratic regulator."""

    kind: Literal["state-feedback"] = "state-feedback"
    of: Annotated[tuple[str, ...], Field(min_length=1)]
    """The states x, formulas of measures and signals."""
    gain: Annotated[tuple[float, ...], Field(min_length=1)]
    """One gain for each [1]."""
    about: tuple[float, ...] | None = None
    """Where the feedback vanishes, by state [1]; by default at zero."""
    sampled: Sampling | None = None
    """Its instants, if it is sampled."""

    @model_validator(mode="after")
    def _one_each(self) -> StateFeedback:
        for field in ("gain", "about"):
            stated = getattr(self, field)
            if stated is not None and len(stated) != len(self.of):
                raise ValueError(f"{field}: {len(stated)} numbers for {len(self.of)} states")
        return self

    def formulas(self, name: str) -> Formulas:
        """Return the signals and states that a controller of this name is."""
        signals: dict[str, Any] = {}
        parts = []
        for k, (one, gain) in enumerate(zip(self.of, self.gain, strict=True), 1):
            measured = one if self.sampled is None else _sample(self.sampled, one, measured=True)
            signals |= {f"{name}_x{k}": measured, f"{name}_k{k}": gain}
            away = f"{name}_x{k}"
            if self.about is not None:
                signals[f"{name}_about{k}"] = self.about[k - 1]
                away = f"({away} - {name}_about{k})"
            parts.append(f"{name}_k{k}*{away}")
        output = f"-({' + '.join(parts)})"
        return {**signals, name: output if self.sampled is None else _sample(self.sampled, output, late=True)}, {}


class TransferFunction(Record):
    """A transfer function num/den of s, or of z if it is sampled, by polynomials, highest power first, from rest."""

    kind: Literal["transfer-function"] = "transfer-function"
    of: Formula
    """Its input, a formula of measures and signals."""
    num: Annotated[tuple[float, ...], Field(min_length=1)]
    """Coefficients of the numerator [1]."""
    den: Annotated[tuple[float, ...], Field(min_length=1, max_length=10)]
    """Coefficients of the denominator, of the same or a higher degree [1]."""
    sampled: Sampling | None = None
    """Its instants, if it is sampled."""

    @model_validator(mode="after")
    def _proper(self) -> TransferFunction:
        if not self.den[0]:
            raise ValueError("den: begins with 0; leave that out")
        if len(self.num) > len(self.den):
            raise ValueError(
                f"num: of degree {len(self.num) - 1}, beyond the {len(self.den) - 1} of den; no motion has it"
            )
        return self

    def formulas(self, name: str) -> Formulas:
        """Return the signals and states that a controller of this name is.

        In controllable form, in a time in which its coefficients are near 1: states are as large as the input.
        """
        order = len(self.den) - 1
        a = [one / self.den[0] for one in self.den]
        b = [0.0] * (order + 1 - len(self.num)) + [one / self.den[0] for one in self.num]
        if self.sampled is not None:
            return self._sampled(name, self.sampled, a, b)
        pace = max((abs(a[k]) ** (1.0 / k) for k in range(1, order + 1)), default=0.0) or 1.0
        a, b = ([one / pace**k for k, one in enumerate(each)] for each in (a, b))
        signals: dict[str, Any] = {f"{name}_in": self.of}
        turns = "".join(f" - {a[k]!r}*{name}_{k}" for k in range(1, order + 1))
        states: dict[str, Any] = {f"{name}_1": {"rate": f"{pace!r}*({name}_in{turns})"}} if order else {}
        states |= {f"{name}_{k}": {"rate": f"{pace!r}*{name}_{k - 1}"} for k in range(2, order + 1)}
        return {**signals, name: _output(name, a, b)}, states

    def _sampled(self, name: str, sampled: Sampling, a: list[float], b: list[float]) -> Formulas:
        """Return the same of z, by the coefficients over that of the highest power of the denominator."""
        order = len(a) - 1
        turns = "".join(f" - {a[k]!r}*{name}_{k}" for k in range(1, order + 1))
        states = {f"{name}_1": _next(sampled, f"{name}_in{turns}")} if order else {}
        states |= {f"{name}_{k}": _next(sampled, f"{name}_{k - 1}") for k in range(2, order + 1)}
        signals = {f"{name}_in": _sample(sampled, self.of, measured=True)}
        return {**signals, name: _sample(sampled, _output(name, a, b), late=True)}, states


def _output(name: str, a: list[float], b: list[float]) -> str:
    """Return the output of a transfer function in controllable form."""
    parts = [f"{b[0]!r}*{name}_in"] + [f"{b[k] - b[0] * a[k]!r}*{name}_{k}" for k in range(1, len(a))]
    return " + ".join(parts)


Controller = Annotated[Pid | StateFeedback | TransferFunction, Field(discriminator="kind")]
_ADAPTERS: dict[str, TypeAdapter[Any]] = {"controllers": TypeAdapter(Controller), "actuators": TypeAdapter(AnyActuator)}
_NOTHING: dict[str, Any] = {part: {} for part in _ADAPTERS}


def with_controllers(data: dict[str, Any]) -> dict[str, Any]:
    """Return the fields of a scene with controllers as signals and states, and actuators as these and loads.

    Raises ValueError.
    """
    stated, parts = [data.get(part) or {} for part in _ADAPTERS], ("signals", "states", "loads", "joints")
    given = [data.get(part) or {} for part in parts]
    if not any(stated) or not all(isinstance(part, dict) for part in (*stated, *given)):
        return data
    signals, states, loads, joints = (dict(part) for part in given)
    for kind, those in zip(_ADAPTERS, stated, strict=True):
        for name, one in those.items():
            if not _NAME.fullmatch(str(name)):
                raise ValueError(f"{kind}.{name}: a name in formulas has letters, digits and underscores")
            template = _read(kind, str(name), one)
            if isinstance(template, Actuator):
                made, load, joints[template.joint] = acting(str(name), template, joints)
                if name in loads:
                    raise ValueError(
                        f"{kind}.{name}: makes the load {name}, which is there already; rename one of them"
                    )
                loads[name] = load
            else:
                made = template.formulas(str(name))
            for there, found in zip((signals, states), made, strict=True):
                if twice := next((new for new in found if new in signals or new in states), None):
                    raise ValueError(f"{kind}.{name}: makes {twice}, which is there already; rename one of them")
                there |= found
    found_parts = dict(zip(parts, (signals, states, loads, joints), strict=True))
    return {**data, **{part: found for part, found in found_parts.items() if found or part in data}, **_NOTHING}


def _read(part: str, name: str, stated: Any) -> Any:
    """Return a template of a part of the scene. Raises ValueError in one line."""
    try:
        return _ADAPTERS[part].validate_python(stated)
    except ValidationError as error:
        kind = stated.get("kind") if isinstance(stated, dict) else None
        line = str(one_line(error, f"{part}.{name}"))
        raise ValueError(re.sub(rf"^{part}\.{name}: {kind}(: |\.)", f"{part}.{name}.", line)) from None
