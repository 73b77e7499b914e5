"""What the site generates from the program itself: the help of every command."""

from __future__ import annotations

from typing import Any

import click


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Put the commands where a page has the mark for them."""
    return markdown.replace("<!-- commands -->", commands()) if "<!-- commands -->" in markdown else markdown


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
