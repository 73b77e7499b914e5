"""Limits of MJCF and URDF as stops, ropes and struts, and their motion beside MuJoCo's stiff ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import pytest
from shoal.imported.read import Imported, read
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

STIFF = 'solreflimit="-4e6 -2e4" solimplimit="0.9999 0.9999 0.001 0.5 2"'
"""Stiffness and five times the critical damping per mass [1/s^2, 1/s]: a limit that cannot pull and is damped just
critically still gives back 0.14 of the rate."""
INERTIA = '<inertial pos=".3 0 0" mass="1" diaginertia=".02 .03 .04"/>'


def model(joint: str, inside: str = "", *, compiler: str = "", more: str = "") -> str:
    """Return a body that is drawn askew, on a joint."""
    return f"""<mujoco><compiler {compiler}/><option gravity="0 0 -9.81"/><worldbody><site name="wall" pos="0.2 .1 .2"/>
        <body name="a" euler="20 30 40">{joint}{INERTIA}{inside}<site name="tip" pos=".5 0 0"/></body></worldbody>
        {more}</mujoco>"""


def found(folder: Path, text: str, name: str = "m.xml") -> tuple[Path, Imported]:
    """Return the file that holds a text, and what is read of it."""
    path = folder / name
    path.write_text(text)
    return path, read(path)


def limits(folder: Path, text: str, name: str = "m.xml") -> dict[str, tuple[float, float]]:
    """Return the widths of the stops below and above the start, by joint."""
    scene = Scene.parse(found(folder, text, name)[1].scene)
    own: dict[str, tuple[float, float]] = {}
    for joint, one in scene.joints.items():
        if (stops := getattr(one, "stops", None)) is not None:
            free = scene.with_values(
                {f"joints.{joint}.stops.{side}": far for side, far in (("min", -9.0), ("max", 9.0))}
            )
            gaps = simulate(free, np.array([0.0]), whole=True).states.model.gap_angles[:, 0]
            own[joint] = stops.min - gaps[0], stops.max - gaps[0]
    return own


@pytest.mark.parametrize(
    ("joint", "compiler", "expected"),
    [
        ('range="-30 40" ref="10"', "", (np.radians(-40), np.radians(30))),
        ('range="-0.3 0.4" ref="0.1"', 'angle="radian"', (-0.4, 0.3)),
        ('type="slide" range="-0.3 0.4"', "", (-0.3, 0.4)),
    ],
)
@pytest.mark.compiles("kernels of contacts in space")
def test_ranges_become_stops_counted_from_the_start(
    joint: str, compiler: str, expected: tuple[float, float], tmp_path: Path
) -> None:
    """Of hinges in degrees where the compiler does not say radian."""
    text = model(f'<joint name="j" axis="0 1 0" {joint}/>', compiler=compiler)
    assert limits(tmp_path, text)["j"] == pytest.approx(expected, abs=1e-12)
    (told,) = found(tmp_path, text)[1].notes
    assert told.startswith("limits of j: rigid and without rebound")


@pytest.mark.parametrize(
    ("joint", "compiler", "line"),
    [
        ('axis="0 1 0" range="10 40"', "", "joint j: its limits 0.174533 to 0.698132; its start 0 is beyond them"),
        (
            'type="ball" range="0 40"',
            "",
            "joint j: its limits 0 to 0.698132; only a revolute joint or a slider has them",
        ),
        ('axis="0 1 0" range="-30 40" limited="false"', "", ""),
        ('axis="0 1 0" range="-30 40" limited="false"', 'autolimits="false"', ""),
    ],
)
def test_limits_without_a_counterpart_are_named_and_others_are_not(
    joint: str, compiler: str, line: str, tmp_path: Path
) -> None:
    _, read_ = found(tmp_path, model(f'<joint name="j" {joint}/>', compiler=compiler))
    assert list(read_.left_out) == ([line] if line else [])
    assert "stops" not in read_.scene["joints"]["j"]
    assert simulate(Scene.parse(read_.scene), np.array([0.1])).ok


def test_limits_of_urdf_become_stops_and_continuous_joints_have_none(tmp_path: Path) -> None:
    def link(name: str) -> str:
        return (f'<link name="{name}"><inertial><origin xyz=".2 0 0"/><mass value="1"/><inertia ixx=".01" iyy=".02" '
                'izz=".02" ixy="0" ixz="0" iyz="0"/></inertial></link>')  # fmt: skip

    def joint(kind: str, parent: str, child: str, limit: str = "") -> str:
        return (f'<joint name="{kind}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
                f'<axis xyz="0 1 0"/>{limit}</joint>')  # fmt: skip

    text = f"""<robot name="r"><link name="base"/>{link("a")}{link("b")}{link("c")}
        {joint("revolute", "base", "a", '<limit lower="-0.5" upper="1.5" effort="1" velocity="1"/>')}
        {joint("prismatic", "a", "b", '<limit lower="0" upper="0.25" effort="1" velocity="1"/>')}
        {joint("continuous", "b", "c")}</robot>"""
    own = limits(tmp_path, text, "r.urdf")
    assert own["revolute"] == pytest.approx((-0.5, 1.5), abs=1e-12)
    assert own["prismatic"] == pytest.approx((0.0, 0.25), abs=1e-12)
    assert {*own} == {"revolute", "prismatic"}


def apart(path: Path, scene: dict[str, Any], end: float) -> tuple[float, set[str]]:
    """Return how far the sites are from those of MuJoCo [m], and which joints had impacts."""
    times = np.linspace(0.0, end, 21)
    ours = simulate(Scene.parse(scene), times)
    assert ours.ok, ours.message
    theirs = mujoco.MjModel.from_xml_path(str(path))
    theirs.opt.timestep = 5e-5
    data, farthest = mujoco.MjData(theirs), 0.0
    for k, time in enumerate(times):
        while data.time < time - 1e-9:
            mujoco.mj_step(theirs, data)
        mujoco.mj_kinematics(theirs, data)
        farthest = max(farthest, float(np.linalg.norm(ours.marker("tip")[k] - data.site("tip").xpos)))
    return farthest, {event["joint"] for event in ours.model["events"] if event["kind"] == "impact"}


@pytest.mark.parametrize(
    ("text", "end", "struck"),
    [
        (model(f'<joint name="j" axis="0 1 0" range="-30 10" {STIFF}/>'), 0.6, {"j"}),
        (model(f'<joint name="s" type="slide" axis="1 0 .3" range="-.05 .1" {STIFF}/>'), 0.5, {"s"}),
        (model('<joint name="j" axis="0 1 0"/>', more=f"""<tendon><spatial name="rope" range="0.1 0.6" {STIFF}>
            <site site="wall"/><site site="tip"/></spatial></tendon>"""), 0.7, {"rope-at-most"}),
    ],
    ids=["hinge", "slide", "rope"],
)  # fmt: skip
def test_the_motion_is_that_of_stiff_limits_of_mujoco(text: str, end: float, struck: set[str], tmp_path: Path) -> None:
    path, read_ = found(tmp_path, text)
    farthest, impacts = apart(path, read_.scene, end)
    assert impacts == struck
    assert farthest < 2e-3
