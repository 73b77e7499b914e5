"""One statement of an option, and every way of asking has it: same name, same default, same limits."""

from __future__ import annotations

import doctest
import inspect
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import KW_ONLY
from inspect import signature
from typing import Annotated, Any

import click
import pytest
import shoal
from pydantic import TypeAdapter
from pydantic.dataclasses import dataclass
from shoal.api.operations import OPERATIONS
from shoal.arguments import Limit
from shoal.cli import main
from shoal.commands.command import FieldOption, command, spelled
from shoal.errors import InputError
from shoal.requests import NAMES, request_of
from shoal.requests.fields import OfScene, Seed
from shoal.requests.function import function
from shoal.requests.option import Option
from shoal.requests.request import STRICT, Field, fields, offered, read

COMMANDS = {name: {"fmu": "export-fmu"}.get(name, name) for name in NAMES if name != "select"}
FUNCTIONS = [name for name in NAMES if name != "fmu"]
OWN = {"uncertain": {"runs"}}
"""Fields whose default a service states itself, as it computes for many."""


def limits(schema: Any) -> dict[str, float]:
    """Return the limits of a number in a JSON schema."""
    names = {"exclusiveMinimum": "gt", "minimum": "ge", "exclusiveMaximum": "lt", "maximum": "le"}
    found = next((one for one in schema.get("anyOf", [schema]) if names.keys() & one.keys()), {})
    return {names[key]: bound for key, bound in found.items() if key in names}


def limited(shown: dict[str, Field]) -> Iterator[tuple[str, Limit]]:
    yield from ((name, one.limit) for name, one in shown.items() if one.limit is not None)


@pytest.mark.parametrize("name", NAMES)
def test_every_field_is_documented_and_has_one_name(name: str) -> None:
    for field, one in fields(request_of(name)).items():
        assert one.option.help[0].isupper(), field
        assert one.option.help.endswith((".", ")")), field
        assert one.option.old != field


@pytest.mark.parametrize("name", FUNCTIONS)
def test_the_function_takes_the_fields(name: str) -> None:
    """With their defaults; `help` shows each with its type and meaning, what is returned, and an example."""
    found, shown = getattr(shoal, name), offered(request_of(name), "python")
    assert list(signature(found).parameters) == list(shown)
    for field, parameter in signature(found).parameters.items():
        stated = inspect.Parameter.empty if shown[field].required else shown[field].default
        assert parameter.default == stated
        assert parameter.annotation is not inspect.Parameter.empty
        assert f"    {field}: {shown[field].option.help}" in found.__doc__


@pytest.mark.parametrize("name", COMMANDS)
def test_the_command_has_the_fields_as_options(name: str) -> None:
    context = click.Context(main)
    found = main.get_command(context, COMMANDS[name])
    assert found is not None
    shown = offered(request_of(name), "command")
    made = {one.name: one for one in found.params if isinstance(one, FieldOption | click.Argument)}
    assert set(shown) <= set(made)
    for field in shown:
        if isinstance(made[field], FieldOption):
            assert made[field].opts == [spelled(field)]


@pytest.mark.parametrize("name", OPERATIONS)
def test_the_body_has_the_fields(name: str) -> None:
    """A service takes no number that the library refuses, and may take fewer."""
    shown, body = offered(request_of(name), "http"), OPERATIONS[name]
    assert set(body.model_fields) - {"objects", "lanes"} == set(shown)
    for field, one in shown.items():
        nothing = (None, {}, [], (), "")
        default = body.model_fields[field].get_default()
        if not one.required and field not in OWN.get(name, ()):
            assert default == one.default or (default in nothing and one.default in nothing), field
    for field, limit in limited(shown):
        stated = limits(body.model_json_schema()["properties"][field])
        most = stated.pop("le", None)
        bounds = dict(limit.bounds)
        assert most is None or most <= bounds.get("le", most)
        bounds.pop("le", None)
        assert stated == bounds, field


def test_the_schema_of_a_request_states_its_limits() -> None:
    found = 0
    for name in NAMES:
        for _, limit in limited(fields(request_of(name))):
            assert limits(TypeAdapter(Annotated[float, limit]).json_schema()) == limit.bounds
            found += 1
    assert found >= 20


FREE = [name for name in shoal.__all__ if inspect.isfunction(getattr(shoal, name)) and name not in ("plot", "identify")]


@pytest.mark.parametrize("name", FREE)
def test_every_function_says_what_it_returns_by_an_example_that_runs(name: str) -> None:
    text = getattr(shoal, name).__doc__
    assert "Returns:" in text
    example = doctest.DocTestParser().get_doctest(text, {"shoal": shoal}, name, None, 0)
    assert example.examples
    if name != "select":  # which takes seconds
        assert doctest.DocTestRunner().run(example).failed == 0


def test_a_new_option_is_one_line() -> None:
    """A field with its type, default and meaning is an argument and an option, refused by its name."""

    @dataclass(frozen=True, config=STRICT)
    class Wait(OfScene):
        """Wait."""

        _: KW_ONLY
        pause: Annotated[float, Limit("a time", "s", ge=0), Option("Wait so long [s].", "SECONDS")] = 1.0
        seed: Seed = 0

    @function(Wait)
    def wait(asked: Wait) -> tuple[float, int]:
        """Wait."""
        return asked.pause, asked.seed

    assert wait("single-pendulum", pause=2) == (2.0, 0)
    with pytest.raises(InputError, match=r"^pause: needs a time of at least 0 s, found -1$"):
        wait("single-pendulum", pause=-1)
    stated = read(Wait, {"scene": "x", "pause": "0.5", "seed": "3"}, text=True)
    assert (stated.pause, stated.seed) == (0.5, 3)
    with pytest.raises(InputError, match=r"^--pause: needs a time of at least 0 s, found 'soon'$"):
        read(Wait, {"scene": "x", "pause": "soon"}, named=spelled, text=True)
    with pytest.raises(InputError, match="puase: no such field; did you mean pause"):
        read(Wait, {"scene": "x", "puase": 1})


def test_old_names_work_for_a_release_and_say_so() -> None:
    start = {"initial.OA.angle": 0.3}
    with pytest.warns(FutureWarning, match="simulate: times is called at now"):
        found = shoal.simulate("single-pendulum", times=[0.1], set=start, verify=False)  # type: ignore[call-arg]
    with pytest.warns(FutureWarning, match="simulate: values is called set now"):
        again = shoal.simulate("single-pendulum", [0.1], values=start, verify=False)
    assert found.points.tobytes() == again.points.tobytes()
    with pytest.raises(InputError, match="times: is called at now, which is given too; state at alone"):
        shoal.simulate("single-pendulum", at=[0.1], times=[0.2])  # type: ignore[call-arg]
    asked = OPERATIONS["sweep"].model_validate({"scene": "x", "vary": {"a": [1.0]}, "time": 0.5, "values": {"b": 1}})
    assert asked.arguments()["at"] == 0.5
    assert [one.partition(" now")[0] for one in asked.notes] == ["time is called at", "values is called set"]


def test_the_program_lists_its_commands_without_the_requests() -> None:
    """Pydantic alone takes half as long as the list of commands may."""
    program = (
        "import sys; from shoal.cli import main\n"
        "try: main(['--help'])\n"
        "except SystemExit: pass\n"
        "print([name for name in ('pydantic', 'numpy', 'shoal.requests.request') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-1] == "[]", done.stderr


def test_a_command_without_a_function_of_its_own_is_made_alike() -> None:
    @command("simulate")
    def run(asked: Any) -> None:
        """Run."""

    assert isinstance(run, click.Command)
    assert "--patience" in run.get_help(click.Context(run))
