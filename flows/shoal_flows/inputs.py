"""Inputs of a flow, pinned: later changes of the library change neither the study nor its repetition."""

from __future__ import annotations

import re
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from unicodedata import normalize

from shoal import library
from shoal.errors import ComputationError, InputError
from shoal.scene.load import read_yaml, unknown
from shoal.shelf import NAME, check_files, located, shelf

from shoal_flows.choices import names

_OWN = "own"
"""How YAML is called that states no name."""
_LONGEST = 64
"""Name of a run or an entry, in characters."""


def held(parameter: str, kind: str, given: str) -> str:
    """The path of a copy of a scene, a problem or a recording with all that it names; built-in names stay.

    parameter: of the flow that runs, whose run keeps the copy; given: a name, a path, the address of an entry in the
    library of a service (http://HOST:PORT/v1/library/KIND/NAME), or YAML of several lines. Raises InputError.
    """
    if not given or library.KINDS[kind].built_in(given):
        return given
    name = _plain(_stem(given))
    if "\n" in given:
        name, files = _of_text(parameter, kind, given)
    elif given.startswith(("http://", "https://")):
        files = _of_service(parameter, kind, given)
    elif located(kind, given) == given and not Path(given).is_file():
        what = f"{library.KINDS[kind].one}, nor file where this runs, nor entry of its library {shelf().root}"
        raise InputError(f"{parameter}: {unknown(given, what, [one for one in names(kind) if one])}")
    else:
        files = library.gathered(kind, given, name, whole=True)
    path = shelf().hold(name, files)
    try:
        library.KINDS[kind].check(path)
    except InputError as error:
        raise InputError(_said(parameter, path, error)) from None
    _remember(parameter, str(path))
    return str(path)


def title(given: str) -> str:
    """Return the title of a scene, a problem or a study: its stated name, or that of its file."""
    path = Path(given)
    if path.suffix in (".yaml", ".yml"):
        with suppress(OSError, ValueError):
            if name := _stated(path.read_text(encoding="utf-8")):
                return name
    return _stem(given)


def _stem(given: str) -> str:
    """The name of a file without its ending, or of an entry without its version."""
    name = Path(given).name.partition("@")[0].removesuffix(".gz")
    return name.rpartition(".")[0] or name


def headed(given: str, kind: str) -> str:
    """Return the title of a parameter as given, YAML included, before it is validated."""
    return ((_stated(given) or _OWN) if "\n" in given else title(located(kind, given)))[:_LONGEST]


def _stated(text: str) -> str:
    """The name that a document gives itself, on one line; empty if there is none."""
    try:
        data = read_yaml(text, "")
    except InputError:
        return ""
    name = data.get("name") if isinstance(data, dict) else None
    return " ".join(name.split()) if isinstance(name, str) else ""


def _plain(name: str) -> str:
    """A name as an entry of the library may have it: letters without their accents."""
    if NAME.fullmatch(name):
        return name
    letters = normalize("NFKD", name.replace("ß", "ss")).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_-]+", "-", letters).strip("-_")[:_LONGEST] or "given"


def _of_text(parameter: str, kind: str, text: str) -> tuple[str, library.Documents]:
    """YAML as it was typed into a form, under the name that it gives itself."""
    read_yaml(text, parameter)
    name = _plain(_stated(text) or _OWN)
    return name, _gathered(parameter, kind, {f"{name}.yaml": text.encode()}, name)


def _of_service(parameter: str, kind: str, address: str) -> library.Documents:
    """An entry of a service's library, with what it names in the library here."""
    from shoal.engines.remote import RemoteEngine

    service, _, place = address.partition("/v1/library/")
    found, _, name = place.strip("/").partition("/")
    if found != kind or not NAME.fullmatch(name.partition("@")[0]):
        right = f"http://HOST:8001/v1/library/{kind}/NAME"
        raise InputError(f"{parameter}: {address[:200]}: no address of an entry, such as {right}")
    try:
        files = RemoteEngine(service).get_entry(kind, name)
    except (InputError, ComputationError) as error:
        raise type(error)(f"{parameter}: {error}") from None
    return _gathered(parameter, kind, files, _plain(_stem(name)))


def _gathered(parameter: str, kind: str, files: Mapping[str, bytes], name: str) -> library.Documents:
    check_files(name, files)
    with TemporaryDirectory() as folder:
        document = Path(folder) / f"{name}.yaml"
        for path, content in files.items():
            (document.parent / path).parent.mkdir(parents=True, exist_ok=True)
            (document.parent / path).write_bytes(content)
        try:
            return library.gathered(kind, str(document), name, whole=True)
        except InputError as error:
            raise InputError(_said(parameter, document, error)) from None


def _said(parameter: str, document: Path, error: InputError) -> str:
    """Return the error of a document, with the name of its parameter in place of the path."""
    text = str(error).replace(str(document), parameter).replace(f"{document.parent}/", "")
    return text if text.startswith(parameter) else f"{parameter}: {text}"


def _remember(parameter: str, path: str) -> None:
    """Keep a path as the value of the parameter in `tracking.origin`."""
    from prefect.context import FlowRunContext

    context = FlowRunContext.get()
    if context is not None and context.parameters is not None:
        context.parameters[parameter] = path
