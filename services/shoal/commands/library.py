"""`shoal library`: the user library of scenes, problems and recordings, by name."""

from __future__ import annotations

from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import click

from shoal.commands import options

_kind = click.option(
    "--kind", metavar="KIND", help="scene, recording, problem or study, where the name alone does not tell."
)


@click.group()
def library() -> None:
    """Keep scenes, recordings, problems and studies of your own under names.

    Their names stand beside the built-in ones in commands, in Python, in services and in flows. They lie in
    $SHOAL_LIBRARY, else in `library` below Shoal's home. NAME@VERSION is an earlier version.
    """


@library.command()
@click.argument("file", type=click.Path(path_type=Path))
@click.option("--name", help="Under which it is kept; else that of the file.")
@click.option("--kind", metavar="KIND", help="scene, recording, problem or study; else what the fields of FILE say.")
@options.as_json
def add(file: Path, name: str | None, kind: str | None, as_json: bool) -> None:
    """Check FILE and keep it, with the files that it names.

    FILE is a scene, a problem or an uncertain study (YAML), or a recording (CSV, Parquet, or the YAML that describes
    one). A name that is there stands for the new version from then on.
    """
    from shoal import library
    from shoal.terminal import screen

    made = library.add(file, name, kind)
    _changed()
    screen.show(library.about(made), as_json, lambda: screen.say(f"{_title(made)}, version {made.version}"))


@library.command("list")
@click.option("--kind", metavar="KIND", help="Only scenes, recordings, problems or studies.")
@options.as_json
def list_entries(kind: str | None, as_json: bool) -> None:
    """List the entries with their versions."""
    from shoal import library
    from shoal.shelf import shelf
    from shoal.terminal import screen

    wanted = library.kind_of(kind).folder if kind else None
    found = [library.about(entry) for entry in library.entries(wanted)]

    def draw() -> None:
        for folder in library.KINDS:
            if rows := {
                row["name"]: f"{row['version']}  {row['description']}" for row in found if row["kind"] == folder
            }:
                screen.listing(folder, rows)
        if not found:
            screen.say(
                f"nothing in {shelf().root} yet; `shoal library add FILE` keeps a scene, a problem or a recording"
            )

    screen.show({"folder": str(shelf().root), "entries": found}, as_json, draw)


@library.command()
@click.argument("name")
@_kind
@options.as_json
def show(name: str, kind: str | None, as_json: bool) -> None:
    """Print the entry NAME as YAML; with --json its versions and files."""
    from shoal import library
    from shoal.shelf import shelf
    from shoal.terminal import screen

    found = library.entry(name, library.kind_of(kind).folder if kind else None)
    files = found.files()
    told = {
        **library.about(found),
        "versions": shelf().versions(found.kind, found.name),
        "files": {path: len(content) for path, content in files.items()},
        "document": files[f"{found.name}.yaml"].decode(),
    }
    screen.show(told, as_json, lambda: click.echo(told["document"], nl=False))


@library.command()
@click.argument("name")
@_kind
@options.as_json
def remove(name: str, kind: str | None, as_json: bool) -> None:
    """Forget the entry NAME with all its versions. Runs keep what they used."""
    from shoal import library
    from shoal.shelf import shelf
    from shoal.terminal import screen

    found = library.entry(name, library.kind_of(kind).folder if kind else None)
    shelf().remove(found.kind, found.name)
    _changed()
    screen.show({"kind": found.kind, "name": found.name}, as_json, lambda: screen.say(f"{_title(found)}, removed"))


@library.command()
@click.argument("url")
@click.argument("names", nargs=-1, metavar="[NAME]...")
@_kind
@options.as_json
def push(url: str, names: tuple[str, ...], kind: str | None, as_json: bool) -> None:
    """Put entries, or all there are, into the library of the service at URL."""
    from shoal import library
    from shoal.engines.remote import RemoteEngine
    from shoal.terminal import screen

    wanted = library.kind_of(kind).folder if kind else None
    chosen = [library.entry(name, wanted) for name in names] or library.entries(wanted)
    # What a problem names has to be there first.
    chosen.sort(key=lambda one: list(library.KINDS).index(one.kind))
    service = RemoteEngine(url)
    with screen.working(f"to {url}") as tell:
        for one in chosen:
            tell(f"{_title(one)} to {url}")
            service.put_entry(one.kind, one.name, one.files())
        there = service.ask("GET", "/v1/library", read=dict)
    _changed(_names(there), there.get("identity", ""))
    told: dict[str, Any] = {"url": url, "entries": [library.about(one) for one in chosen]}
    screen.show(told, as_json, lambda: screen.say(*(f"{_title(one)}, version {one.version}" for one in chosen)))


def _names(found: dict[str, Any]) -> dict[str, list[str]]:
    """Those of a library by kind, from what a service answers."""
    from shoal.library import KINDS

    return {kind: [entry["name"] for entry in found["entries"] if entry["kind"] == kind] for kind in KINDS}


def _changed(names: dict[str, list[str]] | None = None, identity: str | None = None) -> None:
    """Update the places that show the names of a library; print why one was not updated.

    names: by kind, identity: of that library; else those of the library here. Other packages add functions by the
    entry points of the group `shoal.library`; each returns a line for the user, or "".
    """
    for point in entry_points(group="shoal.library"):
        if note := point.load()(names, identity):
            click.echo(f"note: {note}", err=True)


def _title(entry: Any) -> str:
    from shoal.library import KINDS

    return f"{KINDS[entry.kind].one} {entry.name}"
