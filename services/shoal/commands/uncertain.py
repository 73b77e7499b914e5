"""Motions of a scene whose parameters are known as intervals or distributions only."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from shoal.commands import options
from shoal.commands.command import command
from shoal.commands.options import Out
from shoal.errors import ComputationError, InputError, check_trusted

if TYPE_CHECKING:
    from shoal.requests.uncertain import Uncertain
    from shoal.response import Response


def stated(given: str) -> dict[str, Any]:
    """Return the fields of a study (a name, or a file) by name; none of what is no study. Raises InputError."""
    from shoal.response import stated as studies
    from shoal.scene.load import read_yaml
    from shoal.shelf import shelf

    path = Path(given)
    if path.suffix not in (".yaml", ".yml") or not path.is_file():
        if shelf().find("scenes", given) is not None or studies.document_of(given) == given:
            return {}
        path = Path(studies.document_of(given))
    text = path.read_text(encoding="utf-8")
    data = read_yaml(text, given)
    return studies.fields(text, path, given) if isinstance(data, dict) and studies.KEY in data else {}


@command("uncertain", stated)
@options.as_json
@options.out(".html", ".nc", ".csv", ".json", ".png")
def uncertain(asked: Uncertain, as_json: bool, out: Out) -> None:
    """Bound or predict the motion of SCENE if some of its fields are intervals or distributions.

    Intervals give bounds that runs attain, distributions give means, deviations, quantiles and Sobol indices. A
    requirement states what must hold, a limit what must not happen: with intervals the answer is whether it can be
    violated, with distributions how probable that is. SCENE may be a
    YAML `uncertain: {scene: ..., vary: ..., ...}` that states these options.
    """
    from shoal.notebook import machine
    from shoal.pictures import files
    from shoal.response import uncertain
    from shoal.response.limits import read_limits
    from shoal.response.read import parameters
    from shoal.response.worst import require_case
    from shoal.terminal import screen, tables

    scene = machine(asked, options.note)
    require_case(asked.worst_of, read_limits(asked.limit, asked.require, scene), scene, parameters(asked.vary, scene))
    with screen.working(f"{scene.name}: uncertain response") as tell:
        screen.compile_for(asked.engine, [1, 2], scene)
        response = uncertain(replace(asked, progress=lambda runs: tell(f"{scene.name}: {runs} runs")), scene)
    if out is not None:
        files.response(response, out)
    screen.show(response.to_json(), as_json, lambda: tables.response_table(response))
    if asked.worst is not None:
        _save_worst(response, Path(asked.worst), asked.worst_of)
    check_trusted(response.ok, response.message)


def _save_worst(response: Response, file: Path, of: str) -> None:
    """One scene; those of several limits get numbers. Raises ComputationError, also where there is no worst case."""
    from shoal.response.worst import worst

    try:
        cases = worst(response, of)
    except InputError as error:
        raise ComputationError(f"{error}; {file} is not written") from None
    for k, case in enumerate(cases):
        path = file if len(cases) == 1 else file.with_stem(f"{file.stem}-{k + 1}")
        case.save(path)
        click.echo(f"{path}: {case.scene.description}", err=True)
    if not of and len(cases) < len(response.limits):
        missing = [one.limit.text for one in response.limits if one.shown is None]
        click.echo(f"no run comes near {' or '.join(missing)}: no worst case is written", err=True)
