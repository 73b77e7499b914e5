"""The study of public robot files, on a small mirror made here: what is chosen, and what each file is counted as."""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

pytest.importorskip("mujoco")

from shoal_validation.robot_files.__main__ import summary
from shoal_validation.robot_files.corpus import choose, unpack
from shoal_validation.robot_files.trial import OURS, OWN, trial

ARM = """<link name="base"/><link name="arm"><inertial><origin xyz="0.2 0 0"/><mass value="1"/>
  <inertia ixx="0.001" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="j" type="{kind}"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>"""
FILES = {
    "a/arm.urdf": f'<robot name="r">{ARM.format(kind="continuous")}</robot>',
    "a/same.urdf": f'<robot name="r">{ARM.format(kind="continuous")}</robot>',
    "a/wrong.urdf": f'<robot name="r">{ARM.format(kind="hinged")}</robot>',
    "a/seen.urdf": '<robot name="r"><link name="base"/></robot>',
    "b/pendulum.xml": """<mujoco><worldbody><body name="p"><joint axis="0 1 0" armature=".1" damping=".2"/>
      <geom size=".1" pos=".3 0 0"/></body></worldbody></mujoco>""",
    "b/free.xml": """<mujoco><worldbody><body name="p"><joint type="free" damping=".2"/><geom size=".1"/></body>
      </worldbody></mujoco>""",
    "b/part.xml": "<mujocoinclude><worldbody/></mujocoinclude>",
    "b/notes.xml": "<notes/>",
}


@pytest.fixture
def corpus(tmp_path: Path) -> Path:
    """The files in a bare repository, unpacked again."""
    work, mirror = tmp_path / "work", tmp_path / "mirrors" / "owner+name" / "repo"
    for name, text in FILES.items():
        (work / name).parent.mkdir(parents=True, exist_ok=True)
        (work / name).write_text(text)
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-C", str(work)]
    for command in (["init", "-q"], ["add", "."], ["commit", "-qm", "files"]):
        subprocess.run([*git, *command], check=True)
    subprocess.run(["git", "clone", "-q", "--bare", str(work), str(mirror)], check=True)
    assert unpack(tmp_path / "mirrors", tmp_path / "corpus") == ["owner+name"]
    return tmp_path / "corpus"


def test_each_file_is_counted_once_and_for_what_it_is(corpus: Path) -> None:
    urdfs, mjcfs = choose(corpus, 10, "urdf"), choose(corpus, 10, "mjcf")
    assert len(urdfs) == 3
    assert len(mjcfs) == 3
    assert choose(corpus, 2, "urdf") == urdfs[:2]
    trials = {path.name: trial(path, corpus) for path in (*urdfs, *mjcfs)}
    counted = {name: (one.outcome, one.why) for name, one in trials.items()}
    arm = next(name for name in counted if name in ("arm.urdf", "same.urdf"))
    assert counted == {
        arm: ("imported", ""),
        "wrong.urdf": ("refused", "a wrong value"),
        "seen.urdf": ("refused", "no link that moves has mass"),
        "pendulum.xml": ("imported", ""),
        "free.xml": ("imported", ""),
        "part.xml": ("refused", "a part of other files"),
    }
    for name, how in ((arm, OWN), ("pendulum.xml", OWN)):
        distance = trials[name].distance
        assert trials[name].compared == how
        assert distance is not None
        assert distance < 1e-8
    assert trials["free.xml"].compared.startswith("other physics: damping")
    assert OURS not in {one.compared for one in trials.values()}
    outcomes, motions = summary([("urdf", one) for one in trials.values()])
    assert "| urdf | refused | a part of other files | 1 |" in outcomes
    assert "| urdf | within 1e-06 m: MuJoCo reads the file | 2 |" in motions
