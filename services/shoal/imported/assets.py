"""Files of shapes and pictures that an MJCF file names and that are not there: nothing needs them unless mass does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from shoal.errors import InputError


def do_without(mujoco: Any, file: Path, spec: Any) -> list[str]:
    """Take what is only seen, and absent meshes and height fields, out of a specification; return a note on those.

    Raises InputError where a body that moves takes its mass from an absent mesh.
    """
    for skin in list(spec.skins):
        spec.delete(skin)
    for material in spec.materials:
        material.textures = [""] * len(material.textures)
    for texture in list(spec.textures):
        spec.delete(texture)
    folders = [Path(spec.modelfiledir or file.parent)]
    folders = [folders[0] / (spec.meshdir or ""), folders[0], file.parent, file.parent / (spec.meshdir or "")]
    absent = {}
    for shapes in (spec.meshes, spec.hfields):
        for shape in list(shapes):
            if shape.file and not any((folder / shape.file).is_file() for folder in folders):
                absent[shape.name or Path(shape.file).stem] = shape
    geoms = [geom for geom in spec.geoms if geom.meshname in absent or geom.hfieldname in absent]
    for geom in geoms:
        if _weighs(mujoco, spec, geom):
            raise InputError(
                f"{file}: body {geom.parent.name}: takes its mass from the mesh {geom.meshname!r}, and "
                f"{absent[geom.meshname].file!r} is not found; state an <inertial> to do without it"
            )
        # Its name stays, as others may refer to it.
        geom.type, geom.meshname, geom.hfieldname = mujoco.mjtGeom.mjGEOM_SPHERE, "", ""
        geom.size, geom.mass, geom.contype, geom.conaffinity = [1e-3, 0, 0], 0.0, 0, 0
    for shape in absent.values():
        spec.delete(shape)
    if not absent:
        return []
    listed = ", ".join([*absent][:4]) + ", ..." * (len(absent) > 4)
    return [f"shapes: {len(absent)} files are not found ({listed}); no mass follows from them, and they touch nothing"]


def _weighs(mujoco: Any, spec: Any, geom: Any) -> bool:
    """Return whether a body that moves takes mass from a shape."""
    body, moves = geom.parent, False
    stated = body.explicitinertial and spec.compiler.inertiafromgeom != mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    while body is not None and body.name != "world":
        moves = moves or bool(list(body.joints))
        body = body.parent
    low, high = spec.compiler.inertiagrouprange
    without = geom.mass == 0.0 or geom.density == 0.0 or not low <= geom.group <= high
    return moves and not stated and not without
