"""The cheapest model whose error meets a tolerance: kept word, pruning, refusals."""

from __future__ import annotations

import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.integrate import solve_ivp
from shoal.cli import main
from shoal.engines import get_engine
from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.scene import Scene, load_scene
from shoal.selection import select
from shoal.selection.levels import LADDERS, RIGID, below, cable, quintic
from shoal.selection.prior import estimate
from shoal.selection.refine import refine, settled
from shoal.selection.run import Candidate, distance
from shoal.selection.work import INTEGRATOR, Forecast
from shoal_validation.problems import get_problem
from shoal_validation.selection.machines import draw

HEADLINE = load_scene("flexible-double-pendulum")


def _with_modulus(value: float) -> Scene:
    return HEADLINE.with_values({f"bodies.{rod}.youngs_modulus": value for rod in ("OA", "AB")})


@pytest.mark.by_day(1)
@pytest.mark.parametrize("tolerance", [1e-2, 1e-3])
def test_headline_keeps_its_word_against_exudyn(tolerance: float) -> None:
    problem = get_problem("flexible-case-1")
    selection = select(problem.scene(), tolerance, problem.times)
    assert selection.met
    assert selection.trajectory.ok
    assert problem.error(selection.trajectory) <= tolerance
    assert all(level != RIGID for level in selection.chosen.levels.values())


def test_chosen_scene_reproduces_the_run() -> None:
    selection = select(HEADLINE, 1e-2)
    again = GaussEngine().simulate(selection.chosen.scene)
    np.testing.assert_allclose(again.points, selection.trajectory.points, atol=1e-9)


@pytest.mark.parametrize(("modulus", "rigid"), [(2e16, True), (2e14, True), (2e7, False)])
@pytest.mark.by_day(1)
def test_stiff_rods_come_out_rigid_and_soft_ones_do_not(modulus: float, rigid: bool) -> None:
    selection = select(_with_modulus(modulus), 1e-2)
    assert selection.met
    assert all((level == RIGID) == rigid for level in selection.chosen.levels.values())


def test_stiff_rods_bend_by_a_few_modes_and_keep_their_word_against_exudyn() -> None:
    """Whose steps no axial wave limits; rigid rods are 2.8 mm off."""
    scene = _with_modulus(2e10).with_values({"solver.duration": 0.4})
    selection = select(scene, 1e-3)
    assert selection.met
    assert {level.element for level in selection.chosen.levels.values()} == {"modal"}
    assert selection.trajectory.steps < selection.candidates[0].trajectory.steps / 50
    cables = scene.with_values({"bodies.OA.elements": 8, "bodies.AB.elements": 8, "solver.step": 2e-4})
    theirs = get_engine("exudyn").simulate(cables, selection.trajectory.times)
    assert theirs.ok, theirs.message
    assert selection.trajectory.distance(theirs) <= 1e-3


@pytest.mark.slow
def test_rods_with_shear_bend_by_modes_where_that_is_enough() -> None:
    """Seed 158 of the random machines: elements take 480 times the work. Judged by 8 rods with shear each."""
    machine = draw(158)
    found = select(machine.scene, machine.tolerance)
    assert found.met
    assert "shear and rotary inertia" in found.reason
    assert {level.element for level in found.chosen.levels.values()} == {"modal"}
    sheared = [candidate.work for candidate in found.candidates if "reissner" in candidate.name]
    assert found.chosen.work < min(sheared) / 100
    fine = {f"bodies.{rod}.{field}": value for rod in found.limits
            for field, value in (("element", "simo-reissner"), ("elements", 8))}  # fmt: skip
    judge = GaussEngine().simulate(machine.scene.with_values(fine), found.trajectory.times)
    assert judge.ok, judge.message
    assert found.trajectory.distance(judge) <= machine.tolerance


@pytest.mark.slow
def test_rods_with_damping_have_models_too() -> None:
    """Cables of them have no reduced quadrature. Judged by twice as many quintic elements as the reference's."""
    damped = _with_modulus(2e8).with_values({f"bodies.{rod}.retardation": 1e-3 for rod in ("OA", "AB")})
    selection = select(damped.with_values({"solver.duration": 0.3}), 1e-3)
    assert selection.met
    mesh = {"element": "ancf-quintic", "elements": 8}
    values = {f"bodies.{rod}.{field}": value for rod in ("OA", "AB") for field, value in mesh.items()}
    fine = damped.with_values({**values, "solver.duration": 0.3, "solver.integrator": "radau5"})
    assert GaussEngine().simulate(fine, selection.trajectory.times).distance(selection.trajectory) <= 1e-3


@pytest.mark.slow
def test_rods_whose_strains_are_asked_for_are_made_of_elements() -> None:
    levels = select(_with_modulus(2e14), 1e-2, meshed=("AB",)).chosen.levels
    assert levels["OA"] == RIGID
    assert levels["AB"].element in ("ancf-cable", "ancf-quintic")


def test_a_stiff_rod_and_a_soft_one_are_told_apart() -> None:
    scene = HEADLINE.with_values({"bodies.OA.youngs_modulus": 1e14})
    levels = select(scene, 3e-3).chosen.levels
    assert levels["OA"] == RIGID
    assert levels["AB"] != RIGID


def test_very_stiff_rods_are_judged_without_a_flexible_run() -> None:
    selection = select(_with_modulus(2e16), 1e-2)
    assert set(selection.rigid) == {"OA", "AB"}
    assert all(level == RIGID for candidate in selection.candidates for level in candidate.levels.values())


def test_ladder_says_what_was_tried_and_why_it_stopped() -> None:
    data = select(HEADLINE, 1e-2).to_json()
    assert data["status"] == "met"
    assert sum(candidate["chosen"] for candidate in data["rungs"]) == 1
    assert all(candidate["wall_s"] > 0 and candidate["steps"] > 0 for candidate in data["rungs"])
    assert "reference" in data["reason"]
    assert data["estimated_error"] <= 1e-2


def test_rigid_machine_gets_the_loosest_tolerance_that_does() -> None:
    """Of slender rods, as the reference is."""
    problem = get_problem("double-pendulum")
    scene = problem.scene().with_values({"solver.theory": "slender"})
    coarse, fine = (select(scene, tolerance, problem.times) for tolerance in (1e-2, 1e-7))
    assert problem.error(coarse.trajectory) <= 1e-2
    assert problem.error(fine.trajectory) <= 1e-7
    assert coarse.chosen.work < fine.chosen.work


def test_chaos_is_owned_up_to() -> None:
    selection = select(load_scene("rigid-double-pendulum").with_values({"solver.duration": 60.0}), 1e-3)
    assert not selection.met
    assert not selection.trajectory.ok
    assert set(selection.trajectory.codes) <= {"tolerance-not-met", "error-not-estimated"}


def test_what_would_take_too_long_is_not_tried_and_not_met() -> None:
    selection = select(_with_modulus(1e19), 1e-9, patience=5.0)
    assert not selection.met
    assert all(level == RIGID for candidate in selection.candidates for level in candidate.levels.values())
    assert "element steps, about" in selection.trajectory.message


@pytest.mark.slow
def test_where_no_theory_settles_it_is_told_of_both() -> None:
    """A rod so soft that its slender runs are rejected, and with shear is not settled by what the patience allows."""
    machine = draw(86)
    found = select(machine.scene, machine.tolerance, patience=0.3)
    assert not found.met
    assert re.match("slender rods: the runs are rejected: .*; with shear and rotary inertia: the next", found.reason)


def test_a_torque_that_folds_a_rod_ends_the_search() -> None:
    """Before rods with shear, which no number of elements settles either."""
    machine = draw(79)
    found = select(machine.scene, machine.tolerance)
    assert not found.met
    assert "the torque load bends A to a strain of 3.1 at its surface" in found.trajectory.message
    assert not any("reissner" in candidate.name for candidate in found.candidates)


@pytest.mark.slow
def test_the_way_down_takes_a_share_of_the_work_of_the_climb(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the run that it is at when that much is done; what is found by then meets the tolerance."""
    scene = _with_modulus(2e7).with_values({"solver.duration": 0.2})
    free = select(scene, 1e-4)
    monkeypatch.setattr("shoal.selection.coarsen.SEARCH", 0.0)
    monkeypatch.setattr("shoal.selection.coarsen.SHARE", 0.2)
    bound = select(scene, 1e-4)
    climbed = select(scene, 1e-4, coarsened=False)
    assert all(found.chosen.error <= 1e-4 for found in (free, bound, climbed))
    work = [sum(candidate.work for candidate in found.candidates) for found in (climbed, bound, free)]
    assert work[0] < work[1] < work[2]
    assert bound.chosen.work <= climbed.chosen.work


def test_patience_is_stated_with_a_tolerance() -> None:
    with pytest.raises(InputError, match="patience: needs a time above 0 s"):
        select(HEADLINE, 1e-3, patience=0.0)
    run = CliRunner().invoke(main, ["simulate", "flexible-double-pendulum", "--patience", "5"])
    assert isinstance(run.exception, SystemExit | InputError)
    assert run.exit_code != 0
    hasty = select(HEADLINE, 1e-6, [0.1], patience=1e-3)
    assert not hasty.met
    assert "more than 0.001 s" in hasty.reason


def test_rods_that_cannot_bend_say_why() -> None:
    offset = {"kind": "torsion-spring", "first": {"body": "OA", "point": [0.5, 0.1]}, "second": {"body": "AB"}}
    scene = _with_modulus(2e9).with_values(
        {"bodies.OA.element": "rigid", "bodies.AB.element": "rigid", "loads": {"spring": offset}}
    )
    selection = select(scene, 1e-3)
    assert "not on the axis" in selection.rigid["OA"]
    assert selection.chosen.levels["AB"] != RIGID


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, np.inf])
def test_tolerance_is_a_length_above_zero(tolerance: float) -> None:
    with pytest.raises(InputError, match="tolerance: needs a length above 0 m"):
        select(HEADLINE, tolerance)


def test_shear_that_the_theory_leaves_out_is_reported() -> None:
    """Exudyn's geometrically exact beam, which has shear, ends 0.36 mm from the cable's (16/32 elements, mechanics)."""
    assert 0.36e-3 / 3 < select(HEADLINE, 1e-2).shear < 0.36e-3 * 3


def test_command_line_prints_the_ladder() -> None:
    arguments = ["simulate", "flexible-double-pendulum", "--tolerance", "1e-2", "--at", "0.25,0.5", "--json"]
    run = CliRunner().invoke(main, arguments, standalone_mode=False)
    data: dict[str, Any] = json.loads(run.stdout)
    assert data["status"] == "ok"
    assert data["markers"]["B"]["t"] == [0.25, 0.5]
    assert data["selection"]["levels"]["AB"]["element"] != "rigid"


class At:
    """A motion that is told by one number."""

    ok = True

    def __init__(self, x: float) -> None:
        self.x = x

    def distance(self, other: Any) -> float:
        return abs(self.x - other.x)


@pytest.mark.parametrize(
    ("places", "left"),
    [
        ([0.0, 0.8, 1.0, 1.04], 0.04 / 3),  # falls of 4 and 5: the smaller one counts
        ([0.0, 0.4, 0.7, 0.9], 0.6),  # slow falls promise little
        ([0.0, 0.1, 0.6, 0.7], 0.4),  # gaps that grew nothing
        ([0.0, 1.0, 1.01], 0.01 / 3),  # one fall alone may be chance
        ([0.0, 0.3], 0.3),
    ],
)
def test_what_is_left_is_told_by_how_fast_the_distances_fell(places: list[float], left: float) -> None:
    candidates: Any = [SimpleNamespace(trajectory=At(x), levels={}) for x in places]
    assert settled(candidates)[0] == pytest.approx(left)


class Meshes:
    """Runs whose distance from the truth is a function of the levels."""

    forecast, patience = SimpleNamespace(work=lambda _: 0.0), 1.0
    coarsest, fewest = dict.fromkeys("AB", quintic(1)), dict.fromkeys("AB", 1)

    def __init__(self, error: Any) -> None:
        self.error = error

    def refined(self, count: Any) -> Any:
        return {rod: quintic(n) for rod, n in count.items()}

    def __call__(self, levels: Any, *_: Any) -> Any:
        elements = {rod: level.elements for rod, level in levels.items()}
        return Candidate(levels, HEADLINE, At(self.error(**elements)), 0.0)  # type: ignore[arg-type]


@pytest.mark.parametrize("fall", [1.4, 1.9, 3.0, 8.0])
def test_a_climb_tells_no_less_than_the_error_that_is_left(fall: float) -> None:
    """Errors that fall slowly with every doubling: neighbours agree long before the error is small."""
    meshes: Any = Meshes(lambda A: fall ** -np.log2(A))
    found: Any = refine(meshes, ("A",), {}, 0.5)
    assert found.candidate.trajectory.x <= 1.001 * found.error
    assert found.error <= 0.25


def test_rods_that_are_left_behind_are_part_of_the_error() -> None:
    """Rod B is refined no more after the second mesh, which is still 0.01 m off."""
    meshes: Any = Meshes(lambda A, B: 0.9 * A**-2.0 + 0.02 / B)
    found: Any = refine(meshes, ("A", "B"), {}, 0.2)
    assert found.candidate.levels["B"].elements == 2
    assert found.candidate.trajectory.x <= 1.001 * found.error


@pytest.mark.slow
def test_a_soft_rod_that_kinks_is_met_by_a_mesh_that_follows_it() -> None:
    """Seed 31 of the random machines: coarse meshes lose energy in the kink; Exudyn's are 1e-4 m off."""
    pytest.importorskip("exudyn")
    from shoal.engines.exudyn import ExudynEngine

    machine = draw(31)
    found = select(machine.scene, machine.tolerance)
    assert found.met
    assert "no theory of rods holds beyond 1" in found.reason
    assert any(candidate.role == "reference" and not candidate.ok for candidate in found.candidates)
    fine = {f"bodies.{rod}.element": "simo-reissner" for rod in "ABC"} | {
        f"bodies.{rod}.elements": 128 for rod in "ABC"
    }
    beams = ExudynEngine(beam="geometrically-exact", modified_newton=True)
    judge = beams.simulate(machine.scene.with_values(fine | {"solver.step": 1e-4}), found.trajectory.times)
    assert found.trajectory.distance(judge) < machine.tolerance + 1e-4


@pytest.mark.parametrize("limit", list(LADDERS))
def test_levels_below_are_coarser(limit: str) -> None:
    ladder = LADDERS[limit]
    for level in ladder:
        assert all(ladder.index(coarser) < ladder.index(level) for coarser in below(level, limit, ladder[0]))


THICK = HEADLINE.with_values(
    {f"bodies.{rod}.height": 0.1 for rod in ("OA", "AB")} | {"solver.theory": "auto", "solver.duration": 0.3}
)


@pytest.mark.slow
def test_thick_rods_shear_and_keep_their_word_against_geometrically_exact_beams() -> None:
    """Exudyn's geometrically exact beams have shear; slender rods end beyond the tolerance from them."""
    pytest.importorskip("exudyn")
    from shoal.engines.exudyn import ExudynEngine

    found = select(THICK, 2e-4, [0.15, 0.3])
    assert found.met
    assert {level.element for level in found.chosen.levels.values()} == {"simo-reissner"}
    assert "shear and rotary inertia" in found.reason
    assert found.shear == 0.0
    fine = THICK.with_values({"bodies.OA.elements": 16, "bodies.AB.elements": 32, "solver.step": 2e-4})
    beams = ExudynEngine(beam="geometrically-exact", modified_newton=True).simulate(fine, [0.15, 0.3])
    assert found.trajectory.distance(beams) < 2e-4
    slender = select(THICK.with_values({"solver.theory": "slender"}), 2e-4, [0.15, 0.3])
    assert slender.chosen.error <= 2e-4 < slender.shear
    assert not slender.met
    assert not slender.trajectory.ok
    assert f"known error {slender.errors.total:.1e} m: shear and rotary inertia" in slender.trajectory.message
    assert slender.trajectory.distance(beams) > 2e-4


ROD = {"kind": "rod", "length": 1.0, "height": 0.25, "width": 0.05, "density": 1000.0, "element": "rigid"}
THICK_PENDULUM: dict[str, Any] = {
    "name": "thick-pendulum",
    "bodies": {"r": ROD},
    "joints": {"O": {"first": {"body": "ground", "point": [0, 0]}, "second": {"body": "r", "point": "start"}}},
    "markers": {"e": {"body": "r", "point": "end"}},
    "initial": {"r": {"angle": 0.4}},
    "solver": {"duration": 1.5},
}
"""A rod without a modulus, a quarter as high as it is long."""


def _true_pendulum(times: Any, height: float = 0.25) -> Any:
    """Where its end is, by scipy: a rod of 1 m with the inertia of its sections."""
    arm = 1 / 3 + height**2 / 12
    angle = solve_ivp(
        lambda _, y: [y[1], -9.81 / 2 / arm * np.cos(y[0])],
        (0.0, times[-1]),
        [0.4, 0.0],
        t_eval=times,
        method="DOP853",
        rtol=1e-11,
        atol=1e-12,
    ).y[0]
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


@pytest.mark.parametrize("tolerance", [3e-1, 3e-2, 1e-3, 1e-6])
@pytest.mark.parametrize("theory", ["auto", "slender"])
def test_an_answer_is_met_only_where_the_true_machine_is_within_the_tolerance(theory: str, tolerance: float) -> None:
    """What the theory neglects is worth 60 mm here: rods with rotary inertia take its place, or it is not met."""
    scene = Scene.parse(THICK_PENDULUM).with_values({"solver.theory": theory})
    found = select(scene, tolerance, np.linspace(0.1, 1.5, 15))
    away = np.max(np.linalg.norm(found.trajectory.marker("e") - _true_pendulum(found.trajectory.times), axis=1))
    assert found.met == found.trajectory.ok == (theory == "auto" or tolerance == 3e-1)
    assert away <= (found.errors.total or 0.0) * (1.0 + 1e-6)
    assert found.met == ((found.errors.total or 0.0) <= tolerance)
    assert found.chosen.error <= tolerance


def test_the_command_says_what_the_theory_neglects_and_fails(tmp_path: Path) -> None:
    path = tmp_path / "thick.yaml"
    path.write_text(json.dumps(THICK_PENDULUM))
    command = ["simulate", str(path), "--tolerance", "1e-2", "--json"]
    told = CliRunner().invoke(main, [*command, "--set", "solver.theory=slender"])
    assert told.exit_code == 3
    assert json.loads(told.stdout)["selection"]["status"] == "not met"
    assert "shear and rotary inertia that the rods leave out are worth about 0.07 m" in told.stderr
    assert CliRunner().invoke(main, command).exit_code == 0


def test_rigid_rods_get_the_rotary_inertia_that_counts() -> None:
    """A stiff pendulum of height h: m (L^2 + h^2)/12 about its centre, so that it swings as one of (L + h^2/(4 L))."""
    stiff = {"bodies.OA.youngs_modulus": 1e14, "bodies.AB.youngs_modulus": 1e14}
    found = select(THICK.with_values(stiff), 1e-4, [0.3])
    assert found.met
    assert {(level.element, level.rotary) for level in found.chosen.levels.values()} == {("rigid", True)}
    rigid = {f"bodies.{rod}.{field}": value for rod in ("OA", "AB")
             for field, value in (("element", "rigid"), ("rotary_inertia", True))}  # fmt: skip
    exact = GaussEngine().simulate(THICK.with_values(rigid | {"solver.integrator": "dop853"}), [0.3])
    assert found.trajectory.distance(exact) < 1e-4


def test_ancf_full_is_a_theory_of_its_own() -> None:
    """Its limit has shear, so that no rod becomes a cable."""
    thick = {f"bodies.{rod}.{key}": value for rod in ("OA", "AB")
             for key, value in (("element", "ancf-full"), ("law", "enhanced"), ("height", 0.05))}  # fmt: skip
    selection = select(HEADLINE.with_values(thick), 2e-2)
    assert selection.met
    assert {level.element for level in selection.chosen.levels.values()} == {"ancf-full"}
    reference = [candidate for candidate in selection.candidates if candidate.role == "reference"][-1]
    assert distance(selection.chosen.trajectory, reference.trajectory) <= 2e-2


@pytest.mark.parametrize("levels", [(cable(2), cable(4)), (quintic(1), quintic(8)), (quintic(4), quintic(2))])
def test_forecast_of_the_stable_step(levels: tuple[Any, Any]) -> None:
    from shoal.mechanics.simulate import stable_step
    from shoal.selection.levels import apply

    chosen = dict(zip(("OA", "AB"), levels, strict=True))
    true = stable_step(apply(HEADLINE, chosen), INTEGRATOR)
    assert 0.6 < Forecast(HEADLINE, {"OA": RIGID, "AB": RIGID}).step(chosen) / true < 1.6


@pytest.mark.parametrize("modulus", [2e9, 2e10, 2e11, 2e12])
def test_prior_is_right_to_two_orders_of_magnitude(modulus: float) -> None:
    scene = _with_modulus(modulus)
    prior = sum(one.error for one in estimate(scene, ("OA", "AB")).values())
    engine = GaussEngine()
    rigid = engine.simulate(scene.with_values({f"bodies.{rod}.element": "rigid" for rod in ("OA", "AB")}))
    values = {f"bodies.{rod}.{key}": value for rod in ("OA", "AB")
              for key, value in (("element", "ancf-quintic"), ("elements", 2))}  # fmt: skip
    bent = engine.simulate(scene.with_values({**values, "solver.step": 3e-6}))
    assert 0.01 < distance(rigid, bent) / prior < 100


def test_machine_without_freedom() -> None:
    weld = {"kind": "weld", "first": {"body": "ground", "point": [0.0, 0.0]}, "second": {"body": "OA"}}
    scene = load_scene("single-pendulum").with_values({"joints": {"O": weld}})
    np.testing.assert_allclose(GaussEngine().simulate(scene, [0.5]).marker("A"), [[1.0, 0.0]], atol=1e-12)


@pytest.mark.parametrize("longest", [0.25, 0.15])
def test_steps_that_end_at_the_longest_are_told_by_a_tolerance_that_shortens_them(longest: float) -> None:
    """A tighter tolerance hardly moves a run whose steps are not its own. Truth: the tolerances of the solver."""
    scene = load_scene("single-pendulum")
    found = select(scene.with_values({"solver.max_step": longest}), 1e-4, [5.0])
    true = found.trajectory.distance(get_engine("gauss").simulate(scene, [5.0]))
    assert found.met
    assert true / 1.2 < found.chosen.error < 1.2 * true
