"""The program `shoal`: its commands, and every error that a user is meant to read as one line with its exit status.

The commands stand in `shoal.commands`. The packages above this one add theirs by the entry points of the group
`shoal.commands`: a name, and where its click command is. Each command calls one plain function; heavy imports wait
until it runs.
"""

from __future__ import annotations

import atexit
import errno
import gc
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import Any

import click

from shoal.commands.analysis import linearize, modes, reactions, statics
from shoal.commands.built_in import problems, scenes
from shoal.commands.forward import compare, simulate, sweep
from shoal.commands.installation import doctor, export, export_fmu, import_scene, serve
from shoal.commands.inverse import design, identify
from shoal.commands.library import library
from shoal.commands.uncertain import uncertain
from shoal.errors import FULL, ComputationError, InputError, ShoalError
from shoal.home import unused_home

NO_NAME = errno.ENAMETOOLONG, errno.ELOOP
"""What is given for a file can be none, wherever one first looks for it."""
RARELY = 500_000, 20, 20
"""Python looks for circles among its objects so seldom: imports make many that all stay, a tenth of a second's look."""
ONE_THREAD = "OPENBLAS_NUM_THREADS", "1"
"""Of numpy's linear algebra, unless the user wants more: several wait for each other at small matrices, and the solver
has threads of its own. Read when numpy is imported."""
EXTRAS = {
    "pipeline": ("prefect", "mlflow"),
    "services": ("fastapi", "starlette", "uvicorn", "pydantic_settings", "orjson"),
    "fmu": ("pythonfmu", "pythonfmu3"),
    "mujoco": ("mujoco",),
}
"""Modules that only an extra of the package brings."""


class Program(click.Group):
    """Its own commands and those that other packages add."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names of all commands, sorted."""
        return sorted({*self.commands, *_added()})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name, imported if another package adds it."""
        if (own := self.commands.get(cmd_name)) is not None:
            return own
        point = _added().get(cmd_name)
        return None if point is None else point.load()

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the program and leave with its exit status."""
        gc.set_threshold(*RARELY)
        # At its end Python would look through all of them once more, for a fifth of a second, before it forgets them.
        atexit.register(gc.freeze)
        os.environ.setdefault(*ONE_THREAD)
        _open_all()
        try:
            try:
                with _extras_named():
                    sys.exit(super().main(*args, **{**kwargs, "standalone_mode": False}))
            finally:
                sys.stdout.flush()  # here, where a full disk can still be told of
        except click.exceptions.NoArgsIsHelpError as error:
            click.echo(error.format_message())
            sys.exit(InputError.exit_status)
        except (ShoalError, click.ClickException) as error:
            message = error.format_message() if isinstance(error, click.ClickException) else str(error)
            if isinstance(error, click.UsageError) and error.ctx is not None:
                message = f"{message.rstrip('.')} (see `{error.ctx.command_path} --help`)"
            click.echo(f"shoal: {message}", err=True)
            sys.exit(getattr(error, "exit_status", InputError.exit_status))
        except click.Abort:
            click.echo("shoal: stopped", err=True)
            sys.exit(130)
        except OSError as error:
            if error.errno in NO_NAME:
                click.echo(f"shoal: {error.filename}: {error.strerror}", err=True)
                sys.exit(InputError.exit_status)
            if error.errno not in FULL:
                raise
            click.echo(f"shoal: cannot write: {error.strerror}", err=True)
            # What is still in the buffer of standard output would fail once more.
            os._exit(ComputationError.exit_status)


def _open_all() -> None:
    """Open streams that a shell has closed (`>&-`) on the null device; else the next file would get their text."""
    for name, mode in {"stdin": "r", "stdout": "w", "stderr": "w"}.items():
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open(mode, encoding="utf-8"))  # noqa: SIM115 - until the end


@cache
def _added() -> dict[str, EntryPoint]:
    """Return the entry points of commands of other packages, by name."""
    return {point.name: point for point in entry_points(group="shoal.commands")}


@contextmanager
def _extras_named() -> Iterator[None]:
    """Name the extra that brings a missing module. Raises InputError."""
    try:
        yield
    except ModuleNotFoundError as error:
        for extra, modules in EXTRAS.items():
            if (error.name or "").split(".")[0] in modules:
                raise InputError(f"{error.name} is not installed; install shoal with its extra '{extra}'") from None
        raise


@click.group(
    cls=Program,
    commands=[
        *(scenes, problems, library),
        *(simulate, sweep, uncertain, compare),
        *(statics, modes, linearize, reactions),
        *(identify, design),
        *(serve, export, export_fmu, import_scene, doctor),
    ],
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(package_name="shoal")
def main() -> None:
    """Simulate and identify rigid-flexible machines, and check the answers against other engines.

    SCENE and PROBLEM are a name (see `shoal scenes`; `shoal library add` makes more) or a YAML file.
    """
    if unused := unused_home():
        click.echo(f"note: {unused}", err=True)
