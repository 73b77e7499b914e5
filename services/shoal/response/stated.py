"""A study that is kept as a file: `uncertain: {scene: ..., vary: ..., ...}`.

Its fields are the options of the command. Beside it stand at most its name and a description. A scene is a name, or a
file beside the document.
"""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, ConfigDict, Field, ValidationError

from shoal.errors import InputError
from shoal.regular import require_regular
from shoal.response.read import correlations, prices
from shoal.scene import Scene, load_scene
from shoal.scene.load import LARGEST, read_yaml, unknown
from shoal.scene.record import Base, limited
from shoal.shelf import located, shelf

KEY = "uncertain"
BESIDE = "name", "description"
PAIRS = {"vary": ("~", "="), "set": ("=", "="), "correlate": ("=", "="), "cost": ("=", "=")}
"""Options that a mapping may state, and what stands between key and value: before a distribution, and else."""
_LIBRARY = files("shoal.response") / "library"


def pairs(field: str, value: Any) -> list[str]:
    """What would stand on the command line: one text a pair."""
    if not isinstance(value, dict):
        return [str(one) for one in (value if isinstance(value, list) else [value])]
    before, between = PAIRS[field]
    return [f"{key}{before if '(' in str(one) else between}{_plain(field, one)}" for key, one in value.items()]


def _plain(field: str, value: Any) -> Any:
    return f"{value[0]}:{value[1]}" if field == "vary" and isinstance(value, list) and len(value) == 2 else value


def _texts(field: str) -> Any:
    return BeforeValidator(lambda value: pairs(field, value))


def _instants(value: Any) -> Any:
    return value.split(",") if isinstance(value, str) else value if isinstance(value, list | None) else [value]


def _values(value: Any) -> Any:
    if isinstance(value, dict) or value is None:
        return value
    texts = [str(one).partition("=") for one in (value if isinstance(value, list) else [value])]
    return {path: one for path, _, one in texts}


class Stated(Base):
    """The fields of such a file; see `shoal uncertain --help`. What it writes is for the command line only."""

    model_config = ConfigDict(frozen=True, extra="forbid", alias_generator=lambda name: name.replace("_", "-"))

    scene: str
    vary: Annotated[list[str], _texts("vary"), Field(min_length=1)]
    correlate: Annotated[list[str], _texts("correlate")] = []
    set: Annotated[dict[str, Any], BeforeValidator(_values)] = {}
    method: str = "auto"
    gap: Annotated[float, limited("gap")] | None = None
    runs: Annotated[int, limited("most")] = 20_000
    degree: Annotated[int, limited("degree")] | None = None
    count: Annotated[int, limited("count")] | None = None
    limit: Annotated[list[str], _texts("limit")] = []
    require: Annotated[list[str], _texts("require")] = []
    limit_method: str = "auto"
    limit_runs: Annotated[int, limited("limit_runs")] = 5_000
    allocate: bool = False
    target: Annotated[float, limited("target")] | None = None
    cost: Annotated[list[str], _texts("cost")] = []
    time_limit: Annotated[float, limited("time_limit")] | None = None
    engine: str = "gauss"
    at: Annotated[list[float] | None, BeforeValidator(_instants)] = None
    tolerance: Annotated[float, limited("tolerance")] | None = None
    seed: Annotated[int, limited("seed")] = 0
    verify: bool = True
    worst: str | None = None
    worst_of: str = ""
    checkpoint: str | None = None
    out: str | None = None

    def machine(self) -> Scene:
        """The scene with its values set. Raises InputError."""
        return load_scene(self.scene).with_values(self.set)

    def asked(self) -> dict[str, Any]:
        """Arguments of `shoal.uncertain`, without its files. Raises InputError."""
        same = ("method", "gap", "degree", "count", "limit_method", "limit_runs", "allocate", "target", "time_limit")
        return {
            **{name: getattr(self, name) for name in (*same, "engine", "tolerance", "seed", "verify")},
            "vary": self.vary,
            "times": self.at,
            "correlations": correlations(self.correlate),
            "costs": prices(self.cost),
            "limits": self.limit,
            "requirements": self.require,
            "most": self.runs,
        }


def fields(data: Any, name: str) -> dict[str, Any]:
    """The fields of a document, checked for what stands beside them. Raises InputError."""
    if not isinstance(data, dict) or KEY not in data:
        raise InputError(f"{name}: is no study: it has no field `{KEY}`")
    found, others = data[KEY], sorted(set(data) - {KEY, *BESIDE})
    if others or not isinstance(found, dict) or not isinstance(found.get("scene"), str):
        wrong = f"{others[0]} does not belong beside it" if others else "needs a mapping with the name of a scene"
        raise InputError(f"{name}: {KEY}: {wrong}")
    return found


def scene_of(stated: str, document: Path) -> str:
    """The path of a scene that lies beside the document, else what was stated."""
    beside = document.parent / stated
    return str(beside) if beside.is_file() else stated


def load_study(given: str) -> Stated:
    """A study by its name, built in or in the library, or from a file. Raises InputError."""
    document = Path(document_of(given))
    require_regular(document, "study")
    try:
        if document.stat().st_size > LARGEST:
            raise InputError(f"{given}: larger than the {LARGEST} bytes that are read")
        text = document.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError):
        known = [*built_in_studies(), *(entry.name for entry in shelf().entries("studies"))]
        raise InputError(f"study: {unknown(given, 'study, nor file', known)}") from None
    told = fields(read_yaml(text, given), given)
    try:
        return Stated.model_validate({**told, "scene": scene_of(told["scene"], document)})
    except ValidationError as error:
        first = error.errors()[0]
        where, what = ".".join(map(str, first["loc"])), first["msg"].removeprefix("Value error, ")
        raise InputError(f"{given}: {KEY}: {where}: {what}, found {first['input']!r}") from None


def document_of(given: str) -> str:
    """The path of a study that is named, else what was given."""
    return str(_LIBRARY / f"{given}.yaml") if given in built_in_studies() else located("studies", given)


def built_in_studies() -> list[str]:
    """Their names."""
    return sorted(one.name.removesuffix(".yaml") for one in _LIBRARY.iterdir() if one.name.endswith(".yaml"))
