"""The best of a study as a version of a registered model, one model for each problem."""

from __future__ import annotations

import re
from collections.abc import Sequence

from shoal.identification import load_problem
from shoal.pictures.answer import Answer

from shoal_flows import workers
from shoal_flows.jobs import Fit
from shoal_flows.tracking.identification import best_of
from shoal_flows.tracking.model import files, validation
from shoal_flows.tracking.model.confirmation import Confirmation, confirm
from shoal_flows.tracking.record import MODEL, Registration, Run


def register(study: Run, fits: Sequence[Fit]) -> None:
    """Put the best fit into a run as a model, which enters the registry when the run is sent to MLflow.

    The best is the best of those that can be trusted, else of all; nothing happens without a fit.
    """
    if (best := best_of(fits)) is None:
        return
    confirmation = workers.run(confirmed, best)
    study.files |= {f"{MODEL}/{path}": content for path, content in files.packed(best).items()}
    study.registration = registration(best, confirmation)


def confirmed(fit: Fit) -> Confirmation:
    """Confirm a fit by a second engine."""
    return confirm(Answer(load_problem(fit.cell.problem), fit.estimate))


def registration(fit: Fit, confirmation: Confirmation) -> Registration:
    """Name, description and tags of the version of a fit, and what speaks against it."""
    estimate, doubts = fit.estimate, validation.doubts(fit.estimate, confirmation)
    values = {**estimate.parameters, **estimate.quantities}
    found = "\n".join(f"| {n} | {v.value:.6g} | {v.lower:.6g} to {v.upper:.6g} |" for n, v in values.items())
    tags = {
        "problem": estimate.problem,
        "method": fit.cell.method,
        "fit": fit.cell.name,
        "engine": estimate.engine,
        "data": estimate.data,
        "fitness": repr(estimate.fitness),
        "rms": repr(estimate.rms),
        "verdict": str(estimate.verdict),
        "second engine": str(confirmation),
        **{f"parameter.{name}": repr(value.value) for name, value in estimate.parameters.items()},
    }
    return Registration(
        # A name in the registry may hold neither of these.
        name=re.sub(r"[/:%\"']", "-", estimate.problem),
        about=f"{load_problem(fit.cell.problem).description}\n\n{_USE}",
        description=f"{fit.cell.name}: {estimate.verdict}.\n\n| parameter | value | 95 % |\n|---|---|---|\n{found}\n",
        tags=tags,
        doubts=doubts,
    )


_USE = (
    "`predict` takes times [s] in the column `t [s]` and computes where the markers of the identified machine are, "
    "[m] and [rad], with Shoal, which has to be installed. The alias `champion` is the latest version that passed its "
    "validation."
)
