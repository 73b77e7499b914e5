"""Signals: formulas of time, of measures of the machine, of states and of each other, which loads follow.

A signal is written out by putting the formulas of others in place of their names, so that what depends on t alone is
a function of time like any other. Numbers stay what they are by name: lanes may differ in them.
"""

from __future__ import annotations

import keyword
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import Annotated, Any

from pydantic import Discriminator, Tag

from shoal.errors import InputError
from shoal.scene import expression, formula
from shoal.scene.formula import MEASURES, Measure, Node, leaves
from shoal.scene.function import SignalFunction
from shoal.scene.joints import GROUND, Attachment, Coupling, Cylindrical, DrivenAngle, Revolute, Slider
from shoal.scene.record import Positive, Record
from shoal.scene.sampled import Sampled, SampledState, differences

TAKEN = {"t", "pi", "e", *expression.ONE, *expression.MANY, *MEASURES}
_MOST, _DEEPEST = 2000, 200
"""Operations of a signal that is written out, and how deep they are nested: bounds on time and memory."""
TURNING, SLIDING = (Revolute, DrivenAngle, Cylindrical), (Slider, Cylindrical)
_AXES = "xyz"


@dataclass(frozen=True)
class Constant:
    """A signal that is a number, by its name."""

    name: str


@dataclass(frozen=True)
class Table:
    """A signal that is a table, by its name."""

    name: str


@dataclass(frozen=True)
class StateValue:
    """A state, by its name."""

    name: str


@dataclass(frozen=True)
class HeldValue:
    """A sampled signal or state, by its name: a number between its instants."""

    name: str


class State(Record):
    """A number that obeys an equation of first order, integrated with the motion, as of a filter or an integrator."""

    rate: SignalFunction
    """Its rate as a function of time, measures, signals and states [1/s]."""
    start: float = 0.0
    """Its value at the start [1]."""
    size: Positive = 1.0
    """What is large of it, so that it is as exact as a rate of so many SI units of the machine [1]."""


AnyState = Annotated[
    Annotated[State, Tag("function-rate")] | Annotated[SampledState, Tag("function-next")],
    Discriminator(differences),
]


def check_signals(scene: Any) -> None:
    """Raises ValueError for names that are taken or unknown, for measures that there are not, and for cycles."""
    for part, name in [*(("signals", one) for one in scene.signals), *(("states", one) for one in scene.states)]:
        if name in TAKEN or keyword.iskeyword(name):
            raise ValueError(f"{part}.{name}: the name is taken by formulas; use another one")
        if part == "states" and name in scene.signals:
            raise ValueError(f"states.{name}: there is a signal of this name; use another one")
    for where, function in signal_functions(scene):
        check_leaves(scene, where, function)
    _check_instants(scene)
    size, depth = dict[str, int](), dict[str, int]()
    for name in _order(scene.signals):
        function = formula_of(scene.signals[name])
        size[name], depth[name] = _extent(_tree(function), size, depth)
        if size[name] > _MOST or depth[name] > _DEEPEST:
            raise ValueError(
                f"signals.{name}: too long where signals are written out; at most {_MOST} operations, nested at most "
                f"{_DEEPEST} deep"
            )
    if scene.signals:
        known = expanded(scene)
        for where, function in signal_functions(scene):
            try:
                _put(_tree(function), known)
            except InputError as error:
                raise ValueError(_at(where, error)) from None


def _at(where: str, error: InputError) -> str:
    return f"{where}: {str(error).removeprefix('function: ')}"


def check_coupling(scene: Any, name: str, joint: Coupling) -> None:
    """Raises ValueError for measures of a coupling that a scene does not have."""
    for number, term in enumerate(joint.terms):
        if term.measure is not None:
            _check_measure(scene, f"joints.{name}.terms.{number}.of", term.measure)
    if scene.dimensions == 3 and joint.value is not None:
        for number, term in enumerate(joint.terms):
            if term.measure is not None and term.measure.kind == "angle":
                raise ValueError(
                    f"joints.{name}.value: in space a sum with an angle (terms.{number}) is that of the start; leave "
                    "it out, and drive an angle by a driven-angle"
                )


def _check_instants(scene: Any) -> None:
    """Raises ValueError where an acceleration would decide on the forces that it depends on."""
    if not any(_accelerations(one) for _, one in signal_functions(scene)):
        return
    known = expanded(scene)
    for where, one in signal_functions(scene):
        sampled = where.endswith((".sample", ".next"))
        if not where.startswith("signals.") and not sampled and (found := _accelerations(one, known)):
            raise ValueError(
                f"{where}: {found[0]} depends on the forces of the same instant; a sampled signal may follow it "
                "(`sample`, `period`)"
            )


def _accelerations(function: SignalFunction, known: Mapping[str, Node] | None = None) -> list[Measure]:
    """Return the accelerations in a function; known: what stands in it for names."""
    tree = _tree(function)
    parts = leaves(tree if known is None else _put(tree, known))
    return [one for one in parts if isinstance(one, Measure) and one.kind == "acceleration"]


def check_leaves(scene: Any, where: str, function: SignalFunction) -> None:
    """Raises ValueError for names and measures of a function that a scene does not have; where: its field."""
    known = scene.signals.keys() | scene.states.keys()
    try:
        found = list(_leaves(function))
    except InputError as error:
        raise ValueError(_at(where, error)) from None
    for leaf in found:
        if isinstance(leaf, Measure):
            _check_measure(scene, where, leaf)
        elif leaf != "t" and leaf not in known:
            there = f"; there are {', '.join([*scene.signals, *scene.states])}" if known else ""
            raise ValueError(f"{where}: {function.expression!r} has {leaf!r}, which is not known{there}; t is time")


def signal_functions(scene: Any) -> Iterator[tuple[str, SignalFunction]]:
    """Yield the signals of a scene and the functions that may depend on them, with their fields."""
    for name, one in scene.signals.items():
        if isinstance(one, Sampled):
            yield f"signals.{name}.sample", one.sample
        elif isinstance(one, SignalFunction):  # else an array, one number a lane
            yield f"signals.{name}", one
    for name, load in scene.loads.items():
        for field, value in load:
            if isinstance(value, SignalFunction):
                yield f"loads.{name}.{field}", value
    for name, state in scene.states.items():
        sampled = isinstance(state, SampledState)
        yield (f"states.{name}.next", state.next) if sampled else (f"states.{name}.rate", state.rate)


def continuous_states(scene: Any) -> dict[str, State]:
    """Return the states that are integrated."""
    return {name: one for name, one in scene.states.items() if isinstance(one, State)}


def sampled_parts(scene: Any) -> dict[str, Sampled | SampledState]:
    """Return the sampled signals, each behind those that it depends on at an instant, and then the sampled states."""
    order = [(name, scene.signals[name]) for name in _order(scene.signals)]
    return {name: one for name, one in [*order, *scene.states.items()] if isinstance(one, Sampled | SampledState)}


def refuse_sampled(scene: Any, why: str) -> None:
    """Raises InputError where a scene has sampled signals or states."""
    for part in ("signals", "states"):
        for name, one in getattr(scene, part).items():
            if isinstance(one, Sampled | SampledState):
                raise InputError(f"{part}.{name}: sampled every {one.period:g} s: {why}")


def formula_of(signal: Any) -> Any:
    """Return the function that is sampled of a sampled signal; any other signal itself."""
    return signal.sample if isinstance(signal, Sampled) else signal


def following(scene: Any) -> list[str]:
    """Return the fields of loads, and of the rates of states, that are no functions of time alone."""
    found = [where for where, one in signal_functions(scene) if not where.startswith("signals.") and not one.of_time]
    return sorted(found, key=lambda where: where.startswith("states."))


def written_out(scene: Any, function: SignalFunction, known: Mapping[str, Node] | None = None) -> Node:
    """Return the tree of a function with the formulas of signals in place of their names; known: see `expanded`."""
    return _put(_tree(function), expanded(scene) if known is None else known)


def expanded(scene: Any) -> dict[str, Node]:
    """Return what stands in formulas for the names of signals and states."""
    states = continuous_states(scene)
    known: dict[str, Node] = {name: StateValue(name) if name in states else HeldValue(name) for name in scene.states}
    known |= {name: HeldValue(name) for name, one in scene.signals.items() if isinstance(one, Sampled)}
    for name in _order(scene.signals):
        one = scene.signals[name]
        if isinstance(one, Sampled):
            continue
        if not isinstance(one, SignalFunction) or one.number is not None:
            known[name] = Constant(name)
        else:
            try:
                known[name] = Table(name) if one.table is not None else _put(_tree(one), known)
            except InputError as error:
                raise ValueError(_at(f"signals.{name}", error)) from None
    return known


def depends_on_time(scene: Any, function: SignalFunction) -> bool:
    """Return whether any part of a function is one of time, or held over time."""
    return any(leaf == "t" or isinstance(leaf, Table | HeldValue) for leaf in leaves(written_out(scene, function)))


def is_of_time(node: Node) -> bool:
    """Return whether a tree that is written out depends on t alone, and can be written as one expression."""
    return all(leaf == "t" for leaf in leaves(node))


def place(scene: Any, name: str) -> Attachment:
    """Return the place of a marker, of a moving point, of the ground, or where a body starts. Raises ValueError."""
    found = [scene.markers[name]] if name in scene.markers else []
    found += [Attachment(body=name)] if name in scene.bodies else []
    found += [Attachment(body=GROUND, point=name)] if name in scene.ground_points else []
    found += [Attachment(body=GROUND, point=(0.0,) * scene.dimensions)] if name == GROUND else []
    if any(one != found[0] for one in found):
        raise ValueError(f"{name!r} is the name of a marker and of another place; rename one of them")
    if not found:
        raise ValueError(f"no marker, body or point of the ground {name!r}; there are {', '.join(scene.markers)}")
    return found[0]  # type: ignore[no-any-return]


def joint_of(scene: Any, measure: Measure) -> Any:
    """Return the joint whose motion is measured; None of the angle of a body. Raises ValueError."""
    (name,) = measure.names
    wanted = TURNING if measure.kind in ("angle", "rate") else SLIDING
    joint = scene.joints.get(name)
    if joint is None and wanted is TURNING and name in scene.bodies:
        return None
    if joint is None:
        bodies = " or body" if wanted is TURNING else ""
        known = ", ".join(one for one, each in scene.joints.items() if isinstance(each, wanted)) or "none"
        raise ValueError(f"no joint{bodies} {name!r}; of this kind there are {known}")
    if wanted is TURNING and name in scene.bodies:
        raise ValueError(f"{name!r} is the name of a joint and of a body; rename one of them")
    if not isinstance(joint, wanted):
        kinds = " or ".join(str(one.model_fields["kind"].default) for one in wanted)
        raise ValueError(f"joint {name!r} is {joint.kind}; the measure is of {kinds}")
    return joint


def _check_measure(scene: Any, where: str, measure: Measure) -> None:
    try:
        if measure.kind in ("position", "velocity", "acceleration"):
            name, axis = measure.names
            at = place(scene, name)
            if axis not in _AXES[: scene.dimensions]:
                raise ValueError(f"the axis is {' or '.join(_AXES[: scene.dimensions])}, found {axis!r}")
            scene._check_attachment(where, at)
        elif measure.kind in ("distance", "distance_rate"):
            first, second = (place(scene, name) for name in measure.names)
            if first == second:
                raise ValueError("both are one place")
            for at in (first, second):
                scene._check_attachment(where, at)
        elif joint_of(scene, measure) is None:
            (name,) = measure.names
            if scene.dimensions == 3:
                raise ValueError("in space an angle is that of a joint")
            if scene.bodies[name].kind == "point-mass":
                raise ValueError(f"{name} is a point mass, which has no direction")
    except ValueError as error:
        raise ValueError(f"{where}: {measure}: {str(error).removeprefix(where + '.point: ')}") from None


def _leaves(function: SignalFunction) -> Iterator[Any]:
    return leaves(formula.tree(function.expression)) if function.expression is not None else iter(())


def _tree(function: SignalFunction) -> Node:
    if function.expression is not None:
        return formula.tree(function.expression)
    return float(function.number) if function.number is not None else 0.0


def _order(signals: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the names of signals, each behind those that it depends on at once. Raises ValueError for a cycle."""
    late = {name for name, one in signals.items() if isinstance(one, Sampled) and one.delay > 0.0}
    graph = {
        name: {leaf for leaf in _leaves(one) if leaf in signals} - late if isinstance(one, SignalFunction) else set()
        for name, one in ((name, formula_of(one)) for name, one in signals.items())
    }
    try:
        return tuple(TopologicalSorter(graph).static_order())
    except CycleError as error:
        names = error.args[1][::-1]
        sampled = any(isinstance(signals[name], Sampled) for name in names)
        way = "; a state with `next` is its value before, as is a sampled signal with a delay" if sampled else ""
        raise ValueError(f"signals.{names[0]}: depends on itself: {' -> '.join(names)}{way}") from None


def _extent(node: Node, size: Mapping[str, int], depth: Mapping[str, int]) -> tuple[int, int]:
    """Return the operations of a tree that is written out, and how deep they are nested."""
    if not isinstance(node, tuple):
        return (size.get(node, 0), depth.get(node, 0)) if isinstance(node, str) else (0, 0)
    inner = [_extent(argument, size, depth) for argument in node[1:]]
    return 1 + sum(one for one, _ in inner), 1 + max(one for _, one in inner)


def _put(node: Node, known: Mapping[str, Node]) -> Node:
    if isinstance(node, tuple):
        return formula.make(node[0], *(_put(argument, known) for argument in node[1:]))
    return known[node] if isinstance(node, str) and node != "t" else node
