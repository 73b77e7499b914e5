"""The mesh error that statics and modes tell, against the error that a much finer mesh shows."""

from __future__ import annotations

import numpy as np
import pytest
import shoal
from shoal.scene import Scene

BEAM = Scene.parse(
    {
        "name": "cantilever",
        "bodies": {
            "beam": {
                **{"kind": "rod", "element": "ancf-cable", "elements": 2, "length": 1.0, "height": 0.01, "width": 0.01},
                **{"density": 2700.0, "youngs_modulus": 1e8},
            }
        },
        "joints": {
            "wall": {
                "kind": "weld",
                "first": {"body": "ground", "point": [0, 0]},
                "second": {"body": "beam", "point": "start"},
            }
        },
        "markers": {"tip": {"body": "beam", "point": "end"}},
    }
)


def finest(elements: int) -> dict[str, int]:
    return {"bodies.beam.elements": elements}


def test_of_a_place_of_rest() -> None:
    """Bent far by its own weight."""
    found, true = shoal.statics(BEAM), shoal.statics(BEAM, set=finest(12), verify=False)
    error = float(np.linalg.norm(found.marker("tip") - true.marker("tip")))
    assert found.marker("tip")[1] < -0.1
    assert found.errors.estimates["mesh"] == pytest.approx(error, rel=0.5)
    assert "mesh" not in true.errors.estimates


def test_of_modes() -> None:
    found, true = shoal.modes(BEAM, count=3), shoal.modes(BEAM, count=3, set=finest(12), verify=False)
    errors = [abs(1 - one / other) for one, other in zip(found.frequencies, true.frequencies, strict=True)]
    assert found.mesh_errors == pytest.approx(errors, rel=0.5)
    assert [mode["mesh_error"] for mode in found.to_json()["modes"]] == list(found.mesh_errors)


def test_what_has_no_mesh_has_no_error_of_it() -> None:
    assert shoal.statics("rigid-double-pendulum").to_json()["mesh_error"] is None
    assert shoal.modes("rigid-double-pendulum").mesh_errors == ()
