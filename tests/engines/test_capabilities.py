"""What engines say they can do, they do; the rest they refuse in one line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from shoal.engines import ENGINES, get_engine
from shoal.engines.capabilities import FEATURES, needs
from shoal.errors import InputError
from shoal.scene import JOINT_KINDS, LOAD_KINDS, Scene

CAPABILITIES = {name: get_engine(name).capabilities for name in ENGINES}
OURS = ("gauss", "exudyn", "exudyn-ge", "casadi", "tree", "mujoco")
NAMES = sorted(CAPABILITIES["gauss"].all)


def wants(machine: Scene) -> set[str]:
    return {need for _, need in needs(machine)}


def able(engine: str, machine: Scene) -> bool:
    return wants(machine) <= CAPABILITIES[engine].all


def taken(engine: str, machine: Scene) -> bool:
    """Whether an engine takes a machine; those that are for few say what they take, in one line."""
    if engine in OURS:
        return True
    try:
        get_engine(engine).simulate(machine, [1e-6])
    except InputError as error:
        if f": engine {engine} takes " not in str(error) or "\n" in str(error):
            raise
        return False
    return True


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("engine", list(CAPABILITIES))
@pytest.mark.by_day(45)
def test_every_engine_does_what_it_says_and_refuses_the_rest(
    engine: str, name: str, scenes: list[Scene], run: Callable[..., Any]
) -> None:
    pytest.importorskip(engine.partition("-")[0] if engine in ("exudyn", "exudyn-ge", "casadi", "mujoco") else "numpy")
    asking = sorted((machine for machine in scenes if name in wants(machine)), key=lambda machine: len(wants(machine)))
    assert asking, f"no scene of the fixture `scenes` in conftest.py has {name}; add one"
    if name in CAPABILITIES[engine].all:
        machine = next(machine for machine in asking if able(engine, machine) and taken(engine, machine))
        step = {"step": 1e-5, "duration": 0.002, "integrator": "rk4" if machine.dimensions == 2 else "dop853"}
        assert np.all(np.isfinite(run(get_engine(engine), machine, np.array([0.001, 0.002]), **step)))
    else:
        refused = [(field, need) for field, need in needs(asking[0]) if need not in CAPABILITIES[engine].all]
        assert name in dict(map(reversed, refused))
        with pytest.raises(InputError) as error:
            get_engine(engine).simulate(asking[0])
        assert str(error.value).startswith(f"{refused[0][0]}: engine {engine} cannot do {refused[0][1]}; use gauss")
        assert "\n" not in str(error.value)


def test_every_name_is_a_kind_or_a_feature_and_has_a_machine(scenes: list[Scene]) -> None:
    assert {"rigid", *JOINT_KINDS, *LOAD_KINDS, *FEATURES} <= set(NAMES) <= set().union(*map(wants, scenes))
    assert all(capabilities.all <= set(NAMES) for capabilities in CAPABILITIES.values())


def test_a_refusal_names_the_field_and_who_can(cases: dict[str, Any]) -> None:
    machine = cases["motor"].scene
    message = "loads.M.torque: engine casadi cannot do functions of time; use gauss or exudyn or exudyn-ge"
    with pytest.raises(InputError, match=f"^{message}$"):
        get_engine("casadi").simulate(machine)


def test_lanes_are_refused_like_a_single_run(cases: dict[str, Any]) -> None:
    pytest.importorskip("exudyn")
    machine = cases["curved-cable"].scene
    with pytest.raises(InputError, match=r"^bodies\.A\.curvature: engine exudyn-ge cannot do curved flexible rods"):
        get_engine("exudyn-ge").simulate_many(machine, {"initial.A.angle": np.array([0.1, 0.2])})
