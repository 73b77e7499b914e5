"""The generated reference of scenes leaves nothing out: every field has a meaning, and every number a unit."""

import runpy
from pathlib import Path

import pytest
from pydantic import BaseModel
from shoal.scene import Scene

HOOKS = runpy.run_path(str(Path(__file__).parents[2] / "docs" / "hooks.py"))
MODELS = {model.__name__: model for model in HOOKS["models"](Scene)}


@pytest.mark.parametrize("name", MODELS)
def test_every_field_has_a_meaning_and_a_number_its_unit(name: str) -> None:
    model: type[BaseModel] = MODELS[name]
    said = HOOKS["meanings"](model)
    for field, info in HOOKS["fields"](model).items():
        assert said.get(field), field
        assert "[" in said[field] or not HOOKS["has_number"](info.annotation), f"{field}: {said[field]}"


def test_all_kinds_were_looked_at() -> None:
    assert {"Rod", "PointMass", "Coupling", "DistributedForce", "MovingPoint", "Function", "Solver"} <= set(MODELS)
    tables = HOOKS["scene_fields"]()
    assert "| `length` | number > 0 | required | Length of the axis [m]. |" in tables
    assert "| `gravity` | list of numbers | `[0, -9.81]` |" in tables
