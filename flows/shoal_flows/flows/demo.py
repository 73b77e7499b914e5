"""Flow: the main job. Both cases of the paper by every method, on several meshes, on three engines."""

from __future__ import annotations

from contextlib import ExitStack

from prefect import flow
from shoal.requests.compare import Compare

from shoal_flows.flows.runner import side_by_side
from shoal_flows.flows.study import Draw, Running, open_running
from shoal_flows.flows.tasks import measure, run_engines
from shoal_flows.jobs import Cell
from shoal_flows.pictures import draw_convergence, draw_mesh_error, draw_residuals, draw_trajectory
from shoal_flows.plan import CASES, SAME_MESH, SLOWEST_FIRST, TITLES, mesh_cells, method_cells, same_mesh_cells
from shoal_flows.results import Compared, DemoResult, Study

METHOD_PICTURES: dict[str, Draw] = {
    "convergence": draw_convergence,
    "residuals": draw_residuals,
    "trajectory": draw_trajectory,
}


@flow(name="demo", task_runner=side_by_side())
def demo() -> DemoResult:
    """Identify both cases by every method and on four meshes; compare the engines on both scenes."""
    measured = {case: measure.submit(case, None) for case in (*CASES, *SAME_MESH.values())}
    compared = {case: run_engines.submit(Compare(scene)) for case, scene in CASES.items()}
    with ExitStack() as stack:

        def begin(what: str, cells: list[Cell]) -> Running:
            case = cells[0].problem
            return stack.enter_context(open_running(f"{case} · {what}", cells, measured[case].result()))

        studies = {case: begin("identify", method_cells(case)) for case in CASES}
        meshes = {case: begin("mesh error", mesh_cells(case)) for case in CASES}
        same = {case: begin("same mesh", same_mesh_cells(case)) for case in CASES}
        # The longest first, so that no core waits for the other at the end.
        queue = [
            (study, cell) for study in (*studies.values(), *meshes.values(), *same.values()) for cell in study.cells
        ]
        for study, cell in sorted(queue, key=lambda item: SLOWEST_FIRST.index(item[1].method)):
            study.submit(cell)
        return DemoResult(
            {case: _published(study) for case, study in studies.items()},
            {case: _finish(study, mesh_error=draw_mesh_error) for case, study in meshes.items()},
            {case: _finish(study) for case, study in same.items()},
            {case: Compared(*future.result()) for case, future in compared.items()},
        )


def _finish(study: Running, **pictures: Draw) -> Study:
    return study.finish(TITLES[study.cells[0].problem], pictures)


def _published(study: Running) -> Study:
    found = _finish(study, **METHOD_PICTURES)
    study.publish(found)
    return found
