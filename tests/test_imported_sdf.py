"""SDF files: joints whose frames are elsewhere than their children's, floating links, and what is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from shoal.errors import InputError
from shoal.imported import read
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

mujoco: Any = pytest.importorskip("mujoco")
FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}
LINK = """<link name="{}"><pose{}>{}</pose><inertial><pose>.1 0 .02 .3 0 0</pose><mass>{}</mass><inertia><ixx>.01</ixx>
  <iyy>.02</iyy><izz>.015</izz><ixy>.001</ixy><ixz>0</ixz><iyz>0</iyz></inertia></inertial></link>"""
JOINT = """<joint name="{}" type="{}"><parent>{}</parent><child>{}</child><pose>{}</pose><axis><xyz{}>{}</xyz>
  <limit><lower>-1e16</lower><upper>1e16</upper></limit><dynamics><damping>.1</damping></dynamics></axis></joint>"""


def written(folder: Path, inside: str, model: str = "") -> Path:
    path = folder / "model.sdf"
    path.write_text(f'<sdf version="1.9"><model name="m">{model}{inside}</model></sdf>')
    return path


def test_a_chain_moves_as_in_mujoco(tmp_path: Path) -> None:
    inside = LINK.format("a", "", "0 0 1 0 .2 .4", 1.0) + LINK.format("b", ' relative_to="a"', ".5 .1 0 .3 0 0", 0.5)
    inside += '<plugin name="p"><x>1</x></plugin>' + JOINT.format(
        "h", "revolute", "world", "a", "-.1 0 .05 0 0 .3", "", "0 1 .2"
    )
    inside += JOINT.format("s", "prismatic", "a", "b", "0 .1 0 .2 .1 0", ' expressed_in="__model__"', "1 0 .5")
    found = read(written(tmp_path, inside, "<pose>0 0 .5 0 0 .7</pose>"))
    assert found.missing == ()
    assert found.left_out == ("<plugin>: 1 (in line 3)",)
    # The same bodies by hand: MuJoCo has the axis of a slide in the body's frame, here that of the model.
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    common: dict[str, Any] = {"ipos": [0.1, 0, 0.02], "explicitinertial": True}

    def turn(*angles: float) -> Any:
        return Rotation.from_euler("xyz", angles)

    inner = turn(0.3, 0, 0).as_matrix() @ np.array([[0.01, 0.001, 0], [0.001, 0.02, 0], [0, 0, 0.015]])
    inner = inner @ turn(0.3, 0, 0).as_matrix().T
    full = [inner[0, 0], inner[1, 1], inner[2, 2], inner[0, 1], inner[0, 2], inner[1, 2]]
    model = turn(0, 0, 0.7)
    first = model * turn(0, 0.2, 0.4)
    a = spec.worldbody.add_body(name="a", pos=[0, 0, 1.5], quat=first.as_quat(scalar_first=True), mass=1,
                                fullinertia=full, **common)  # fmt: skip
    hinge = a.add_joint(name="h", pos=[-0.1, 0, 0.05], axis=turn(0, 0, 0.3).apply([0, 1, 0.2]))
    hinge.damping[0] = 0.1
    b = a.add_body(name="b", pos=[0.5, 0.1, 0], quat=turn(0.3, 0, 0).as_quat(scalar_first=True), mass=0.5,
                   fullinertia=full, **common)  # fmt: skip
    along = (first * turn(0.3, 0, 0)).inv().apply([1, 0, 0.5])
    slide = b.add_joint(name="s", type=mujoco.mjtJoint.mjJNT_SLIDE, axis=along)
    slide.damping[0] = 0.1
    theirs = spec.compile()
    theirs.opt.timestep, theirs.opt.integrator = 2e-4, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(theirs)
    mujoco.mj_step(theirs, data, 1500)
    mujoco.mj_kinematics(theirs, data)
    moved = simulate(Scene.parse(found.scene).with_values(FINE), np.array([0.3]))
    assert moved.ok, moved.message
    for name in "ab":
        assert moved.marker(name)[0] == pytest.approx(data.body(name).xpos, abs=1e-7)


def test_links_that_no_joint_holds_float_unless_the_model_is_static(tmp_path: Path) -> None:
    inside = LINK.format("a", "", "0 0 1 0 0 0", 1.0)
    found = read(written(tmp_path, inside))
    moved = simulate(Scene.parse(found.scene), np.array([0.2]))
    assert moved.marker("a")[0] == pytest.approx([0, 0, 1 - 9.81 / 2 * 0.04], abs=0.02)
    with pytest.raises(InputError, match="nothing in it moves"):
        read(written(tmp_path, inside, "<static>true</static>"))


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ("<include><uri>model://x</uri></include>", "nested and included models and frames are not read"),
        (LINK.format("a", "", "0 0 1", 1.0), "<pose> in line 1: must be 6 numbers, found '0 0 1'"),
        (LINK.format("a", "", "0 0 1 0 0 0", 1.0) + JOINT.format("j", "universal", "world", "a", "", "", "1 0 0"),
         "<joint j> in line 2: type: must be one of revolute, continuous, prismatic, fixed, ball, found 'universal'"),
        (LINK.format("a", "", "0 0 1 0 0 0", 1.0) + JOINT.format("j", "revolute", "b", "a", "", "", "1 0 0"),
         "<joint j> in line 2: no link 'b'; there are a"),
    ],
)  # fmt: skip
def test_what_is_not_read_is_named(inside: str, message: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        read(written(tmp_path, inside))
    assert message in str(refused.value)
