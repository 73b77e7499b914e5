"""Studies whose runs cannot all start as stated, against where a slider-crank can be put together."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from shoal.notebook import uncertain
from shoal.pictures.uncertainty import uncertainty
from shoal.response import Response
from shoal.scene import Scene

ANGLE, CRANK, LINE = 1.2, 0.3, 0.1
"""Stated angle [rad] and length [m] of the crank; height of the slider's line above its hinge [m]."""
SHORTEST = CRANK * math.sin(ANGLE) - LINE
"""The shortest rod that reaches from the crank where it is stated to the slider's line [m]."""
ROD = "joints.R.length"
SCENE = Scene.parse({
    "name": "slider-crank",
    "bodies": {
        "crank": {"kind": "rigid-body", "mass": 1.0, "inertia": 0.1, "named_points": {"end": [CRANK, 0.0]}},
        "P": {"kind": "point-mass", "mass": 0.5},
    },
    "joints": {
        "O": {"first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "crank"}},
        "S": {"kind": "slider", "first": {"body": "ground", "point": [0.0, LINE]}, "second": {"body": "P"}},
        "R": {"kind": "distance", "first": {"body": "crank", "point": "end"}, "second": {"body": "P"}, "length": 0.4},
    },
    "markers": {"A": {"body": "crank", "point": "end"}},
    "initial": {"crank": {"angle": ANGLE}, "P": {"position": [0.5, LINE], "guess": ["position"]}},
})  # fmt: skip


def study(low: float, high: float, **more: Any) -> Response:
    how: dict[str, Any] = {"method": "scan", "degree": 4, "verify": False, **more}
    return uncertain(SCENE, {ROD: (low, high)}, [0.001], **how)


def test_runs_that_start_elsewhere_are_told_and_the_answer_stands() -> None:
    """Of five rods evenly from 0.8 to 1.2 of the shortest, two are too short."""
    found = study(0.8 * SHORTEST, 1.2 * SHORTEST)
    assert found.ok
    assert found.elsewhere is not None
    assert found.bounds is not None
    told = found.to_json()
    highest = math.asin((0.8 * SHORTEST + LINE) / CRANK)
    crank = told["starts"]["values"]["initial.crank.angle"]
    assert (told["starts"]["elsewhere"], crank["unit"]) == (crank["runs"], "rad")
    assert 2 <= told["starts"]["elsewhere"] < told["starts"]["runs"]
    assert crank["by"] >= ANGLE - highest - 1e-9
    assert "starts-elsewhere" in found.codes
    assert "start elsewhere than stated" in uncertainty(found)


def test_every_run_or_none_starts_elsewhere() -> None:
    """A guess may move without a word, and so may what is round-off."""
    none, every = study(1.001 * SHORTEST, 2 * SHORTEST), study(0.8 * SHORTEST, 0.9 * SHORTEST)
    assert none.elsewhere is not None
    assert every.elsewhere is not None
    assert none.elsewhere.elsewhere == 0
    assert "starts-elsewhere" not in none.codes
    assert every.elsewhere.elsewhere == every.elsewhere.runs == every.evaluations


def test_a_study_that_goes_on_from_a_file_tells_it_again(tmp_path: Path) -> None:
    first, again = (study(0.8 * SHORTEST, 1.2 * SHORTEST, checkpoint=tmp_path / "runs") for _ in range(2))
    assert first.elsewhere
    assert again.elsewhere == first.elsewhere
    assert again.to_json()["bounds"] == first.to_json()["bounds"]
