"""`shoal uncertain`: machines whose fields are known as intervals or distributions."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import shoal
from click.testing import CliRunner
from one_body import pendulum
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.notebook import uncertain
from shoal.scene import Scene, load_scene

PENDULUM = pendulum(
    gravity=[0.0, -9.81],
    initial={"OA": {"angle": 1.0 - np.pi / 2}},
    solver={"duration": 10.0, "samples": 10, "integrator": "dop853"},
)
"""1 m long, released from 1 rad to the vertical: an inertia m k^2 makes it swing as one of length 1 + k^2."""


BOX = {"initial.OA.angle": (0.75, 0.82), "initial.AB.angle": (0.5, 0.56)}


def test_bounds_of_a_pendulum() -> None:
    """Angle from the vertical at 10 s for lengths between 0.98 and 1.02 m: elliptic functions, two ways.

    An inertia I about the centre makes the length 1 + I, so lengths below 1 m are those of stronger gravity.
    """
    scene = Scene.parse({**PENDULUM, "gravity": [0.0, -9.81 / 0.98]})
    found = uncertain(scene, {"bodies.OA.inertia": (0.0, 1.02 / 0.98 - 1)}, [10.0])
    assert found.ok
    assert found.bounds is not None
    lower, upper = (found.column("A", "angle", of)[0] + np.pi / 2 for of in (found.bounds.lower, found.bounds.upper))
    assert (lower, upper) == pytest.approx((-0.69833601, -0.17730048), abs=1e-7)
    assert found.evaluations - found.controls <= 20


def test_bounds_are_attained() -> None:
    """Running the scene with the values that are named gives the bound, to the last bit but rounding."""
    vary = {"initial.OA.angle": ("-2%", "2%"), "bodies.AB.length": ("-1%", "1%")}
    found = uncertain("flexible-double-pendulum", vary, [0.25, 0.5], verify=False)
    assert found.ok
    assert found.bounds is not None
    for name, at in (("lower", found.bounds.at_lower), ("upper", found.bounds.at_upper)):
        values = found.column("B", "x", at.T)[:, -1]
        given = dict(zip(vary, values.tolist(), strict=True))
        run = shoal.simulate("flexible-double-pendulum", [0.25, 0.5], set=given, verify=False)
        assert run.marker("B")[-1, 0] == pytest.approx(
            found.column("B", "x", getattr(found.bounds, name))[-1], abs=1e-9
        )


@pytest.mark.slow
def test_beyond_the_horizon_nothing_is_claimed() -> None:
    """A double pendulum that turns over: bounds until some instant, beyond it the reach; exit status 3."""
    found = uncertain("rigid-double-pendulum", BOX, np.linspace(0.5, 12.0, 24), verify=False)
    assert found.status == "beyond-horizon"
    assert 0.5 <= found.horizon < 12.0
    assert found.bounds is not None
    assert found.bounds.likely is not None
    below, above = (found.column("B", "x", of) for of in found.bounds.likely)
    assert found.codes[0] == "beyond-horizon"
    # Among 400 other machines at least nine in ten lie there: 95 % do, and some scatter.
    random = np.random.default_rng(9)
    values = {path: random.uniform(low, high, 400) for path, (low, high) in BOX.items()}
    drawn = get_engine("gauss").simulate_many(load_scene("rigid-double-pendulum"), values, found.times)
    x = drawn.points[:, drawn.markers.index("B"), 0].T
    assert np.all(np.mean((x >= below) & (x <= above), axis=0) > 0.9)
    outer = found.column("B", "x", found.bounds.upper_outer)
    assert outer[-1] >= found.column("B", "x", found.bounds.upper)[-1]
    assert outer[-1] > 1.0


@pytest.mark.parametrize(
    ("vary", "names"),
    [
        (["bodies.OA.mass"], "is not PATH=LOW:HIGH"),
        (["bodies.OA.mass=1"], "is not PATH=LOW:HIGH"),
        (["bodies.OA.mass=2:1"], "LOW must be below HIGH"),
        (["bodies.OA.mass=1:1"], "state what is known with --set"),
        (["bodies.OA.mass~normal(1,0.5)"], "reaches from -2.517 to 4.517; truncated-normal"),
        (["solver.step=1e-4:1e-3"], "solver.step is a setting of the solver"),
        (["solver.relative_tolerance~uniform(1e-9,1e-8)"], "setting of the solver"),
        (["bodies.OA.mass=a:b"], "is no number"),
        (["initial.OA.angle=-2%:2%"], "-2% of what the scene states, which is 0, is nothing"),
        (["bodies.OA.mass=-1:1"], "bodies.OA.mass"),
        (["bodies.XY.mass=1:2"], "XY"),
        (["gravity=1:2"], "no number"),
        (["bodies.OA.mass~gauss(1,2)"], "no such distribution"),
        (["bodies.OA.mass~normal(1)"], r"normal\(MEAN,SD\)"),
        (["bodies.OA.mass~normal(1,-1)"], "must be positive"),
        (["bodies.OA.mass~empirical(nowhere.csv)"], "cannot read"),
        (["bodies.OA.mass=1:2", "bodies.OA.mass=1:2"], "varied twice"),
    ],
)
def test_wrong_input_is_named(vary: list[str], names: str) -> None:
    with pytest.raises(InputError, match=names):
        uncertain("single-pendulum", vary)


def test_a_load_whose_scale_is_a_number_varies() -> None:
    """x = F t^2 / 2m."""
    ball = {"name": "ball", "gravity": [0, 0], "bodies": {"b": {"kind": "point-mass", "mass": 1.0}},
            "markers": {"b": {"body": "b"}}, "initial": {"b": {"position": [0, 0]}},
            "loads": {"f": {"kind": "force", "at": {"body": "b"}, "force": [2.0, 0.0], "scale": 1.0}}}  # fmt: skip
    found = uncertain(Scene.parse(ball), ["loads.f.scale=-10%:20%"], [1.0])
    assert found.bounds is not None
    assert found.column("b", "x", found.bounds.lower)[0] == pytest.approx(0.9, abs=1e-9)
    assert found.column("b", "x", found.bounds.upper)[0] == pytest.approx(1.2, abs=1e-9)
    ball["loads"]["f"]["scale"] = "sin(t)"
    with pytest.raises(InputError, match=r"loads.f.scale is 'a function of time', which is no number"):
        uncertain(Scene.parse(ball), ["loads.f.scale=1:2"], [1.0])


@pytest.mark.parametrize("head", ["", "# of 12 balls\nspeed\n"])
def test_observations_are_a_column_with_or_without_its_name(head: str, tmp_path: Path) -> None:
    """A ball goes as far in a second as its speed, drawn from the column, says: mean and deviation are of the data."""
    data = np.linspace(0.8, 1.3, 12) ** 2
    (tmp_path / "speed.csv").write_text(head + "\n".join(str(float(x)) for x in data))
    ball = {"name": "ball", "bodies": {"b": {"kind": "point-mass", "mass": 1.0}}, "markers": {"b": {"body": "b"}},
            "initial": {"b": {"position": [0, 0], "velocity": [1, 0]}}}  # fmt: skip
    found = uncertain(Scene.parse(ball), [f"initial.b.velocity.0~empirical({tmp_path / 'speed.csv'})"], [1.0])
    assert found.statistics is not None
    assert found.column("b", "x", found.statistics.mean)[0] == pytest.approx(np.mean(data), rel=1e-9)
    assert found.column("b", "x", found.statistics.std)[0] == pytest.approx(np.std(data), rel=1e-9)


def test_the_command_prints_what_the_contract_says(tmp_path: Path) -> None:
    out = tmp_path / "bounds.csv"
    words = ["uncertain", "single-pendulum", "--vary", "initial.OA.angle=-0.1:0.1", "--at", "0.5,1", "--json"]
    run = CliRunner().invoke(main, [*words, "--out", str(out)])
    assert run.exit_code == 0, run.output
    told = json.loads(run.stdout)
    assert told["status"] == "ok"
    assert {"method", "why", "evaluations", "failed", "wall_s", "horizon", "mesh_error", "step_error"} <= told.keys()
    assert told["parameters"]["initial.OA.angle"]["low"] == -0.1
    bounds = told["bounds"]["A"]["angle"]
    assert bounds["t"] == [0.5, 1.0]
    assert bounds["lower_outer"][0] <= bounds["lower"][0] < bounds["upper"][0] <= bounds["upper_outer"][0]
    assert len(bounds["argument_lower"]) == 2
    assert out.read_text().startswith("t,A.x.lower")


def test_the_table_tells_units() -> None:
    words = ["uncertain", "single-pendulum", "--vary", "initial.OA.angle=-0.1:0.1", "--at", "0.5", "--no-verify"]
    printed = CliRunner().invoke(main, words).stdout
    assert all(f"A.{quantity} [{unit}]" in printed for quantity, unit in (("x", "m"), ("y", "m"), ("angle", "rad")))


def test_statistics_of_a_machine() -> None:
    """A pendulum at rest that hangs down stays there whatever its mass: no variance, and no shares of it."""
    scene = Scene.parse({**PENDULUM, "initial": {"OA": {"angle": -np.pi / 2}}})
    found = uncertain(scene, ["bodies.OA.mass~lognormal(1,0.1)"], [1.0], verify=False)
    assert found.statistics is not None
    assert found.column("A", "y", found.statistics.mean)[0] == pytest.approx(-1.0)
    assert found.column("A", "y", found.statistics.std)[0] == pytest.approx(0.0, abs=1e-12)
    assert found.to_json()["statistics"]["A"]["y"]["sobol"]["bodies.OA.mass"]["total"] == [None]


@pytest.mark.slow
def test_an_expansion_does_not_run_away() -> None:
    """Mean and deviation of the tip by chaos agree with those of a thousand other runs, within their scatter."""
    vary = ["initial.OA.angle~normal(0.785,0.02)"]
    auto, sampled = (
        uncertain("flexible-double-pendulum", vary, [0.25, 0.5], method=method, verify=False, seed=seed)
        for method, seed in (("auto", 0), ("monte-carlo", 1))
    )
    one, other = auto.statistics, sampled.statistics
    assert one is not None
    assert other is not None
    assert np.all(np.abs(one.mean - other.mean) < 5 * other.error)
    assert one.std == pytest.approx(other.std, rel=0.15)


def test_a_method_that_knows_no_gap_says_so() -> None:
    found = uncertain("single-pendulum", ["initial.OA.angle=-0.1:0.1"], [0.5], method="scan", degree=4, verify=False)
    assert found.ok
    assert "outer-bounds-unknown" in found.codes


def test_what_misses_the_gap_is_named_worst_first() -> None:
    """Three at most; all gaps beside the bounds are those that the message goes by."""
    found = uncertain(
        *("rigid-double-pendulum", {"initial.OA.angle": ("-5%", "5%")}, [0.5, 0.6]),
        **{"method": "chebyshev", "degree": 5, "verify": False, "gap": 1e-6},
    )
    bounds = found.to_json()["bounds"]
    missed = {f"{m}.{q}": one["gap"] for m, told in bounds.items() for q, one in told.items() if one["gap"] > 1e-6}
    worst = sorted(missed, key=lambda name: -missed[name])
    assert len(worst) > 3
    assert found.status == "gap-not-reached"
    named = ", ".join(f"{name} {missed[name]:.1e}" for name in worst[:3])
    assert found.findings[0].text.endswith(f"asked for 1e-06: {named} and {len(worst) - 3} more")


@pytest.mark.slow
def test_the_finer_mesh_tells_which_bounds_move() -> None:
    """By as much as the finer machine, simulated by itself at the values that are named, lies elsewhere."""
    vary = {"initial.OA.angle": ("-2%", "2%"), "bodies.AB.length": ("-1%", "1%")}
    found = uncertain("flexible-double-pendulum", vary, [0.25, 0.5], tolerance=5e-3)
    assert found.finer is not None
    assert found.bounds is not None
    told = found.to_json()
    assert told["finer_mesh"]["share_of_bounds"] == 1.0
    name, most = next(iter(told["finer_mesh"]["moved"].items()))
    marker, quantity, side = name.split(".")
    at = found.column(marker, quantity, getattr(found.bounds, f"at_{side}").T)[:, list(found.times).index(most["t"])]
    values = {**dict(zip(vary, at.tolist(), strict=True)), **told["finer_mesh"]["mesh"]}
    # Twice the elements bear half the step at most.
    step = {"solver.integrator": "leapfrog", "solver.step": found.stated.solver.step / 8}
    run = shoal.simulate(found.stated, [0.25, 0.5], set={**values, **step}, verify=False)
    assert run.ok
    when, mark = list(found.times).index(most["t"]), run.markers.index(marker)
    there = run.angles[when, mark, 0] if quantity == "angle" else run.points[when, mark, "xy".index(quantity), 0]
    bound = found.column(marker, quantity, getattr(found.bounds, side))[when]
    assert there - bound == pytest.approx(most["by"], rel=0.05)
