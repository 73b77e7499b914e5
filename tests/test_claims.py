"""Statements of pages about the program: commands, options, files, variables, lists of engines, kinds and limits."""

from __future__ import annotations

import importlib.util
import json
import re
from importlib.metadata import requires
from pathlib import Path
from typing import Any

import pytest
import yaml
from shoal.api.settings import Settings
from shoal.cli import main
from shoal.engines import ENGINES, get_engine
from shoal.errors import ComputationError, InputError
from shoal.identification import METHODS
from shoal.mechanics.integrators import INTEGRATORS, facts
from shoal.scene import JOINT_KINDS, LOAD_KINDS, load_scene
from shoal.scene.bodies import Element
from shoal.scene.dimensions import SPATIAL_KINDS
from shoal.scene.load import scene_names
from shoal.scene.sections import SECTIONS
from shoal_validation.renew import MEASURED, STUDIES, measured_table

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in DOCS.rglob("*.md")}
PAGES["README.md"] = (ROOT / "README.md").read_text(encoding="utf-8")
PARTS = ("services", "flows", "validation", "tests", "docs", "deploy")
SOURCES = [path for part in PARTS for path in (ROOT / part).rglob("*.*") if "__pycache__" not in path.parts]
TEXT = "".join(path.read_text(encoding="utf-8") for path in SOURCES if path.suffix in (".py", ".sh"))
TEXT += "".join((ROOT / name).read_text(encoding="utf-8") for name in ("Procfile", "docker-compose.yml"))
CONTEXT = main.make_context("shoal", [], resilient_parsing=True)
COMMANDS: dict[str, Any] = {name: main.get_command(CONTEXT, name) for name in main.list_commands(CONTEXT)}
GROWING = re.compile(r"docs/extend/")
"""Pages about files that are yet to be written."""


def rows(page: str, head: str) -> list[list[str]]:
    """The cells of the table of a page that begins with this line."""
    (table,) = re.findall(rf"^{re.escape(head)}\n\|[-|: ]+\n((?:\|.*\n?)+)", PAGES[page], re.M)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]


def names(cell: str) -> list[str]:
    """What a cell sets as code."""
    return re.findall(r"`([^`]+)`", cell)


@pytest.mark.parametrize("page", PAGES)
def test_page_is_no_longer_than_250_lines(page: str) -> None:
    assert len(PAGES[page].splitlines()) <= 250


@pytest.mark.parametrize("page", [page for page in PAGES if not GROWING.match(page)])
def test_files_modules_targets_and_variables_of_a_page_are_there(page: str) -> None:
    text = PAGES[page]
    files = {*re.findall(r"`([\w/.-]+\.(?:py|sh))`", text), *re.findall(r"\b(tests/[\w/]+\w(?:\.py)?)", text)}
    known = [path.as_posix() for path in SOURCES]
    assert [
        file for file in files if not (ROOT / file).exists() and not any(k.endswith(f"/{file}") for k in known)
    ] == []
    modules = re.findall(r"python\s+-m\s+(shoal[\w.]+\w)", text)
    assert [name for name in modules if importlib.util.find_spec(name) is None] == []
    targets = re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)
    bash = "".join(re.findall(r"^```bash[^\n]*\n(.*?)^```", text, re.M | re.S))
    made = {*re.findall(r"`make ([a-z-]+)", text), *re.findall(r"^make ([a-z-]+)", bash, re.M)}
    assert made <= set(targets)
    settings = {f"SHOAL_API_{name.upper()}" for name in Settings.model_fields}
    variables = set(re.findall(r"\b(SHOAL_[A-Z_]+)", text)) - settings
    assert [name for name in variables if name not in TEXT] == []


@pytest.mark.parametrize("page", PAGES)
def test_commands_and_options_of_a_page_are_there(page: str) -> None:
    for name, line in re.findall(r"(?:^|`|bin/)shoal ([a-z][a-z-]*)([^`\n|#]*)", PAGES[page], re.M):
        assert name in COMMANDS, f"shoal {name}"
        options = {one for part in COMMANDS[name].params for one in (*part.opts, *part.secondary_opts)} | {"--help"}
        assert set(re.findall(r"(?<![\w\[-])(--[a-z][a-z-]*)", line)) <= options, f"shoal {name}{line}"
    for module, line in re.findall(r"python -m (shoal_[\w.]+\w)([^`\n|#]*)", PAGES[page]):
        found = importlib.util.find_spec(module)
        assert found
        place = Path(str(found.origin))
        text = "".join(
            path.read_text() for path in ((place.parent).glob("*.py") if place.stem == "__init__" else [place])
        )
        assert [one for one in re.findall(r"(--[a-z][a-z-]*)", line) if f'"{one}"' not in text] == []


def test_engines_are_those_of_the_table_with_their_rods_and_loops() -> None:
    page = "docs/reference/engines.md"
    table = rows(page, "| engine | what runs the scene | flexible rods | loops |")
    assert [names(row[0]) for row in table] == [[name] for name in ENGINES]
    everything = get_engine("gauss").capabilities.elements - {"rigid"}
    for name, _, rods, loops in table:
        can = get_engine(*names(name)).capabilities
        assert can.elements & everything == (everything if rods == "all" else set(names(rods))), name
        assert ("closed loops" in can.features) == (loops == "yes"), name


def test_methods_are_those_of_the_table() -> None:
    table = rows("docs/reference/engines.md", "| method | what it does |")
    assert sorted(name for row in table for name in names(row[0])) == sorted(METHODS)


def test_integrators_are_those_of_the_table_with_their_orders() -> None:
    table = rows("docs/integration.md", "| integrator | order | for |")
    said = {name: order for name, order, _ in table}
    kind = {name: "" if facts(name).explicit else ", implicit" for name in INTEGRATORS}
    kind |= {name: ", adaptive" for name in INTEGRATORS if facts(name).adaptive}
    assert said == {name: f"{facts(name).order}{kind[name]}" for name in INTEGRATORS}
    friction = re.search(r"It needs the integrators (.*?)\. A redundant", PAGES["docs/scenes.md"], re.S)
    assert friction
    assert set(names(friction[1])) == {name for name in INTEGRATORS if facts(name).constraint_forces}


def test_kinds_of_joints_loads_elements_and_sections_are_those_of_the_tables() -> None:
    page = "docs/scenes.md"
    joints = {name for row in rows(page, "| kind | constraint |") for name in names(row[0])}
    assert joints == set(JOINT_KINDS) - set(SPATIAL_KINDS)
    spatial = {name for row in rows("docs/space.md", "| kind | in space |") for name in names(row[0])}
    assert set(SPATIAL_KINDS) <= spatial
    assert {name for row in rows(page, "| kind | load |") for name in names(row[0])} == set(LOAD_KINDS)
    elements = rows(page, "| `element` | rod | where |")
    assert {name for row in elements for name in names(row[0])} == set(Element.__args__)
    sections = rows(page, "| `section` | stated by | area, second moments, torsion constant |")
    assert {name for row in sections for name in names(row[0])} == set(SECTIONS)


def test_limits_of_a_service_are_its_defaults() -> None:
    table = rows("docs/service-operation.md", "| variable | default | |")
    said = {}
    for variables, values, _ in table:
        numbers = values.split(", ")
        said |= dict(zip(names(variables), numbers, strict=True))
    assert said.pop("SHOAL_ALLOWED_HOSTS") == said.pop("SHOAL_API_KEYS_FILE") == "none"
    assert said.pop("SHOAL_API_LIBRARY") == "that of `SHOAL_LIBRARY`"
    fields = Settings.model_fields
    assert set(said) == {f"SHOAL_API_{name.upper()}" for name in fields} - {"SHOAL_API_LIBRARY", "SHOAL_API_KEYS_FILE"}
    for name, value in said.items():
        default = fields[name.removeprefix("SHOAL_API_").lower()].default
        assert value == (default if isinstance(default, str) else f"{default:.0f}"), name


def test_exit_statuses_are_those_of_the_table() -> None:
    said = {int(row[0]) for row in rows("docs/terminal.md", "| exit status | |")}
    assert said == {0, InputError.exit_status, ComputationError.exit_status, 130}


def test_deployments_are_those_of_the_table() -> None:
    stated = yaml.safe_load((ROOT / "prefect.yaml").read_text())["deployments"]
    table = rows("docs/operations.md", "| deployment | flow | what it does |")
    flows = {one["name"]: one["entrypoint"].rpartition(":")[2] for one in stated}
    assert {names(row[0])[0]: names(row[1])[0] for row in table} == {
        f"{flow}/{name}": flow for name, flow in flows.items()
    }


def test_extras_that_pages_name_are_there() -> None:
    extras = {found[1] for one in requires("shoal") or () if (found := re.search(r"extra == ['\"](\w+)['\"]", one))}
    said = {name for text in PAGES.values() for name in re.findall(r"extras? `(\w+)`", text)}
    assert said <= extras


def test_a_name_that_is_unknown_is_refused_with_similar_names_and_the_list_of_all() -> None:
    with pytest.raises(InputError, match="did you mean single-pendulum or") as refused:
        load_scene("single-pendulm")
    assert all(name in str(refused.value) for name in scene_names())


@pytest.mark.parametrize("name", STUDIES)
def test_study_is_recorded_and_shown_where_its_results_stand(name: str) -> None:
    study = STUDIES[name]
    module, *_ = study.arguments[1:]
    assert importlib.util.find_spec(module)
    assert set(json.loads((ROOT / MEASURED).read_text())) == set(STUDIES)
    for page in study.pages:
        text = PAGES[f"docs/{page}"]
        assert "<!-- measured -->" in text or page == "accuracy-figures.md"
        assert f"`python -m {module}" in measured_table(page, ROOT / MEASURED)
    if study.section:
        assert f"<!-- begin {study.section} -->" in PAGES[f"docs/{study.pages[0]}"]


def test_every_generated_part_has_a_study() -> None:
    for page, text in PAGES.items():
        if parts := re.findall(r"<!-- begin (\S+) -->", text):
            assert any(f"docs/{of}" == page for study in STUDIES.values() for of in study.pages), (page, parts)


def test_files_of_the_map_for_newcomers_are_there() -> None:
    (tree,) = re.findall(r"```text\n(.*?)```", PAGES["docs/extend/index.md"], re.S)
    known = [path.as_posix() for path in SOURCES]
    files = re.findall(r"[\w/]+\.py\b", tree)
    assert len(files) > 20
    assert [file for file in files if not any(place.endswith(f"/{file}") for place in known)] == []
