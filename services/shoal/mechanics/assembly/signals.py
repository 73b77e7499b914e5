"""Signals of a scene as measures of the placement and a tape: equal parts of formulas are evaluated once."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import tape
from shoal.mechanics.affine import Affine
from shoal.mechanics.applied import Applied
from shoal.mechanics.assembly.measures import ElementForceLaw, Measures
from shoal.mechanics.forces import DISTANCE, PLACE
from shoal.mechanics.numerics.tile import Number, index, stacked
from shoal.mechanics.samples import FIRST_PENDING, Samples
from shoal.mechanics.signals import Signals
from shoal.scene import GROUND, Attachment, Function, SignalFunction, Slider
from shoal.scene.formula import Measure, Node, leaves
from shoal.scene.function import Formula
from shoal.scene.joints import Z
from shoal.scene.sampled import Clock, Sampled, SampledState
from shoal.scene.signals import (
    Constant,
    HeldValue,
    State,
    StateValue,
    Table,
    continuous_states,
    expanded,
    is_of_time,
    joint_of,
    place,
    sampled_parts,
    written_out,
)

Operand = tuple[str, int]
"""A register: its section, and its number there."""


def _is_held(node: Node) -> bool:
    """Return whether a tree depends on the held value of a sampled signal."""
    return any(isinstance(leaf, HeldValue) for leaf in leaves(node))


_RATES = {"rate": "angle", "slide_rate": "slide", "distance_rate": "distance"}
_NO_LAW = ElementForceLaw()


def _is_of_forces(node: Node) -> bool:
    """Return whether a tree depends on an acceleration."""
    return any(isinstance(leaf, Measure) and leaf.kind == "acceleration" for leaf in leaves(node))


class SignalLoads:
    """Collects what loads follow, and the loads that do.

    fit: returns the number of a function of time, from its field and itself
    Attributes:
        names: of the signals that are numbers, by constant; empty of others
    """

    def __init__(self, measures: Measures, torques: Measures, fit: Callable[[str, Any], int]) -> None:
        self.scene, self.measures, self._torques, self._fit = measures.scene, measures, torques, fit
        self._turning: list[int] = []
        self._strengths: list[Operand] = []
        self.outputs: dict[str, Operand] = {}
        """What is recorded: loads by their fields, states and signals by their names."""
        self._measured: dict[tuple[str, tuple[str, ...]], int] = {}
        self._rows: dict[str, list[int]] = {"position": [], "velocity": [], "acceleration": []}
        self._functions: list[int] = []
        self._constants: list[Number] = []
        self.names: list[str] = []
        self._code: list[tuple[int, list[Operand]]] = []
        self._switches: list[int] = []
        self._known: dict[Node, Operand] = {}
        self._held: dict[str, int] = {}
        self._holds: list[tuple[str, Sampled | SampledState, int, Operand]] = []
        self._always: list[int] | None = None
        self.clocks: dict[Clock, str] = {}
        """Instants of samples, and the last field that follows each."""

    @cached_property
    def states(self) -> dict[str, State]:
        """States that are integrated."""
        return continuous_states(self.scene)

    @cached_property
    def _expanded(self) -> dict[str, Node]:
        return expanded(self.scene)

    def resolve(self, f: SignalFunction) -> tuple[Any, Node | None]:
        """Return a function of time, or the tree of what is none."""
        if f.of_time:
            return f, None
        node = written_out(self.scene, f, self._expanded)
        if isinstance(node, Table):
            return self.scene.signals[node.name], None
        if isinstance(node, float):
            return Function(number=node), None
        return (Formula(node), None) if is_of_time(node) else (None, node)

    def strength(self, field: str, node: Node) -> int:
        """Return the number of a strength that loads follow. Raises InputError for accelerations."""
        if _is_of_forces(node):
            raise InputError(
                f"{field}: an acceleration depends on the forces of the same instant; only samples know it"
            )
        found = self._operand(field, node)
        if found not in self._strengths:
            self._strengths.append(found)
        if field.startswith("loads."):
            self.outputs[field] = found
        return self._strengths.index(found)

    def record(self) -> None:
        """Record beside what loads follow all states, and those signals that are evaluated anyway."""
        for name in self.states if self._strengths else ():
            self.outputs[name] = self._operand(f"states.{name}", StateValue(name))

    def sample(self) -> None:
        """Add what is evaluated at samples only, of those sampled signals and states that loads depend on."""
        parts = sampled_parts(self.scene)
        trees = {
            name: written_out(self.scene, one.sample if isinstance(one, Sampled) else one.next, self._expanded)
            for name, one in parts.items()
        }
        ahead = list(self._held)
        while ahead:
            inner = {leaf.name for leaf in leaves(trees[ahead.pop()]) if isinstance(leaf, HeldValue)} - {*self._held}
            self._held |= {name: len(self._held) + k for k, name in enumerate(sorted(inner))}
            ahead += inner
        continuous = self._known
        self._always = self._sizes()
        # What is held may change between samples of one instant, but not what else is measured.
        self._known = {node: one for node, one in continuous.items() if not _is_held(node)}
        for name in (name for name in parts if name in self._held):
            one, signal = parts[name], isinstance(parts[name], Sampled)
            field = f"signals.{name}.sample" if signal else f"states.{name}.next"
            source = self._operand(field, trees[name])
            self._holds.append((name, one, len(self._code), source))
            if signal or one.clock not in self.clocks:
                self.clocks[one.clock] = field.rpartition(".")[0]
            self.outputs[name] = "held", self._held[name]
        self._known |= continuous
        stated: dict[str, Any] = self.scene.signals
        for name, each in stated.items():
            if not isinstance(each, SignalFunction) or each.number is not None:
                continue
            # Accelerations are those of steps, and are not known between them.
            if self._expanded[name] in self._known and not _is_of_forces(self._expanded[name]):
                self.outputs[name] = self._known[self._expanded[name]]

    @property
    def sampled(self) -> tuple[str, ...]:
        """Names of what is sampled."""
        return tuple(name for name, _, _, _ in self._holds)

    def _sizes(self) -> list[int]:
        places, rates = self._rows["position"], self._rows["velocity"]
        return [len(self.measures.kinds), len(places), len(rates), len(self._functions), len(self._code)]

    def turn(self, name: str, first: Attachment, second: Attachment, strength: int) -> None:
        """Let a torque of the plane follow a strength."""
        self._torques._angle(name, first, second, ElementForceLaw(amplitude=1.0), Z)
        self._turning.append(strength)

    def push(self, name: str, vectors: list[Affine], strength: int) -> None:
        """Let a force along a line follow a strength. vectors: both places and the line's direction."""
        self._torques._measure(name, PLACE, vectors, ElementForceLaw(amplitude=1.0), 0.0)
        self._turning.append(strength)

    def signals(self, applied: Callable[[Callable[[int], int]], Applied]) -> Signals | tuple[()]:
        """Return all as arrays; nothing where no load follows any. applied: makes the loads from their registers."""
        if not self._strengths:
            return ()
        sizes = {
            "measure": 2 * len(self.measures.kinds),
            "position": len(self._rows["position"]),
            "velocity": len(self._rows["velocity"]),
            "function": len(self._functions),
            "acceleration": len(self._rows["acceleration"]),
            "held": len(self._held),
            "constant": len(self._constants),
        }
        base = dict(zip([*sizes, "result"], np.cumsum([0, *sizes.values()]).tolist(), strict=True)) | {"switch": 0}

        def register(operand: Operand) -> int:
            return int(base[operand[0]]) + operand[1]

        strengths = [register(one) for one in self._strengths]
        code = [[operation, *map(register, operands)] for operation, operands in self._code]
        position, velocity = self._rows["position"], self._rows["velocity"]
        turned = self._torques.forces()._replace(drive=index([strengths[k] for k in self._turning]))
        return Signals(
            self.measures.forces(),
            index(position),
            len(position),
            index(velocity),
            len(velocity),
            index(self._functions),
            len(self._functions),
            index(self._rows["acceleration"]),
            len(self._rows["acceleration"]),
            stacked(self._constants),
            len(self._constants),
            index([one + [0] * (tape.ENTRIES - len(one)) for one in code]).ravel(),
            len(code),
            base["result"],
            index(strengths),
            len(strengths),
            index(self._switches),
            len(self._switches),
            index([register(one) for one in self.outputs.values()]),
            len(self.outputs),
            index(self._always or self._sizes()),
            self._samples(register),
            applied(lambda strength: strengths[strength]),
            turned,
        )

    def _samples(self, register: Callable[[Operand], int]) -> Samples:
        """Return what is sampled as arrays."""
        rows, numbers, pending = [], [*self.clocks], FIRST_PENDING
        for name, one, end, source in self._holds:
            late = isinstance(one, SampledState) or one.clock.delay > 0
            flying = one.clock.flying if one.clock.delay else 1 if late else 0
            target = register(("held", self._held[name]))
            rows.append([end, register(source), target, numbers.index(one.clock), pending, flying, one.clock.delay > 0])
            pending += flying + 2 if late else 0
        starts = {self._held[name]: getattr(one, "start", 0.0) for name, one, _, _ in self._holds}
        quanta = [getattr(one, "quantum", None) or 0.0 for _, one, _, _ in self._holds]
        begin = stacked([starts[k] for k in range(len(starts))])
        return Samples(len(rows), index(rows).ravel(), stacked(quanta), len(starts), begin, pending)

    def _operand(self, field: str, node: Node) -> Operand:
        if node not in self._known:
            self._known[node] = self._entered(field, node)
        return self._known[node]

    def _entered(self, field: str, node: Node) -> Operand:
        if isinstance(node, float | Constant):
            value = self.scene.signals[node.name] if isinstance(node, Constant) else node
            self.names.append(node.name if isinstance(node, Constant) else "")
            self._constants.append(value.number if isinstance(value, Function) else value)
            return "constant", len(self._constants) - 1
        if isinstance(node, Measure):
            return self._measure(node)
        if isinstance(node, StateValue):
            return self._state(field, node.name)
        if isinstance(node, HeldValue):
            return "held", self._held.setdefault(node.name, len(self._held))
        if isinstance(node, Table) or is_of_time(node):
            function = self.scene.signals[node.name] if isinstance(node, Table) else Formula(node)
            self._functions.append(self._fit(field, function))
            return "function", len(self._functions) - 1
        operation, *parts = node
        if operation == "ramp":
            operation, parts = "rise", [("min", ("max", parts[0], 0.0), 1.0)]
        if operation == "+" and (factors := self._product(parts)):
            self._code.append((tape.MULTIPLY_ADD, [self._operand(field, part) for part in factors]))
        else:
            operands, number = [self._operand(field, part) for part in parts], tape.CODES[operation]
            if number in tape.SWITCHES and self._always is not None:  # no step ends there
                operands = [operands[0], operands[-1], ("switch", 0)]
            elif number in tape.SWITCHES:  # whose last entry is their number
                operands = [operands[0], operands[-1], ("switch", len(self._switches))]
                self._switches.append(len(self._code))
            self._code.append((number, operands))
        return "result", len(self._code) - 1

    def _state(self, field: str, name: str) -> Operand:
        """The rate of the unknown of a state, times the size of that."""
        size: Number = self.states[name].size
        self._rows["velocity"].append(self.measures.placement.states[name])
        rate = "velocity", len(self._rows["velocity"]) - 1
        if np.ndim(size) == 0 and size == 1.0:
            return rate
        self.names.append("")
        self._constants.append(size)
        self._code.append((tape.MULTIPLY, [rate, ("constant", len(self._constants) - 1)]))
        return "result", len(self._code) - 1

    def _product(self, parts: list[Node]) -> list[Node]:
        """Return a, b and c of a sum a b + c whose product nothing else has asked for yet; else nothing."""
        for part, other in (parts, parts[::-1]):
            if isinstance(part, tuple) and part[0] == "*" and part not in self._known and not is_of_time(part):
                return [part[1], part[2], other]
        return []

    def _measure(self, measure: Measure) -> Operand:
        kind, names = measure.kind, measure.names
        if kind in self._rows:
            point = self.measures.placement.point(self.scene, place(self.scene, names[0]))
            self._rows[kind].append(self.measures.rows.of(point)["xyz".index(names[1])])
            return kind, len(self._rows[kind]) - 1
        key = _RATES.get(kind, kind), names
        if key not in self._measured:
            self._measured[key] = len(self.measures.kinds)
            self._add(str(measure), key[0], measure)
        return "measure", 2 * self._measured[key] + (kind in _RATES)

    def _add(self, name: str, kind: str, measure: Measure) -> None:
        scene, measures = self.scene, self.measures
        if kind == "distance":
            ends = [measures.placement.point(scene, place(scene, one)) for one in measure.names]
            measures._measure(name, DISTANCE, ends, _NO_LAW, 0.0)
            return
        joint = joint_of(scene, measure)
        if kind == "slide":
            line = joint.direction if isinstance(joint, Slider) and joint.axis is None else joint.axis
            along = measures.placement.line(joint.first, line)
            ends = [measures.placement.point(scene, side) for side in (joint.first, joint.second)]
            measures._measure(name, PLACE, [*ends, along], _NO_LAW, 0.0)
        elif joint is None:
            base = Attachment(body=GROUND, point=(0.0,) * scene.dimensions)
            measures._angle(name, base, Attachment(body=measure.names[0]), _NO_LAW, Z)
        else:
            measures._angle(name, joint.first, joint.second, _NO_LAW, joint.axis)
