"""Small MJCF machines, one for each attribute: they move as in MuJoCo, or a line tells what is left out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from shoal.imported import read
from shoal.mechanics.analysis.statics import statics
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

mujoco: Any = pytest.importorskip("mujoco")
FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}
TIME = 0.4

SLIDES = '<joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 1 0"/><joint type="slide" axis="0 0 1"/>'
CHILD = """<body name="p" pos=".2 0 0"><joint name="pin" axis="0 1 0"/><site name="ptip" pos=".6 0 0"/>
<inertial pos=".3 0 0" mass="1" diaginertia=".01 .02 .02"/></body>"""
OFF = '<inertial pos=".3 .1 .05" mass="2" diaginertia=".1 .12 .05"/>'
CENTRED = '<inertial pos="0 0 0" mass="2" diaginertia=".1 .12 .05"/>'


def machine(
    joints: str,
    inertial: str = OFF,
    *,
    inside: str = "",
    flag: str = "",
    more: str = "",
    pose: str = "",
    beside: str = "",
) -> str:
    """A body with joints on the ground; inside: what else it has; more: sections; beside: of the ground."""
    return f"""<mujoco><compiler angle="radian"/><option gravity="1 2 -9.81"><flag contact="disable" {flag}/></option>
      <worldbody>{beside}<body name="b" pos="0 0 1" {pose}>{joints}{inertial}<site name="tip" pos=".6 0 .1"/>{inside}
      </body></worldbody>{more}</mujoco>"""


def written(text: str, folder: Path) -> Path:
    path = folder / "machine.xml"
    path.write_text(text)
    return path


def apart(path: Path, scene: dict[str, Any]) -> float:
    """How far the markers are from where MuJoCo has them in the end, at most [m]."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep, model.opt.integrator = 4e-4, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    while data.time < TIME - 1e-9:
        mujoco.mj_step(model, data)
    mujoco.mj_kinematics(model, data)
    found = simulate(Scene.parse(scene).with_values(FINE), np.array([TIME]))
    assert found.ok, found.message
    bodies = {model.body(number).name for number in range(model.nbody)}
    theirs = {name: (data.body if name in bodies else data.site)(name).xpos for name in scene["markers"]}
    return max(float(np.max(np.abs(found.marker(name)[0] - place))) for name, place in theirs.items())


TURNED = 'euler=".3 .5 1"'
WALL = '<site name="wall" pos="1 0 1.5"/>'
PUSH = '<general site="tip" refsite="tip" biastype="affine" gainprm="0" biasprm="9" gear="0 0 1 0 0 0"/>'
START = '<keyframe><key name="start" qvel="2"/></keyframe>'


def hinge(fields: str = "") -> str:
    return f'<joint name="h" axis="0 1 0" {fields}/>'


def slide(fields: str = "") -> str:
    return f'<joint name="s" type="slide" axis="1 .3 1" {fields}/>'


def tendon(fields: str) -> str:
    return f'<tendon><spatial name="t" {fields}><site site="wall"/><site site="tip"/></spatial></tendon>'


SECOND = f'<body name="c" pos=".5 .1 1"><freejoint/>{OFF}</body>'


def held(by: str) -> str:
    """Another body, held by the first at a joint that is not at its place."""
    return f'<equality><{by} name="e" body1="b" body2="c" solref=".002 1"/></equality>'


SAME = {
    "gantry": machine(SLIDES, CENTRED, inside=CHILD),
    "gantry-turned": machine(SLIDES, inside=CHILD, pose='euler=".3 .5 1"'),
    "gantry-oblique": machine(SLIDES.replace("1 0 0", "1 .5 .2")),
    "mass-with-a-site-off-its-centre": machine(SLIDES, CENTRED),
    "free-by-slides-and-ball": machine(SLIDES + '<joint type="ball" pos=".1 0 0"/>', inside=CHILD),
    "free-by-slides-and-hinges": machine(
        SLIDES + '<joint axis="0 0 1"/><joint axis="1 0 0"/><joint axis="0 1 0"/>', inside=CHILD
    ),
    "slide-drawn-elsewhere": machine('<joint type="slide" axis="0 0 1"/><joint pos=".2 0 .1" axis="0 0 1"/>'),
    "slide-drawn-elsewhere-than-a-ball": machine('<joint type="slide"/><joint type="ball" pos=".2 0 .1"/>'),
    "springs-off-the-start": machine(hinge('stiffness="40" springref=".7" ref="-.4"'), pose=TURNED,
                                     inside=CHILD.replace("axis", 'stiffness="30" springref="4" axis')),
    "spring-polynomial": machine(hinge('stiffness="90 -40 300" springref=".1"')),
    "damping-with-the-square": machine(hinge('damping="1 3"')),
    "slide-with-a-spring": machine(slide('stiffness="200 0 400" damping="2 9"'), pose=TURNED),
    "slide-with-a-spring-off-the-start": machine(slide('stiffness="200" springref=".2" ref=".1"'), pose=TURNED),
    "slide-after-a-hinge-with-a-spring": machine(
        hinge() + slide('stiffness="200" springref="-.2"').replace(".3", "0"), pose=TURNED),
    "slide-on-a-body-with-a-spring": machine("<freejoint/>", inside=f"""<body name="c" pos=".3 .2 .1" {TURNED}>
        {slide('stiffness="90" springref="-.2"')}{OFF}</body>"""),
    "tendon-polynomial": machine(hinge(), beside=WALL, more=tendon('stiffness="50 20 900" springlength=".6"')),
    "gravity-off": machine(hinge(), more=START, flag='gravity="disable"'),
    "springs-off": machine(hinge('stiffness="20"'), beside=WALL, more=tendon('stiffness="5"'), flag='spring="disable"'),
    "dampers-off": machine(hinge('damping="2 1"'), beside=WALL, more=tendon('damping="5"'), flag='damper="disable"'),
    "friction-off": machine(hinge('frictionloss="2"'), flag='frictionloss="disable"'),
    "limits-off": machine(hinge('range="-.1 .1"'), flag='limit="disable"'),
    "constraints-off": machine(hinge('range="-.1 .1" frictionloss="2"'), flag='constraint="disable"'),
}  # fmt: skip


@pytest.mark.parametrize("name", SAME)
def test_moves_as_in_mujoco_with_nothing_left_out(name: str, tmp_path: Path) -> None:
    path = written(SAME[name], tmp_path)
    found = read(path)
    assert found.left_out == ()
    assert apart(path, found.scene) < 1e-8


SOFT = ": solref (from line"
ONLY = "only a revolute joint or a slider has it"
TOLD: dict[str, tuple[str, tuple[str, ...]]] = {
    "free-resisted": (
        machine('<joint name="f" type="free" damping="3" frictionloss="1" armature="2" stiffness="30"/>'),
        (f"joint f: damping 3; {ONLY}", f"joint f: frictionloss 1; {ONLY}", "joint f: its spring (stiffness 30.0)",
         "joint f: its armature 2"),
    ),
    "hinge-polynomials": (machine(hinge('damping="1 2 3"')), ("joint h: cubic damping 3",)),
    "slide-polynomial": (machine(slide('stiffness="200 5"')), ("joint s: the part 5.0 * t**2 of its spring",)),
    "ball-polynomials": (
        machine('<joint name="f" type="ball" damping="0 2" stiffness="0 0 7"/>'),
        (f"joint f: quadratic damping 2; {ONLY}", "joint f: its spring (cubic 7.0)"),
    ),
    "spring-that-yields": (
        machine(hinge('stiffness="20" springyield=".3"')), ("joint h: that its spring yields at 0.3",)
    ),
    "tendon": (
        machine(hinge(), beside=WALL, more=tendon('stiffness="5" damping="1 2" armature="5" range="0 1"')),
        ("tendon t: its armature", "tendon t: its damping that is not linear"),
    ),
    "weld-elsewhere": (
        machine(hinge(), beside=SECOND, more=held('weld relpose=".5 .1 .3 1 0 0 0"')),
        ("equality e: weld in another pose than that of the start", "<weld>" + SOFT),
    ),
    "weld-turned": (
        machine(hinge(), beside=SECOND, more=held('weld relpose=".5 .1 0 1 .1 0 0"')),
        ("equality e: weld in another pose than that of the start", "<weld>" + SOFT),
    ),
    "equality-not-active": (
        machine(hinge(), beside=SECOND, more=held('connect active="false" anchor=".3 0 .1"')),
        ("equality e: connect, not active", "<connect>" + SOFT),
    ),
    "equalities-off": (
        machine(hinge(), beside=SECOND, more=held('weld'), flag='equality="disable"'),
        ("equality e: weld, not active", "<weld>" + SOFT),
    ),
    "actuators-off": (
        machine(hinge(), more=f"<actuator>{PUSH}</actuator>", flag='actuation="disable"'), ("actuators: 1",)
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", TOLD)
def test_what_is_left_out_is_told_in_a_line_each(name: str, tmp_path: Path) -> None:
    text, lines = TOLD[name]
    left_out = read(written(text, tmp_path)).left_out
    assert len(left_out) == len(lines)
    for told, line in zip(left_out, lines, strict=True):
        assert told.startswith(line)


def test_a_mass_alone_stays_a_point_mass(tmp_path: Path) -> None:
    text = machine(SLIDES, CENTRED).replace(".6 0 .1", "0 0 0")
    assert read(written(text, tmp_path)).scene["bodies"]["b"] == {"kind": "point-mass", "mass": 2.0}


CHAINS = {
    "hinges-apart": machine('<joint axis="0 0 1"/><joint axis="1 0 0"/><joint axis="0 1 0" pos=".1 0 .1"/>'),
    "hinges-apart-and-oblique": machine(
        '<joint axis="0 1 0" pos="0 0 .08" damping=".5"/><joint axis="1 0 .5" pos="0 0 .04" stiffness="9"/>'
    ),
    "slides-on-a-body-that-moves": machine(
        hinge(), inside=f'<body name="c" pos=".2 .1 0">{SLIDES}{OFF}</body>', beside=""
    ),
    "slides-with-damping": machine(SLIDES.replace('"1 0 0"', '"1 0 0" damping="3"') + '<joint axis="1 2 0"/>'),
    "slide-on-an-oblique-hinge": machine(
        '<joint axis="0 1 0"/><joint type="slide" axis="1 0 1" stiffness="80"/>', pose=TURNED
    ),
    "ball-on-a-hinge": machine('<joint axis="0 1 0" damping=".3" pos=".1 0 0"/><joint type="ball"/>', inside=CHILD),
}


@pytest.mark.parametrize("name", CHAINS)
def test_joints_that_no_single_one_stands_for_are_a_chain(name: str, tmp_path: Path) -> None:
    """Of bodies that weigh 1.5e-8 of what they carry; what acts in each joint acts in the scene too."""
    path = written(CHAINS[name], tmp_path)
    found = read(path)
    assert found.left_out == ()
    assert any(body.endswith("-link") for body in found.scene["bodies"])
    assert apart(path, found.scene) < 1e-7


def test_a_chain_starts_with_the_rates_of_its_file(tmp_path: Path) -> None:
    joints = '<joint axis="0 1 0" pos="0 .1 .08"/><joint axis="1 0 .5" damping=".1"/><joint type="slide" axis="1 1 0"/>'
    key = '<keyframe><key name="start" qvel="1 2 .3"/></keyframe>'
    path = written(machine(joints, more=key), tmp_path)
    assert apart(path, read(path).scene) < 1e-7


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("slide-.267261 .534522 .801784", "hinge-.894427 -.447214 0"),
        ("hinge-.894427 -.447214 0", "slide-.267261 .534522 .801784"),
        ("slide-.267261 .534522 .801784", "hinge--.267262 -.534522 -.801784"),
        ("hinge-.267261 .534522 .801784", "hinge-.894427 -.447214 0"),
    ],
)
def test_axes_with_the_digits_of_a_file_are_parallel_or_square(first: str, second: str, tmp_path: Path) -> None:
    joints = "".join('<joint type="{}" axis="{}"/>'.format(*joint.split("-", 1)) for joint in (first, second))
    path = written(machine(joints), tmp_path)
    assert apart(path, read(path).scene) < 1e-6


FOUR_BAR = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"/><worldbody>
  <body name="a"><joint axis="0 1 0"/><inertial pos="0 0 .25" mass="1" diaginertia=".02 .02 .001"/>
    <body name="b" pos="0 0 .5" euler="1.5708 0 0"><joint axis="0 0 -1"/>
      <inertial pos=".5 0 0" mass="1" diaginertia=".001 .08 .08"/><site name="middle" pos=".5 0 0"/></body></body>
  <body name="c" pos="1 0 0"><joint axis="0 1 0"/><inertial pos="0 0 .3" mass="1" diaginertia=".02 .02 .001"/></body>
</worldbody><equality><connect body1="b" body2="c" anchor="1 0 0" solref="0.002 1"/></equality>
<keyframe><key name="start" qpos="0 0 0" qvel="2 -2 2"/></keyframe></mujoco>"""


def test_a_loop_with_the_digits_of_a_file_does_not_lock(tmp_path: Path) -> None:
    path = written(FOUR_BAR, tmp_path)
    assert apart(path, read(path).scene) < 1e-4


def test_axes_of_a_chain_are_as_in_its_file(tmp_path: Path) -> None:
    path = written(FOUR_BAR.replace("<equality>", "<!--").replace("</equality>", "-->"), tmp_path)
    assert apart(path, read(path).scene) < 1e-8


@pytest.mark.parametrize(("word", "kind"), [('torquescale="0"', "spherical"), ('torquescale="2"', "weld")])
def test_a_weld_without_torque_is_a_ball(word: str, kind: str, tmp_path: Path) -> None:
    path = written(machine(hinge(), beside=SECOND, more=held(f'weld anchor=".1 .2 0" {word}')), tmp_path)
    found = read(path)
    assert found.left_out == ("<weld>: solref (from line 3)",)
    assert found.scene["joints"]["e"]["kind"] == kind
    assert apart(path, found.scene) < 1e-4


def test_springs_that_rest_off_the_start_have_a_potential(tmp_path: Path) -> None:
    """So that there are places of rest: MuJoCo's forces vanish there."""
    path = written(SAME["springs-off-the-start"], tmp_path)
    scene = Scene.parse(read(path).scene)
    assert {load.kind for load in scene.loads.values()} == {"torsion-spring"}
    found = statics(scene)
    assert found.ok, found.message
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    model.dof_damping[:], model.opt.timestep = 20.0, 1e-2
    mujoco.mj_step(model, data, 4000)
    places = np.array([data.body(name).xpos if name in "bp" else data.site(name).xpos for name in scene.markers])
    assert found.points == pytest.approx(places, abs=1e-8)


TENDONS = """<mujoco><option gravity="0 0 -9.81"><flag contact="disable"/></option><worldbody>
<body name="a"><joint name="h" axis="0 1 0"/><inertial pos=".1 0 0" mass="1" diaginertia=".02 .02 .02"/>
<body name="b" pos=".3 0 0"><joint name="p" axis="0 1 0"/><inertial pos=".1 0 0" mass=".4" diaginertia=".01 .01 .01"/>
<body name="c" pos=".2 0 0"><joint name="s" type="slide" axis="1 0 1"/>
<inertial pos="0 0 0" mass=".2" diaginertia=".01 .01 .01"/></body></body></body></worldbody>
<tendon><fixed name="t"><joint joint="h" coef="2"/><joint joint="p" coef="-1"/><joint joint="s" coef=".5"/></fixed>
</tendon><equality><tendon tendon1="t" solref="2e-4 1" solimp=".99999 .99999 .001 .5 2"/></equality></mujoco>"""


def test_an_equality_of_a_tendon_over_joints_is_a_coupling(tmp_path: Path) -> None:
    path = written(TENDONS, tmp_path)
    found = read(path)
    assert found.missing == ()
    (kind,) = {one["kind"] for name, one in found.scene["joints"].items() if name not in ("h", "p", "s")}
    assert kind == "coupling"
    assert apart(path, found.scene) < 1e-5
