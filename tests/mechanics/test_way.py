"""The way of a simulation: the files that a first run of a planar scene enters are those of docs/method.md."""

from __future__ import annotations

import re
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
import shoal
from shoal.engines import get_engine
from shoal.scene import load_scene

ROOT = Path(shoal.__file__).parent
METHOD = Path(__file__).parents[2] / "docs" / "method.md"
SCENES = ("rigid-double-pendulum", "flexible-double-pendulum", "n-four-bar-2")


def entered(name: str) -> set[str]:
    """Files under `services/shoal` of which a function is called in the first run of a scene, with kernels loaded."""
    engine, scene = get_engine("gauss"), load_scene(name)
    times = [scene.solver.step]
    engine.simulate(scene, times)
    other = scene.with_values({"gravity.1": -9.5})
    found: set[str] = set()

    def hook(frame: Any, event: str, _: Any) -> None:
        if event == "call" and frame.f_code.co_filename.startswith(str(ROOT)):
            found.add(Path(frame.f_code.co_filename).relative_to(ROOT).as_posix())

    sys.setprofile(hook)
    threading.setprofile(hook)
    try:
        assert engine.simulate(other, times).ok
    finally:
        sys.setprofile(None)
        threading.setprofile(None)
    return found


def listed() -> dict[str, set[str]]:
    """Files that the page names for every planar scene, and for each kind of machine beside them."""
    section = METHOD.read_text().split("### Files that a first run enters")[1].split("\n#")[0]
    rows = (line.strip("|").split("|") for line in section.splitlines() if line.startswith("| `"))
    return {row[0].strip().strip("`"): set(re.findall(r"`([^`]+\.py)`", row[1])) for row in rows}


@pytest.mark.parametrize("name", SCENES)
def test_a_run_passes_through_the_files_that_the_page_lists(name: str) -> None:
    files = listed()
    assert entered(name) == files["every scene"] | files[name]
