"""Fields that several requests share: one type, one name, one sentence for each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import KW_ONLY, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeAlias

from pydantic import BeforeValidator
from pydantic import Field as Constraint
from pydantic.dataclasses import dataclass

from shoal import arguments
from shoal.arguments import Limit
from shoal.errors import InputError
from shoal.requests import texts
from shoal.requests.option import HERE, Option
from shoal.requests.request import STRICT, wrong

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    import numpy.typing as npt
    import pandas as pd

    from shoal.scene import Scene
    from shoal.scene.record import Record


def instants(given: Any) -> Any:
    """Return instants [s] that increase from 0 on, as a list. Raises ValueError."""
    if given is None:
        return None
    try:
        found = arguments.numbers("at", given, "times in s").tolist()
    except InputError as error:
        raise ValueError(str(error).partition(": ")[2]) from None
    if found[0] < 0:
        raise ValueError(f"must start at or after 0 s, found {found[0]:g}")
    for before, after in pairwise(found):
        if not before < after:
            raise ValueError(f"must increase, found {after:g} after {before:g} s")
    return found


def _files(given: Any) -> Any:
    """Read FILE, or NAME=FILE once or more."""
    found = texts.listed(given)
    if len(found) == 1 and ("=" not in found[0] or Path(found[0]).exists()):
        return found[0]
    if bare := [one for one in found if "=" not in one]:
        raise ValueError(f"{bare[0]!r} is not NAME=FILE, as several recordings need it")
    return texts.pairs("[NAME=]FILE")(found)


_PROBLEM = (
    "The measured channels and the unknown parameters: a name (see `shoal problems`), a YAML file, or its fields."
)
_DATA = (
    "A recording (CSV, Parquet, a YAML that describes one, or a table whose columns are those of the channels) instead "
    "of the problem's own; by name of several."
)
_MACHINE = "The machine: a name (see `shoal scenes`), a YAML file, its fields or an object."
_SET = "Set fields of the scene by their paths, such as bodies.OA.elements=16, solver.step=1e-5."
_VALUES = "Values that an identification found, an estimate or the JSON file of one; what is set goes before them."
_AT = "Sample at these times [s]; else as the scene says."

if TYPE_CHECKING:
    AnyScene = Scene | Mapping[str, Any] | str | Path
    AnyProblem = Record | Mapping[str, Any] | str | Path
    Data: TypeAlias = "str | Path | pd.DataFrame | Mapping[str, str | Path | pd.DataFrame] | None"
    Values = Mapping[str, Any] | None
    Found = Any
    At = Sequence[float] | npt.NDArray[np.float64] | None
else:
    AnyProblem = Annotated[Any, Option(_PROBLEM, metavar="PROBLEM", shown="Problem | Mapping[str, Any] | str | Path")]
    Data = Annotated[
        Any,
        Option(
            _DATA,
            "[NAME=]FILE",
            many=True,
            old="recordings",
            shown="str | Path | DataFrame | Mapping[str, str | Path | DataFrame] | None",
            text=_files,
        ),
    ]
    AnyScene = Annotated[Any, Option(_MACHINE, metavar="SCENE", shown="Scene | Mapping[str, Any] | str | Path")]
    Values = Annotated[
        Any,
        Option(_SET, "PATH=VALUE", many=True, old="values", shown="Mapping[str, Any] | None", text=texts.fields),
    ]
    Found = Annotated[Any, Option(_VALUES, "FILE", shown="Estimate | str | Path | None", fronts=HERE)]
    At = Annotated[
        Annotated[list[float], Constraint(min_length=1)] | None,
        BeforeValidator(instants),
        Option(_AT, "T,T,...", old="times", shown="Sequence[float] | ndarray | None", text=texts.numbers),
    ]

Engine = Annotated[
    str, Option("Who simulates; gauss is Shoal's own solver.", "NAME", names="engines", fronts=(*HERE, "form"))
]
Verify = Annotated[bool, Option("Estimate errors by more careful runs.")]
Length = Annotated[float, Limit("a length", "m", gt=0)]
Instant = Annotated[float, Limit("a time", "s", ge=0)]
Seconds = Annotated[float, Limit("a time", "s", gt=0)]
Seed = Annotated[int, Limit("a whole number", ge=0, whole=True), Option("Seed of the random numbers.")]


@dataclass(frozen=True, config=STRICT)
class OfScene:
    """Prepare a scene, with fields of it set, for a loop of your own."""

    scene: AnyScene
    _: KW_ONLY
    set: Values = None
    values: Found = None

    def of(self, scene: Scene) -> Self:
        """Return the same request for a scene whose fields are set."""
        return replace(self, scene=scene, set=None, values=None)

    def machine(self) -> Scene:
        """Return the scene with its fields set, without `values`. Raises InputError."""
        from shoal.scene.load import as_scene

        scene = as_scene(self.scene)
        return scene.with_values(self.set) if self.set else scene


@dataclass(frozen=True, config=STRICT)
class OfProblem:
    """Problem of identification, and fields of its scene to set.

    values: what is sought starts from them, what else they hold is set
    """

    problem: AnyProblem
    _: KW_ONLY
    set: Values = None
    values: Found = None


def check_tolerance(tolerance: float | None, verify: bool, engine: str = "gauss") -> None:
    """Refuse a tolerance that cannot be kept, within a request."""
    if tolerance is not None and not verify:
        wrong("verify", "a tolerance is kept by estimates of the error; leave it out, or do not turn verify off")
    if tolerance is not None and engine != "gauss":
        wrong("tolerance", f"models are chosen for engine gauss only, found engine {engine!r}")
