"""The exit status of a command."""

from __future__ import annotations

import sys

import click

EXIT_UNTRUSTED = 3


def finish(trusted: bool, reason: str) -> None:
    """Exit status 0 only for an answer that can be trusted, else 3 with the reason."""
    if not trusted:
        click.echo(f"shoal: {reason}", err=True)
        sys.exit(EXIT_UNTRUSTED)
