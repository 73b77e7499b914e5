"""Commands whose arguments and options are the fields of their requests."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from shoal.errors import InputError

if TYPE_CHECKING:
    from shoal.requests.request import Field


def _engines() -> str:
    from shoal.engines import ENGINES

    return f"{', '.join(ENGINES)}, or the address of a service (see `shoal serve`)"


def _methods() -> str:
    from shoal.identification.methods import METHODS

    return ", ".join(METHODS)


def _responses() -> str:
    from shoal.response.methods import methods

    return ", ".join(methods())


def _probabilities() -> str:
    from shoal.response.limits.choice import WAYS

    return ", ".join(WAYS)


_NAMES: Mapping[str, Callable[[], str]] = {
    "engines": _engines,
    "methods": _methods,
    "responses": _responses,
    "probabilities": _probabilities,
}
"""Names that an option takes, by their kind; imported for the help only."""


_STATED = "shoal.stated"
"""Where the context of a command keeps what a file states."""


def _is_subject(name: str) -> bool:
    return name in ("scene", "problem")


def spelled(name: str) -> str:
    """Return the name of a field as the command line writes it."""
    return name.upper() if _is_subject(name) else f"--{name.replace('_', '-')}"


class FieldOption(click.Option):
    """The option of a field. Its value is read by the request, which also has its default."""

    def __init__(self, field: Field) -> None:
        self.field = field
        name = spelled(field.name)
        written: dict[str, Any] = {"multiple": True, "metavar": field.option.metavar or _metavar(field)}
        if field.flag:
            name = f"{name}/--no-{name[2:]}" if field.default else name
            written = {"is_flag": True}
        elif field.option.bare:
            written |= {"is_flag": False, "flag_value": field.option.bare}
        super().__init__([name, field.name], **written)

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the option and its help."""
        option, default = self.field.option, self.field.default
        names = f" One of {_NAMES[option.names]()}." if option.names else ""
        if self.field.flag:
            default = spelled(f"{'' if default else 'no_'}{self.field.name}")[2:] if default else None
        more = ["required"] if self.field.required else []
        more += [f"default: {default}"] if default not in (None, "", [], ()) else []
        more += [str(self.field.limit)] if self.field.limit else []
        more += ["repeatable"] if option.many else []
        self.help = f"{option.help}{names}" + (f"  [{'; '.join(more)}]" if more else "")
        return super().get_help_record(ctx)


def _metavar(field: Field) -> str:
    if field.choices:
        return f"[{'|'.join(field.choices)}]"
    return "TEXT" if field.limit is None else "N" if field.limit.whole else "X"


class Command(click.Command):
    """A command that asks for a request, whose options are made when they are looked at.

    asks: name of the request; stated: returns the fields that a file in place of SCENE states
    """

    asks = ""
    _all: list[click.Parameter]
    _merged: bool
    stated: Callable[[str], dict[str, Any]] | None = None

    @cached_property
    def _fields(self) -> list[click.Parameter]:
        from shoal.requests import request_of
        from shoal.requests.request import offered

        return [
            FieldOption(one)
            if not _is_subject(one.name)
            else click.Argument([one.name], is_eager=True, callback=self._read)
            for one in offered(request_of(self.asks), "command").values()
        ]

    @property
    def params(self) -> list[click.Parameter]:
        """Fields, and what the command line has for itself."""
        if not self._merged:
            self._all, self._merged = [*self._fields, *self._all], True
        return self._all

    @params.setter
    def params(self, own: list[click.Parameter]) -> None:
        self._all, self._merged = own, False

    def _read(self, context: click.Context, parameter: click.Parameter, given: str) -> str:
        if self.stated is not None:
            context.meta[_STATED] = found = self.stated(given)
            own = found.keys() & {one.name for one in self.params if not isinstance(one, FieldOption)} - {"scene"}
            context.default_map = {name: str(found.pop(name)) for name in own}
        return given


def command(
    asks: str, stated: Callable[[str], dict[str, Any]] | None = None, *, name: str = ""
) -> Callable[[Any], Command]:
    """Make the command of a request, which its function is called with, before what the command line has for itself.

    stated: returns the fields that a file in place of SCENE states, before which come those on the command line; name:
    of the command, where it is not that of the request
    """

    def made(function: Callable[..., None]) -> Command:
        @wraps(function)
        @click.pass_context
        def asked(context: click.Context, /, **given: Any) -> None:
            from shoal.requests import request_of
            from shoal.requests.request import offered, read

            kind = request_of(asks)
            fields = {name: given.pop(name) for name in offered(kind, "command")}
            function(read(kind, _given(context, fields), named=spelled, text=True), **given)

        made: Command = click.command(name or asks, cls=Command)(asked)
        made.asks, made.stated = asks, stated
        return made

    return made


def _given(context: click.Context, fields: Mapping[str, Any]) -> dict[str, Any]:
    """Return the fields that stand on the command line, or in a file. Raises InputError for one that stands twice."""
    found = {}
    for one in context.command.params:
        if one.name not in fields or context.get_parameter_source(one.name) is not ParameterSource.COMMANDLINE:
            continue
        value = found[one.name] = fields[one.name]
        if isinstance(one, FieldOption) and one.multiple and not one.field.option.many:
            if len(value) > 1:
                raise InputError(f"{spelled(one.name)}: is given {len(value)} times; once is right")
            found[one.name] = value[0]
    stated: Mapping[str, Any] = context.meta.get(_STATED, {})
    return {**found, **{name: value for name, value in stated.items() if name == "scene" or name not in found}}
