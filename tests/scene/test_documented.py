"""docs/scenes.md leaves nothing out: every field of everything a scene is made of stands there as code."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import pytest
from shoal.scene import Scene
from shoal.scene.record import Record

PAGE = (Path(__file__).parents[2] / "docs" / "scenes.md").read_text(encoding="utf-8")
CODE = " ".join(re.findall(r"```\w*\n.*?```|`[^`\n]+`", PAGE, re.DOTALL))


def records(kind: Any) -> Iterator[type[Record]]:
    """The models that a type is made of, each as often as it occurs."""
    if isinstance(kind, type) and issubclass(kind, Record):
        yield kind
        for field in kind.model_fields.values():
            yield from records(field.annotation)
    for part in get_args(kind):
        yield from records(part)


MODELS = {model.__name__: model for model in records(Scene)}


@pytest.mark.parametrize("name", MODELS)
def test_every_field_is_named(name: str) -> None:
    assert [field for field in MODELS[name].model_fields if not re.search(rf"\b{field}\b", CODE)] == []


def test_all_kinds_were_looked_at() -> None:
    assert {"Rod", "PointMass", "Coupling", "DistributedForce", "MovingPoint", "Function", "Solver"} <= set(MODELS)
