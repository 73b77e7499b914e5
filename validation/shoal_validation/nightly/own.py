"""Lines of the user's machines: every scene of the library that states its expectations (`expect:`)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from shoal import library
from shoal.engines import get_engine
from shoal.engines.verification import verified
from shoal.errors import InputError
from shoal.expectation import question
from shoal.scene import load_scene
from shoal.scene.expect import ExpectedAsBefore
from shoal.trajectory import Status

from shoal_validation.nightly.line import Line
from shoal_validation.nightly.measure import Measured, timed

ENGINE = "gauss"
OWN = "library/"
"""Before the name of a machine in a night, which may be that of a built-in problem."""
REASON = "the tolerance that the scene states"


def lines() -> Iterator[Line]:
    """One for each expectation; one that fails for a scene that cannot be read any more."""
    for entry in library.entries("scenes"):
        version = f"{entry.name}@{entry.version}"
        line = partial(Line, OWN + entry.name, ENGINE, reason=REASON, version=entry.version)
        try:
            scene = load_scene(version)
        except InputError as error:
            refused = partial(Measured, str(Status.REFUSED), np.nan, np.nan, str(error))
            yield line(method="scene", limit=0.0, run=refused, source="a scene that can be read")
            continue
        for name, expected in scene.expect.items():
            limit = expected.tolerance
            run: Callable[[], Measured] = partial(measured, version, name)
            try:
                asked = question(scene, name, entry.document)
                source, unit = asked.source, asked.unit
            except InputError:
                source, unit = "what it states", "m"  # the run says why, as what was found
            before = isinstance(expected, ExpectedAsBefore)
            yield line(method=name, limit=limit, run=run, source=source, unit=unit, noise=limit, as_before=before)


def measured(version: str, name: str) -> Measured:
    """One expectation of a scene (NAME@VERSION), run and verified as `shoal simulate` does. Raises InputError."""
    document = library.entry(version, "scenes").document
    asked = question(load_scene(version), name, document)
    seconds, trajectory = timed(lambda: verified(get_engine(ENGINE), asked.scene, asked.times))
    status, error = str(trajectory.status[0]), np.nan
    if trajectory.ok and asked.error is not None:
        error = asked.error(trajectory)
    points = trajectory.points[..., 0].ravel().tolist() if trajectory.ok and asked.error is None else None
    return Measured(status, error, seconds, trajectory.message, points)
