"""Options that several commands share, and how they are read. Raises click's errors, or InputError."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

from shoal.errors import InputError, check_trusted

NEEDED = {".parquet": "pyarrow", ".nc": "xarray"}
"""Packages that a form of files asks for."""
Out = Path | None
"""Where the result is written, if it is."""


def key_value(context: click.Context, parameter: click.Parameter, pairs: tuple[str, ...]) -> dict[str, str]:
    """Return K=V pairs as a mapping."""
    from shoal.requests import texts

    try:
        return texts.pairs(str(parameter.metavar))(pairs)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


def note(text: str) -> None:
    """Print a note on standard error."""
    click.echo(f"shoal: note: {text}", err=True)


def finish(
    answer: Any,
    as_json: bool,
    out: Out,
    write: Callable[[Any, Path], None],
    table: Callable[[Any], None],
    reason: str | None = None,
) -> None:
    """Write an answer where it was asked for, print it as JSON or as a table, and end by whether it can be trusted.

    reason: why it cannot be, else its message. Raises ComputationError.
    """
    from shoal.terminal import screen

    if out is not None:
        write(answer, out)
    screen.show(answer.to_json(), as_json, lambda: table(answer))
    check_trusted(answer.ok, answer.message if reason is None else reason)


class EngineName(click.ParamType):  # type: ignore[type-arg]  # click 8.1 has none
    """The name of an engine; engines are imported on demand."""

    name = "engine"

    def get_metavar(self, param: click.Parameter, ctx: click.Context) -> str | None:
        """The names, as usage shows them."""
        return self._choice().get_metavar(param, ctx)

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """The name, if there is such an engine."""
        return self._choice().convert(value, param, ctx)

    def _choice(self) -> click.Choice[str]:
        from shoal.engines import ENGINES

        return click.Choice(list(ENGINES))


as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")


def emphasis(command: Callable[..., Any]) -> Callable[..., Any]:
    """--magnify and --stress of pictures of rods that bend."""
    magnify = "In pictures: magnify the deflection of rods about their undeformed shape."
    stress = "In pictures: colour rods that bend by their largest normal stress (bending and normal force)."
    command = click.option("--stress", is_flag=True, help=stress)(command)
    return click.option("--magnify", type=float, metavar="FACTOR", help=magnify)(command)


def emphasised(scene: Any, out: Out, magnify: float | None, stress: bool) -> dict[str, Any]:
    """Return what the options of `emphasis` ask of a picture of a scene. Raises InputError."""
    if magnify is None and not stress:
        return {}
    from shoal.pictures.emphasis import Emphasis
    from shoal.pictures.files import DRAWN

    asked: dict[str, Any] = {"magnify": 1.0 if magnify is None else magnify, "stress": stress}
    if out is None or out.suffix not in DRAWN:
        raise InputError(
            f"{'stress' if magnify is None else 'magnify'}: is of pictures; add --out with {', '.join(DRAWN)}"
        )
    Emphasis(**asked).check(scene)
    return asked


def out(*endings: str, default: str | None = None, otherwise: str = "") -> Callable[[Any], Any]:
    """--out FILE, refused before anything is computed where it could not be written.

    endings: the forms there are; otherwise: what happens without the option
    """

    def checked(context: click.Context, parameter: click.Parameter, path: Out) -> Out:
        if path is None:
            return None
        if path.suffix not in endings:
            raise InputError(f"out: {path} ends in {path.suffix or 'nothing'}; use one of {', '.join(endings)}")
        if not path.absolute().parent.is_dir():
            raise InputError(f"out: the folder {path.absolute().parent} does not exist")
        try:
            path.stat()
        except FileNotFoundError:
            pass
        except OSError as error:
            raise InputError(f"out: {path} cannot be written: {error.strerror}") from None
        if path.suffix in NEEDED and find_spec(NEEDED[path.suffix]) is None:
            raise InputError(f"out: {path} needs the package {NEEDED[path.suffix]}; install it, or write another form")
        return path

    *others, last = endings
    listed = f"{', '.join(others)} or {last}" if others else last
    return click.option(
        "--out",
        type=click.Path(path_type=Path, dir_okay=False),
        default=default,
        show_default=default is not None,
        callback=checked,
        help=f"Write {listed}{otherwise}.",
    )
