"""Charts are drawn anew from what was measured: a map that was kept is the map."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from shoal_validation.stability import MAPS
from shoal_validation.stability.survey import stored

KEPT = json.loads((Path(__file__).parents[2] / "docs" / "charts" / "stability.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", MAPS)
def test_a_map_is_read_back_as_it_was_kept(name: str) -> None:
    found = stored(MAPS[name], KEPT[name])
    assert found.to_json() == KEPT[name]
    assert [panel.method for panel in found.panels if panel.ours], "our own panels are told from the others"
