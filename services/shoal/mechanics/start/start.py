"""Consistent initial conditions of a planar machine: poses and rates that satisfy its joints and the stated values.

Stated values are kept exactly if possible; all others follow from them, or are zero where nothing determines them.
Stated values that miss by the rounding of their digits are corrected in the order of the scene, and so are guesses
(`InitialState.guess`). Any other contradiction is refused by name.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

import numpy as np

from shoal.errors import InputError
from shoal.mechanics import plane
from shoal.mechanics import rotation as turns
from shoal.mechanics.affine import Affine
from shoal.mechanics.frames import Frame, ModalFrame, RigidFrame
from shoal.mechanics.joints import Meet, of_scene
from shoal.mechanics.numerics.tile import Array, Flags, Number
from shoal.mechanics.start.centred import centred
from shoal.mechanics.start.closure import Rows
from shoal.mechanics.start.poses import ROUNDING, Assembly, Statement
from shoal.mechanics.start.rates import Velocities
from shoal.mechanics.start.strained import gives_way, numbers_of_start, require_numbers
from shoal.scene import GROUND, InitialState, Scene
from shoal.scene.ended import End
from shoal.scene.initial import ABOUT_Z, POSES, RATES, UNITS, Quantity
from shoal.scene.joints import is_loose, places
from shoal.scene.paths import lanes_of

_EFFORT = 8_000
"""Gaps (`Assembly.effort`) after which no fewer statements are sought that contradict each other."""
_SLACK = 1e-3
"""Part of the largest pull on a statement below which one is not pulled."""
UNCHANGED = 1e-9
"""Changes below this, relative to the value, 1 rad, the size or the speed of the machine, are not spoken of."""


class Start(NamedTuple):
    """A scene whose initial state is complete and agrees with its joints; failed: lanes that have none, (lanes,)."""

    scene: Scene
    failed: Flags


def started(scene: Scene) -> Start:
    """Return the start of a scene. Raises InputError if a single scene has none; of many lanes, reports those."""
    return Start(scene, np.zeros(1, dtype=bool)) if is_direct(scene) else complete(scene)


def complete(scene: Scene) -> Start:
    """Return the start with every quantity of every body."""
    count = lanes_of((scene.initial, scene.bodies, scene.joints))
    lanes = max(count, 1)
    placed_as, moved_as = centred(scene, lanes)
    assembly = Assembly(placed_as, lanes)
    placed = assembly.run()
    if not np.all(placed.ok) and gives_way(scene):
        if not count:
            require_numbers(scene)
        if not gives_numbers(scene):
            placed = placed._replace(ok=np.ones_like(placed.ok))
    if not count and not placed.ok[0]:
        raise pose_refused(assembly)
    moved_by = assembly if moved_as is placed_as else Assembly(moved_as, lanes)
    velocities = Velocities(moved_by, placed.poses)
    moving = velocities.run()
    if not count and not moving.ok[0]:
        # The other ways to put the machine together may have the stated rates.
        for other in assembly.others(placed.poses):
            tried = Velocities(moved_by, other).run()
            if tried.ok[0]:
                placed, moving = placed._replace(poses=other), tried
                break
        else:
            raise _rates_refused(velocities, moving.broken)

    def column(values: Array, k: int) -> Any:
        return values[:, k] if count else float(values[0, k])

    initial = {}
    for number, name in enumerate(scene.bodies):
        x, y, turn = range(3 * number, 3 * number + 3)
        u, v = placed.poses, moving.rates
        initial[name] = InitialState.model_construct(
            angle=column(u, turn),
            rate=column(v, turn),
            position=(column(u, x), column(u, y)),
            velocity=(column(v, x), column(v, y)),
            modes=scene.start(name).modes,
            mode_rates=scene.start(name).mode_rates,
            guess=(),
        )
    return Start(scene.model_copy(update={"initial": initial}), ~(placed.ok & moving.ok))


def gives_numbers(scene: Scene) -> bool:
    """Return whether joints or loads take a number of theirs (an angle, a length, a side) from the start.

    In space they take their axes from it.
    """
    return scene.dimensions == 3 or next(numbers_of_start(scene), None) is not None


def is_direct(scene: Scene) -> bool:
    """Return whether the walk along the joints keeps every statement: open chains of revolute joints in the plane."""
    if scene.ground_points or scene.dimensions == 3 or any(start.mode_rates for start in scene.initial.values()):
        return False
    if any(map(is_loose, scene.joints.values())):
        return False
    group = {name: name for name in (GROUND, *scene.bodies)}
    for _, condition in of_scene(scene):
        if not isinstance(condition, Meet):
            return False
        one, other = group[condition.first.body], group[condition.second.body]
        if one == other:
            return False
        for body, owner in group.items():
            if owner == other:
                group[body] = one
    placed = [group[GROUND]]
    for name, start in scene.initial.items():
        if start.position is not None or start.velocity is not None:
            placed.append(group[name] if start.position is not None else group[GROUND])
    return len(set(placed)) == len(placed)


def pose_refused(assembly: Assembly) -> InputError:
    """Return an error that names the stated poses in contradiction, or the joint that cannot be closed at all."""
    if not assembly.seek([]).ok[0]:
        name, gap, _ = _worst_residual(assembly, [])
        return InputError(f"joints.{name}: cannot be assembled; its places stay {gap} apart at best")
    guilty, fewest = _narrowed(assembly, [one for one in assembly.statements if one.firm])
    name, gap, small = _worst_residual(assembly, guilty)
    why = f"joint {name} would stay {gap} apart"
    if small:
        # Of a machine that holds itself more than it needs to: no statement is at fault.
        return InputError(f"{_stated(guilty[-1])}: {why}, as rounded places or lengths do; state them with more digits")
    return _contradiction(guilty, why, fewest)


def _narrowed(assembly: Assembly, guilty: list[Statement]) -> tuple[list[Statement], bool]:
    """Return a minimal conflict: statements that contradict each other without the rest, and whether it is minimal.

    Large parts are left out first; the last statements of the scene are kept, as the ones in excess.
    """
    before, joints = assembly.effort, list(assembly.scene.joints)
    for mechanism in dict.fromkeys(tuple(_connected(assembly.scene, [one.body])) for one in guilty):
        own = [one for one in guilty if tuple(_connected(assembly.scene, [one.body])) == mechanism]
        if own != guilty and not assembly.closes(own, mechanism):
            guilty, joints = own, list(mechanism)
            break
    pulled = _pulled(assembly, guilty)
    if 0 < len(pulled) < len(guilty) and not assembly.closes(pulled, joints):
        guilty = pulled
    size = len(guilty) // 2
    while size:
        first = 0
        while first < len(guilty):
            if assembly.effort - before > _EFFORT:
                return guilty, False
            fewer = guilty[:first] + guilty[first + size :]
            if fewer and not assembly.closes(fewer, joints):
                guilty = fewer
            else:
                first += size
        size //= 2
    return guilty, True


def _held_open(assembly: Assembly, chosen: list[Statement]) -> tuple[Array, Rows]:
    """Return weights of the rows, and the rows of least gaps in joints that close loops, with statements kept."""
    fixed, begin = assembly.held(chosen)
    weight = np.where(np.isin(assembly.closure.rows(assembly.guess).names, assembly.walk.closing), 1.0, 1e3)
    u, _ = assembly.close(assembly.closure, begin, fixed, weight)
    return weight, assembly.closure.rows(u)


def _pulled(assembly: Assembly, chosen: list[Statement]) -> list[Statement]:
    """Return the statements that gaps would pull if joints were springs: the others do not keep the machine open."""
    weight, rows = _held_open(assembly, chosen)
    length = np.where(rows.angular, 1.0, assembly.size) / weight
    pull = np.abs(rows.gap[0] / length**2 @ rows.slope[0]) * np.sqrt(assembly.give)
    largest = [float(np.max(pull[list(one.columns)])) for one in chosen]
    return [one for one, size in zip(chosen, largest, strict=True) if size > _SLACK * max(largest)]


def _worst_residual(assembly: Assembly, chosen: list[Statement]) -> tuple[str, str, bool]:
    """Return the joint of the worst residual with these statements kept, its size, and whether rounding explains it."""
    rows = _held_open(assembly, chosen)[1]
    near = _connected(assembly.scene, [one.body for one in chosen])
    size = np.abs(rows.gap[0]) * np.isin(rows.names, near)
    worst = int(np.argmax(size / np.where(rows.angular, 1.0, assembly.size)))
    name = rows.names[worst]
    total = float(np.linalg.norm([g for g, n, a in zip(size, rows.names, rows.angular, strict=True)
                                  if n == name and a == rows.angular[worst]]))  # fmt: skip
    small = total < ROUNDING * (1.0 if rows.angular[worst] else assembly.size)
    return name, f"{total:.3g} {'rad' if rows.angular[worst] else 'm'}", small


def _connected(scene: Scene, bodies: list[str]) -> list[str]:
    """Return the joints of the mechanisms that these bodies are parts of, all joints if there are no bodies."""
    joints = {name: {at.body for at in places(joint)} - {GROUND} for name, joint in scene.joints.items()}
    found, size = set(bodies), -1
    while len(found) > size:
        size = len(found)
        found = found.union(*(there for there in joints.values() if there & found))
    return [name for name, there in joints.items() if not bodies or there & found] or list(joints)


def _rates_refused(velocities: Velocities, broken: list[Statement]) -> InputError:
    """Return an error that names the stated rates in contradiction, or the joint that cannot move as it is driven."""
    if not broken:
        for name in dict.fromkeys(velocities.rows.names):
            if velocities.run(joint=name).ok[0]:
                return InputError(
                    f"joints.{name}: cannot begin to move as it is driven or as the rates are stated; "
                    "the joints allow no such motion in this position"
                )
        return InputError("initial: the joints allow no motion with these rates in this position")
    last = broken[0]
    others = [one for one in velocities.statements if one is not last and one.firm]
    guilty = [one for one in others if last not in velocities.run(without=one).broken]
    names = dict.fromkeys((*velocities.walk.closing, *velocities.rows.names))
    joint = next((name for name in names if last not in velocities.run(joint=name).broken), "")
    asked = velocities.run(without=last).rates[0, last.columns]
    asked = np.where(np.abs(asked) > UNCHANGED * velocities.speed, asked, 0.0)
    wants = f"joint {joint} asks for {_written(asked)} {UNITS[last.quantity]}" if joint else "they cannot both hold"
    return _contradiction([*guilty, last], wants)


def _contradiction(guilty: list[Statement], why: str, fewest: bool = True) -> InputError:
    """Return an error that names the last statement and those that it contradicts. fewest: whether all of them do."""
    *others, last = guilty
    if not others:
        return InputError(f"{_stated(last)}: {why}; leave it out and it follows from the joints")
    value = f"{last.path}: {_written(last.values[0])} {UNITS[last.quantity]}"
    listed = ", ".join(f"{one.path} = {_written(one.values[0])}" for one in others[:3])
    more = f" and {len(others) - 3} more" if len(others) > 3 else ""
    out = "one of them out and it follows" if fewest else "some of them out and they follow"
    return InputError(f"{value} contradicts {listed}{more}: {why}; leave {out} from the rest")


def _stated(one: Statement) -> str:
    return f"{one.path}: {_written(one.values[0])} {UNITS[one.quantity]} cannot be kept"


def _written(values: Array) -> str:
    numbers = [f"{value:z.6g}" for value in values]
    return numbers[0] if len(numbers) == 1 else f"[{', '.join(numbers)}]"


def body_states(frames: Mapping[str, Frame], scene: Scene, q: Array, v: Array) -> dict[str, InitialState]:
    """Return the state of every body at the coordinates q and rates v of a machine, each (unknowns,).

    scene: in the plane with a complete start, to whose angles whole turns are counted. In space rods have no attitude.
    Of (unknowns, lanes) its numbers are arrays, without modes.
    """
    found = {}
    origin = (0.0,) * scene.dimensions
    for name, frame in frames.items():
        place = frame.origin if isinstance(frame, ModalFrame) else frame.point(origin)
        if scene.dimensions == plane.DIMENSIONS:
            attitude = _angle(frame, scene.start(name).angle, q, v)
        else:
            attitude = _rotation(frame, q, v) if isinstance(frame, RigidFrame) else {}
        found[name] = InitialState.model_construct(
            position=_numbers(place_at(place, q)), velocity=_numbers(rate_at(place, v)), guess=(), **attitude
        )
    return found


def _angle(frame: Frame, near: Number, q: Array, v: Array) -> dict[str, Any]:
    """The angle of a body in the plane, its rate, and its modes; near: one with the same whole turns [rad]."""
    modes, mode_rates = tuple[float, ...](), tuple[float, ...]()
    if isinstance(frame, ModalFrame):
        axis = frame.directors[0]
        modes, mode_rates = _bending(frame, q, v) if q.ndim == 1 else (modes, mode_rates)
    else:
        axis = frame.direction((0.0,) * plane.DIMENSIONS)
    along, turning = place_at(axis, q), rate_at(axis, v)
    turn = plane.angle(along) - near
    angle = near + turn - 2 * np.pi * np.rint(turn / (2 * np.pi))
    (angle, rate) = _numbers([angle, plane.cross(along, turning) / sum(along**2)])
    return {"angle": angle, "rate": rate, "modes": modes, "mode_rates": mode_rates}


def _rotation(frame: RigidFrame, q: Array, v: Array) -> dict[str, Any]:
    """The rotation vector and the spin of a rigid body in space."""
    directors = np.array([place_at(one, q) for one in frame.directors])
    turning = np.array([rate_at(one, v) for one in frame.directors])
    lanes = directors.reshape(*directors.shape[:2], -1).swapaxes(0, 1)
    vectors = np.stack([turns.vector_of(lanes[..., lane]) for lane in range(lanes.shape[2])], axis=1)
    spin = 0.5 * np.sum(np.cross(directors, turning, axis=1), axis=0)
    return {"rotation": _numbers(vectors.reshape(spin.shape)), "spin": _numbers(spin)}


def _bending(frame: ModalFrame, q: Array, v: Array) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Amplitudes of modes and their rates."""
    e = frame.directors[0].at(q) / np.linalg.norm(frame.directors[0].at(q))
    turning = float(plane.cross(e, frame.directors[0].rate(v)) / (e @ frame.directors[0].at(q))) * plane.quarter(e)
    modes = tuple(float(e @ one.at(q) - rest) for one, rest in frame.measured)
    return modes, tuple(float(e @ one.rate(v) + turning @ one.at(q)) for one, _ in frame.measured)


def _numbers(parts: Iterable[Any]) -> tuple[Any, ...]:
    """Numbers of Python, or arrays over lanes as they are."""
    return tuple(x if np.ndim(x) else float(x) for x in parts)


def place_at(vector: Affine, q: Array) -> Array:
    """Return a vector at coordinates, (d,) for (unknowns,) or (d, lanes) for (unknowns, lanes)."""
    return vector.at(q) if q.ndim == 1 else _summed(vector, vector.constant, q)


def rate_at(vector: Affine, v: Array) -> Array:
    """Return the rate of change of a vector at rates of the coordinates, shaped likewise."""
    return vector.rate(v) if v.ndim == 1 else _summed(vector, 0.0 * vector.constant, v)


def _summed(vector: Affine, constant: Array, q: Array) -> Array:
    total = sum((c * q[unknown] for unknown, c in vector.terms.items()), constant)
    return np.broadcast_to(total, (len(total), max(total.shape[1], q.shape[1])))


def changes(scene: Scene, used: Mapping[str, InitialState], size: Number, lanes: int = 1) -> list[dict[str, Any]]:
    """Return the stated values that are not used, of every lane: body -> quantity -> stated, used.

    Round-off of any size [m] is left out. An angle or rate in space is returned as the rotation or spin where it is not
    about z.
    """
    found: list[dict[str, Any]] = [{} for _ in range(lanes)]
    turning, moving = (_largest_stated(scene, lanes, *some) for some in (("rate", "spin"), ("velocity",)))
    pace = np.maximum(1.0, turning)
    least = {"position": size, "velocity": np.maximum(size * pace, moving), "rate": pace, "spin": pace}
    for name, start in () if isinstance(scene.initial_from, End) else scene.initial.items():
        for quantity in UNITS:
            if getattr(start, quantity) is None:
                continue
            compared, stated, now = _alike(quantity, getattr(start, quantity), used[name], lanes)
            if now is None:
                continue
            off = np.max(np.abs(now[: len(stated)] - stated[: len(now)]), axis=0)
            small = UNCHANGED * np.maximum(np.max(np.abs(stated), axis=0), least.get(quantity, 1.0))
            about_z = np.broadcast_to(compared == quantity or np.all(np.abs(now[:2]) <= small, axis=0), lanes)
            for lane in np.flatnonzero(off > small):
                reported = quantity if about_z[lane] else compared
                parts = stated[:, lane].tolist(), now[:, lane].tolist()
                one, other = (part[-1] if reported in ABOUT_Z else tuple(part) for part in parts)
                found[lane].setdefault(name, {})[reported] = {"stated": one, "used": other, "unit": UNITS[reported]}
    return found


def _alike(quantity: Quantity, stated: Any, used: InitialState, lanes: int) -> tuple[Quantity, Array, Array | None]:
    """Return a quantity, its stated and its used values, (components, lanes), to be compared; None: has none."""
    if used.rotation is not None and quantity in ABOUT_Z:
        quantity, stated = ABOUT_Z[quantity], (0.0, 0.0, stated)
    wanted, now = _rows(stated, lanes), getattr(used, quantity)
    if now is None:
        return quantity, wanted, None
    now = _rows(now, lanes)
    if quantity == "rotation":
        # Of the rotation vectors of one attitude the one that is nearest.
        turn = np.linalg.norm(now, axis=0)
        along = np.where(turn > 0, now, wanted)
        along = along / np.maximum(np.linalg.norm(along, axis=0), 1e-300)
        now = now + 2 * np.pi * np.rint((np.sum(along * wanted, axis=0) - turn) / (2 * np.pi)) * along
    return quantity, wanted, now


def _rows(value: Any, lanes: int) -> Array:
    """The components of a quantity, (components, lanes)."""
    parts = value if isinstance(value, tuple | list) else (value,)
    return np.stack([np.broadcast_to(np.asarray(part, dtype=float), lanes) for part in parts])


def _largest_stated(scene: Scene, lanes: int, *quantities: Quantity) -> Array:
    """The largest of these that a body is stated to have, else zero, (lanes,)."""
    stated = (getattr(start, quantity) for start in scene.initial.values() for quantity in quantities)
    sizes = [np.max(np.abs(_rows(value, lanes)), axis=0) for value in stated if value is not None]
    return np.max(sizes, axis=0) if sizes else np.zeros(lanes)


def facts(scene: Scene, used: Mapping[str, InitialState], size: float) -> dict[str, Any]:
    """The start of every body as it was used, and what of it the scene states otherwise; size: of the machine [m]."""
    (found,) = changes(scene, used, size)
    return {
        "initial": {name: one.model_dump(exclude={"guess"}) for name, one in used.items()},
        "initial_changes": found,
        "initial_correction": _largest(found, POSES),
        "initial_rate_correction": _largest(found, RATES),
    }


def _largest(found: Mapping[str, Any], quantities: tuple[Quantity, ...]) -> float:
    """The largest of the changes of these quantities."""
    every = (one for body in found.values() for quantity, one in body.items() if quantity in quantities)
    return float(max((np.max(np.abs(np.subtract(one["used"], one["stated"]))) for one in every), default=0.0))
