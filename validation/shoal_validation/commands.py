"""The command of `shoal` that holds it against known answers."""

from __future__ import annotations

import click
from shoal.commands import options
from shoal.errors import check_trusted


@click.command()
@click.option("--only", metavar="NAME", help="One problem of the library or of the paper.")
@click.option("--quick", is_flag=True, help="A part that takes one or two minutes.")
@options.as_json
def validate(only: str | None, quick: bool, as_json: bool) -> None:
    """Run the problem library over all engines, and write a page. Against its references and the nights before."""
    from shoal_validation.nightly.main import main

    check_trusted(
        main(only, quick, as_json), "not every line is as it should be; the page and the lines above name them"
    )
