"""URDF files as users have them: roots, packages, macros, links without mass, loops and moments of no body."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from scipy.integrate import solve_ivp
from shoal.cli import main
from shoal.errors import InputError
from shoal.imported import read
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene
from shoal.trajectory import Trajectory

mujoco: Any = pytest.importorskip("mujoco")
FINE = {"solver.integrator": "dop853", "solver.relative_tolerance": 1e-10, "solver.absolute_tolerance": 1e-11}


def link(name: str, mass: float, centre: str, inertia: tuple[float, float, float], more: str = "") -> str:
    x, y, z = inertia
    return f"""<link name="{name}"><inertial><origin xyz="{centre}"/><mass value="{mass}"/>
      <inertia ixx="{x}" iyy="{y}" izz="{z}" ixy="0" ixz="0" iyz="0"/></inertial>{more}</link>"""


def joint(
    name: str, parent: str, child: str, axis: str = "0 1 0", at: str = "0 0 0", more: str = "", kind: str = "continuous"
) -> str:
    return f"""<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/><origin xyz="{at}"/>
      <axis xyz="{axis}"/>{more}</joint>"""


def written(folder: Path, inside: str, name: str = "robot.urdf") -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f'<robot name="r">{inside}</robot>')
    return path


def moved(scene: dict[str, Any], times: list[float]) -> Trajectory:
    found = simulate(Scene.parse(scene).with_values(FINE), np.array(times))
    assert found.ok, found.message
    return found


ARM = link("arm", 1.0, "0.2 0 0", (1e-3, 0.013, 0.013))


def test_a_link_without_mass_between_two_joints_keeps_what_acts_in_both(tmp_path: Path) -> None:
    """As MuJoCo moves one body on two hinges; a frame without mass at the end is a place."""
    inside = f"""<link name="base"/><link name="shoulder"/>{ARM}<link name="tool"/>
      {joint("pan", "base", "shoulder", "0 0 1", "0 0 .1", '<dynamics damping="0.3"/>')}
      {joint("lift", "shoulder", "arm", "0 1 .2", ".05 0 .1", '<dynamics damping="0.1"/>')}
      {joint("tip", "arm", "tool", "1 0 0", ".4 0 0", kind="fixed")}"""
    found = read(written(tmp_path, inside))
    assert found.missing == ()
    assert any(note.startswith("<link shoulder> in line 1: has no mass; given 1.5e-08 kg") for note in found.notes)
    model = mujoco.MjModel.from_xml_string("""<mujoco><compiler angle="radian"/><option integrator="RK4"
      timestep="2e-4"/><worldbody><body name="arm" pos=".05 0 .2"><joint axis="0 0 1" pos="-.05 0 -.1" damping=".3"/>
      <joint axis="0 1 .2" damping=".1"/><inertial pos=".2 0 0" mass="1" diaginertia="1e-3 .013 .013"/>
      <site name="tool" pos=".4 0 0"/></body></worldbody></mujoco>""")
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data, 1500)
    mujoco.mj_kinematics(model, data)
    assert moved(found.scene, [0.3]).marker("tool")[0] == pytest.approx(data.site("tool").xpos, abs=1e-8)


def test_what_has_no_mass_at_the_end_of_a_chain_is_left_out(tmp_path: Path) -> None:
    inside = f'<link name="base"/>{ARM}<link name="wheel"/>{joint("j", "base", "arm")}{joint("k", "arm", "wheel")}'
    found = read(written(tmp_path, inside))
    assert set(found.scene["bodies"]) == {"arm"}
    assert found.left_out[0].startswith("<link wheel> in line 2: has no mass, so that it acts on nothing; <joint k>")


def test_links_that_are_fixed_together_weigh_as_one_body(tmp_path: Path) -> None:
    """A physical pendulum of two rods at a right angle, the second turned by rpy of its origin: Huygens and Steiner."""
    rods = link("a", 1.0, "0 0 -0.5", (1 / 12, 1 / 12, 0)) + link("b", 2.0, "0.5 0 0", (0, 1 / 6, 1 / 6))
    inside = f"{rods}{joint('j', 'world', 'a', '1 0 0', '0 0 2')}" + joint(
        "w", "a", "b", at="0 0 -1", kind="fixed"
    ).replace('xyz="0 0 -1"', 'xyz="0 0 -1" rpy="0 0 1.5707963267948966"')
    found = read(written(tmp_path, inside))
    assert set(found.scene["bodies"]) == {"a"}
    mass, inertia = 3.0, 1 / 3 + 1 / 6 + 2 * (1 + 0.25)
    centre = np.array([2 * 0.5, -0.5 - 2.0]) / mass  # along y and z
    way = solve_ivp(
        lambda _, x: [x[1], mass * 9.81 * (np.sin(x[0]) * centre[1] - np.cos(x[0]) * centre[0]) / inertia],
        (0, 0.5), [0.0, 0.0], rtol=1e-11, atol=1e-12,
    ).y[0, -1]  # fmt: skip
    corner = moved(found.scene, [0.5]).marker("b")[0]
    assert corner == pytest.approx([0, np.sin(way), 2 - np.cos(way)], abs=1e-8)


@pytest.mark.parametrize("stated", ["loop_joint", "second-parent"])
def test_a_loop_closes_as_a_joint(stated: str, tmp_path: Path) -> None:
    """A parallelogram, whose coupler is carried round without turning: one equation."""
    end = 0.2 * np.array([np.sin(0.7), np.cos(0.7)])
    at, centre = f"{end[0]} 0 {end[1]}", f"{end[0] / 2} 0 {end[1] / 2}"
    crank = (7e-4, 7e-4, 1e-5)
    links = link("crank", 0.2, centre, crank) + link("rocker", 0.2, centre, crank)
    links += link("coupler", 0.4, "0.2 0 0", (1e-5, 5e-3, 5e-3))
    loop = {
        "loop_joint": f"""<loop_joint name="c" type="continuous"><link1 link="coupler" xyz="0.4 0 0"/>
          <link2 link="rocker" xyz="{at}"/><axis xyz="0 1 0"/></loop_joint>""",
        "second-parent": joint("c", "rocker", "coupler", at=at),
    }[stated]
    if stated == "second-parent":
        # The coupler's own frame is at its joint with the crank; the loop is closed at a frame of the rocker there.
        links += link("pin", 1e-9, "0 0 0", (1e-12, 1e-12, 1e-12))
        loop = joint("p", "coupler", "pin", at="0.4 0 0", kind="fixed") + joint("c", "rocker", "pin", at=at)
    tree = (
        joint("a", "world", "crank")
        + joint("b", "crank", "coupler", at=at)
        + joint("d", "world", "rocker", at="0.4 0 0")
    )
    found = read(written(tmp_path, links + tree + loop))
    assert found.missing == ()
    assert found.scene["joints"]["c"]["kind"] == "revolute"
    # Both cranks with 0.2 kg in their middle and 7e-4 kg m^2 about y, which is at a right angle to them; all of the
    # coupler at their ends.
    inertia, moment = 2 * (7e-4 + 0.2 * 0.1**2) + 0.4 * 0.2**2, 9.81 * (2 * 0.2 * 0.1 + 0.4 * 0.2)
    way = solve_ivp(
        lambda _, x: [x[1], moment * np.sin(x[0]) / inertia], (0, 0.3), [0.7, 0.0], rtol=1e-11, atol=1e-12
    ).y[0, -1]
    place = 0.2 * np.array([np.sin(way), 0.0, np.cos(way)])
    assert moved(found.scene, [0.3]).marker("coupler")[0] == pytest.approx(place, abs=1e-7)


def test_a_loop_that_is_open_makes_another_machine(tmp_path: Path) -> None:
    two = ARM + link("other", 1.0, "0.1 0 0", (1e-3, 0.01, 0.01))
    loop = '<loop_joint name="c" type="continuous"><link1 link="arm" xyz=".4 0 0"/><link2 link="other"/></loop_joint>'
    found = read(
        written(tmp_path, two + joint("j", "world", "arm") + joint("k", "world", "other", at=".4 0 .1") + loop)
    )
    assert found.missing == ("<loop_joint c> in line 5: closes a loop that is open by 0.1 m in the pose of the file",)


def test_moments_of_no_body_are_raised_with_a_note(tmp_path: Path) -> None:
    inside = joint("j", "world", "arm") + link("arm", 1.0, "0.2 0 0", (0.001, 0.001, 0.01))
    found = read(written(tmp_path, inside))
    (note,) = found.notes
    assert note.endswith(
        "no body has the principal moments of inertia 0.001, 0.001, 0.01 kg m^2, the largest above the others' sum; "
        "taken as 0.005, 0.005, 0.01"
    )
    with pytest.raises(InputError, match=r"moment of inertia -0.001 kg m\^2 is negative"):
        read(written(tmp_path, joint("j", "world", "arm") + link("arm", 1.0, "0.2 0 0", (-0.001, 0.001, 0.01))))


def test_a_mass_in_one_point_swings(tmp_path: Path) -> None:
    """Without any moment of inertia of its own, on a hinge: a simple pendulum."""
    found = read(written(tmp_path, joint("j", "world", "arm") + link("arm", 1.0, "0.5 0 0", (0, 0, 0), "")))
    angle = solve_ivp(
        lambda _, x: [x[1], 9.81 * np.cos(x[0]) / 0.5], (0, 0.3), [0, 0], rtol=1e-11, atol=1e-12
    ).y[0, -1]  # fmt: skip
    scene = found.scene
    scene["markers"]["mass"] = {"body": "arm", "point": [0.5, 0, 0]}
    place = 0.5 * np.array([np.cos(angle), 0, -np.sin(angle)])
    assert moved(scene, [0.3]).marker("mass")[0] == pytest.approx(place, abs=1e-7)


CUBE = """v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"""


def test_packages_are_found_above_beside_and_in_variables(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In this order; a mesh counts where a link has no <inertial>."""
    mesh = '<collision><geometry><mesh filename="package://parts/arm.obj"/></geometry></collision>'
    inside = f'<link name="base"/><link name="arm">{mesh}</link>{joint("j", "base", "arm")}'
    path = written(tmp_path / "ws" / "robot" / "urdf", inside)
    with pytest.raises(
        InputError, match=r"no <inertial>, and its shape 'package://parts/arm.obj' is not found \(looked"
    ):
        read(path)
    places = [tmp_path / "share" / "parts", tmp_path / "ws" / "parts", tmp_path / "ws" / "robot"]
    (tmp_path / "ws" / "robot" / "package.xml").write_text("<package><name>parts</name></package>")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "share"))
    masses = []
    for size, folder in enumerate(places, 1):
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "arm.obj").write_text(CUBE.replace("1 0 0", f"{size} 0 0"))
        if folder == places[0]:
            (tmp_path / "ws" / "robot" / "package.xml").rename(tmp_path / "kept.xml")
        if folder == places[2]:
            (tmp_path / "kept.xml").rename(tmp_path / "ws" / "robot" / "package.xml")
        masses.append(read(path).scene["bodies"]["arm"]["mass"])
    assert masses == pytest.approx([1000 / 6, 2000 / 6, 3000 / 6])


def test_macros_are_written_out(tmp_path: Path) -> None:
    """With arguments of the command, and packages as meshes find them."""
    pytest.importorskip("xacro")
    space = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "arm.xacro").write_text(
        f'<robot {space}><xacro:macro name="arm" params="name mass"><link name="${{name}}"><inertial>'
        '<origin xyz="0.2 0 0"/><mass value="${mass}"/><inertia ixx="1e-3" iyy="0.01" izz="0.01"/>'
        "</inertial></link></xacro:macro></robot>"
    )
    path = tmp_path / "robot" / "robot.urdf.xacro"
    path.parent.mkdir()
    path.write_text(
        f'<robot name="r" {space}><xacro:arg name="mass" default="1"/>'
        '<xacro:include filename="$(find parts)/arm.xacro"/>'
        f'<xacro:arm name="arm" mass="$(arg mass)"/>{joint("j", "world", "arm")}</robot>'
    )
    out = tmp_path / "made.yaml"
    done = CliRunner().invoke(main, ["import", str(path), "--argument", "mass=2.5", "--out", str(out)])
    assert done.exit_code == 0, done.stderr
    assert yaml.safe_load(out.read_text())["bodies"]["arm"]["mass"] == 2.5
    stated = '<xacro:arg name="mass" default="1"/>'
    path.write_text(path.read_text().replace(stated, ""))
    with pytest.raises(InputError, match="argument mass; state it by --argument mass=VALUE"):
        read(path)
    path.write_text(path.read_text().replace("parts", "nowhere"))
    with pytest.raises(InputError, match=r"xacro: .*find nowhere.*no such package"):
        read(path)
    path.write_text('<robot name="r"><xacro:arm/></robot>')
    with pytest.raises(InputError, match="xacro: unbound prefix"):
        read(path)


def test_a_joint_that_mimics_another_follows_it(tmp_path: Path) -> None:
    """Fingers on a hand that turns: slides, of which the second follows the first; MuJoCo couples alike."""
    finger = (1e-4, 1e-4, 1e-4)
    hand, first, second = (0.5, "0 0 .05", (1e-3, 1e-3, 5e-4)), (0.1, ".01 0 .02", finger), (0.2, "-.01 0 .02", finger)
    mimic = '<mimic joint="f" multiplier="-0.7" offset="0.03"/>'
    inside = link("hand", *hand) + link("one", *first) + link("two", *second)
    inside += joint("w", "world", "hand", "0 1 .3") + joint("f", "hand", "one", "1 0 .2", "0 .02 .1", kind="prismatic")
    inside += joint("g", "hand", "two", "1 0 0", "0 -.02 .1", mimic, kind="prismatic")
    found = read(written(tmp_path, inside))
    assert found.missing == ()
    assert found.scene["joints"]["g-mimic"]["kind"] == "coupling"
    model = mujoco.MjModel.from_xml_string("""<mujoco><option integrator="RK4" timestep="1e-4"/><worldbody><body>
      <joint axis="0 1 .3"/><inertial pos="0 0 .05" mass=".5" diaginertia="1e-3 1e-3 5e-4"/>
      <body name="one" pos="0 .02 .1"><joint name="f" type="slide" axis="1 0 .2"/>
      <inertial pos=".01 0 .02" mass=".1" diaginertia="1e-4 1e-4 1e-4"/></body>
      <body name="two" pos="0 -.02 .1"><joint name="g" type="slide" axis="1 0 0"/>
      <inertial pos="-.01 0 .02" mass=".2" diaginertia="1e-4 1e-4 1e-4"/></body></body></worldbody><equality>
      <joint joint1="g" joint2="f" polycoef=".03 -.7 0 0 0" solref="2e-4 1" solimp=".99999 .99999 .001 .5 2"/>
      </equality></mujoco>""")
    data = mujoco.MjData(model)
    data.qpos[2] = 0.03
    mujoco.mj_step(model, data, 2000)
    mujoco.mj_kinematics(model, data)
    ours = moved(found.scene, [0.2])
    for name in ("one", "two"):
        assert ours.marker(name)[0] == pytest.approx(data.body(name).xpos, abs=1e-6)


def test_options_of_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text('<mujoco><worldbody><body><joint/><geom size=".1"/></body></worldbody></mujoco>')
    with pytest.raises(InputError, match="root: MJCF states whether bodies are free"):
        read(path, "floating")
    with pytest.raises(InputError, match="argument: has no macros that take 'mass'"):
        read(written(tmp_path, ARM + joint("j", "world", "arm")), arguments={"mass": "1"})
