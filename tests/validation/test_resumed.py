"""Long studies go on where they were stopped."""

from __future__ import annotations

from pathlib import Path

import pytest
from shoal_validation.resumed import Found, resumed


def test_a_study_that_was_stopped_goes_on(tmp_path: Path) -> None:
    record, studied = tmp_path / "record.jsonl", list[str]()

    def study(key: str) -> Found:
        if key == "b" and "b" not in studied:
            studied.append(key)
            raise KeyboardInterrupt
        studied.append(key)
        return {"size": float(len(studied)), "told": None}

    with pytest.raises(KeyboardInterrupt):
        list(resumed(["a", "b", "c"], study, record))
    found = list(resumed(["a", "b", "c"], study, record))
    assert studied == ["a", "b", "b", "c"]
    assert found == [(key, {"size": size, "told": None}) for key, size in (("a", 1.0), ("b", 3.0), ("c", 4.0))]


def test_without_a_record_nothing_is_kept() -> None:
    studied = [list(resumed(["a"], lambda key: {"key": key}, None)) for _ in range(2)]
    assert studied == [[("a", {"key": "a"})]] * 2
