"""Every element and attribute of a file is in the scene or in a line of the report: random files, random extras."""

from __future__ import annotations

import copy
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from shoal.cli import main
from shoal.errors import InputError
from shoal.imported import Imported, read
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene

mujoco: Any = pytest.importorskip("mujoco")
FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}
TYPES = ("continuous", "revolute", "prismatic", "floating", "spherical")


def words(values: Any) -> str:
    return " ".join(f"{x:.6g}" for x in np.ravel(values))


def link(robot: ET.Element, name: str, rng: np.random.Generator) -> None:
    inertial = ET.SubElement(ET.SubElement(robot, "link", name=name), "inertial")
    ET.SubElement(inertial, "origin", xyz=words(rng.normal(size=3) * 0.1), rpy=words(rng.normal(size=3)))
    ET.SubElement(inertial, "mass", value=f"{rng.uniform(0.5, 2):.5g}")
    x, y, z = rng.uniform(0.02, 0.03, 3)
    ET.SubElement(
        inertial, "inertia", ixx=f"{x:.5g}", iyy=f"{y:.5g}", izz=f"{z:.5g}", ixy="1e-3", ixz="2e-3", iyz="-1e-3"
    )


def urdf(rng: np.random.Generator) -> ET.Element:
    """A random tree of links on the ground; joints of every type that a scene has."""
    robot = ET.Element("robot", name="random")
    ET.SubElement(robot, "link", name="world")
    for number in range(int(rng.integers(2, 5))):
        link(robot, f"L{number}", rng)
        parent = "world" if number == 0 else f"L{rng.integers(number)}"
        kind = str(rng.choice(TYPES if parent == "world" else [*TYPES[:3], "spherical", "fixed"]))
        joint = ET.SubElement(robot, "joint", name=f"J{number}", type=kind if number else "continuous")
        ET.SubElement(joint, "parent", link=parent)
        ET.SubElement(joint, "child", link=f"L{number}")
        ET.SubElement(joint, "origin", xyz=words(rng.normal(size=3) * 0.3), rpy=words(rng.normal(size=3)))
        if joint.get("type") in TYPES[:3]:
            ET.SubElement(joint, "axis", xyz=words(rng.normal(size=3)))
            ET.SubElement(joint, "dynamics", damping=f"{rng.uniform(0, 0.3):.4g}")
    return robot


def written(root: ET.Element, folder: Path) -> Path:
    path = folder / ("machine.urdf" if root.tag == "robot" else "machine.xml")
    path.write_text(ET.tostring(root, encoding="unicode"))
    return path


def invented(rng: np.random.Generator) -> str:
    return "x" + "".join(rng.choice(list("abcdefgh"), 6))


def test_a_random_urdf_moves_as_in_mujoco_and_random_extras_are_reported(tmp_path: Path) -> None:
    for seed in range(12):
        rng = np.random.default_rng(seed)
        robot = urdf(rng)
        plain = read(written(robot, tmp_path))
        assert (plain.left_out, plain.missing, plain.notes) == ((), (), ())
        extras = []
        everything = list(robot.iter())
        for place in (everything[k] for k in rng.permutation(len(everything))[:3]):
            extras += [f"<{tag}>: " for tag in [invented(rng)] if ET.SubElement(place, tag) is not None]
            name = invented(rng)
            place.set(name, "1")
            extras.append(name)
        path = written(robot, tmp_path)
        found = read(path)
        report = "\n".join(found.left_out)
        assert all(extra in report for extra in extras), (extras, report)
        assert found.missing == ()
        assert found.scene == plain.scene
        assert distance(path, found) < 1e-7, seed


def distance(path: Path, found: Imported) -> float:
    """Return how far the origins of bodies are from MuJoCo's after 0.2 s, at most [m]."""
    model = mujoco.MjModel.from_xml_path(str(path))
    model.opt.timestep, model.opt.integrator = 2e-4, mujoco.mjtIntegrator.mjINT_RK4
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1000)
    mujoco.mj_kinematics(model, data)
    moved = simulate(Scene.parse(found.scene).with_values(FINE), np.array([0.2]))
    assert moved.ok, moved.message
    bodies = [name for name in found.scene["bodies"] if name in {model.body(k).name for k in range(model.nbody)}]
    return max(float(np.max(np.abs(moved.marker(name)[0] - data.body(name).xpos))) for name in bodies)


def test_an_unknown_element_that_joins_links_makes_another_machine(tmp_path: Path) -> None:
    """Whatever its name and wherever it names them; the command refuses until it is told to go on."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        robot = urdf(rng)
        names = rng.choice([one.get("name") for one in robot.iter("link")], 2, replace=False)
        joining = ET.SubElement(robot, invented(rng))
        if seed % 2:
            joining.set("first", names[0])
            joining.set("second", names[1])
        else:
            for name in names:
                ET.SubElement(joining, invented(rng), link=name)
        path, out = written(robot, tmp_path), tmp_path / "made.yaml"
        found = read(path)
        assert len(found.missing) == 1
        assert joining.tag in found.missing[0]
        out.unlink(missing_ok=True)
        refused = CliRunner().invoke(main, ["import", str(path), "--out", str(out)])
        assert refused.exit_code == 2
        assert joining.tag in refused.stderr
        assert not out.exists()
        partly = CliRunner().invoke(main, ["import", str(path), "--out", str(out), "--partial"])
        assert partly.exit_code == 0
        assert f"left out: {found.missing[0]}; the scene is another machine" in partly.stderr


MJCF = """<mujoco model="m"><compiler angle="radian"/>
<option gravity="0 0 -9.5" timestep="0.003" wind="1 0 0"><flag energy="enable" contact="disable"/></option>
<size nuser_geom="1"/><statistic extent="2"/><visual><global fovy="40"/></visual>
<custom><numeric name="n" data="3"/></custom>
<default><joint margin="0.01"/><geom rgba="1 0 0 1"/><default class="c"><joint armature="0.2"/></default></default>
<asset><texture name="t" builtin="flat" width="8" height="8" type="2d"/><material name="steel" texture="t"/></asset>
<worldbody><light pos="0 0 3"/><camera name="eye" pos="1 1 1"/>
<geom type="plane" size="1 1 1" material="steel" pos="0 0 -1"/>
<body name="a" pos="0 0 1" gravcomp="0.5" user="3">
  <joint name="ja" axis="0 1 0" range="-1 1" solreflimit="0.03 1" stiffness="3" damping="0.2" frictionloss="0.01"/>
  <geom type="capsule" fromto="0 0 0 .3 0 0" size="0.02" mass="1.5" condim="4" group="2" user="7"/>
  <site name="tip" pos=".3 0 0" rgba="0 1 0 1"/>
  <body name="b" pos=".3 0 0"><joint name="jb" class="c" axis="0 1 0" ref="0.1"/>
    <inertial pos=".1 0 0" mass="0.7" diaginertia=".01 .02 .02"/><site name="end" pos=".3 0 0"/></body></body>
<body name="m" mocap="true" pos="2 0 0"/>
<body name="g" pos="0 1 1"><joint name="jg" axis="0 -1 0"/><geom size=".1 .1 .1" type="box" friction=".3"/></body>
<body name="w" pos="0 2 1"><joint name="jw" axis="0 1 0"/>
  <geom size=".1 .1 .1" type="box" fluidshape="ellipsoid"/></body>
</worldbody>
<contact><exclude body1="a" body2="b"/></contact>
<tendon><spatial name="rope" width="0.01" stiffness="20" damping="1" springlength="0.2" range="0 9">
  <site site="tip"/><site site="end"/></spatial></tendon>
<equality><joint joint1="jw" joint2="jg" polycoef="0 -1.5 0 0 0" solref="0.01 1"/></equality>
<actuator><motor joint="ja" gear="3"/></actuator>
<sensor><jointpos joint="ja"/></sensor>
<keyframe><key name="start" qpos="0 0.1 0 0" qvel="1 2 0 0"/></keyframe>
</mujoco>"""


def mutants(root: ET.Element) -> Iterator[tuple[str, ET.Element]]:
    """Yield the file without each element, and without each attribute."""
    for number, element in enumerate(root.iter()):
        for name in element.attrib:
            other = copy.deepcopy(root)
            del list(other.iter())[number].attrib[name]
            still = element.get("mocap") is not None or element.get("type") == "plane"
            yield f"{element.tag}{'.still' * still}@{name}", other
        for position, child in enumerate(element):
            other = copy.deepcopy(root)
            inside = list(other.iter())[number]
            inside.remove(inside[position])
            yield f"{element.tag}/{child.tag}", other


SILENT = {"mujoco@model", "numeric@name", "texture@width", "texture@height", "visual/global", "global@fovy"} | {
    # Details of things that a line reports as a whole.
    *("light@pos", "camera@name", "camera@pos", "numeric@data", "custom/numeric", "material@name", "material@texture"),
    *("texture@name", "texture@builtin", "texture@type", "size@nuser_geom", "statistic@extent", "motor@gear"),
    *("exclude@body1", "exclude@body2", "motor@joint", "jointpos@joint", "gazebo/material", "gazebo@reference"),
    *("safety_controller@k_velocity", "body.still@name", "body.still@pos"),
    *("geom.still@pos", "geom.still@type"),
    # Of contacts, which a flag of this file disables.
    *("contact/exclude", "mujoco/contact", "geom@condim", "geom@friction"),
    # Defaults, and names that nothing refers to.
    *("key@qpos", "robot@name", "robot/link"),
}


@pytest.mark.parametrize("kind", ["mjcf", "urdf"])
def test_without_any_part_of_a_file_the_scene_or_the_report_is_another(kind: str, tmp_path: Path) -> None:
    root = ET.fromstring(MJCF) if kind == "mjcf" else urdf(np.random.default_rng(7))
    if kind == "urdf":
        joint = next(one for one in root.findall("joint") if one.get("type") == "revolute")
        joint.append(ET.Element("limit", lower="-1", upper="2", effort="3", velocity="4"))
        joint.append(ET.Element("safety_controller", k_velocity="3"))
        root.append(ET.fromstring('<gazebo reference="L0"><material>red</material></gazebo>'))
    whole = read(written(root, tmp_path))
    assert whole.missing == ()
    silent, tried = set[str](), 0
    for what, mutant in mutants(root):
        tried += 1
        try:
            same = parts(read(written(mutant, tmp_path))) == parts(whole)
        except InputError:
            same = False
        silent |= {what} if same else set()
    assert tried > 60
    assert silent <= SILENT, silent - SILENT


def parts(found: Imported) -> Any:
    return found.scene, [line.split(" (from line")[0] for line in found.left_out], found.missing, found.notes


def test_the_root_is_held_or_floats_as_asked(tmp_path: Path) -> None:
    """By default it is held if anything else moves, and a note says so either way."""
    rng = np.random.default_rng(3)
    robot = ET.Element("robot", name="r")
    link(robot, "trunk", rng)
    path = written(robot, tmp_path)
    alone = read(path)
    assert "--root fixed" in alone.notes[0]
    times = np.array([0.1, 0.2])
    fallen = simulate(Scene.parse(alone.scene), times).marker("trunk")[:, 2]
    assert fallen == pytest.approx(-9.81 / 2 * times**2, abs=1e-9)
    with pytest.raises(InputError, match="nothing in it moves"):
        read(path, "fixed")
    link(robot, "leg", rng)
    joint = ET.SubElement(robot, "joint", name="hip", type="continuous")
    ET.SubElement(joint, "parent", link="trunk")
    ET.SubElement(joint, "child", link="leg")
    ET.SubElement(robot, "link", name="world")
    path = written(robot, tmp_path)
    (note,) = read(path).notes
    assert "fixed to the ground; --root floating frees it" in note
    freed = read(path, "floating")
    assert freed.notes == ()
    assert set(freed.scene["bodies"]) == {"trunk", "leg"}
    said = '<joint name="base" type="floating"><parent link="world"/><child link="trunk"/></joint>'
    robot.append(ET.fromstring(said))
    assert distance(written(robot, tmp_path), freed) < 1e-7


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('<robot name="r"><link name="a"></robot>', "no well-formed XML: mismatched tag in line 1"),
        (
            '<robot name="r"><link name="b"/><link name="a"/><joint name="j" type="continuous">'
            '<parent link="b"/><child link="a"/></joint></robot>',
            "nothing in it moves; <link a> in line 1: has no mass",
        ),
        (
            '<robot name="r"><link name="a"/><joint name="j" type="fixed"><parent link="b"/><child link="a"/>'
            "</joint></robot>",
            "<joint j> in line 1: no link 'b'",
        ),
    ],
)
def test_what_cannot_be_read_is_refused_by_its_own_name(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "machine.urdf"
    path.write_text(text)
    with pytest.raises(InputError) as refused:
        read(path)
    assert message in str(refused.value)


def test_shapes_that_carry_no_mass_need_no_files(tmp_path: Path) -> None:
    robot = urdf(np.random.default_rng(1))
    plain = read(written(robot, tmp_path)).scene
    for one in robot.iter("link"):
        shape = ET.SubElement(ET.SubElement(one, "visual"), "geometry")
        ET.SubElement(shape, "mesh", filename="package://nowhere/mesh.stl")
    for one in robot.findall("link")[1:]:
        shape = ET.SubElement(ET.SubElement(one, "collision"), "geometry")
        ET.SubElement(shape, "mesh", filename="package://nowhere/mesh.stl")
    found = read(written(robot, tmp_path))
    assert found.scene == plain
    assert any(line.startswith("<collision>: ") for line in found.left_out)


GEARS = """<mujoco><compiler angle="radian"/><option gravity="0 0 -9.81"><flag contact="disable"/></option><worldbody>
{base}<body name="a"><joint name="ja" axis="0 1 0"/><inertial pos=".2 0 0" mass="1" diaginertia=".01 .02 .02"/></body>
<body name="b" pos="{place}"><joint name="jb" axis="{axis}"/>
<inertial pos=".1 0 .1" mass=".5" diaginertia=".01 .02 .02"/>
</body>{end}</worldbody><equality><joint name="e" joint1="jb" joint2="ja" polycoef="0 {ratio} 0 0 0" solref=".002 1"/>
</equality></mujoco>"""
CARRIER = '<body name="p"><joint axis="1 0 0"/><inertial pos="0 .1 0" mass="1" diaginertia=".02 .02 .02"/>'


@pytest.mark.parametrize("ratio", [-2.0, 0.75])
@pytest.mark.parametrize("axis", ["0 1 0", "0 -1 0", "1 0 1"])
@pytest.mark.parametrize("base", ["", CARRIER], ids=["on-the-ground", "on-a-body"])
def test_joints_in_a_ratio_move_as_in_mujoco(ratio: float, axis: str, base: str, tmp_path: Path) -> None:
    path = tmp_path / "gears.xml"
    path.write_text(GEARS.format(base=base, end="</body>" * bool(base), place="0 .1 0", axis=axis, ratio=ratio))
    found = read(path)
    assert found.missing == ()
    assert found.scene["joints"]["e"]["kind"] == "coupling"
    assert distance(path, found) < 2e-4


@pytest.mark.parametrize("kind", ["connect", "weld"])
def test_equalities_of_sites_close_loops(kind: str, tmp_path: Path) -> None:
    path = tmp_path / "sites.xml"
    path.write_text(f"""<mujoco><compiler angle="radian"/><worldbody><site name="wall" pos=".4 0 0"/>
    <body name="a"><joint type="ball"/><inertial pos=".2 0 0" mass="1" diaginertia=".01 .02 .02"/>
    <body name="b" pos=".2 0 .1"><joint type="ball"/><inertial pos=".1 0 0" mass="1"
    diaginertia=".01 .02 .02"/><site name="s" pos=".2 0 -.1"/></body></body></worldbody>
    <equality><{kind} name="e" site1="s" site2="wall"/></equality></mujoco>""")
    found = read(path)
    assert found.missing == ()
    assert found.scene["joints"]["e"]["kind"] == ("spherical" if kind == "connect" else "weld")
    path.write_text(path.read_text().replace('pos=".4 0 0"', 'pos=".4 0 .01"'))
    assert read(path).missing == (f"equality e: {kind} in another pose than that of the start",)


def test_actuators_with_several_controls_or_none_are_counted(tmp_path: Path) -> None:
    """Of which MuJoCo has more or fewer numbers than actuators; constant pushes beside them keep theirs."""
    inside = """<dcmotor joint="j" motorconst="0.5" resistance="1" input="pos vel" controller="10 0 1"/>
    <general name="push" site="tip" biastype="affine" gainprm="0" biasprm="9" gear="0 0 1 0 0 0"/>
    <damper joint="j" kv="1" ctrlrange="0 1"/>"""
    body = """<body name="a"><joint name="j" axis="0 1 0"/><geom size=".1" pos=".3 0 0"/><site name="tip" pos=".5 0 0"/>
    </body>"""
    path = tmp_path / "motors.xml"
    path.write_text(f"<mujoco><worldbody>{body}</worldbody><actuator>{inside}</actuator></mujoco>")
    found = read(path)
    assert any(line.startswith("actuators: 2") for line in found.left_out)
    assert set(found.scene["loads"]) == {"push"}


def test_a_body_that_loops_hold_still_is_simulated(tmp_path: Path) -> None:
    """Every constraint holds what others hold, and nothing can move."""
    path = tmp_path / "held.xml"
    path.write_text("""<mujoco><worldbody><body name="a"><geom size=".05"/></body>
    <body name="b" pos="0 0 -.1"><joint type="slide"/><geom size=".05"/></body></worldbody>
    <equality><connect body1="a" body2="b" anchor="0 0 0"/></equality></mujoco>""")
    moved = simulate(Scene.parse(read(path).scene), np.array([0.1]))
    assert moved.ok, moved.message
    assert moved.marker("b")[0] == pytest.approx([0, 0, -0.1], abs=1e-12)
