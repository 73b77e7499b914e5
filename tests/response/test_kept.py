"""Studies that go on from a file, and studies that end with their time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from shoal.errors import ComputationError, InputError
from shoal.notebook import uncertain
from shoal.response import Response
from shoal.response.machine import ResponseModel
from shoal.response.runs import Keep
from shoal.scene import Scene
from thrown import ALONG, THROWN, UP

RANDOM = {UP: "normal(5,0.2)", ALONG: "normal(2,0.1)"}


def study(vary: dict[str, Any], **more: Any) -> Response:
    return uncertain(Scene.parse(THROWN), vary, [0.25, 0.5, 0.75], verify=False, **more)


def told(found: Response) -> dict[str, Any]:
    return {key: one for key, one in found.to_json().items() if key != "wall_s"}


def test_a_study_that_was_broken_off_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed in the middle of a limit, half of its last runs written: the answer is that of one that was not."""
    how: dict[str, Any] = {"limit": ["P.y > 1.75"], "limit_runs": 1500}
    whole, file = study(RANDOM, **how), tmp_path / "runs"
    made, original = [0], ResponseModel._some

    def some(machine: ResponseModel, values: Any) -> Any:
        made[0] += 1
        if made[0] == 12:
            raise KeyboardInterrupt
        return original(machine, values)

    with monkeypatch.context() as broken:
        broken.setattr(ResponseModel, "_some", some)
        with pytest.raises(KeyboardInterrupt):
            study(RANDOM, checkpoint=file, **how)
    file.write_bytes(file.read_bytes()[:-7])
    made[0] = -1000
    with monkeypatch.context() as counted:
        counted.setattr(ResponseModel, "_some", some)
        again = study(RANDOM, checkpoint=file, **how)
    assert told(again) == told(whole)
    first = made[0]
    made[0] = -1000
    with monkeypatch.context() as counted:
        counted.setattr(ResponseModel, "_some", some)
        assert told(study(RANDOM, checkpoint=file, **how)) == told(whole)
    assert made[0] == -1000
    assert first > -1000


def test_a_file_of_another_study_is_refused(tmp_path: Path) -> None:
    study({UP: (4.7, 5.3)}, checkpoint=tmp_path / "runs")
    other = Scene.parse({**THROWN, "gravity": [0.0, -9.0]})
    with pytest.raises(InputError, match="of another study"):
        uncertain(other, {UP: (4.7, 5.3)}, [0.25, 0.5, 0.75], verify=False, checkpoint=tmp_path / "runs")


@pytest.mark.parametrize("vary", [{UP: (4.7, 5.3), ALONG: (1.7, 2.3)}, RANDOM])
def test_a_study_ends_with_its_time(vary: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """With what is known by then, and a status that says so."""
    calls, original = [0], Keep.__call__

    def late(keep: Keep, *arguments: Any) -> Any:
        calls[0] += 1
        if calls[0] > 2:
            keep.end = 0.0
        return original(keep, *arguments)

    monkeypatch.setattr(Keep, "__call__", late)
    found = study(vary, time_limit=1000.0, limit=["P.y > 1.75"])
    assert found.status == "time-limit"
    assert found.codes[0] == "time-over"
    assert found.limits == ()
    assert found.evaluations > 0
    assert (found.bounds is None) is (vary is RANDOM)


def test_no_time_at_all() -> None:
    with pytest.raises(ComputationError, match="time-limit"):
        study(RANDOM, time_limit=1e-9)
