"""Loads that are not ours: whatever somebody states as a measure with a law acts, and has a potential and a tangent."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
import pytest
from shoal.errors import InputError
from shoal.mechanics import forces
from shoal.mechanics.analysis.evaluate import Evaluator
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.assembly.build import build
from shoal.mechanics.assembly.loads import LOADS, ElementForceLaw, Loads
from shoal.mechanics.forces import ANGLE, DISTANCE, PLACE
from shoal.scene import Attachment, Function, Scene
from shoal.scene.record import Record

WEIGHT = 2.0 * 9.81


class Pull(Record):
    """A drive [N] along a distance, or along the direction from the ground's origin to the second place."""

    kind: Literal["pull"] = "pull"
    first: Attachment
    second: Attachment
    force: Function
    measure: int = DISTANCE


def _enter(loads: Loads, name: str, load: Pull) -> None:
    ends = [loads.placement.point(loads.scene, side) for side in (load.first, load.second)]
    vectors = [*ends, *([ends[1]] if load.measure == PLACE else [])]
    loads._measure(name, load.measure, vectors, ElementForceLaw(amplitude=-1.0), 0.0, drive=load.force)


@pytest.fixture(autouse=True)
def _known(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(LOADS, Pull, _enter)


def hung(*pulls: Any, dimensions: int = 2, **more: Any) -> Scene:
    """Point masses of 2 kg, each pulled by so much towards a place 9 m above it; more: loads that we know."""
    zero = [0.0] * dimensions
    above = Attachment(body="ground", point=(0.0, 9.0, 0.0)[:dimensions])
    names = [f"m{k}" for k in range(len(pulls))]
    scene = Scene.parse(
        {
            "name": "hung",
            "dimensions": dimensions,
            "gravity": [0.0, -9.81, 0.0][:dimensions],
            "bodies": {name: {"kind": "point-mass", "mass": 2.0} for name in names},
            "joints": {},
            "loads": more,
            "markers": {name: {"body": name, "point": zero} for name in names},
            "initial": {name: {"position": zero} for name in names},
        }
    )
    own = {
        name: pull
        if isinstance(pull, Pull)
        else Pull(first=above, second=scene.markers[name], force=Function.model_validate(pull))
        for name, pull in zip(names, pulls, strict=True)
    }
    return scene.model_copy(update={"loads": {**own, **scene.loads}})


def test_a_law_has_the_numbers_that_the_kernels_read_in_their_order() -> None:
    assert [getattr(forces, field.upper()) for field in ElementForceLaw._fields] == list(range(forces.LAW))


def test_loads_beside_each_other_act_as_if_alone() -> None:
    """With all of its weight at the other end of a rope a mass stays, with three quarters it falls by g/4."""
    evaluator = Evaluator.of(hung(WEIGHT, 0.75 * WEIGHT, 0.0), horizon=1.0)
    assert evaluator.acceleration(np.zeros(6), np.zeros(6))[1::2] == pytest.approx([0.0, -9.81 / 4, -9.81], abs=1e-12)


def test_statics_knows_what_a_drive_along_a_distance_holds() -> None:
    """Half of the weight is left to a spring of 50 N/m."""
    above = {"body": "ground", "point": [0.0, 2.0]}
    spring = {"kind": "spring", "first": above, "second": {"body": "m0", "point": [0.0, 0.0]}, "stiffness": 50.0}
    rest = statics(hung(WEIGHT / 2, spring=spring))
    assert rest.points[0] == pytest.approx([0.0, -WEIGHT / 100], abs=1e-9)


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("measure", [DISTANCE, PLACE])
def test_a_drive_has_the_potential_and_the_stiffness_of_its_force(measure: int, dimensions: int) -> None:
    first, second = (Attachment(body=name, point=(0.0, 0.0, 0.0)[:dimensions]) for name in ("m0", "m1"))
    pull = Pull(first=first, second=second, force=Function(number=3.0), measure=measure)
    evaluator = Evaluator.of(hung(pull, 1.0, dimensions=dimensions), horizon=1.0)
    q = np.array([0.3, -0.2, 0.5, 1.1, 0.7, -0.4])[: 2 * dimensions]

    def slope(function: Any) -> Any:
        return np.array([(function(q + step) - function(q - step)) / 2e-6 for step in 1e-6 * np.eye(len(q))])

    look = evaluator.at(q)
    np.testing.assert_allclose(evaluator.stiffness(q).toarray(), -slope(lambda x: evaluator.at(x).force), atol=1e-7)
    potential = slope(lambda x: evaluator.at(x).applied + evaluator.at(x).gravity)
    np.testing.assert_allclose(potential, -look.force, atol=1e-7)


def test_a_drive_about_an_axis_in_space_is_told_that_nobody_knows_its_tangent() -> None:
    pull = Pull(first=Attachment(body="ground", point=(0.0, 0.0, 1.0)), second=Attachment(body="m0", point=(0.0,) * 3),
                force=Function(number=3.0), measure=ANGLE)  # fmt: skip
    with pytest.raises(NotImplementedError, match="a drive about an axis in space"):
        Evaluator.of(hung(pull, dimensions=3), horizon=1.0).stiffness(np.array([1.0, 0.5, 0.2]))


@pytest.mark.parametrize("own", [False, True])
def test_a_function_is_named_by_its_field_and_one_that_a_load_makes_by_the_load(
    own: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def enter(loads: Loads, name: str, load: Pull) -> None:
        _enter(loads, name, load.model_copy(update={"force": load.force.model_copy()}))

    if own:
        monkeypatch.setitem(LOADS, Pull, enter)
    with pytest.raises(InputError, match=r"^loads\.m0: " if own else r"^loads\.m0\.force: "):
        build(hung("1/(t - 0.5)"), horizon=1.0)
