"""Results of the flows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Generic, Protocol, TypeVar

from shoal.engines.compare import Comparison
from shoal.engines.sweep import Sweep
from shoal.identification.design import Design
from shoal.json_values import plain
from shoal.mechanics.analysis.equilibrium import Equilibrium
from shoal.response import Response
from shoal.scene import Scene
from shoal.selection import Selection
from shoal.trajectory import Trajectory

from shoal_flows.exports import Exports
from shoal_flows.jobs import Fit
from shoal_flows.pictures import Picture
from shoal_flows.verdicts import verdict


@dataclass(frozen=True)
class Study:
    """Fits of one problem, in the order asked for. run_id: of the parent run in MLflow; failures: reason by cell."""

    name: str
    run_id: str
    fits: list[Fit]
    failures: dict[str, str]
    pictures: dict[str, Picture] = field(default_factory=dict)

    @property
    def trusted(self) -> bool:
        """Return whether every optimisation ended with an answer that can be used."""
        return bool(self.fits) and not self.failures and all(f.estimate.verdict.trusted for f in self.fits)

    def doubts(self) -> list[str]:
        """Every reason not to trust the whole."""
        found = [f"{fit.cell.name}: {doubt}" for fit in self.fits for doubt in verdict(fit.estimate).doubts]
        return [*found, *(f"{name} failed: {reason}" for name, reason in self.failures.items())]

    def by_method(self) -> dict[str, Fit]:
        """The first fit of each method."""
        return {f.cell.method: f for f in reversed(self.fits)}

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal run identify --json` prints."""
        return {
            "status": "ok" if self.trusted else "failed",
            "study": self.name,
            "run_id": self.run_id,
            "estimates": [f.estimate.to_json() for f in self.fits],
            "failures": self.failures,
        }


class Answer(Protocol):
    """Interface of the library's answers."""

    def to_json(self) -> dict[str, Any]:
        """Return the answer as plain data."""
        ...


A = TypeVar("A", bound=Answer)


@dataclass(frozen=True)
class Logged(Generic[A]):
    """An answer with the id of its run; trusted if its verdict leaves no doubt."""

    answer: A
    run_id: str

    @property
    def trusted(self) -> bool:
        """Return whether it may be believed."""
        return not self.doubts()

    def doubts(self) -> list[str]:
        """Return why it is not trusted."""
        return list(verdict(self.answer).doubts)

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal run FLOW --json` prints."""
        return {**self.answer.to_json(), "run_id": self.run_id}


@dataclass(frozen=True)
class Compared(Logged[Comparison]):
    """A comparison of engines, with its picture."""

    picture: Picture


@dataclass(frozen=True)
class Swept(Logged[Sweep]):
    """A sweep."""


@dataclass(frozen=True)
class Responded(Logged[Response]):
    """Response of an uncertain machine."""


@dataclass(frozen=True)
class Simulated(Logged[Trajectory]):
    """A motion of a scene."""

    scene: Scene

    def to_json(self) -> dict[str, Any]:
        """Return the motion with the name of its scene."""
        return plain({**super().to_json(), "scene": self.scene.name})  # type: ignore[no-any-return]


@dataclass(frozen=True)
class AtRest(Logged[Equilibrium]):
    """An equilibrium."""


@dataclass(frozen=True)
class Selected(Logged[Selection]):
    """A chosen model."""

    def to_json(self) -> dict[str, Any]:
        """Return the motion of the model, and how it was chosen."""
        motion, selection = self.answer.trajectory.to_json(), self.answer.to_json()
        return {**motion, "selection": selection, "run_id": self.run_id}


@dataclass(frozen=True)
class Designed(Logged[Design]):
    """Design of an experiment."""


@dataclass(frozen=True)
class Exported(Logged[Exports]):
    """Files of other tools."""


@dataclass(frozen=True)
class DemoResult:
    """Both cases: by every method, on several meshes, on the mesh of the data, and on several engines."""

    studies: dict[str, Study]
    meshes: dict[str, Study]
    same_mesh: dict[str, Study]
    comparisons: dict[str, Compared]

    @property
    def trusted(self) -> bool:
        """Return whether least squares and the repaired swarm found trusted answers and the engines agree on the
        tip.
        """
        return not self.doubts()

    def doubts(self) -> list[str]:
        """Every reason not to trust the whole."""
        found = []
        for name, study in self.studies.items():
            fits = study.by_method()
            for method in ("least-squares", "iafsa"):
                if method not in fits:
                    found.append(f"{name}: {method} failed: {next(iter(study.failures.values()), '')}")
                elif not fits[method].estimate.verdict.trusted:
                    found.append(f"{name}: {method}: {fits[method].estimate.verdict}")
        for name, compared in self.comparisons.items():
            if not compared.trusted:
                found.append(f"{name}: an engine refused the scene or failed")
            for row in compared.answer.differences():
                distance = row["largest"]
                if "gauss" in row["engines"] and row["marker"] == "B" and not (distance or 1.0) < AGREEMENT:
                    found.append(f"{name}: {' and '.join(row['engines'])} differ by {distance} m at B")
        return found

    def _groups(self) -> tuple[dict[str, Study], ...]:
        return self.studies, self.meshes, self.same_mesh

    def to_json(self) -> dict[str, Any]:
        """The object that `shoal run demo --json` prints."""
        return {
            "status": "ok" if self.trusted else "failed",
            "doubts": self.doubts(),
            "studies": [study.to_json() for group in self._groups() for study in group.values()],
            "comparisons": {name: compared.to_json() for name, compared in self.comparisons.items()},
        }


AGREEMENT = 1e-4
"""Distance [m] of the tip by which engines may differ at the scenes' own step."""
