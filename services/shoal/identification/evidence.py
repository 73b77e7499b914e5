"""Evidence at an answer, before it is judged: residuals, derivatives, the model's error, tests."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from shoal.identification.deadline import unless_late
from shoal.identification.diagnostics.hypotheses import ScoreTest
from shoal.identification.diagnostics.residual_tests import ResidualTests, residual_tests
from shoal.identification.forward import ForwardModel
from shoal.identification.uncertainty.covariance import Block, blocks_of
from shoal.identification.uncertainty.linearisation import Linearisation, followed, linearise
from shoal.identification.uncertainty.model_error import Corrections, ModelError, model_error, rms_of
from shoal.identification.uncertainty.sensitivity import Sensitivity, believed
from shoal.identification.uncertainty.uncertain_inputs import Given, taken_as_given
from shoal.trajectory import Array


@dataclass(frozen=True, eq=False)
class Evidence:
    """Residuals, derivatives, model error and tests at a point (parameters,).

    predicted: channels there by recording, (samples, channels)
    residual: there, (rows,); not finite where it cannot be simulated, or no time was left to
    seen: the same, zeros where it is not finite, and its Jacobian
    looked: whether there was time for derivatives
    possible: whether the point can be simulated
    blocks: the series of the residuals
    beside: the linearisation, with what the model, not the noise, leaves, and with what is `given`
    at: the same with what uncertain `fields` of the scene add
    error: of the model itself; mesh, theory: sizes of its parts, root mean squares
    given: what is taken as known and is not quite: measured signals, between their samples too
    """

    point: Array
    predicted: dict[str, Array]
    residual: Array
    seen: Sensitivity
    looked: bool
    possible: bool
    blocks: list[Block]
    beside: Linearisation
    at: Linearisation
    error: ModelError
    mesh: float | None
    theory: float | None
    tests: ResidualTests
    given: list[Given]
    fields: Given | None

    @property
    def known(self) -> bool:
        """Return whether intervals can be estimated."""
        return self.possible and self.looked

    def score_test(self, model: ForwardModel) -> ScoreTest:
        """Return what tests hypotheses at the point of a model."""
        seen, refined = self.seen, self.error.refined(self.seen.residual, self.seen.jacobian, self.at.pseudo_inverse)
        rows = np.ones(len(seen.residual), dtype=bool)
        if seen.end is not None:
            rows[: len(model.rows.time)] = model.rows.time <= seen.end + 1e-12
        given = [one for one in (*self.given, self.fields) if one is not None]
        residual = seen.residual if refined is None else refined
        noise, stated = self.at.alone.noise, model.rows.noise is not None
        return ScoreTest(residual, followed(seen.jacobian)[0], self.blocks, noise, given, stated, rows)

    @property
    def correction(self) -> Corrections:
        """Correction of the point by the model's error."""
        return self.error.corrections(self.at.pseudo_inverse)


def evidence(model: ForwardModel, point: Array) -> Evidence:
    """Around a point, as far as time allows."""
    foreseen = unless_late(lambda: _predicted(model, point), None)
    predicted = foreseen or _unpredicted(model)
    residual = model.compared(point[None], {name: seen[None] for name, seen in predicted.items()})[0]
    looked = None if foreseen is None else unless_late(lambda: believed(model, point, residual), None)
    seen = looked or _unseen(model, residual)
    tested = bool(np.all(np.isfinite(residual)))
    possible = tested or looked is None
    if not tested:
        seen = replace(seen, residual=np.zeros_like(seen.residual), jacobian=np.zeros_like(seen.jacobian))
    blocks = blocks_of(model, len(seen.residual))
    at = linearise(seen.jacobian, seen.residual, model.sizes(point), blocks, seen.error)
    error, given, fields = ModelError(None, None), list[Given](), None
    if possible and looked is not None:
        error = unless_late(lambda: model_error(model, point, predicted, seen.residual), error)
        found = unless_late(lambda: taken_as_given(model, point, predicted, seen.residual), None)
        (given, fields), looked = found or (given, fields), None if found is None else looked
    parts = (_size(model, error.mesh), _size(model, error.theory))
    known = [one for one in (*given, fields) if one is not None]
    unshown = [one.left(seen.jacobian, at.pseudo_inverse) for one in known]
    limit = float(np.linalg.norm([parts[0] or 0.0, parts[1] or 0.0, *unshown]))
    chosen = float(np.linalg.norm([size for size, one in zip(unshown, known, strict=True) if one.one_of_many]))
    refined = error.refined(seen.residual, seen.jacobian, at.pseudo_inverse)
    tests = ResidualTests.not_made(model)
    if tested:
        tests = residual_tests(model, seen.residual, blocks, at.noise, limit, refined, chosen)
    independent = float(np.sqrt(np.sum(np.any(seen.jacobian != 0.0, axis=1))))
    at = replace(at, systematic=tests.excess * independent)
    beside = reduce(lambda so_far, one: one.spread(so_far), given, at)
    at = beside if fields is None else fields.spread(beside)
    parts_found = point, predicted, residual, seen, looked is not None, possible, blocks, beside, at, error
    return Evidence(*parts_found, *parts, tests, given, fields)


def _size(model: ForwardModel, rows: Array | None) -> float | None:
    """Root mean square of rows of what was measured."""
    return None if rows is None else rms_of(rows[: len(model.rows.time)])


def _unseen(model: ForwardModel, residual: Array) -> Sensitivity:
    """Empty sensitivity of an answer, where there is no time for derivatives."""
    nothing = np.zeros((len(residual), len(model.names)))
    return Sensitivity(residual, nothing, np.inf, np.inf, nothing)


def _predicted(model: ForwardModel, point: Array) -> dict[str, Array]:
    """Return the channels of each recording at an answer, (samples, channels). Raises TimeIsUp."""
    return {name: np.asarray(model.observe(point[None], name)[0]) for name in model.measurement.recordings}


def _unpredicted(model: ForwardModel) -> dict[str, Array]:
    """Return nan for the channels of each recording, where there is no time to run it."""
    return {name: np.full(recording.values.shape, np.nan) for name, recording in model.measurement.recordings.items()}
