"""Options that several commands share, and how they are read. Raises click's errors, or InputError."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib.util import find_spec
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from shoal.arguments import LIMITS
from shoal.errors import InputError

if TYPE_CHECKING:
    from shoal.identification.carried import Carried

Values = dict[str, Any]
"""Fields of a scene by path."""
Times = list[float] | None
"""Instants [s], else the scene's own."""
NEEDED = {".parquet": "pyarrow", ".nc": "xarray"}
"""Packages that a form of files asks for."""
Out = Path | None
"""Where the result is written, if it is."""
_VALUES = "shoal.values"
"""Where a command's context keeps what an estimate's file carries."""
_SET = "shoal.set"
"""Where it keeps what --set states."""


def key_value(context: click.Context, parameter: click.Parameter, pairs: tuple[str, ...]) -> dict[str, str]:
    """Pairs such as PATH=VALUE as a mapping; of a path that stands twice no value is lost in silence."""
    found: dict[str, str] = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not (key and equals and value):
            reason = "; there is nothing after the =" if key and equals else ""
            raise click.BadParameter(f"{pair!r} is not {parameter.metavar}{reason}")
        if (key := key.strip()) in found:
            raise click.BadParameter(f"{key} is given twice, as {found[key]} and as {value.strip()}")
        found[key] = value.strip()
    return found


def field_values(context: click.Context, parameter: click.Parameter, pairs: tuple[str, ...]) -> dict[str, Any]:
    """PATH=VALUE pairs; a value in brackets or braces is a list or a mapping as YAML writes it, `null` is nothing."""
    return {path: _structured(path, text) for path, text in key_value(context, parameter, pairs).items()}


def _start(text: str) -> Any:
    """A way to start, or what the file of a run says of its end."""
    from shoal.scene.ended import read_end

    return text if text == "statics" else read_end(Path(text))


def _structured(path: str, text: str) -> Any:
    if text == "null":
        return None
    if text[0] not in "[{":
        return _start(text) if path in ("initial.from", "initial_from") else text
    from shoal.scene.load import read_yaml

    try:
        return read_yaml(text, path)
    except InputError:
        raise click.BadParameter(
            f"{path}: {text!r} is neither a list such as [0, -9.81] nor a mapping such as {{angle: 0.6}}"
        ) from None


def axes(context: click.Context, parameter: click.Parameter, pairs: tuple[str, ...]) -> dict[str, Any]:
    """PATH=LOW:HIGH:COUNT pairs as values by path."""
    return {path: _axis(path, text) for path, text in key_value(context, parameter, pairs).items()}


def speeds(context: click.Context, parameter: click.Parameter, given: tuple[str, ...]) -> list[float] | None:
    """LOW:HIGH:COUNT, or V,V,..., as speeds in rad/s."""
    text: str | None = once(context, parameter, given)
    if text is None:
        return None
    low, *others = text.split(":")
    try:
        if len(others) == 2 and 1 <= int(others[1]) <= 1000:
            first, step = float(low), (float(others[0]) - float(low)) / max(int(others[1]) - 1, 1)
            found = [first + k * step for k in range(int(others[1]))]
        else:
            found = [] if others else [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if not found or not all(0.0 <= speed < math.inf for speed in found):
        raise click.BadParameter(f"{text!r} is not LOW:HIGH:COUNT nor a list of speeds in rad/s, such as 0:300:31")
    return found


def _axis(path: str, text: str) -> Any:
    import numpy as np

    try:
        low, high, count = text.split(":")
        first, last, number = float(low), float(high), int(count)
    except ValueError:
        raise InputError(f"vary: {path}={text} is not PATH=LOW:HIGH:COUNT, such as initial.OA.angle=0:1.5:31") from None
    if not (1 <= number <= 1_000_000) or not np.isfinite([first, last]).all():
        raise InputError(f"vary: {path}={text}: COUNT is between 1 and 1000000, LOW and HIGH are finite")
    if number == 1 and first != last:
        raise InputError(f"vary: {path}={text}: one value is not at both ends; COUNT is 2 or more, or HIGH is LOW")
    return np.linspace(first, last, number)


def recordings(
    context: click.Context, parameter: click.Parameter, given: tuple[str, ...]
) -> str | dict[str, str] | None:
    """FILE, or NAME=FILE once or more."""
    if len(given) == 1 and ("=" not in given[0] or Path(given[0]).exists()):
        return given[0]
    if bare := [one for one in given if "=" not in one]:
        raise click.BadParameter(f"{bare[0]!r} is not NAME=FILE, as several recordings need it")
    return key_value(context, parameter, given) or None


def sizes(context: click.Context, parameter: click.Parameter, given: tuple[str, ...]) -> dict[str, float] | None:
    """NAME=NUMBER, once or more."""
    found = key_value(context, parameter, given)
    try:
        return {name: float(size) for name, size in found.items()} or None
    except ValueError:
        raise click.BadParameter(f"{', '.join(given)} is not NAME=NUMBER") from None


def windows(
    context: click.Context, parameter: click.Parameter, given: tuple[str, ...]
) -> list[tuple[float, float]] | dict[str, list[tuple[float, float]]] | None:
    """[NAME=]FROM:TO, once or more."""
    found: dict[str, list[tuple[float, float]]] = {}
    for one in given:
        name, _, span = one.rpartition("=")
        try:
            begin, end = map(float, span.split(":"))
        except ValueError:
            raise click.BadParameter(f"{one!r} is not FROM:TO in s, such as 1.5:2, nor NAME=FROM:TO") from None
        found.setdefault(name, []).append((begin, end))
    if "" in found and len(found) > 1:
        raise click.BadParameter("NAME=FROM:TO is needed for all of several recordings")
    return found.get("", found or None)


def limited(name: str) -> click.IntRange | click.FloatRange:
    """The type of an option that is an argument of `LIMITS`; that a number is finite is seen by what computes."""
    limit = LIMITS[name]
    open_ = {"min_open": limit.gt is not None, "max_open": limit.lt is not None}
    ends: Any = (limit.ge if limit.gt is None else limit.gt), (limit.le if limit.lt is None else limit.lt)
    return click.IntRange(*ends, **open_) if limit.whole else click.FloatRange(*ends, **open_)


class Once(click.Option):
    """An option that is refused twice, by its callback; of others click takes the last in silence."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **{**kwargs, "multiple": True})


def once(context: click.Context, parameter: click.Parameter, given: tuple[Any, ...]) -> Any:
    """The value of an option of the class `Once`."""
    if len(given) > 1:
        raise click.BadParameter(f"is given {len(given)} times; once is right")
    return given[0] if given else None


def times_list(context: click.Context, parameter: click.Parameter, given: tuple[str, ...]) -> Times:
    """T,T,... as numbers that increase from 0 on."""
    if len(given) > 1:
        raise click.BadParameter(f"is given {len(given)} times; write the times in one list, such as 0.1,0.2,0.5")
    if not given:
        return None
    text = given[0]
    try:
        times = [float(part) for part in text.split(",")]
    except ValueError:
        times = []
    # Not a number is at no place of an order.
    if not times or not times[0] >= 0.0 or not all(a < b for a, b in pairwise([*times, math.inf])):
        right = "a list of finite times in s that increase from 0 on, such as 0.1,0.2,0.5"
        raise click.BadParameter(f"{text!r} is not {right}")
    return times


def _carried(context: click.Context, parameter: click.Parameter, path: Path | None) -> Carried | None:
    """Return the estimate of a file that is carried over."""
    if path is None:
        return None
    from shoal.identification.carried import read_values

    return read_values(path)


def _remember(context: click.Context, parameter: click.Parameter, path: Path | None) -> None:
    if (found := _carried(context, parameter, path)) is None:
        return
    for note in found.notes():
        click.echo(f"shoal: note: {note}", err=True)
    context.meta[_VALUES] = found


def _with_carried(context: click.Context, parameter: click.Parameter, pairs: tuple[str, ...]) -> dict[str, Any]:
    found: Carried | None = context.meta.get(_VALUES)
    context.meta[_SET] = stated = field_values(context, parameter, pairs)
    return {**({} if found is None else found.values), **stated}


def set_values() -> Values:
    """Return the values of --set of the running command, without those of an estimate's file."""
    return dict(click.get_current_context().meta.get(_SET, {}))


class LateHelp(click.Option):
    """An option whose help, with its imports, is made on demand."""

    def __init__(self, *args: Any, told: Callable[[], str], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.told = told

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """The option and its help."""
        self.help = self.told()
        return super().get_help_record(ctx)


def _methods() -> str:
    from shoal.identification.methods import METHODS

    return f"One of {', '.join(METHODS)}; the problem's by default."


def _engines() -> str:
    from shoal.engines import ENGINES

    return f"{', '.join(ENGINES)}, or the address of a service (see `shoal serve`)."


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


_set: dict[str, Any] = {
    "multiple": True,
    "metavar": "PATH=VALUE",
    "help": "Set any field of the scene, such as bodies.OA.elements=16, solver.step=1e-5 (repeatable).",
}
_values: dict[str, Any] = {
    "type": click.Path(path_type=Path, dir_okay=False),
    "metavar": "FILE",
    "help": "Values that `shoal identify --out FILE.json` found; --set goes before them.",
}
set_only = click.option("--set", "values", callback=field_values, **_set)
"""Fields of a problem's scene; see `fitted`."""
fitted = click.option("--values", "fitted", callback=_carried, **_values)
"""What a problem starts from, or takes as known."""


def values(command: Any) -> Any:
    """--set and --values of a scene, together the fields to set."""
    # Eager, so that it is known when --set is read.
    command = click.option("--values", "fitted", callback=_remember, is_eager=True, expose_value=False, **_values)(
        command
    )
    return click.option("--set", "values", callback=_with_carried, **_set)(command)


at = click.option(
    "--at",
    "times",
    cls=Once,
    metavar="T,T,...",
    callback=times_list,
    help="Sample at these times [s]; else as the scene says.",
)
verify = click.option("--verify/--no-verify", default=True, show_default=True, help="Estimate errors by more runs.")
as_json = click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")
engine = click.option("--engine", cls=LateHelp, told=_engines, default="gauss", show_default=True)
method = click.option("--method", cls=LateHelp, told=_methods, metavar="NAME")


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
