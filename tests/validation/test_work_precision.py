"""Work and precision: fronts are fronts, references agree, measured errors fall as the method's order says."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib.resources import files
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shoal.engines import get_engine
from shoal_validation.problems import PROBLEMS, get_problem
from shoal_validation.work_precision.contract import OURS, Method, Point, Run, counted
from shoal_validation.work_precision.data import load, save
from shoal_validation.work_precision.front import GAIN, cheapest, front
from shoal_validation.work_precision.gauss import method as own
from shoal_validation.work_precision.measure import FAMILIES, Study, curve
from shoal_validation.work_precision.mesh import twisted, with_mesh
from shoal_validation.work_precision.page import failures, tables
from shoal_validation.work_precision.table import costs
from shoal_validation.work_precision.within import measure

FLEXIBLE = [name for name, problem in PROBLEMS.items() if problem.flexible and not twisted(problem.scene())]
POINT = Point(OURS, "leapfrog", "2C/4C", "step 0.001 s", 1.0, 1.0)
sizes = st.floats(1e-9, 1e3)
points = st.lists(st.tuples(sizes, sizes, st.sampled_from(["ok", "ok", "refused"])), max_size=30).map(
    lambda rows: [replace(POINT, seconds=t, error=e, status=s) for t, e, s in rows]
)


@given(points, st.floats(1e-9, 1e-1))
def test_a_front_is_a_front(cloud: list[Point], floor: float) -> None:
    """Each point of it is clearly nearer than all faster ones, all else is not, and only believed runs are on it."""
    best = front(cloud, floor)
    known = [(p.seconds, max(p.error, floor)) for p in best]
    assert all(a[0] <= b[0] and a[1] * (1 - GAIN) > b[1] for a, b in pairwise(known))
    assert all(p.ok for p in best)
    for p in (p for p in cloud if p.ok):
        assert any(seconds <= p.seconds and error * (1 - GAIN) <= max(p.error, floor) for seconds, error in known)


@given(points, sizes)
def test_the_cheapest_is_the_cheapest(cloud: list[Point], reach: float) -> None:
    """No believed run within the error takes less time."""
    found = cheapest(cloud, reach)
    there = [p.seconds for p in cloud if p.ok and p.error <= reach]
    assert (found.seconds if found else None) == min(there, default=None)


@pytest.mark.parametrize("name", FLEXIBLE)
def test_stored_references_are_exact_enough(name: str) -> None:
    """The file states an error of at most 3e-6 m, and its own refinements bear it out."""
    data = json.loads((files("shoal_validation.problems") / "computed" / f"{name}.json").read_text(encoding="utf-8"))
    changes = [data["settings"][key]["largest"] for key in ("change_from_mesh", "change_from_step")]
    assert data["error"] == pytest.approx(sum(changes))
    assert data["error"] <= 3e-6
    assert data["agreement"] <= 2 * data["error"]


@pytest.mark.parametrize("name", FLEXIBLE)
def test_our_beam_agrees_with_the_reference(name: str) -> None:
    """Exudyn's converged cables and our quintic beam, which share no shape function, are the same beam: 4/20 elements
    are 1.3e-5 m off at most, a tenth of what 2/12 elements are."""
    problem = get_problem(name)
    scene = with_mesh(problem.scene(), "4Q/20Q").with_values({"solver.integrator": "leapfrog", "solver.step": 1e-4})
    assert problem.error(get_engine("gauss").simulate(scene, problem.times)) < 2e-5


def test_our_director_rod_agrees_with_the_reference_by_beams() -> None:
    """Extrapolated from 8 and 16 elements, as those of second order are: nearer than the finer one by far."""
    problem = get_problem("swinging-strip")
    coarse, fine = (
        get_engine("gauss").simulate(with_mesh(problem.scene(), mesh), problem.times) for mesh in ("8D", "16D")
    )
    limit = (4 * fine.marker("E") - coarse.marker("E")) / 3
    assert np.max(np.linalg.norm(limit - problem.reference.points, axis=1)) < 1e-3
    assert problem.error(fine) > 1e-3


def test_stored_references_by_beams_tell_how_far_our_rods_are() -> None:
    """Which is the largest of what is not known."""
    data = json.loads(
        (files("shoal_validation.problems") / "computed" / "swinging-strip.json").read_text(encoding="utf-8")
    )
    changes = [data["settings"][key]["largest"] for key in ("change_from_mesh", "change_from_step")]
    assert data["error"] == pytest.approx(max(sum(changes), data["agreement"]))
    assert data["error"] <= 3e-4


@pytest.mark.parametrize("name", ["heavy-top", "bricard"])
def test_mujoco_comes_near_machines_in_space(name: str) -> None:
    """An open chain, and a loop whose soft constraints stiffen with a shorter step."""
    pytest.importorskip("mujoco")
    problem = get_problem(name)
    method = FAMILIES["MuJoCo"](problem, True)[0]
    assert ("soft" in method.name) == (name == "bricard")
    errors = [
        next(curve(problem, replace(method, settings=(h,)), repeats=1)).error for h in counted(problem, (2000, 8000))
    ]
    assert errors[1] < errors[0] / 8
    assert errors[1] < 1e-5


@pytest.mark.slow
@pytest.mark.parametrize("name", FLEXIBLE)
def test_our_finest_beam_agrees_with_the_reference(name: str) -> None:
    """On 16/32 elements only the reference's own error is left; two thirds of it are that of our step."""
    problem = get_problem(name)
    scene = with_mesh(problem.scene(), "16Q/32Q").with_values({"solver.integrator": "leapfrog", "solver.step": 1e-5})
    assert problem.error(get_engine("gauss").simulate(scene, problem.times)) < 2 * problem.reference.error


def test_leapfrog_is_of_second_order_on_its_mesh() -> None:
    """The measured error against the time-converged mesh falls with the step's square; the continuum's does not."""
    problem = get_problem("flexible-case-1")
    method = own("leapfrog", "2C/4C", counted(problem, (2000, 4000, 8000)))
    measured = list(curve(problem, method, repeats=1))
    errors = np.array([p.mesh_error for p in measured], dtype=float)
    assert np.log2(errors[:-1] / errors[1:]) == pytest.approx(2.0, abs=0.15)
    assert measured[-1].error == pytest.approx(measured[0].error, rel=1e-2)
    assert measured[-1].error > 1e3 * errors[-1]


def test_runs_that_fail_have_a_status_and_no_place() -> None:
    """A step beyond the stability limit is refused; a run that is off by a tenth of the machine is silently wrong."""
    problem = get_problem("flexible-case-1")
    refused = next(curve(problem, own("leapfrog", "2C/4C", (1e-3,))))
    assert refused.status == "refused"
    assert "stability limit" in refused.message

    path = problem.reference.points + np.array([0.0, 1.0])
    wrong = next(curve(problem, Method("x", "y", "", "step", (1.0,), lambda *_: lambda: Run(path)), repeats=1))
    assert wrong.status == "silently wrong"

    study = Study(problem, [refused, wrong])
    assert front(study.points, 0.0) == []
    assert all(line.ours is None for line in costs(study))
    assert "leapfrog: 1 refused" in failures([study])
    assert "y: 1 silently wrong" in failures([study])


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_comes_near_the_rigid_double_pendulum(family: str) -> None:
    """Its finest setting is within a millimetre of Lagrange's equations: the scene was understood."""
    if family == "MuJoCo":
        pytest.importorskip("mujoco")
    problem = get_problem("double-pendulum")
    method = FAMILIES[family](problem, True)[1 if family == "ours" else 0]
    middle = method.settings[len(method.settings) // 2]
    found = next(curve(problem, replace(method, settings=(middle,)), repeats=1))
    assert found.ok
    assert found.error < 1e-3


def test_data_can_be_drawn_again(tmp_path: Path) -> None:
    """What was saved comes back: four digits of every number, and every status."""
    wrong = replace(POINT, error=float("nan"), status="silently wrong", message="why")
    study = Study(
        get_problem("flexible-case-1"), [replace(POINT, error=1.23456e-3, mesh_error=2e-5), wrong], {"x": "y"}
    )
    save(tmp_path, [study], {"processor": "x"})
    (found,), machine = load(tmp_path)
    assert machine == {"processor": "x"}
    assert found.left_out == study.left_out
    assert found.points[0] == replace(study.points[0], error=1.235e-3)
    assert not found.points[1].ok
    assert found.points[1].message == "why"


def test_tables_tell_what_an_error_costs() -> None:
    """Each error that is reached has a line with the run that reaches it; one that is not says so."""
    problem = get_problem("flexible-case-1")
    text = tables([Study(problem, [replace(POINT, seconds=2e-3, error=5e-4)])], {"processor": "x"})
    assert "| flexible-case-1 | 1e-03 | 2 ms: leapfrog, 2C/4C, step 0.001 s | not reached |" in text
    assert "| flexible-case-1 | 1e-04 | not reached |" in text
    assert problem.reference.source in text


@pytest.mark.slow
def test_what_an_error_costs_can_be_measured_again() -> None:
    studies, _ = load(Path(__file__).parents[2] / "docs" / "charts")
    kept = next(one for one in studies if one.problem.name == "flexible-hanging")
    known = {point.label: point.error for point in kept.points}
    rows = list(measure([kept], rounds=1))
    assert len(rows) == 3 * len(costs(kept)), "ours, 64 of ours and Exudyn's for each error"
    assert [row.error for row in rows] == pytest.approx([known[row.label] for row in rows], rel=1e-3)
    assert all(row.error <= row.reach for row in rows)
