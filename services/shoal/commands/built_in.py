"""What comes with Shoal: scenes and problems."""

from __future__ import annotations

import click

from shoal.errors import InputError


@click.command()
@click.argument("name", required=False)
def scenes(name: str | None) -> None:
    """List the built-in scenes and problems, or print one as YAML. Where both have the name, the scene."""
    from shoal.identification.problem import problem_names
    from shoal.scene.load import load_scene, scene_library, scene_names, unknown
    from shoal.scene.parametric import parametric
    from shoal.terminal.screen import listing

    if name is None:
        listing("scenes", {n: load_scene(n).description for n in scene_names()})
        _show_problems()
        return
    if (data := parametric(name)) is not None:
        import yaml

        click.echo(yaml.safe_dump(data, sort_keys=False), nl=False)
        return
    if name in scene_names():
        click.echo((scene_library() / f"{name}.yaml").read_text(encoding="utf-8"), nl=False)
        if name in problem_names():
            click.echo(f"shoal: there is a problem of that name too: shoal problems {name}", err=True)
        return
    if name not in problem_names():
        raise InputError(unknown(name, "scene or problem", [*scene_names(), *problem_names()]) + "; see `shoal scenes`")
    _show_problems(name)


@click.command()
@click.argument("name", required=False)
def problems(name: str | None) -> None:
    """List the built-in problems, or print one as YAML."""
    from shoal.identification.problem import problem_names
    from shoal.scene.load import unknown

    if name is not None and name not in problem_names():
        raise InputError(unknown(name, "problem", problem_names()) + "; see `shoal problems`")
    _show_problems(name)


def _show_problems(name: str | None = None) -> None:
    """One as YAML, or the names of all."""
    from shoal.identification.problem import load_problem, problem_library, problem_names
    from shoal.terminal.screen import listing

    if name is None:
        listing("problems", {n: load_problem(n).description for n in problem_names()})
    else:
        click.echo((problem_library() / f"{name}.yaml").read_text(encoding="utf-8"), nl=False)
