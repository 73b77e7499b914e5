"""The Exudyn engine: against closed forms, textbook equations, published-element numbers, and its own failures."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipj, ellipk
from shoal.engines.exudyn import ExudynEngine
from shoal.engines.exudyn.build import build, library
from shoal.engines.exudyn.cable import CablePart
from shoal.engines.exudyn.checks import judge
from shoal.engines.exudyn.engine import WEAK
from shoal.engines.exudyn.record import KeptStates, Steps, choose_steps
from shoal.engines.gauss import GaussEngine
from shoal.errors import InputError
from shoal.scene import Scene, load_scene
from shoal.trajectory import Status

pytest.importorskip("exudyn")

FAST = ExudynEngine(modified_newton=True)
BEAM = ExudynEngine(beam="geometrically-exact", modified_newton=True)
ORIGIN = {"body": "ground", "point": [0.0, 0.0]}
ROD = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.04, "density": 5540.0, "youngs_modulus": 2e8}
CABLE = {**ROD, "element": "ancf-cable", "elements": 2}


def meshed(name, first, **fields):
    values = {"bodies.OA.elements": first, "bodies.AB.elements": 2 * first}
    return load_scene(name).with_values({**values, **{path.replace("_", "."): v for path, v in fields.items()}})


def tip(engine, scene):
    trajectory = engine.simulate(scene, [0.5])
    assert trajectory.ok, trajectory.message
    return trajectory.marker("B")[-1]


def every_joint(friction=0.2):
    """Cables and rigid bodies joined at ends, inside a cable and off an axis, with friction and initial rates."""
    return Scene.parse(
        {
            "name": "every-joint",
            "bodies": {
                "A": CABLE,
                "B": {**CABLE, "length": 1.5, "elements": 3, "youngs_modulus": 2e7},
                "C": {**ROD, "element": "rigid"},
                "D": {"kind": "rigid-body", "mass": 2.0, "inertia": 0.1, "centre_of_mass": [0.2, 0.1]},
            },
            "joints": {
                "O": {"first": ORIGIN, "second": {"body": "A"}, "friction": friction},
                "AB": {"first": {"body": "A", "point": "end"}, "second": {"body": "B", "point": [0.25, 0.0]}},
                "CB": {"first": {"body": "C"}, "second": {"body": "B", "point": "end"}, "friction": friction},
                "CD": {"first": {"body": "C", "point": "end"}, "second": {"body": "D", "point": [0.5, 0.2]}},
            },
            "markers": {"middle": {"body": "A", "point": [0.37, 0.0]}, "off": {"body": "D", "point": [0.1, 0.3]}},
            "initial": {"A": {"angle": 0.3, "rate": 2.0}, "B": {"angle": -0.5, "rate": -1.0}, "C": {"angle": 7.0}},
            "solver": {"duration": 0.3, "step": 5e-4, "samples": 10},
        }
    )


def four_bar(**angles):
    bar = {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.04, "density": 1000.0}
    return Scene.parse(
        {
            "name": "four-bar",
            "bodies": {"a": bar, "b": {**bar, "length": 2.0}, "c": bar},
            "joints": {
                "O": {"first": ORIGIN, "second": {"body": "a"}},
                "P": {"first": {"body": "a", "point": "end"}, "second": {"body": "b"}},
                "Q": {"first": {"body": "b", "point": "end"}, "second": {"body": "c", "point": "end"}},
                "R": {"first": {"body": "ground", "point": [2.0, 0.0]}, "second": {"body": "c"}},
            },
            "markers": {"M": {"body": "b", "point": "centre"}},
            "initial": {name: {"angle": angle, "rate": 1.0} for name, angle in {"a": 1.0, "c": 1.0, **angles}.items()},
        }
    )


def test_single_pendulum_follows_the_elliptic_closed_form():
    # Released at the horizontal: sin(phi/2) = k sn(K - w t, k^2), phi from the downward vertical, k = sin(pi/4).
    trajectory = ExudynEngine().simulate(load_scene("single-pendulum"), np.linspace(0.1, 5.0, 50))
    k, w = np.sin(np.pi / 4), np.sqrt(9.81)
    phi = 2 * np.arcsin(k * ellipj(ellipk(k**2) - w * trajectory.times, k**2)[0])
    assert trajectory.ok
    np.testing.assert_allclose(trajectory.angle("A"), phi - np.pi / 2, atol=2e-5)
    np.testing.assert_allclose(trajectory.marker("A")[:, 0], np.sin(phi), atol=2e-5)


@pytest.mark.parametrize("integrator", ["trapezoidal", "generalized-alpha"])
@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.by_day(2)
def test_rigid_double_pendulum_follows_the_textbook_equations(integrator, friction):
    lengths, masses = np.array([1.0, 2.0]), np.array([1.0, 2.0])

    def rate(_, state):
        (a, b), w = state[:2], state[2:]
        c = masses[1] * lengths[0] * lengths[1] / 2
        inner = masses[0] * lengths[0] ** 2 / 3 + masses[1] * lengths[0] ** 2
        mass = np.array([[inner, c * np.cos(a - b)], [c * np.cos(a - b), masses[1] * lengths[1] ** 2 / 3]])
        turn = c * np.sin(a - b) * np.array([-(w[1] ** 2), w[0] ** 2])
        weight = -9.81 * np.array(
            [(masses[0] / 2 + masses[1]) * lengths[0] * np.cos(a), masses[1] * lengths[1] / 2 * np.cos(b)]
        )
        rub = friction * np.array([-w[0] + (w[1] - w[0]), -(w[1] - w[0])])
        return [*w, *np.linalg.solve(mass, turn + weight + rub)]

    scene = load_scene("rigid-double-pendulum").with_values(
        {"solver.step": 2.5e-4, "joints.O.friction": friction, "joints.A.friction": friction}
    )
    trajectory = ExudynEngine(integrator=integrator).simulate(scene, np.linspace(0.2, 2.0, 10))
    start = [np.pi / 4, np.pi / 6, 0.0, 0.0]
    angles = solve_ivp(rate, (0, 2), start, t_eval=trajectory.times, rtol=1e-11, atol=1e-11).y[:2]
    assert trajectory.ok
    np.testing.assert_allclose(trajectory.angle("A"), angles[0], atol=2e-5)
    np.testing.assert_allclose(trajectory.angle("B"), angles[1], atol=2e-5)


@pytest.mark.parametrize(
    ("name", "first", "quadrature", "expected", "tolerance"),
    [
        # Converged in time at the meshes of the paper and eight times finer: independent codes agree on these.
        ("flexible-double-pendulum", 2, "full", (2.67616, 0.57868), 6e-6),
        ("flexible-double-pendulum", 16, "full", (2.646223, 0.572009), 3e-6),
        ("flexible-double-pendulum-hanging", 16, "full", (1.593280, -2.451881), 3e-6),
        # The reduced rule: Exudyn itself at a step of 2e-5 s.
        ("flexible-double-pendulum", 2, "reduced", (2.654121, 0.562119), 4e-6),
    ],
)
@pytest.mark.by_day(2)
def test_cable_reaches_the_known_tip(name, first, quadrature, expected, tolerance):
    scene = meshed(name, first, bodies_OA_quadrature=quadrature, bodies_AB_quadrature=quadrature, solver_step=1e-4)
    np.testing.assert_allclose(tip(FAST, scene), expected, atol=tolerance)


def test_geometrically_exact_beam_is_the_second_opinion():
    # Another three-node geometrically exact code at 16/32 elements: (2.645967, 0.572268).
    beam = tip(BEAM, meshed("flexible-double-pendulum", 16, solver_step=2e-4))
    np.testing.assert_allclose(beam, (2.645967, 0.572268), atol=8e-6)


def test_rods_with_shear_end_where_geometrically_exact_beams_do():
    scene = meshed("flexible-double-pendulum", 16, bodies_OA_height=0.1, bodies_AB_height=0.1)
    shear = scene.with_values({f"bodies.{rod}.element": "simo-reissner" for rod in ("OA", "AB")})
    native = tip(GaussEngine(), shear.with_values({"solver.integrator": "leapfrog", "solver.step": 2e-5}))
    beam = tip(BEAM, shear.with_values({"solver.step": 2e-4}))
    np.testing.assert_allclose(native, beam, atol=3e-5)
    cable = tip(GaussEngine(), scene.with_values({"solver.integrator": "leapfrog", "solver.step": 2e-5}))
    assert np.abs(cable - beam).max() > 3e-4


def test_full_and_modified_newton_agree():
    scene = load_scene("flexible-double-pendulum")
    np.testing.assert_allclose(tip(ExudynEngine(), scene), tip(FAST, scene), atol=2e-9)


@pytest.mark.parametrize("quadrature", ["full", "reduced"])
def test_recomputed_energy_has_exudyns_elastic_force_as_its_gradient(quadrature):
    exu = library()
    scene = meshed("flexible-double-pendulum", 1, bodies_OA_quadrature=quadrature, bodies_AB_quadrature=quadrature)
    machine = build(exu, scene.with_values({"gravity": (0.0, 0.0)}), "ancf-cable")
    bent = 0.05 * np.random.default_rng(1).standard_normal(machine.unknowns)
    solver = exu.MainSolverImplicitSecondOrder()
    settings = exu.SimulationSettings()
    settings.solution.file.write = False
    solver.InitializeSolver(machine.mbs, settings)
    machine.mbs.systemData.SetODE2Coordinates(bent)
    machine.mbs.systemData.SetAECoordinates(np.zeros(machine.constraints))
    solver.ComputeODE2RHS(machine.mbs)
    force = -np.array(solver.GetSystemResidual())[: machine.unknowns]
    step = 1e-6 * np.eye(machine.unknowns)
    places = machine.reference + bent
    still = np.zeros_like(step)
    elastic = [
        sum(part.energy(places + sign * step, still).elastic for part in machine.parts.values()) for sign in (1, -1)
    ]
    assert all(isinstance(part, CablePart) for part in machine.parts.values())
    np.testing.assert_allclose((elastic[0] - elastic[1]) / 2e-6, force, atol=1e-7 * np.max(np.abs(force)))


@pytest.mark.parametrize("engine", [FAST, BEAM, ExudynEngine(integrator="generalized-alpha")])
def test_every_kind_of_joint_keeps_its_energy_balance(engine):
    trajectory = engine.simulate(every_joint())
    assert trajectory.ok, trajectory.message
    assert trajectory.energy_drift[0] < 5e-5
    assert trajectory.constraint_drift[0] < 1e-5
    assert trajectory.points.shape == (11, 2, 2, 1)


def test_cable_and_beam_agree_on_every_kind_of_joint():
    fine = {"bodies.A.elements": 8, "bodies.B.elements": 12}
    cable, beam = (engine.simulate(every_joint().with_values(fine)) for engine in (FAST, BEAM))
    np.testing.assert_allclose(cable.points, beam.points, atol=2e-3)
    np.testing.assert_allclose(cable.angles, beam.angles, atol=1e-2)


def test_closed_loop_moves_as_a_parallelogram():
    trajectory = ExudynEngine().simulate(four_bar())
    assert trajectory.ok, trajectory.message
    np.testing.assert_allclose(trajectory.angle("M"), 0.0, atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(trajectory.marker("M") - [1.0, 0.0], axis=1), 1.0, atol=1e-5)


def test_open_loop_is_bad_input_and_a_refused_lane():
    with pytest.raises(InputError, match=r"initial\.c\.angle: 1\.1 rad contradicts initial\.a\.angle = 1: joint R"):
        ExudynEngine().simulate(four_bar(c=1.1))
    lanes = ExudynEngine().simulate_many(four_bar(), {"bodies.b.length": np.array([2.0, 9.0])})
    assert lanes.status == (Status.OK, Status.REFUSED)
    assert lanes.codes == ["refused-by-engine"]
    assert np.all(np.isfinite(lanes.points[..., 0]))
    assert np.all(np.isnan(lanes.points[..., 1]))


def test_lanes_equal_single_runs():
    scene = load_scene("flexible-double-pendulum").with_values({"solver.duration": 0.1})
    angles = np.array([0.7, 0.8])
    lanes = FAST.simulate_many(scene, {"initial.OA.angle": angles})
    for lane, angle in enumerate(angles):
        single = FAST.simulate(scene.with_values({"initial.OA.angle": float(angle)}))
        np.testing.assert_array_equal(lanes.points[..., lane], single.points[..., 0])
        np.testing.assert_array_equal(lanes.angles[..., lane], single.angles[..., 0])


def test_angle_is_continuous_and_starts_where_the_scene_says():
    spin = load_scene("single-pendulum").with_values({"initial.OA.angle": 12.0, "initial.OA.rate": 20.0})
    trajectory = ExudynEngine().simulate(spin, [0.0, 5.0])
    assert trajectory.angle("A")[0] == 12.0
    assert trajectory.angle("A")[1] > 100
    whirl = load_scene("flexible-double-pendulum").with_values(
        {"initial.OA.angle": 7.0, "initial.OA.rate": 8.0, "initial.AB.angle": 7.0, "initial.AB.rate": 8.0}
    )
    dense, sparse = FAST.simulate(whirl), FAST.simulate(whirl, [0.5])
    assert abs(dense.angle("A")[0] - 7.0) < 0.2
    assert np.max(np.abs(np.diff(dense.angle("A")))) < 1
    assert sparse.angle("A")[-1] == pytest.approx(dense.angle("A")[-1], abs=1e-9)


def test_times_off_the_step_are_interpolated():
    scene = load_scene("flexible-double-pendulum").with_values({"solver.step": 1e-4})
    odd = FAST.simulate(scene, [0.10003, 0.25013, 0.4])
    fine = FAST.simulate(scene.with_values({"solver.step": 1e-5}), [0.10003, 0.25013, 0.4])
    assert odd.model["step"] == 1e-4
    assert fine.model["step"] == 1e-5
    np.testing.assert_allclose(odd.points, fine.points, atol=3e-6)


@pytest.mark.parametrize(
    ("wanted", "step", "size", "count"),
    [
        ([0.01, 0.025], 5e-4, 5e-4, 50),
        ([0.1, 0.2, 0.3], 3e-2, 0.025, 12),
        ([0.1, 0.25], 0.04, 0.25 / 7, 7),
        ([0.0], 1e-3, 1e-3, 0),
        ([0.0, 0.5], 1e-3, 1e-3, 500),
    ],
)
def test_steps_meet_the_wanted_times(wanted, step, size, count):
    steps = choose_steps(np.array(wanted), step, 10)
    assert steps.size == pytest.approx(size)
    assert steps.count == count
    assert steps.kept[-1] == count


def test_long_records_are_thinned_but_keep_what_is_wanted():
    steps = choose_steps(np.array([0.1234, 1.0]), 1e-4, 5_000)
    assert len(steps.kept) < 1100
    assert {1234, 10_000} <= set(steps.kept.tolist())


def test_newton_failure_is_a_status_and_standard_output_stays_clean(capfd):
    scene = load_scene("flexible-double-pendulum").with_values({"solver.step": 0.25})
    trajectory = ExudynEngine().simulate(scene)
    assert trajectory.status == (Status.FAILED,)
    assert trajectory.codes == ["engine-stopped"]
    assert np.all(np.isnan(trajectory.points[-1]))
    assert FAST.simulate(load_scene("single-pendulum")).ok
    assert capfd.readouterr().out == ""


def test_weakly_stable_index_3_run_is_not_believed():
    # Spectral radius 1 with position constraints: the multipliers grow until Newton fails; the default does not.
    scene = load_scene("rigid-double-pendulum").with_values({"solver.duration": 10.0})
    weak = ExudynEngine().simulate(scene.with_values({"solver.integrator": "generalized-alpha"}))
    assert not weak.ok
    assert WEAK in weak.advice
    assert ExudynEngine().simulate(scene).ok


@pytest.mark.parametrize("asked", ["auto", "generalized-alpha", "rk4"])
def test_a_result_names_the_integrator_that_made_it(asked):
    """A scene's generalized-alpha is Exudyn's, with its radius; an integrator that Exudyn has not is not claimed."""
    scene = load_scene("rigid-double-pendulum").with_values(
        {"solver.integrator": asked, "solver.spectral_radius": 0.8, "solver.step": 0.005, "solver.energy_tolerance": 1}
    )
    made = "generalized-alpha" if asked == "generalized-alpha" else "trapezoidal"
    run = ExudynEngine().simulate(scene)
    assert (run.model["integrator"], run.model["spectral_radius"]) == (made, 0.8 if made == asked else 1.0)
    assert run.points.tobytes() == ExudynEngine(integrator=made).simulate(scene).points.tobytes()
    other = "trapezoidal" if made == "generalized-alpha" else "generalized-alpha"
    assert run.distance(ExudynEngine(integrator=other).simulate(scene)) > 1e-5


def test_numerical_damping_and_drift_are_caught():
    damped = load_scene("rigid-double-pendulum").with_values(
        {"solver.step": 0.02, "solver.spectral_radius": 0.0, "solver.energy_tolerance": 1e-3}
    )
    assert ExudynEngine(integrator="generalized-alpha").simulate(damped).status == (Status.ENERGY,)
    coarse = load_scene("rigid-double-pendulum").with_values({"solver.step": 0.01, "solver.duration": 10.0})
    assert ExudynEngine().simulate(coarse).status == (Status.DRIFTED,)


@pytest.mark.parametrize(("shift", "status"), [(100.0, Status.OUT_OF_REACH), (np.nan, Status.DIVERGED)])
def test_success_with_nonsense_is_not_believed(shift, status):
    machine = build(library(), load_scene("flexible-double-pendulum"), "ancf-cable")
    record = KeptStates(choose_steps(np.array([0.0]), 1e-3, machine.unknowns), machine.reference)
    record.take(machine.mbs, 0.0)
    assert judge(machine, record, "").findings == []
    record.q += shift
    assert [one.kind.implies for one in judge(machine, record, "").findings] == [status]


def test_machine_at_rest_has_no_energy_drift():
    rest = load_scene("single-pendulum").with_values({"initial.OA.angle": -np.pi / 2})
    trajectory = ExudynEngine().simulate(rest)
    assert trajectory.ok
    assert trajectory.energy_drift[0] < 1e-6


def test_beam_friction_needs_a_node():
    scene = every_joint().with_values({"joints.AB.friction": 0.1, "joints.AB.second.point": (0.4, 0.0)})
    assert FAST.simulate(scene).ok
    with pytest.raises(InputError, match="needs a beam node"):
        BEAM.simulate(scene)


def test_beams_are_welded_in_line_only():
    scene = every_joint(0.0).with_values({"joints.AB": {"kind": "weld", "first": {"body": "A", "point": "end"},
                                                        "second": {"body": "B"}}})  # fmt: skip
    straight = {"initial.B.angle": 0.3, "initial.B.rate": 2.0}
    assert BEAM.simulate(scene.with_values(straight), [0.05]).ok
    with pytest.raises(InputError, match="keeps no angle of a flexible rod but 0; use exudyn"):
        BEAM.simulate(scene.with_values({"initial.B.rate": 2.0}))


def test_names_of_the_variants():
    assert (FAST.name, BEAM.name) == ("exudyn", "exudyn-ge")
    assert "closed loops" in FAST.capabilities.features
    assert not FAST.capabilities.lanes


def test_thinned_record_is_read_between_its_kept_steps() -> None:
    """A parabola is what cubic Hermite interpolation gives back, whatever steps were kept."""
    steps = Steps(np.array([0.5, 0.95, 1.0]), 10, 0.1, np.array([0, 4, 8, 10]), ((10, 1.0),))
    record = KeptStates(steps, np.zeros(1))
    record.q[:, 0], record.v[:, 0] = record.times**2, 2 * record.times
    q, v = record.at_wanted()
    np.testing.assert_allclose(q[:, 0], steps.wanted**2, atol=1e-14)
    np.testing.assert_allclose(v[:, 0], 2 * steps.wanted, atol=1e-13)


@pytest.mark.parametrize(
    ("scale", "expected"),
    [
        ("step(t - 0.3001) - step(t - 0.3002)", 1e-4),
        ("step(0.01 - t)", 0.01),
        ("exp(-((t - 0.3)/1e-4)**2)", 1e-4 * np.sqrt(np.pi)),
        ({"table": [[0.0, 0.0], [0.3, 0.0], [0.30001, 1.0], [0.30002, 0.0]], "smooth": False}, 1e-5),
    ],
)
@pytest.mark.parametrize("integrator", ["auto", "generalized-alpha"])
@pytest.mark.by_day(2)
def test_no_pulse_is_lost(scale, expected, integrator):
    scene = Scene.parse(
        {
            "name": "pushed",
            "gravity": [0.0, 0.0],
            "bodies": {"m": {"kind": "point-mass", "mass": 2.0}},
            "loads": {"F": {"kind": "force", "at": {"body": "m"}, "force": [100.0, 0.0], "scale": scale}},
            "markers": {"m": {"body": "m"}},
            "initial": {"m": {"position": [0.0, 0.0]}},
            "solver": {"duration": 1.0, "samples": 2, "integrator": integrator},
        }
    )
    trajectory = ExudynEngine().simulate(scene)
    assert trajectory.ok, trajectory.message
    speed = np.diff(trajectory.points[:, 0, 0, 0])[-1] / 0.5
    assert speed == pytest.approx(50.0 * expected, rel=1e-8)


def test_a_rate_that_jumps_is_refused_and_a_smooth_one_followed():
    drive = {"kind": "driven-angle", "first": ORIGIN, "second": {"body": "R"}, "angle": "3*max(t - 0.5, 0)"}
    data = {
        "name": "crank",
        "bodies": {"R": {"kind": "rod", "length": 1.0, "height": 0.02, "width": 0.02, "density": 1000.0}},
        "joints": {"O": {"first": ORIGIN, "second": {"body": "R"}}, "D": drive},
        "markers": {"E": {"body": "R", "point": "end"}},
        "solver": {"duration": 1.0, "samples": 4},
    }
    with pytest.raises(InputError, match=r"^joints\.D\.angle: .* rate jumps, at t = 0\.5; use gauss"):
        ExudynEngine().simulate(Scene.parse(data))
    smooth = Scene.parse(data).with_values({"joints.D.angle": "3*max(t - 0.5, 0)**2"})
    trajectory = ExudynEngine().simulate(smooth)
    assert trajectory.angles[-1, 0, 0] == pytest.approx(0.75, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize(("width", "shorter"), [(1e-2, 1), (1e-3, 2)])
def test_a_narrow_law_of_a_spring_is_not_leapt_over(width, shorter):
    """A mass passes at 1 m/s through a law that takes 0.2 J from it on its way."""
    law = f"{float(0.2 / width / np.sqrt(np.pi))!r}*exp(-((t - 0.3)/{width!r})**2)"
    spring = {"kind": "spring", "first": {"body": "ground", "point": [-1.0, 0.0]}, "second": {"body": "m"}}
    scene = Scene.parse(
        {
            "name": "law",
            "gravity": [0.0, 0.0],
            "bodies": {"m": {"kind": "point-mass", "mass": 2.0}},
            "loads": {"S": spring | {"elastic": law}},
            "markers": {"m": {"body": "m"}},
            "initial": {"m": {"position": [0.0, 0.0], "velocity": [1.0, 0.0]}},
            "solver": {"duration": 1.0, "step": 1e-3},
        }
    )
    run = ExudynEngine().simulate(scene, [0.9, 1.0])
    assert run.ok, run.message
    assert run.model["step"] == 1e-3 / shorter
    speed = (run.marker("m")[1, 0] - run.marker("m")[0, 0]) / 0.1
    assert speed == pytest.approx(np.sqrt(0.8), rel=1e-5)
    narrow = scene.with_values({"loads.S.elastic": "exp(-((t - 0.3)/1e-6)**2)"})
    refused = ExudynEngine().simulate(narrow, [0.9, 1.0])
    assert not refused.ok
    assert refused.codes == ["engine-stopped"]


@pytest.mark.parametrize(
    "engine", [pytest.param(FAST, id="cable"), pytest.param(BEAM, id="beam", marks=pytest.mark.slow)]
)
def test_a_soft_start_of_a_stiff_rod_follows_the_rigid_closed_form(engine):
    """Rods of any stiffness and mesh whose load grows from zero: I angle'' = F L sin(w t), small angles, no gravity."""
    rng = np.random.default_rng(19)
    for _ in range(6):
        modulus, length, side = 10.0 ** rng.uniform(9.0, 12.0), rng.uniform(0.3, 3.0), rng.uniform(0.02, 0.04)
        place, elements = rng.uniform(-20.0, 20.0, 2), int(rng.integers(1, 13))
        rod = {**CABLE, "length": length, "height": side, "width": side, "density": 2700.0}
        inertia = 2700.0 * side**2 * length**3 / 3
        # So slow that the rod bends as at rest, and so weak that it turns by a thousandth of a radian.
        w = 0.02 * np.pi**2 * side / length**2 * np.sqrt(modulus / 2700.0 / 12)
        force = 1e-3 * inertia * w**2 / length
        scene = Scene.parse(
            {
                "name": "soft-start",
                "gravity": [0.0, 0.0],
                "bodies": {"arm": {**rod, "youngs_modulus": modulus, "elements": elements}},
                "joints": {"O": {"first": {"body": "ground", "point": place.tolist()}, "second": {"body": "arm"}}},
                "loads": {
                    "f": {"kind": "force", "at": {"body": "arm", "point": "end"}, "force": [0.0, force],
                          "scale": f"sin({w}*t)"}
                },
                "markers": {"tip": {"body": "arm", "point": "end"}},
                "solver": {"duration": 2.0 / w, "samples": 4, "step": 0.002 / w},
            }
        )  # fmt: skip
        found = engine.simulate(scene)
        assert found.ok, found.message
        turned = force * length / inertia * (found.times / w - np.sin(w * found.times) / w**2)
        tip = found.marker("tip") - place
        assert np.max(np.abs(tip[:, 1] - length * np.sin(turned))) < 0.01 * length * np.max(turned)
