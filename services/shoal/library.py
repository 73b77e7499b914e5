"""The user library: scenes, recordings, problems and studies that are checked before they are kept.

Their names stand beside the built-in ones wherever one is taken. An entry holds all files that it needs and that are
not themselves in the library; references to other entries are resolved at each use, unless a study pins a version.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from shoal.errors import InputError
from shoal.expectation import question
from shoal.identification import load_problem, measure
from shoal.identification.problem import built_in_problems
from shoal.identification.recording.reading import YAML, described, read
from shoal.identification.recording.source import FileSource
from shoal.response.limits import read_limits
from shoal.response.posterior import is_source
from shoal.response.read import parameters
from shoal.response.stated import KEY, built_in_studies, load_study
from shoal.scene import Scene, load_scene
from shoal.scene.edited import Keys, as_yaml, edited
from shoal.scene.load import LARGEST, built_in_scenes, read_yaml, some, unknown
from shoal.scene.measured import PARTS
from shoal.scene.parametric import parametric
from shoal.shelf import LARGEST as LARGEST_ENTRY
from shoal.shelf import NAME, Files, StoredVersion, check_name, check_paths, located, shelf
from shoal.table import load_table

if TYPE_CHECKING:
    from shoal.mechanics.model import Model

Documents = dict[str, bytes]


@dataclass(frozen=True)
class EntryKind:
    """A kind of entry of the library. folder: its name there; one: in words; check: of a document, raises InputError.

    mark: the field that only its documents have; built_in: names that are taken; references: how a document names
    another file (the keys that lead there, `*` for any), and of which kind that is; "" is none of them, a table
    """

    folder: str
    one: str
    check: Callable[[Path], object]
    mark: str
    built_in: Callable[[str], bool] = lambda name: False
    references: Mapping[Keys, str] = field(default_factory=dict)


def _check_scene(document: Path) -> None:
    scene = load_scene(str(document))
    if _model(scene).failed.any():
        raise InputError(f"{document.name}: initial: no start agrees with the joints and with what is stated")
    for name in scene.expect:
        try:
            question(scene, name, document)
        except InputError as error:
            raise InputError(f"{document.name}: {error}") from None


def _model(scene: Scene) -> Model:
    """Build the model of a scene, with its functions of time and its start. Raises InputError."""
    from shoal.engines.capabilities import check_acceleration
    from shoal.mechanics.machine import Machine
    from shoal.mechanics.simulate import runs

    check_acceleration(scene)
    return runs(Machine.of(scene), scene.solver, 0.0).model


def _check_recording(document: Path) -> None:
    source = FileSource.model_validate(described({}, document))
    load_table(Path(source.path or ""), source.columns, largest=LARGEST_ENTRY)
    if source.channels:
        read(source, tuple(source.channels))


def _check_problem(document: Path) -> None:
    problem = load_problem(str(document))
    scene = problem.load_scene()
    _model(scene)
    if all(isinstance(source, FileSource) and source.path for source in problem.sources.values()):
        measure(problem, scene)


def _check_study(document: Path) -> None:
    study = load_study(str(document))
    scene = study.machine()
    _model(scene)
    if any("empirical(" in text or is_source(text) for text in study.vary):
        raise InputError(f"{document.name}: {KEY}: vary: a file of observations cannot be kept with a study")
    parameters(study.vary, scene)
    read_limits(study.limit, study.require, scene)


KINDS = {
    kind.folder: kind
    for kind in (
        EntryKind("recordings", "recording", _check_recording, "path", references={("path",): ""}),
        EntryKind(
            *("scenes", "scene", _check_scene, "bodies", lambda name: _scene_named(name)),
            references={
                ("expect", "*", "path"): "recordings",
                ("initial", "from"): "",
                **{(part, "*", "*", "path"): "" for part in PARTS},
            },
        ),
        EntryKind(
            *("problems", "problem", _check_problem, "parameters", lambda name: name in built_in_problems()),
            references={
                ("scene",): "scenes",
                ("source", "path"): "recordings",
                ("recordings", "*", "path"): "recordings",
            },
        ),
        EntryKind(
            *("studies", "study", _check_study, KEY, lambda name: name in built_in_studies()),
            references={(KEY, "scene"): "scenes"},
        ),
    )
}
"""In an order in which none needs a later one."""


def _scene_named(name: str) -> bool:
    return name in built_in_scenes() or parametric(name) is not None


def kind_of(given: str) -> EntryKind:
    """The kind of that name, in the singular or the plural. Raises InputError."""
    for kind in KINDS.values():
        if given in (kind.folder, kind.one):
            return kind
    raise InputError(f"kind: no kind {given!r}; there are {', '.join(kind.one for kind in KINDS.values())}")


def entries(kind: str | None = None) -> list[StoredVersion]:
    """Everything in the library, or what is of a kind."""
    return [entry for folder in KINDS if kind in (None, folder) for entry in shelf().entries(folder)]


def entry(name: str, kind: str | None = None) -> StoredVersion:
    """The entry of that NAME or NAME@VERSION. Raises InputError."""
    found = [one for folder in KINDS if kind in (None, folder) and (one := shelf().find(folder, name)) is not None]
    if not found:
        known = [one.name for one in entries(kind)]
        there = f"there are {some(known)}" if known else "there are none yet; `shoal library add FILE` makes one"
        raise InputError(f"name: {unknown(name, 'entry of the library', known)}; {there}")
    if len(found) > 1:
        kinds = ", ".join(KINDS[one.kind].one for one in found)
        raise InputError(f"kind: {name} is the name of more than one entry ({kinds}); say which with --kind")
    return found[0]


def about(entry: StoredVersion) -> dict[str, Any]:
    """Return the summary of an entry for lists and services."""
    try:
        data = read_yaml(_text(_content(entry.document, LARGEST), entry.document), entry.name)
        description = str(data.get("description", "")) if isinstance(data, dict) else ""
    except InputError as error:
        description = f"cannot be used: {error}"
    return {"kind": entry.kind, "name": entry.name, "version": entry.version, "description": description}


def add(file: str | Path, name: str | None = None, kind: str | None = None) -> StoredVersion:
    """Check a scene, a problem or a recording (YAML, CSV or Parquet) and keep it with the files that it names.

    name: else that of the file; kind: else what its fields say. Raises InputError.
    """
    path = Path(file)
    wanted = kind_of(kind).folder if kind else _guessed(path)
    name = check_name(name or path.name.partition(".")[0])
    return put(wanted, name, gathered(wanted, str(path), name, whole=False))


def put(kind: str, name: str, files: Files) -> StoredVersion:
    """Keep files under a name if they are right; see `Shelf.put`. Raises InputError."""
    if KINDS[kind].built_in(check_name(name)):
        raise InputError(f"name: {name} is the name of a built-in {KINDS[kind].one}; choose another")
    return shelf().put(kind, name, files, lambda document: _check(KINDS[kind], document))


def gathered(kind: str, given: str, name: str, *, whole: bool) -> Documents:
    """All files of a document (a path, or a name of the library) as an entry of that name. Raises InputError.

    whole: with what it names in the library; else such names stay. Built-in names always stay. Texts stay as they are,
    but for paths that cannot be kept in an entry.
    """
    path = Path(located(kind, given))
    document = f"{name}.yaml"
    if kind == "recordings" and path.suffix not in YAML:
        ending = "".join(path.suffixes[-2:]) if path.suffix == ".gz" else path.suffix
        table = f"{name}{ending or '.csv'}"
        return {document: as_yaml({"path": table}).encode(), table: _content(path, LARGEST_ENTRY)}
    found = _gathered(kind, path, document, whole)
    return {document: found.pop(document), **found}


def _gathered(kind: str, path: Path, document: str, whole: bool) -> Documents:
    """A file and all that it names, by paths from the folder in which it will be the file `document`."""
    if not kind or (kind == "recordings" and path.suffix not in YAML):
        return {document: _content(path, LARGEST_ENTRY)}
    if kind == "recordings":
        described({}, path)  # raises where it is not one
    content = _content(path, LARGEST)
    text = _text(content, path)
    data, files, changes = read_yaml(text, str(path)), {document: content}, dict[Keys, str]()
    for wanted, target in KINDS[kind].references.items():
        for keys, reference in _places(data, wanted):
            label = ".".join(keys)
            beside = path.parent / reference
            if not beside.exists():
                inside = shelf().find(target, reference) is not None
                if not (inside and whole):
                    if not inside and Path(reference).suffix:
                        raise InputError(f"{path}: {label}: {reference} cannot be read: no such file")
                    continue
                beside = Path(located(target, reference))
            where = PurePosixPath(reference)
            needed = _below(where.parent, _gathered(target, beside, where.name, whole))
            if path.parent / reference != beside or not _fits(needed, files):
                where = PurePosixPath(label.removesuffix(".path").replace(".", "-"), _plain(beside))
                needed = _below(where.parent, _gathered(target, beside, where.name, whole))
                changes[keys] = str(where)
            files |= needed
    return files | {document: edited(text, changes).encode()} if changes else files


def _below(folder: PurePosixPath, files: Documents) -> Documents:
    return {str(folder / path): content for path, content in files.items()}


def _fits(more: Documents, files: Documents) -> bool:
    """Return whether files can be kept beside others under the paths that they have."""
    try:
        check_paths([*more, *files])
    except InputError:
        return False
    return all(files.get(path, content) == content for path, content in more.items())


def _check(kind: EntryKind, document: Path) -> None:
    """Raises InputError, in which paths are those of the entry."""
    _check_paths(kind, document)
    try:
        kind.check(document)
    except InputError as error:
        raise InputError(str(error).replace(f"{document.parent}/", "")) from None


def _check_paths(kind: EntryKind, document: Path) -> None:
    """Return whether a document names nothing but what is below it, and entries of the library. Raises InputError."""
    size = document.stat().st_size
    if size > LARGEST:
        raise InputError(f"{document.name}: larger than the {LARGEST} bytes that are read")
    data = read_yaml(_text(document.read_bytes(), Path(document.name)), document.name)
    for wanted, target in kind.references.items():
        for keys, given in _places(data, wanted):
            label, parts = ".".join(keys), Path(given).parts
            if Path(given).is_absolute() or ".." in parts or "\0" in given:
                raise InputError(f"{document.name}: {label}: {given[:80]!r} leads out of the entry")
            inside = document.parent / given
            if not inside.is_file() and (Path(given).suffix or not target):
                raise InputError(f"{document.name}: {label}: {given[:80]!r} is not among the files of the entry")
            if target and inside.suffix in YAML:
                _check_paths(KINDS[target], inside)


def _places(data: Any, wanted: Keys, above: Keys = ()) -> Iterable[tuple[Keys, str]]:
    """Yield the texts of a document: the keys of each, and the text."""
    if not isinstance(data, dict):
        return
    for key in list(data) if wanted[0] == "*" else [key for key in wanted[:1] if key in data]:
        if len(wanted) > 1:
            yield from _places(data[key], wanted[1:], (*above, key))
        elif isinstance(data[key], str) and ((*above, key), data[key]) != (("initial", "from"), "statics"):
            yield (*above, key), data[key]


def _guessed(path: Path) -> str:
    """The kind of a file by its fields. Raises InputError."""
    if path.suffix not in YAML:
        return "recordings"
    data = read_yaml(_text(_content(path, LARGEST), path), str(path))
    for kind in KINDS.values():
        if isinstance(data, dict) and kind.mark in data:
            return kind.folder
    marks = ", ".join(f"`{kind.mark}` (a {kind.one})" for kind in KINDS.values())
    raise InputError(f"{path}: its kind cannot be told: it has none of the fields {marks}; say --kind")


def _content(path: Path, largest: int) -> bytes:
    """Bytes of a file. Raises InputError."""
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: cannot be read: not a file")
    try:
        with path.open("rb") as file:
            content = file.read(largest + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if len(content) > largest:
        raise InputError(f"{path}: larger than the {largest} bytes that an entry of the library may have")
    return content


def _text(content: bytes, path: Path) -> str:
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path}: cannot be read: not UTF-8 text") from None


def _plain(path: Path) -> str:
    """The name of a file that becomes part of an entry."""
    stem, dot, ending = path.name.partition(".")
    return f"{stem if NAME.fullmatch(stem) else 'part'}{dot}{ending}"
