"""A file, read as a scene."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shoal.errors import InputError
from shoal.findings import Finding
from shoal.imported import limits
from shoal.imported.absent import absent
from shoal.imported.actuators import add_actuators
from shoal.imported.assets import do_without
from shoal.imported.audit import MJCF, URDF, constraints, unread
from shoal.imported.axes import Axes
from shoal.imported.bodies import initial, is_mass, mass, rigid
from shoal.imported.composite import SMALL, TOUCHING
from shoal.imported.contacts import add_contacts
from shoal.imported.equalities import add_equalities
from shoal.imported.findings import findings
from shoal.imported.hanging import hang
from shoal.imported.loops import add_loops
from shoal.imported.markup import XmlElement, parse, with_includes
from shoal.imported.packages import expand
from shoal.imported.parts import Parts
from shoal.imported.rounding import numbers
from shoal.imported.sdf import as_urdf
from shoal.imported.source import Source
from shoal.imported.springs import add_resistance
from shoal.imported.switches import switch_off
from shoal.imported.table import Row, rows
from shoal.imported.tendons import add_tendons
from shoal.imported.urdf import Robot, Root, urdf_robot
from shoal.scene import GROUND, Scene


@dataclass(frozen=True)
class Imported:
    """A scene as data, and a report of what of its file is not in it.

    left_out: a line for everything that has no counterpart; missing: those of them that hold bodies, without which the
    scene has other degrees of freedom than the file: another machine; notes: assumptions where the file is silent;
    warnings: those of MuJoCo; rows: what became what
    """

    scene: dict[str, Any]
    left_out: tuple[str, ...]
    missing: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()
    rows: tuple[Row, ...] = ()

    @property
    def findings(self) -> list[Finding]:
        """Return what is not in the scene, by what that changes, and what was assumed."""
        return findings(self.left_out, self.missing, self.notes)


@dataclass(frozen=True)
class Loaded:
    """A file as MuJoCo has compiled it, with its XML, what it says beside that, and MuJoCo's warnings."""

    xml: XmlElement
    robot: Robot
    model: Any
    warnings: tuple[str, ...]


def load(file: Path, root: Root | None = None, arguments: Mapping[str, str] | None = None) -> Loaded:
    """Return the model of a URDF, SDF or MJCF file. Raises InputError. For the arguments see `read`."""
    import mujoco

    if not file.is_file():
        raise InputError(f"{file}: no such file")
    xml = parse(file, file.read_bytes())
    if xml.tag == "sdf":
        xml = as_urdf(file, xml)
    if file.suffix == ".xacro" or any(one.tag.startswith("xacro:") for one in xml.walk()):
        xml = parse(file, expand(file, arguments or {}))
    elif arguments:
        raise InputError(f"{file}: argument: has no macros that take {next(iter(arguments))!r}")
    if root is not None and xml.tag != "robot":
        raise InputError(f"{file}: root: MJCF states whether bodies are free; leave it out")
    with warnings.catch_warnings(record=True, action="always") as told:
        robot = urdf_robot(mujoco, file, xml, root) if xml.tag == "robot" else _mjcf(mujoco, file, xml)
        model = _compiled(file, robot.spec)
    return Loaded(xml, robot, model, tuple(" ".join(str(one.message).split()) for one in told))


def read(
    file: Path, root: Root | None = None, arguments: Mapping[str, str] | None = None, *, contacts: bool = True
) -> Imported:
    """Return the scene of a URDF, SDF or MJCF file at its own start, in metres, kilograms, seconds and radians.

    root: whether the ground holds the root of a URDF file; by default it does if anything else moves. arguments: of
    macros of xacro. contacts: whether those of geoms are wanted. Raises InputError if there is no such file, if it is
    wrong or if nothing in it moves, and ModuleNotFoundError without MuJoCo.
    """
    import mujoco

    loaded = load(file, root, arguments)
    robot = loaded.robot
    switch_off(mujoco, loaded.model)
    source = Source.of(mujoco, loaded.model)
    parts = _parts(source, contacts)
    add_loops(file, source, robot.loops, parts)
    notes = [*robot.notes, *parts.notes]
    if not parts.bodies:
        raise InputError(f"{file}: nothing in it moves{''.join(f'; {line}' for line in [*robot.left_out, *notes][:3])}")
    parts.left_out = robot.left_out + parts.left_out
    _audit(file, loaded.xml, parts)
    scene = _scene(source, parts, re.sub(r"[^A-Za-z0-9_-]", "-", file.stem))
    _count_angles(scene, parts.away, str(file))
    notes += limits.note(parts)
    return Imported(
        scene, tuple(parts.left_out), tuple(parts.missing), tuple(notes), loaded.warnings, tuple(rows(source, parts))
    )


def _mjcf(mujoco: Any, file: Path, root: XmlElement) -> Robot:
    """Return the machine of an MJCF file. Raises InputError."""
    if root.tag != "mujoco":
        raise InputError(f"{file}: <{root.tag}>: no machine; import the file with <mujoco> that includes it")
    for element in root.named("include"):
        if not (file.parent / (path := element.attributes.get("file", ""))).is_file():
            raise InputError(f"{file}: {element}: includes {path!r}, which is not found")
    try:
        spec = mujoco.MjSpec.from_file(str(file))
    except ValueError as error:
        raise InputError(f"{file}: {' '.join(str(error).split())}") from None
    return Robot(spec, notes=do_without(mujoco, file, spec))


def _compiled(file: Path, spec: Any) -> Any:
    try:
        return spec.compile()
    except ValueError as error:
        raise InputError(f"{file}: {' '.join(str(error).split())}") from None


def _audit(file: Path, root: XmlElement, parts: Parts) -> None:
    """List what of the file's XML is not translated."""
    if root.tag == "robot":
        for line in constraints(root):
            parts.miss(line)
        parts.left_out += unread(root, URDF)
    else:
        parts.left_out += unread(with_includes(root, file.parent), MJCF)


def _parts(source: Source, contacts: bool) -> Parts:
    model, parts = source.model, Parts()
    if contacts:
        add_contacts(source, parts)
        parts.small = TOUCHING if parts.contacts else SMALL
    elif np.any(source.model.geom_contype | source.model.geom_conaffinity):
        parts.left_out.append("geoms: all that touch others, as asked")
    # In a loop, axes of several bodies have to agree.
    loops, shared = np.any(model.eq_active0), Axes()
    for body in range(1, model.nbody):
        if source.owners[body] != body:
            continue
        name, alone = source.names[body], is_mass(source, body)
        parts.bodies[name] = mass(source, body) if alone else rigid(source, body, parts)
        parts.initial[name] = initial(source, body, turns=not alone)
        if alone:
            add_resistance(source, source.own(body), {"kind": "point-mass"}, parts)
        else:
            hang(source, body, shared if loops else Axes(), parts)
    add_tendons(source, parts)
    add_equalities(source, parts)
    add_actuators(source, parts)
    if model.nflex:
        parts.miss(f"flexible bodies: {model.nflex}")
    parts.left_out += absent(source)
    return parts


def _scene(source: Source, parts: Parts, name: str) -> dict[str, Any]:
    """The whole, as a scene's data."""
    return {
        "name": name if name[:1].isalpha() else f"scene-{name}",
        "dimensions": 3,
        "gravity": numbers(source.model.opt.gravity),
        "bodies": parts.bodies,
        "joints": parts.joints,
        **({"loads": parts.loads} if parts.loads else {}),
        **({"contacts": parts.contacts} if parts.contacts else {}),
        "markers": _markers(source, parts),
        "initial": parts.initial,
    }


def _markers(source: Source, parts: Parts) -> dict[str, Any]:
    """One at the origin of every body, and one at every site that moves."""
    markers: dict[str, Any] = {name: {"body": name} for name in parts.bodies if name not in parts.between}
    for site, marker in enumerate(source.called(source.mujoco.mjtObj.mjOBJ_SITE, source.model.nsite, "site")):
        at = source.at_site(site)
        if at["body"] != GROUND:
            markers[marker if marker not in markers else f"site-{marker}"] = at
    return markers


def _count_angles(data: dict[str, Any], away: dict[str, float], file: str) -> None:
    """State angles [rad] as the mechanics counts them: of torsion springs that rest away from the start, and of stops.

    The stops of a hinge are stated from its start, where a torsion spring in its place measures its angle. Raises
    InputError of data that are no scene.
    """
    from shoal.mechanics.assembly.loads import Loads
    from shoal.mechanics.assembly.placement import place
    from shoal.mechanics.derived import RowAllocator

    hinges = {name: one for name, one in data["joints"].items() if "stops" in one and one["kind"] == "revolute"}
    measures = {
        f"stops-of-{name}": {
            "kind": "torsion-spring",
            "stiffness": 1.0,
            **{key: one[key] for key in ("first", "second", "axis")},
        }
        for name, one in hinges.items()
    }
    free = {name: {key: part for key, part in one.items() if key != "stops"} for name, one in data["joints"].items()}
    scene = Scene.parse(data | {"joints": free, "loads": data.get("loads", {}) | measures}, file)
    if away or measures:
        loads = Loads(scene, place(scene), RowAllocator(0), 0.0)
        start = {name: float(np.ravel(angle)[0]) for name, angle in zip(loads.names, loads.angles, strict=True)}
        for name, angle in away.items():
            data["loads"][name]["angle"] = start[name] + angle
        for name, one in hinges.items():
            one["stops"] = {side: limit + start[f"stops-of-{name}"] for side, limit in one["stops"].items()}
