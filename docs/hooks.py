"""What the site generates from the program itself: the help of every command, the table of findings."""

from __future__ import annotations

from typing import Any

import click


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put what is generated where a page has the mark for it."""
    for mark, generate in {"<!-- commands -->": commands, "<!-- findings -->": findings}.items():
        markdown = markdown.replace(mark, generate()) if mark in markdown else markdown
    return markdown


def findings() -> str:
    """The table of all kinds of findings of an identification."""
    from shoal.findings import Kind
    from shoal.identification import findings as kinds

    rows = ["| code | severity | meaning | verdict | what to do |", "|---|---|---|---|---|"]
    for one in vars(kinds).values():
        if isinstance(one, Kind):
            rows.append(f"| `{one.code}` | {one.severity} | {one.meaning} | {one.implies} | {one.remedy} |")
    return "\n".join(rows)


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
