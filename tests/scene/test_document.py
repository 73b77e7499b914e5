"""The example of docs/scenes.md is a scene."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from shoal.mechanics.assembly.build import build
from shoal.scene import Scene
from shoal.scene.load import read_yaml


def test_the_documented_scene_can_be_built() -> None:
    text = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text(encoding="utf-8")
    block = re.search(r"```yaml\n(.*?)```", text, re.DOTALL)
    assert block is not None
    scene = Scene.parse(read_yaml(block[1], "docs/scenes.md"), "docs/scenes.md")
    model = build(scene)
    assert model.flexible == 4
    assert model.constraint_names == ("rope",)
    # The clamp leaves one unknown of the slope: 4 free nodes of 4, the clamped stretch, the load's place.
    assert model.unknowns == 4 * 4 + 1 + 2
    assert np.all(np.isfinite(model.q0))
