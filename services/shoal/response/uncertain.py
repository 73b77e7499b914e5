"""Response of a machine to uncertain parameters: inputs, model, runs, errors of the model, limits, findings."""

from __future__ import annotations

from contextlib import closing
from dataclasses import replace

from shoal.compile import clock
from shoal.requests.uncertain import Uncertain
from shoal.response.allocate import allocate
from shoal.response.assess import allow_for_limits, assess_limits
from shoal.response.conclusions import findings_about, withheld
from shoal.response.event_shares import event_shares
from shoal.response.problem import read
from shoal.response.respond import respond_markers
from shoal.response.result import Response
from shoal.response.verify import compare_meshes, known_errors
from shoal.scene import Scene


def uncertain(asked: Uncertain, scene: Scene) -> Response:
    """Bound or predict the motion of the markers of a scene of which some fields are intervals or distributions.

    scene: that of the request, with its fields set. Raises InputError, ComputationError.
    """
    begin = clock.now()
    problem = read(asked, scene)
    with closing(problem.keep):
        found = respond_markers(problem)
        known = known_errors(problem, found)
        found = known.widened(found)
        finer = compare_meshes(problem, found)
        limits = assess_limits(problem, found)
        allocation = allocate(problem, limits)
    statistics, missed = allow_for_limits(problem, found.statistics, limits)
    response = Response(
        findings=[],
        scene=problem.scene.name,
        method=asked.method,
        why=found.found.why,
        inputs=problem.inputs,
        times=problem.times,
        markers=tuple(problem.scene.markers),
        quantities=problem.model.quantities,
        evaluations=found.runs.evaluations,
        repeated=found.runs.repeated,
        failed=found.runs.failed,
        seed=asked.seed,
        wall_s=clock.now() - begin,
        horizon=min(found.horizon, float(problem.times[-1])),
        bounds=found.bounds,
        statistics=statistics,
        errors=known.budget,
        model=known.columns,
        stated=problem.scene,
        engine=asked.engine,
        limits=tuple(limits),
        allocation=allocation,
        boxes=found.boxes,
        finer=finer,
        controls=found.runs.controls,
        elsewhere=problem.starts.elsewhere,
        words=event_shares(problem.model, found),
    )
    findings = findings_about(response, problem, found, known) + missed
    return withheld(replace(response, findings=findings))
