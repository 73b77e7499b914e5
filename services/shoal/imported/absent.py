"""What a scene has not at all."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from shoal.imported.source import Source
from shoal.imported.switches import disables


def absent(source: Source) -> Iterator[str]:
    """Lines for what a model has and no scene has: sensors, a medium and so on."""
    model = source.model
    colliding = int(np.sum((model.geom_contype != 0) | (model.geom_conaffinity != 0)))
    if model.ngeom - colliding:
        yield f"geoms: {model.ngeom - colliding} that are only seen"
    for what, count in (
        ("keyframes", model.nkey - (source.key is not None)),
        ("sensors", model.nsensor),
        ("cameras", model.ncam),
        ("lights", model.nlight),
    ):
        if count:
            yield f"{what}: {count}"
    if model.nmocap:
        yield f"mocap bodies: {model.nmocap}; they stand where the file draws them"
    if model.opt.density or model.opt.viscosity:
        yield f"the medium: density {model.opt.density:g}, viscosity {model.opt.viscosity:g}"
    if model.npair and not disables(model, source.mujoco.mjtDisableBit.mjDSBL_CONTACT):
        yield f"contact pairs: {model.npair}"
    if model.nplugin:
        yield f"plugins: {model.nplugin}"
    for body in np.flatnonzero(model.body_gravcomp):
        yield f"body {source.names[body]}: gravity compensation {model.body_gravcomp[body]:g}"
