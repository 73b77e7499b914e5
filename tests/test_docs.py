"""The documentation builds without a warning; its worked examples run as they stand."""

from __future__ import annotations

import json
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.integrate
import shoal
from click.testing import CliRunner
from shoal import swarm
from shoal.cli import main
from shoal.engines import ENGINES, get_engine
from shoal.identification import METHODS, methods
from shoal.identification.findings import Verdict
from shoal_flows.deployment import processes, up

DOCS = Path(__file__).parents[1] / "docs"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(page: str, language: str = "python") -> list[str]:
    """The pieces of code of a page."""
    return [code for name, code in BLOCK.findall((DOCS / page).read_text(encoding="utf-8")) if name == language]


def run(page: str) -> dict[str, Any]:
    """The names that the code of a page leaves behind."""
    found: dict[str, Any] = {"__name__": "page"}
    for code in blocks(page):
        exec(compile(code, page, "exec", dont_inherit=True), found)
    return found


@pytest.mark.slow  # Reads every docstring of the reference; `make docs` is the same.
def test_site_builds_without_a_warning_and_names_no_address_to_load(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, cwd=DOCS.parent, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    loaded = re.compile(r'<(?:script|img|link)[^>]*(?:src|rel="stylesheet" href)="?https?:')
    assert [page.name for page in tmp_path.rglob("*.html") if loaded.search(page.read_text(encoding="utf-8"))] == []
    assert "shoal identify" in (tmp_path / "reference" / "commands.html").read_text(encoding="utf-8")


def test_every_file_and_heading_that_the_readme_names_is_there() -> None:
    links = re.findall(r"\]\(([^):#]+)(?:#([^)]+))?\)", (DOCS.parent / "README.md").read_text(encoding="utf-8"))
    assert len(links) > 10
    assert [file for file, _ in links if not (DOCS.parent / file).exists()] == []
    for file, heading in links:
        titles = re.findall(r"^#+ (.+)$", (DOCS.parent / file).read_text(encoding="utf-8"), re.M) if heading else []
        assert not heading or heading in [re.sub(r"\W+", "-", title.lower()) for title in titles], (file, heading)


def test_readme_fits_on_a_page_and_its_commands_run_as_printed() -> None:
    text = (DOCS.parent / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 120
    code = [
        line
        for _, block in re.findall(r"^```(bash)[^\n]*\n(.*?)^```", text, re.M | re.S)
        for line in block.splitlines()
    ]
    commands = [shlex.split(line, comments=True) for line in code]
    assert {words[0] for words in commands} == {"make", "source", "shoal"}
    assert {words[1] for words in commands if words[0] == "shoal"} <= set(
        main.list_commands(main.make_context("shoal", [], resilient_parsing=True))
    )
    # No word to be replaced, and no file that has not been written before.
    assert not any(word.isupper() for words in commands for word in words[1:])


def test_kinds_without_a_second_engine_are_those_that_the_page_names() -> None:
    (named,) = re.findall(r"The kinds (.*) have no second engine", (DOCS / "validation.md").read_text(encoding="utf-8"))
    ours, *others = (set().union(*kinds(name)) for name in ("gauss", *(set(ENGINES) - {"gauss"})))
    assert set(re.findall(r"`([a-z-]+)`", named)) == ours.difference(*others)


def test_the_page_on_judging_names_every_verdict_in_its_order() -> None:
    (table,) = re.findall(
        r"^\| verdict \| when \|\n.*\n((?:\|.*\n)+)", (DOCS / "judge.md").read_text(encoding="utf-8"), re.M
    )
    assert [row.split("|")[1].strip() for row in table.splitlines()] == [verdict.value for verdict in Verdict]


def kinds(engine: str) -> tuple[frozenset[str], ...]:
    """The elements, joints and loads of an engine."""
    can = get_engine(engine).capabilities
    return can.elements, can.joints, can.loads


def test_notebook_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("notebook.md")["estimate"].parameters["angle"].value == pytest.approx(0.3, abs=1e-6)


@pytest.fixture
def tutorial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The page, with its files in the folder in which the test runs, and a library of its own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SHOAL_LIBRARY", str(tmp_path / "library"))
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    text = (DOCS / "tutorial.md").read_text(encoding="utf-8")
    for name, content in re.findall(r"`(\w+\.yaml)`:\n\n```yaml\n(.*?)```", text, re.DOTALL):
        Path(name).write_text(content)
    return text


def test_every_command_of_the_tutorial_runs_and_finds_what_the_page_says(tutorial: str) -> None:
    """In the order of the page, each with what it needs from those before."""
    commands = re.findall(r"^\.venv/bin/shoal (.*)$", tutorial, re.MULTILINE)
    answers = [CliRunner().invoke(main, shlex.split(command)) for command in commands]
    assert [(done.exit_code, done.stderr) for done in answers if done.exit_code] == []
    assert [command.split()[0] for command in commands] == ["identify", "simulate", "simulate", "identify", "library"]
    for table in re.findall(r"^ (theta\d .*)$", tutorial, re.MULTILINE):
        assert table in answers[0].stdout
    assert Path("paper.html").stat().st_size > 10_000
    assert Path("arm.html").stat().st_size > 10_000
    again = json.loads(CliRunner().invoke(main, ["identify", "find", "--json"]).stdout)
    said = re.search(r"finds a friction of (\S+) N m s/rad and an angle of (\S+) rad", tutorial)
    assert said
    for name, value in zip(("friction", "angle"), said.groups(), strict=True):
        assert again["parameters"][name]["value"] == pytest.approx(float(value), abs=1e-6)


def test_the_servers_of_the_tutorial_are_started_as_it_says(tutorial: str) -> None:
    (options,) = re.findall(r'^make up ARGS="(.*)"$', tutorial, re.MULTILINE)
    context = up.main.make_context("up", shlex.split(options))
    assert set(context.params["without"]) <= {name for stage in processes.chosen(()) for name in stage}
    targets = re.findall(r"^([a-z-]+):", (DOCS.parent / "Makefile").read_text(encoding="utf-8"), re.MULTILINE)
    assert set(re.findall(r"^make ([a-z-]+)", tutorial, re.MULTILINE)) == {"setup", "up"} <= set(targets)
    assert f"<http://127.0.0.1:{processes.port('prefect')}>" in tutorial


NEW = re.compile(r"`((?:mechanics|engines|swarm|identification|response)/\S+\.py)`:$", re.MULTILINE)
CHANGED = re.compile(r"^\+\+\+ b/services/shoal/(\S+)$", re.MULTILINE)
FILES = {
    "element": 3,
    "joint": 2,
    "condition": 2,
    "load": 2,
    "integrator": 3,
    "engine": 2,
    "optimiser": 4,
    "surrogate": 5,
}
"""How many files a new kind touches, by its page; the last two have more than one kind."""
HELD = {
    "heun": ["tests/mechanics/test_integrators.py"],
    "cross-entropy": ["tests/swarm/test_contract.py"],
    "pendulum and every_engine and not (counterweight or level or rope or screw)": [
        "tests/engines/test_capabilities.py"
    ],
    "nelder-mead": ["tests/identification/methods/test_methods.py"],
    "joint or load or element or refused or mechanics": ["tests/test_kinds.py", "tests/scene/test_refused.py"],
}
"""Tests that the pages name, by what chooses those of the pages' kinds."""


def copied(folder: Path) -> dict[str, str]:
    """A copy of the package below a folder, and what makes a process take it in place of ours."""
    shutil.copytree(DOCS.parent / "services", folder / "services", ignore=shutil.ignore_patterns("__pycache__"))
    place = {"PYTHONPATH": str(folder / "services"), "SHOAL_HOME": str(folder / "home"), "NUMBA_CACHE_DIR": ""}
    return os.environ | place


def parts(page: str) -> tuple[dict[str, str], str]:
    """The new files of a page, and the code that uses what they add."""
    names, code = NEW.findall((DOCS / page).read_text(encoding="utf-8")), blocks(page)
    return dict(zip(names, code, strict=False)), "\n".join(code[len(names) :])


def extend(page: str, folder: Path) -> str:
    """Write the files of a page below a folder and apply its changes there; the code that uses them."""
    files, use = parts(page)
    for name, text in files.items():
        (folder / "services" / "shoal" / name).write_text(text)
    for change in blocks(page, "diff"):
        subprocess.run(["git", "apply", "-"], cwd=folder, input=change, text=True, check=True)
    return use


def touched(kind: str) -> set[str]:
    """The files of the library that a page adds or changes."""
    page = f"extend/{kind}.md"
    changed = [name for change in blocks(page, "diff") for name in CHANGED.findall(change)]
    return {*NEW.findall((DOCS / page).read_text(encoding="utf-8")), *changed}


@pytest.mark.parametrize("kind", FILES)
def test_a_new_kind_touches_few_files(kind: str) -> None:
    assert len(touched(kind)) <= FILES[kind]


@pytest.mark.parametrize("kind", FILES)
def test_the_changes_of_a_page_apply(kind: str, tmp_path: Path) -> None:
    copied(tmp_path)
    assert extend(f"extend/{kind}.md", tmp_path)


def changed(folder: Path) -> list[str]:
    """The files of a copy, with all changes of all pages, that are not as ours."""
    for kind in FILES:
        extend(f"extend/{kind}.md", folder)
    ours = DOCS.parent / "services"
    files = [file.relative_to(folder) for file in (folder / "services").rglob("*.py")]
    return [
        str(file)
        for file in files
        if not (ours.parent / file).exists() or (ours.parent / file).read_text() != (folder / file).read_text()
    ]


def checked(folder: Path, *command: str) -> None:
    """A tool of this environment finds nothing in a folder that has the project's settings."""
    shutil.copy(DOCS.parent / "pyproject.toml", folder)
    done = subprocess.run([sys.executable, "-m", *command], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_code_of_the_pages_is_written_as_ours(tmp_path: Path) -> None:
    copied(tmp_path)
    files = changed(tmp_path)
    assert {Path(name).relative_to("services/shoal").as_posix() for name in files} == set().union(*map(touched, FILES))
    checked(tmp_path, "ruff", "check", *files)
    checked(tmp_path, "ruff", "format", "--check", *files)


@pytest.mark.slow  # Checks the package that the code imports.
def test_the_code_of_the_pages_has_types(tmp_path: Path) -> None:
    copied(tmp_path)
    checked(tmp_path, "mypy", *changed(tmp_path))


@pytest.mark.slow  # Compiles the copy.
@pytest.mark.parametrize("chosen", HELD)
def test_kinds_of_the_pages_pass_the_tests_of_all_kinds(chosen: str, everything: tuple[Path, dict[str, str]]) -> None:
    """Those that a newcomer would run, on a copy of the package with the changes of all pages."""
    _, environment = everything
    options = ["-q", "-p", "no:cacheprovider", "-k", f"({chosen}) and not lanes and not lane", *HELD[chosen]]
    command = [sys.executable, "-m", "pytest", *options]
    done = subprocess.run(command, env=environment, cwd=DOCS.parent, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-4000:]
    assert re.search(r"\b[1-9]\d* passed", done.stdout)


@pytest.fixture(scope="module")
def everything(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, str]]:
    """A copy of the package with all changes of all pages, and what makes a process take it."""
    folder = tmp_path_factory.mktemp("everything")
    environment = copied(folder)
    changed(folder)
    return folder, environment


def used(page: str, room: str, folder: Path, wanted: str) -> Any:
    """What the code of a page finds with a copy of a room that has its changes and goes before that of the package.

    The rest is the package's own, whose kernels are compiled.
    """
    shutil.copytree(DOCS.parent / "services/shoal" / room, folder / "services/shoal" / room)
    use = extend(page, folder)
    first = f"import json, shoal\nshoal.__path__.insert(0, {str(folder / 'services/shoal')!r})\n"
    program = f"{first}{use}\nprint(json.dumps({wanted}))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.mark.slow
def test_engine_of_its_page_agrees_with_ours(tmp_path: Path) -> None:
    wanted = "[largest, estimated, refusals]"
    largest, estimated, (kind, own) = used("extend/engine.md", "engines", tmp_path, wanted)
    assert max(*largest, estimated) < 1e-8
    assert kind == "joints.S: engine pendulum cannot do slider; use gauss or exudyn or exudyn-ge"
    assert own.endswith("engine pendulum takes one body on one joint, and markers on the body")


@pytest.mark.slow
def test_surrogate_sampler_and_reliability_method_of_their_page_agree_with_ours(tmp_path: Path) -> None:
    program = (
        "[[[of.bounds.lower.tolist(), of.bounds.upper.tolist(), of.bounds.gap, of.why] for of in (spline, auto)], "
        "[[*of.limits[0].interval, of.evaluations, of.limits[0].exceedance.why] for of in (stratified, plain)]]"
    )
    (ours, theirs), chances = used("extend/surrogate.md", "response", tmp_path, program)
    np.testing.assert_allclose(ours[:2], theirs[:2], atol=1e-5)
    assert ours[2] < 1e-2
    assert ours[3].startswith("cubic splines on a grid of 7 points")
    (low, high, runs, why), (least, most, *_) = chances
    assert max(low, least) < min(high, most)
    assert (runs, why) == (256, "1000 runs of a Latin hypercube")


@pytest.mark.slow  # A swarm takes thousands of runs.
def test_a_method_and_a_swarm_are_two_files_each_and_find_the_angles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The files and diffs of the page, applied to a copy of both folders, from which the lists are then read."""
    page, text = "extend/optimiser.md", (DOCS / "extend/optimiser.md").read_text(encoding="utf-8")
    *files, use = blocks(page)
    names, changes = re.findall(r"`([a-z_/]+\.py)`:$", text, re.MULTILINE), blocks(page, "diff")
    assert len(files) == len(names) == len(changes) == 2
    package = tmp_path / "services" / "shoal"
    for folder in (swarm, methods):
        (place,) = folder.__path__
        copied = package / Path(place).relative_to(Path(shoal.__path__[0]))
        shutil.copytree(place, copied, ignore=shutil.ignore_patterns("__pycache__"))
        monkeypatch.setattr(folder, "__path__", [place, str(copied)])
    for name, code, change in zip(names, files, changes, strict=True):
        (package / name).write_text(code)
        assert change.count("+++ ") == 1
        subprocess.run(["git", "apply", "-"], cwd=tmp_path, input=change, text=True, check=True)
    listed = runpy.run_path(str(package / "swarm" / "__init__.py"))["OPTIMIZERS"]
    monkeypatch.setattr(swarm, "OPTIMIZERS", listed)
    listed = runpy.run_path(str(package / "identification" / "methods" / "__init__.py"))["METHODS"]
    for name in set(listed) - set(METHODS):
        monkeypatch.setitem(METHODS, name, listed[name])
    found: dict[str, Any] = {}
    exec(compile(use, page, "exec", dont_inherit=True), found)
    assert set(found["errors"]) == {"nelder-mead", "cross-entropy"}
    assert max(found["errors"].values()) < 1e-5


@pytest.fixture(scope="module")
def extended(everything: tuple[Path, dict[str, str]]) -> dict[str, Any]:
    """What the pages leave behind that change the mechanics: on a copy of the package, with all their changes in it."""
    folder, environment = everything
    uses = [parts(f"extend/{page}.md")[1] for page in ("element", "joint", "condition", "load", "integrator")]
    wanted = (
        "misses",
        "gap",
        "balanced",
        "rises",
        "threads",
        "ways",
        "given_way",
        "side_by_side",
        "raised",
        "met",
        "order",
    )
    names = ", ".join(f"{name}={name}" for name in wanted)
    program = "\n".join([*uses, f"import json\nprint(json.dumps(dict({names}), default=lambda of: of.tolist()))"])
    done = subprocess.run(
        [sys.executable, "-c", program], env=environment, cwd=folder, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return found


@pytest.mark.slow  # Compiles the copy.
def test_pages_of_the_mechanics_do_what_they_say(extended: dict[str, Any]) -> None:
    first, second = extended["misses"]
    assert 3 < first / second < 5, "the rope is of second order"
    assert second < 1e-2
    assert extended["gap"] < 1e-8, "the joint holds what a slider holds"
    assert extended["balanced"]
    assert extended["rises"] == pytest.approx([0.0, 0.01], abs=1e-9)
    falls, quarter = extended["ways"], 0.25 * 9.81 / 2
    assert falls[0] == pytest.approx([0.0], abs=1e-9)
    assert falls[1] == pytest.approx([quarter], abs=1e-9)
    assert falls[2] == pytest.approx([0.0, quarter], abs=1e-9), "two loads act as if each were alone"
    assert extended["side_by_side"] == pytest.approx([0.0, quarter], abs=1e-9)
    assert extended["given_way"] == pytest.approx(1.0, abs=1e-8), "statics knows what the rope holds"
    assert extended["order"] == pytest.approx(2.0, abs=0.1)


@pytest.mark.slow  # Compiles the copy.
def test_a_new_condition_holds_in_motion_statics_modes_reactions_and_load_cells(extended: dict[str, Any]) -> None:
    """A screw and a rack against m + J / p^2: Newton's law by hand."""
    mass, inertia, pitch, gravity, stiffness = 2.0, 0.003, -0.05, 9.81, 400.0
    turning = inertia / pitch**2
    push = mass * gravity * turning / (mass + turning)
    fallen = 0.5 * gravity * mass / (mass + turning)
    rest = mass * gravity / stiffness
    wanted = [fallen, push, -pitch * push, push, rest, np.sqrt(stiffness / (mass + turning))]
    assert len(extended["threads"]) == 2, "in the plane and in space"
    for found in extended["threads"]:
        assert found == pytest.approx(wanted, rel=1e-8)


@pytest.mark.slow  # Compiles the copy.
def test_a_model_is_chosen_under_a_load_of_a_new_kind(extended: dict[str, Any]) -> None:
    """A rigid rod that a rope of constant force lifts, by scipy; it bends by a tenth of the tolerance."""
    pull, inertia = 20.0, 7800.0 * 0.02**2 / 3

    def rate(t: float, state: Any) -> list[float]:
        tip = np.array([np.cos(state[0]), np.sin(state[0])])
        rope = np.array([1.0, 3.0]) - tip
        x, y = pull * rope / np.hypot(*rope)
        return [state[1], (tip[0] * y - tip[1] * x) / inertia]

    angle = scipy.integrate.solve_ivp(rate, (0.0, 0.4), [0.0, 0.0], t_eval=[0.2, 0.4], rtol=1e-10, atol=1e-12).y[0]
    assert extended["met"]
    assert np.array(extended["raised"]) == pytest.approx(np.stack([np.cos(angle), np.sin(angle)], 1), abs=1e-3)
