"""What the site generates from the program itself: commands, findings, fields of scenes."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from html import unescape
from types import ModuleType
from typing import Any, Literal, get_args, get_origin

import click
from latex2mathml.converter import convert
from pydantic import BaseModel
from pydantic.fields import FieldInfo


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Put what is generated where a page has the mark for it."""
    from shoal_validation.renew import measured_table

    marks = {
        "<!-- commands -->": commands,
        "<!-- findings -->": findings,
        "<!-- gallery -->": gallery,
        "<!-- scene fields -->": scene_fields,
        "<!-- measured -->": lambda: measured_table(page.file.src_uri),
    }
    for mark, generate in marks.items():
        markdown = markdown.replace(mark, generate()) if mark in markdown else markdown
    return markdown


def on_page_content(html: str, **_: Any) -> str:
    """Set formulas as MathML, which browsers draw without a script or a font from elsewhere."""

    def formula(found: re.Match[str]) -> str:
        display = "block" if found["tag"] == "div" else "inline"
        return str(convert(unescape(found["tex"]), display=display))

    return re.sub(
        r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<tex>.*?)\\[)\]]</(?P=tag)>', formula, html, flags=re.DOTALL
    )


def findings() -> str:
    """Return the tables of all kinds of findings, one for each analysis."""
    from shoal.identification import findings as identification
    from shoal.imported import findings as imported
    from shoal.mechanics import findings as motions
    from shoal.mechanics.analysis import findings as statics
    from shoal.mechanics.analysis import modes_findings as modes
    from shoal.mechanics.analysis import reaction_findings as reactions
    from shoal.response import findings as response

    return "\n\n".join(
        [
            f"## Identification\n\n{_kinds(identification, 'verdict')}",
            f"## Uncertain parameters\n\n{_kinds(response, 'status')}",
            f"## Motions\n\n{_kinds(motions, 'status')}",
            f"## Statics\n\n{_kinds(statics, 'status')}",
            f"## Modes and Campbell diagrams\n\n{_kinds(modes, 'status')}",
            f"## Joint reactions\n\n{_kinds(reactions, 'status')}",
            f"## Imports\n\n{_kinds(imported, 'status')}",
        ]
    )


def _kinds(module: ModuleType, implied: str) -> str:
    """Return the table of the kinds of a module; implied: what follows from them."""
    from shoal.findings import Kind

    rows = [f"| code | severity | meaning | {implied} | what to do |", "|---|---|---|---|---|"]
    for one in vars(module).values():
        if isinstance(one, Kind):
            rows.append(f"| `{one.code}` | {one.severity} | {one.meaning} | {one.implies} | {one.remedy} |")
    return "\n".join(rows)


def gallery() -> str:
    """A card for each machine of the gallery: its moving picture, what it shows, and its scene."""
    from shoal_validation.gallery import machines

    cards = []
    for machine in machines():
        scene = f"[`{machine.name}`](gallery/{machine.name}.yaml)" if machine.own else f"`{machine.name}`, built in"
        picture = f"![{machine.name} in motion](gallery/{machine.name}.gif){{ loading=lazy }}"
        cards.append(f"-   {picture}\n\n    {scene}: {machine.scene.description}\n")
    return '<div class="grid cards" markdown>\n\n' + "\n".join(cards) + "\n</div>"


def commands() -> str:
    """The help of every command, as a terminal shows it."""
    from shoal.cli import main

    root = main.make_context("shoal", [], resilient_parsing=True)
    parts = []
    for name in main.list_commands(root):
        command = main.get_command(root, name)
        if command is not None and not command.hidden:
            help_text = command.get_help(click.Context(command, info_name=name, parent=root))
            parts.append(f"## shoal {name}\n\n```text\n{help_text}\n```\n")
    return "\n".join(parts)


def scene_fields() -> str:
    """The tables of the fields of every model that a scene is made of."""
    from shoal.scene import Scene

    return "\n".join(map(_table, models(Scene)))


def models(kind: Any) -> list[type[BaseModel]]:
    """The pydantic models that a type is made of, each once, in the order in which they occur."""
    found: dict[type[BaseModel], None] = {}

    def visit(part: Any) -> None:
        if isinstance(part, type) and issubclass(part, BaseModel) and part not in found:
            found[part] = None
            for field in part.model_fields.values():
                visit(field.annotation)
        for inner in get_args(part):
            visit(inner)

    visit(kind)
    return list(found)


def meanings(model: type[BaseModel]) -> dict[str, str]:
    """The docstrings of a model's fields, its own and inherited; these follow the field (PEP 257)."""
    found = {}
    for base in reversed(model.__mro__):
        if issubclass(base, BaseModel) and base.model_fields:
            (body,) = ast.parse(textwrap.dedent(inspect.getsource(base))).body
            assert isinstance(body, ast.ClassDef)
            for field, after in zip(body.body, body.body[1:], strict=False):
                match field, after:
                    case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(text))):
                        found[name] = " ".join(text.split())
    return found


def fields(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """The fields of a model that a user may choose: without `kind` and others of one value alone."""
    return {
        name: field
        for name, field in model.model_fields.items()
        if len(get_args(field.annotation)) != 1 or get_origin(field.annotation) is not Literal
    }


def has_number(annotation: Any) -> bool:
    """Return whether a type is a float, or has one among its parts that belong to no other model."""
    return annotation is float or any(map(has_number, get_args(annotation)))


def _table(model: type[BaseModel]) -> str:
    kind = model.model_fields.get("kind")
    title = f"`kind: {kind.default}`" if kind else model.__name__
    said = meanings(model)
    head = [
        f"## {title}",
        "",
        inspect.getdoc(model) or "",
        "",
        "| field | type | default | meaning |",
        "|---|---|---|---|",
    ]
    rows = [
        f"| `{name}` | {_type(field)} | {_default(field)} | {said.get(name, '')} |"
        for name, field in fields(model).items()
    ]
    return "\n".join([*head, *rows, ""]) if rows else "\n".join(head[:3]) + "\n"


_WORDS = {float: "number", int: "whole number", str: "text", bool: "true or false", type(None): ""}
_SIGNS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}


def _type(field: FieldInfo) -> str:
    """The type and the allowed range of a field."""
    return _written(field.annotation, field.metadata)


def _written(kind: Any, metadata: Any = ()) -> str:
    if hasattr(kind, "__metadata__"):  # Annotated
        return _written(get_args(kind)[0], kind.__metadata__)
    bounds = [one for part in metadata for one in getattr(part, "metadata", [part])]
    limits = [f"{sign} {getattr(one, name):g}" for one in bounds for name, sign in _SIGNS.items() if hasattr(one, name)]
    origin, parts = get_origin(kind), get_args(kind)
    if origin is Literal:
        text = ", ".join(f"`{one}`" for one in parts)
    elif origin is tuple:
        count = "" if parts[-1] is ... else f"{len(parts)} "
        text = f"list of {count}" + re.sub(r"\bnumber\b", "numbers", _written(parts[0]))
    elif origin is dict:
        text = "by name: " + _written(parts[1])
    elif parts:
        text = " or ".join(dict.fromkeys(filter(None, map(_written, parts))))
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        named = kind.model_fields.get("kind")
        text = f"`{named.default}`" if named else kind.__name__
    else:
        text = _WORDS.get(kind, str(getattr(kind, "__name__", kind)))
    return " ".join([text, *limits])


def _default(field: FieldInfo) -> str:
    """The default of a field as YAML writes it."""
    value = field.default
    if field.is_required():
        return "required"
    if value is None or isinstance(value, BaseModel | dict) or value in ((), ""):
        number = getattr(value, "number", None)
        return "" if number is None else f"`{number:g}`"
    if isinstance(value, tuple):
        return f"`[{', '.join(f'{one:g}' for one in value)}]`"
    return f"`{str(value).lower() if isinstance(value, bool) else value}`"
