"""A user's own scenes, problems and recordings: checked, kept with what they need, found by name."""

from __future__ import annotations

import gzip
import json
import time
from pathlib import Path
from typing import Any

import pytest
import shoal
import yaml
from click.testing import CliRunner
from shoal import library
from shoal.cli import main
from shoal.errors import InputError
from shoal.scene.load import scene_library, scene_names
from shoal.shelf import shelf
from test_hostile_files import HOSTILE, torque

PENDULUM = (scene_library() / "single-pendulum.yaml").read_text(encoding="utf-8")
PARALLELOGRAM = (scene_library() / "parallelogram.yaml").read_text(encoding="utf-8")
PROBLEM: dict[str, Any] = {
    "name": "start",
    "scene": "machine.yaml",
    "parameters": {"theta": {"path": "initial.OA.angle", "lower": -1.5, "upper": 1.5}},
    "channels": [{"marker": "A", "quantity": axis, "column": axis} for axis in ("x", "y")],
    "source": {"kind": "file", "path": "run.csv"},
}
RUN = "t,x,y\n" + "".join(f"{0.1 * k:.1f},{1 - 0.01 * k},{-0.1 * k}\n" for k in range(10))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SHOAL_LIBRARY", str(tmp_path / "library"))
    files = tmp_path / "files"
    files.mkdir()
    (files / "machine.yaml").write_text(PENDULUM.replace("duration: 10.0", "duration: 1.0"))
    (files / "run.csv").write_text(RUN)
    (files / "start.yaml").write_text(yaml.safe_dump(PROBLEM))
    return files


def shoal_(*arguments: str, status: int = 0) -> str:
    done = CliRunner().invoke(main, list(arguments))
    assert done.exit_code == status, done.output
    if status:
        assert done.stderr.count("\n") == 1, done.stderr
    return done.stderr if status else done.stdout


def test_a_scene_of_ones_own_is_taken_by_name(folder: Path) -> None:
    entry = library.add(folder / "machine.yaml", "arm")
    assert shoal.load_scene("arm") == shoal.load_scene(str(folder / "machine.yaml"))
    assert scene_names()[-1] == "arm"
    assert "arm" in shoal_("scenes")
    assert shoal_("scenes", "arm") == (folder / "machine.yaml").read_text()
    (folder / "machine.yaml").write_text(PENDULUM.replace("-9.81", "-1.62"))
    library.add(folder / "machine.yaml", "arm")
    assert shoal.load_scene("arm").gravity == (0.0, -1.62)
    assert shoal.load_scene(f"arm@{entry.version}").gravity == (0.0, -9.81)


def test_a_problem_is_kept_with_the_files_that_it_names(folder: Path, tmp_path: Path) -> None:
    library.add(folder / "start.yaml")
    for file in list(folder.iterdir()):
        file.unlink()
    problem = shoal.load_problem("start")
    assert problem.load_scene().name == "single-pendulum"
    assert "start" in shoal.problem_names()
    from shoal.identification import measure

    measured = measure(problem, problem.load_scene())
    assert measured.recordings["recording"].times.size == 10


def test_names_of_the_library_in_a_problem_are_looked_up_anew(folder: Path) -> None:
    library.add(folder / "machine.yaml", "arm")
    library.add(folder / "run.csv")
    named = {**PROBLEM, "scene": "arm", "source": {"kind": "file", "path": "run"}}
    (folder / "start.yaml").write_text(yaml.safe_dump(named))
    library.add(folder / "start.yaml")
    from shoal.identification import measure

    def samples() -> int:
        problem = shoal.load_problem("start")
        return int(measure(problem, problem.load_scene()).recordings["recording"].times.size)

    assert samples() == 10
    whole = library.gathered("problems", "start", "start", whole=True)
    assert sorted(whole) == ["scene/arm.yaml", "source/run.csv", "source/run.yaml", "start.yaml"]
    (folder / "run.csv").write_text(RUN[: RUN.rindex("\n0.9") + 1])
    library.add(folder / "run.csv")
    assert samples() == 9
    held = shelf().hold("start", whole)
    shelf().remove("recordings", "run")
    shelf().remove("scenes", "arm")
    problem = shoal.load_problem(str(held))
    assert measure(problem, problem.load_scene()).recordings["recording"].times.size == 10
    with pytest.raises(InputError, match="no such scene"):
        samples()


COMMENTED = """# What we measured on Monday.
name: start   # of the arm
scene: {scene}   # the machine
parameters: {{theta: {{path: initial.OA.angle, lower: -1.5, upper: 1.5}}}}

channels:
  - {{marker: A, quantity: x, column: x}}   # in m
  - {{marker: A, quantity: y, column: y}}
source: {{kind: file, path: {path}, every: 1}}   # ünïcode
"""


def test_the_text_of_a_problem_stays_as_it_was_written(folder: Path) -> None:
    """What it names lies beside it, below it, or elsewhere; only then a path has to change, in its own line."""
    (folder / "deep").mkdir()
    (folder / "deep" / "monday.yaml").write_text("# by camera 2\npath: ../run.csv   # raw\n")
    (folder / "elsewhere.yaml").write_text((folder / "machine.yaml").read_text())
    from shoal.identification import measure

    for scene, path, kept in [
        ("machine.yaml", "run.csv", ("machine.yaml", "run.csv")),
        ("./machine.yaml", "deep/monday.yaml", ("./machine.yaml", "deep/monday.yaml")),
        (str(folder / "elsewhere.yaml"), "deep/../run.csv", ("scene/elsewhere.yaml", "source/run.csv")),
        ("start.yaml", "run.csv", ("scene/start.yaml", "run.csv")),
    ]:
        text = COMMENTED.format(scene=scene, path=path)
        file = folder / "problem.yaml"
        file.write_text(text)
        if scene == "start.yaml":
            (folder / scene).write_text((folder / "machine.yaml").read_text())
        entry = library.add(file, "start")
        assert entry.document.read_text() == COMMENTED.format(scene=kept[0], path=kept[1])
        problem = shoal.load_problem("start")
        assert measure(problem, problem.load_scene()).recordings["recording"].times.size == 10
    (described,) = shelf().root.rglob("monday.yaml")
    assert described.read_text() == "# by camera 2\npath: path/run.csv   # raw\n"


def test_an_alias_is_written_anew(folder: Path) -> None:
    """Where a path stands for two fields, its text alone cannot be changed."""
    text = f"name: &it {folder / 'machine.yaml'}\nscene: *it\n" + COMMENTED.split("\n", 3)[3].format(path="run.csv")
    (folder / "start.yaml").write_text(text)
    stored = yaml.safe_load(library.add(folder / "start.yaml").document.read_text())
    assert (stored["name"], stored["scene"]) == (str(folder / "machine.yaml"), "scene/machine.yaml")


@pytest.mark.parametrize(
    ("scene", "why"),
    [
        (torque("9**9**9**9*t"), "finite"),
        (torque("sin(1e12*t)"), "varies too fast"),
        (torque("exp(1000*t)"), "no bound|finite"),
        (PARALLELOGRAM.replace("[2.0, 0.0]}, second", "[9.0, 0.0]}, second"), "initial|joints"),
        (PARALLELOGRAM.replace("{duration", "{acceleration: guess, duration"), "acceleration"),
    ],
)
def test_a_scene_is_checked_as_a_simulation_would(folder: Path, scene: str, why: str) -> None:
    """Up to its start, which has to agree with its joints."""
    (folder / "machine.yaml").write_text(scene)
    with pytest.raises(InputError, match=why) as refusal:
        library.add(folder / "machine.yaml")
    assert "\n" not in str(refusal.value)
    assert library.entries() == []


def test_a_recording_is_taken_by_name(folder: Path) -> None:
    (folder / "described.yaml").write_text("path: run.csv\nstart: 0.0\nduration: 0.5\n")
    library.add(folder / "described.yaml", "part")
    problem = shoal.load_problem(str(folder / "start.yaml"))
    from shoal.identification import measure

    assert measure(problem, problem.load_scene(), "part").recordings["recording"].times.size == 6
    with pytest.raises(InputError, match=r"data: partt: no such file.*did you mean part\?"):
        measure(problem, problem.load_scene(), "partt")


def test_the_commands_say_what_there_is(folder: Path) -> None:
    assert "nothing in" in shoal_("library", "list")
    made = json.loads(shoal_("library", "add", str(folder / "start.yaml"), "--json"))
    assert made["kind"] == "problems"
    listed = json.loads(shoal_("library", "list", "--json"))
    assert listed["entries"] == [made]
    shown = json.loads(shoal_("library", "show", "start", "--json"))
    assert set(shown["files"]) == {"start.yaml", "machine.yaml", "run.csv"}
    assert shown["versions"] == [made["version"]]
    assert shoal_("library", "show", f"start@{made['version']}") == (folder / "start.yaml").read_text()
    assert json.loads(shoal_("library", "remove", "start", "--json")) == {"kind": "problems", "name": "start"}
    assert json.loads(shoal_("library", "list", "--json"))["entries"] == []


def test_a_name_of_two_kinds_needs_its_kind(folder: Path) -> None:
    library.add(folder / "machine.yaml", "arm")
    library.add(folder / "run.csv", "arm")
    assert "say which with --kind" in shoal_("library", "show", "arm", status=2)
    assert "bodies" in shoal_("library", "show", "arm", "--kind", "scene")
    shoal_("library", "remove", "arm", "--kind", "recordings")
    assert [entry.kind for entry in library.entries()] == ["scenes"]


@pytest.mark.parametrize(
    ("name", "text", "arguments", "why"),
    [
        ("a.yaml", "name: a\nbodies: [1]\n", [], "bodies"),
        ("a.yaml", "x: 1\n", [], "its kind cannot be told"),
        ("a.yaml", "x: 1\n", ["--kind", "scene"], "a.yaml: "),
        ("a.yaml", PENDULUM, ["--kind", "machine"], "kind: no kind 'machine'"),
        ("a.yaml", PENDULUM, ["--name", "../a"], "name: '../a'"),
        ("a b.yaml", PENDULUM, [], "name: 'a b'"),
        ("single-pendulum.yaml", PENDULUM, [], "built-in scene"),
        ("n-four-bar-7.yaml", PENDULUM, [], "built-in scene"),
        ("a.yaml", yaml.safe_dump({**PROBLEM, "scene": "elsewhere.yaml"}), [], "scene: elsewhere.yaml cannot be read"),
        ("a.yaml", yaml.safe_dump({**PROBLEM, "scene": "elsewhere"}), [], "elsewhere: no such scene"),
        ("a.yaml", yaml.safe_dump({**PROBLEM, "parameters": {"x": 1}}), [], "parameters.x"),
        ("a.csv", "t,x\n0,one\n", [], ""),
        ("a.csv", "\0\0\0", [], "binary"),
        ("a.csv", "", [], "first line is empty"),
    ],
)
def test_what_is_wrong_is_one_line(folder: Path, name: str, text: str, arguments: list[str], why: str) -> None:
    (folder / name).write_text(text)
    if why:
        assert why in shoal_("library", "add", str(folder / name), *arguments, status=2)
        assert library.entries() == []
    else:
        shoal_("library", "add", str(folder / name), *arguments)  # which columns count is for a problem to say


@pytest.mark.parametrize("reference", ["/etc/hostname", "../../secret.csv", "other.csv", "\0.csv"])
def test_an_entry_names_nothing_outside(tmp_path: Path, reference: str) -> None:
    (tmp_path / "secret.csv").write_text(RUN)
    document = yaml.safe_dump({**PROBLEM, "scene": "single-pendulum", "source": {"kind": "file", "path": reference}})
    with pytest.raises(InputError, match=r"source\.path: .*(leads out of|not among the files)"):
        library.put("problems", "a", {"a.yaml": document.encode()})
    with pytest.raises(InputError, match=r"path: .*(leads out of|not among the files)"):
        library.put("recordings", "a", {"a.yaml": yaml.safe_dump({"path": reference}).encode()})
    inner = {
        "a.yaml": yaml.safe_dump({**PROBLEM, "scene": "single-pendulum", "source": {"kind": "file", "path": "b.yaml"}})
    }
    inner["b.yaml"] = yaml.safe_dump({"path": reference})
    with pytest.raises(InputError, match=r"b\.yaml: path: "):
        library.put("problems", "a", {name: text.encode() for name, text in inner.items()})


def hostile() -> dict[str, tuple[str, dict[str, bytes]]]:
    """Entries that somebody made to do harm, by a name each."""
    found = {}
    for name, (text, _) in HOSTILE.items():
        for kind in library.KINDS:
            found[f"{kind}-{name}"] = kind, {"a.yaml": text.encode()}
    described = b"path: a.csv\n"
    bombs = {
        "zeros": gzip.compress(bytes(400_000_000), 1),
        "columns": b"a," * 2_000_000 + b"\n1\n",
        "one-line": b"1" * 20_000_000,
        "quotes": b'"' * 20_000_001,
        "half-a-parquet": b"PAR1" + b"x" * 1000,
        "half-a-gzip": gzip.compress(RUN.encode())[:40],
    }
    return found | {f"table-{name}": ("recordings", {"a.yaml": described, "a.csv": b}) for name, b in bombs.items()}


@pytest.mark.slow
def test_two_hundred_entries_with_hostile_ones_among_them(folder: Path) -> None:
    """Each of these is refused in less than a second of processor time, and nothing of it stays."""
    good = [library.add(folder / "machine.yaml", f"machine-{k}") for k in range(100)]
    good += [library.add(folder / "run.csv", f"run-{k}") for k in range(40)]
    wrong = hostile()
    assert len(good) + len(wrong) >= 200
    for name, (kind, files) in wrong.items():
        begin = time.process_time()
        with pytest.raises(InputError) as refusal:
            library.put(kind, "a", files)
        assert time.process_time() - begin < 1.0, name
        assert "\n" not in str(refusal.value), name
        assert len(str(refusal.value)) < 2000, name
    assert sorted(entry.name for entry in library.entries()) == sorted(entry.name for entry in good)
    assert {path.name for path in shelf().root.iterdir()} == {"scenes", "recordings", ".lock"}
    begin = time.process_time()
    assert len(json.loads(shoal_("library", "list", "--json"))["entries"]) == 140
    assert time.process_time() - begin < 2.0
