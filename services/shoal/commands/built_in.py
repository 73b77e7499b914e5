"""Scenes and problems by name: what comes with Shoal, and what is in one's own library."""

from __future__ import annotations

from collections.abc import Callable
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import click

from shoal.errors import InputError


@click.command()
@click.argument("name", required=False)
def scenes(name: str | None) -> None:
    """List scenes and problems, or print one as YAML. Where both have the name, the scene."""
    from shoal.identification.problem import problem_names
    from shoal.scene.load import load_scene, scene_library, scene_names, unknown
    from shoal.scene.parametric import parametric

    if name is None:
        _list("scenes", scene_names(), load_scene)
        _show_problems()
        return
    if (data := parametric(name)) is not None:
        from shoal.scene.edited import as_yaml

        click.echo(as_yaml(data), nl=False)
        return
    if name in scene_names():
        _print("scenes", name, scene_library())
        if name in problem_names():
            click.echo(f"shoal: there is a problem of that name too: shoal problems {name}", err=True)
        return
    if name not in problem_names():
        raise InputError(unknown(name, "scene or problem", [*scene_names(), *problem_names()]) + "; see `shoal scenes`")
    _show_problems(name)


@click.command()
@click.argument("name", required=False)
def problems(name: str | None) -> None:
    """List the problems, or print one as YAML."""
    from shoal.identification.problem import problem_names
    from shoal.scene.load import unknown

    if name is not None and name not in problem_names():
        raise InputError(unknown(name, "problem", problem_names()) + "; see `shoal problems`")
    _show_problems(name)


def _show_problems(name: str | None = None) -> None:
    """One as YAML, or the names of all."""
    from shoal.identification.problem import load_problem, problem_library, problem_names

    if name is None:
        _list("problems", problem_names(), load_problem)
    else:
        _print("problems", name, problem_library())


def _list(kind: str, names: list[str], load: Callable[[str], Any]) -> None:
    """Names with what their documents say of themselves."""
    from shoal.terminal.screen import listing

    described = {}
    for name in names:
        try:
            described[name] = load(name).description
        except InputError as error:
            described[name] = f"cannot be used: {error}"
    listing(kind, described)


def _print(kind: str, name: str, built_in: Traversable) -> None:
    """The document of a name."""
    from shoal.shelf import located

    file = built_in / f"{name}.yaml"
    text = (file if file.is_file() else Path(located(kind, name))).read_text(encoding="utf-8")
    click.echo(text, nl=False)
