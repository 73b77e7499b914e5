"""Intervals and distributions in one study: bounds of statistics and probabilities, against closed forms."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from scipy import stats
from scipy.stats import qmc
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import InputError
from shoal.notebook import uncertain
from shoal.pictures import files
from shoal.response import Response, respond
from shoal.response.inputs import Inputs, UncertainParameter
from shoal.response.marginals import Frozen, Interval, Normal, Uniform
from shoal.response.runs import Answers
from shoal.response.statistics import QUANTILES
from shoal.scene import Scene, load_scene
from shoal.trajectory import Array
from thrown import ALONG, THROWN, UP

HEIGHT, ASIDE = "initial.P.position.1", "initial.P.position.0"
Function = Callable[[Mapping[str, Array]], Array]


def model(function: Function) -> Callable[[Mapping[str, Array]], Answers]:
    def answers(values: Mapping[str, Array]) -> Answers:
        found = function(values)
        return Answers(found, np.ones(len(found), dtype=bool))

    return answers


@pytest.mark.slow
def test_a_deviation_is_that_of_runs_and_not_of_polynomials_beyond_them() -> None:
    """Of high degree they ran away where no run held them: 0.13 rad were told in place of 0.0013 rad, as known to 1e-6.

    Judged by plain runs at the interval values that are named.
    """
    ways = {"initial.OA.angle": ("-2%", "2%"), "bodies.AB.length": stats.norm(2.0, 0.01)}
    times = [0.46, 0.47, 0.48, 0.49, 0.5]
    found = uncertain("flexible-double-pendulum", ways, at=times)
    drawn = stats.norm(2.0, 0.01).ppf(qmc.Sobol(1, rng=3).random_base2(9)[:, 0])
    assert found.boxes is not None
    scene, told = load_scene("flexible-double-pendulum"), found.to_json()["statistics"]["A"]["angle"]
    scatter = max(told["mean_upper"]) - min(told["mean_lower"])
    for k, time in enumerate(times):
        for side in ("lower", "upper"):
            (at,) = told[f"argument_std_{side}"][k]
            lanes = {"initial.OA.angle": np.full(len(drawn), at), "bodies.AB.length": drawn}
            runs = get_engine("gauss").simulate_many(scene, lanes, [time])
            seen = np.std(runs.angles[-1, runs.markers.index("A")])
            # So many runs tell a deviation to some 3 %.
            assert told[f"std_{side}"][k] == pytest.approx(seen, rel=0.08, abs=2 * found.boxes.gap * scatter)


def test_an_oscillator_with_a_spring_known_within_bounds() -> None:
    """x cos(sqrt(k / m) t), k in [0.9, 1.1] with m = 1, x normal(1, 0.1): mean c, deviation 0.1 |c|, with
    c = cos(sqrt(k) t), whose range over k follows from where sqrt(k) t is a multiple of pi / 2.
    """
    t = np.array([0.0, 1.0, 5.0, 10.0, 20.0])
    known = Inputs(
        (UncertainParameter("k", Interval(0.9, 1.1), {"k": 1.0}), UncertainParameter("x", Normal(1.0, 0.1), {"x": 1.0}))
    )
    swings = model(lambda v: v["x"][:, None] * np.cos(np.sqrt(v["k"])[:, None] * t))
    answer = respond(swings, known, len(t), groups=np.zeros(len(t), dtype=int), instants=t)
    low, high = np.sqrt(0.9) * t, np.sqrt(1.1) * t
    ends = np.cos(np.stack([low, high]))

    def meets(shift: float) -> Array:
        """Whether a multiple of 2 pi, shifted, lies between."""
        return np.floor((high - shift) / (2 * np.pi)) > np.floor((low - shift) / (2 * np.pi))

    least, largest = np.where(meets(np.pi), -1.0, ends.min(axis=0)), np.where(meets(0.0), 1.0, ends.max(axis=0))
    found = answer.boxes
    assert found is not None
    assert found.mean.lower == pytest.approx(least, abs=1e-6)
    assert found.mean.upper == pytest.approx(largest, abs=1e-6)
    size = np.where((least < 0) & (largest > 0), 0.0, np.minimum(np.abs(least), np.abs(largest)))
    assert found.std.lower == pytest.approx(0.1 * size, abs=1e-5)
    assert found.std.upper == pytest.approx(0.1 * np.maximum(np.abs(least), np.abs(largest)), abs=1e-6)
    late = found.std.at_upper[-1, 0]
    assert abs(np.cos(np.sqrt(late) * 20.0)) == pytest.approx(10 * found.std.upper[-1], abs=1e-6)
    # A quantile x_q c for c > 0 and x_{1 - q} c below: linear in c, so that it is extreme where c is.
    for share, quantile in zip(QUANTILES, found.quantiles, strict=True):
        z = stats.norm.ppf(share)

        def at(c: Array, z: float = z) -> Array:
            return c + 0.1 * z * np.abs(c)

        exact = np.stack([at(least), at(largest)])
        assert quantile.lower == pytest.approx(exact.min(axis=0), abs=5e-4)
        assert quantile.upper == pytest.approx(exact.max(axis=0), abs=5e-4)
    assert answer.horizon == math.inf
    assert found.gap < 1e-3
    assert answer.runs.evaluations <= 300


def test_indices_between_bounds() -> None:
    """y = k a + b + a b with normal a, b: of the variance k^2 + 2, a alone has k^2, and takes part in k^2 + 1."""
    known = {"k": Interval(0.5, 2.0), "a": Normal(0.0, 1.0), "b": Normal(0.0, 1.0)}
    given = Inputs(tuple(UncertainParameter(name, of, {name: 1.0}) for name, of in known.items()))
    answer = respond(model(lambda v: (v["k"] * v["a"] + v["b"] + v["a"] * v["b"])[:, None]), given, 1)
    found = answer.boxes
    assert found is not None
    assert found.shares is not None
    low, high = 0.25, 4.0
    # Share at both ends: first of a, of b; total of a, of b.
    first = [[low / (low + 2), 1 / (high + 2)], [high / (high + 2), 1 / (low + 2)]]
    total = [[(low + 1) / (low + 2), 2 / (high + 2)], [(high + 1) / (high + 2), 2 / (low + 2)]]
    # A hundredth of the largest deviation is added, squared, where shares are not told.
    assert found.shares[0, :, :, 0] == pytest.approx(np.array(first), abs=1e-3)
    assert found.shares[1, :, :, 0] == pytest.approx(np.array(total), abs=1e-3)


DISTRIBUTIONS = (stats.norm(0.0, 1.0), stats.uniform(-1.0, 2.0), stats.triang(0.3, -1.0, 2.0), stats.beta(2, 3, -1, 2))


@pytest.mark.parametrize("seed", [*range(2), *(pytest.param(k, marks=pytest.mark.slow) for k in range(2, 20))])
@pytest.mark.by_day(1)
def test_random_studies_against_brute_force(seed: int) -> None:
    """Smooth functions of one or two intervals and one or two distributions: a grid over the intervals, and quantiles
    of scipy at many quasi-random points for each of its points.
    """
    random = np.random.default_rng(seed)
    count, intervals = int(random.integers(2, 5)), 1 + seed % 2
    intervals = min(intervals, count - 1)
    slopes, waves = random.normal(size=(count, 3)), 0.7 * random.normal(size=(count, 3))
    shift, strength = random.uniform(0, 6, 3), random.uniform(0, 2, 3)
    kinds = [DISTRIBUTIONS[int(k)] for k in random.integers(0, 4, count - intervals)]

    def told(x: Array) -> Array:
        return np.asarray(x @ slopes + strength * np.sin(x @ waves + shift))

    known = [Interval(-1.0, 1.0)] * intervals + [
        Normal(0.0, 1.0) if kind is DISTRIBUTIONS[0] else Frozen(kind) for kind in kinds
    ]
    inputs = Inputs(tuple(UncertainParameter(f"p{k}", one, {f"p{k}": 1.0}) for k, one in enumerate(known)))
    stack = model(lambda v: told(np.stack([v[f"p{k}"] for k in range(count)], axis=1)))
    answer = respond(stack, inputs, 3, seed=seed)
    found = answer.boxes
    assert found is not None
    assert answer.runs.evaluations <= 3000

    points = 40_000 if intervals == 1 else 8192
    x = (qmc.Halton(len(kinds), seed=seed).random(points) * points + 0.5) / (points + 1)
    drawn = np.stack([kind.ppf(x[:, k]) for k, kind in enumerate(kinds)], axis=1)
    axis = np.linspace(-1, 1, 41 if intervals == 1 else 21)
    grid = np.stack(np.meshgrid(*[axis] * intervals), axis=-1).reshape(-1, intervals)
    values = np.stack([told(np.hstack([np.broadcast_to(place, (points, intervals)), drawn])) for place in grid])
    deviation = values.std(axis=1).max(axis=0)
    brute = [values.mean(axis=1), values.std(axis=1), *np.quantile(values, QUANTILES, axis=1)]
    # What the points and the grid leave: little of the deviation, more in the tails.
    allowed = [0.01, 0.01, 0.08, 0.04, 0.02, 0.02, 0.02, 0.04, 0.08]
    for one, exact, share in zip((found.mean, found.std, *found.quantiles), brute, allowed, strict=True):
        off = share * deviation
        assert np.all(np.abs(one.lower - exact.min(axis=0)) < off)
        assert np.all(np.abs(one.upper - exact.max(axis=0)) < off)
        assert np.all(exact.min(axis=0) > one.lower_outer - off)
        assert np.all(exact.max(axis=0) < one.upper_outer + off)


def test_correlation_beside_an_interval() -> None:
    """Deviation of k (x + y): k sqrt(1 + 4 + 2 * 2 * 0.5)."""
    pair = (
        UncertainParameter("x", Normal(0.0, 1.0), {"x": 1.0}),
        UncertainParameter("y", Normal(0.0, 2.0), {"y": 1.0}),
    )
    known = Inputs((pair[0], UncertainParameter("k", Interval(1.0, 3.0), {"k": 1.0}), pair[1]), {("x", "y"): 0.5})
    found = respond(model(lambda v: (v["k"] * (v["x"] + v["y"]))[:, None]), known, 1).boxes
    assert found is not None
    assert (found.std.lower[0], found.std.upper[0]) == pytest.approx((math.sqrt(7), 3 * math.sqrt(7)))
    assert (found.std.at_lower[0, 0], found.std.at_upper[0, 0]) == pytest.approx((1.0, 3.0))


def test_beyond_the_horizon_runs_tell() -> None:
    """The logistic map after 4 and 40 steps: no polynomial tells the latter, whose distribution is the invariant one,
    the arcsine law, with mean 0.5 and deviation 0.354.
    """

    def steps(v: Mapping[str, Array]) -> Array:
        x, kept = np.clip(0.3 + v["x"] + v["k"], 0.01, 0.99), []
        for k in range(1, 41):
            x = 4 * x * (1 - x)
            if k in (1, 40):
                kept.append(x)
        return np.stack(kept, axis=1)

    known = Inputs(
        (
            UncertainParameter("k", Interval(-0.1, 0.1), {"k": 1.0}),
            UncertainParameter("x", Uniform(-0.1, 0.1), {"x": 1.0}),
        )
    )
    answer = respond(model(steps), known, 2, instants=np.array([1.0, 40.0]))
    found = answer.boxes
    assert found is not None
    assert answer.horizon == 1.0
    assert found.places >= 3
    assert np.isnan(found.mean.upper_outer[1])
    assert np.isfinite(found.mean.upper_outer[0])
    assert found.mean.lower[1] - 0.15 < 0.5 < found.mean.upper[1] + 0.15
    assert found.std.upper[1] == pytest.approx(math.sqrt(0.125), abs=0.1)


def study(vary: dict[str, object], limit: str, times: list[float]) -> Response:
    return uncertain(Scene.parse(THROWN), vary, times, limit=[limit], limit_runs=2000, verify=False, seed=2)


@pytest.mark.slow
def test_a_linear_limit_with_an_interval_mean() -> None:
    """y = h + v t - 5 t^2 at t = 0.5, v normal(5, 0.3), h in [-0.05, 0.1]: P(y > 1.7) = Phi((h - 0.45) / 0.15)."""
    found = study({UP: "normal(5,0.3)", HEIGHT: (-0.05, 0.1)}, "P.y > 1.7", [0.5])
    assert found.ok
    told = found.to_json()["limits"][0]
    least, largest = (float(stats.norm.cdf((h - 0.45) / 0.15)) for h in (-0.05, 0.1))
    assert told["probability_lower"] == pytest.approx(least, rel=0.1)
    assert told["probability_upper"] == pytest.approx(largest, rel=0.1)
    assert told["at_lower"]["parameters"] == {HEIGHT: -0.05}
    assert told["at_upper"]["parameters"] == {HEIGHT: 0.1}
    assert told["lower_outer"] <= told["lower"] <= least
    assert largest <= told["upper"] <= told["upper_outer"]
    assert told["at_upper"]["lower"] <= largest <= told["at_upper"]["upper"]
    # The most probable way is on the limit, with the value of the interval that makes it most probable.
    assert told["shown_by"]["parameters"] == pytest.approx({HEIGHT: 0.1, UP: (1.7 - 0.1 + 1.25) / 0.5}, rel=1e-3)
    statistics = found.to_json()["statistics"]["P"]["y"]
    assert statistics["mean_lower"] == pytest.approx([-0.05 + 1.25])
    assert statistics["mean_upper"] == pytest.approx([0.1 + 1.25])
    assert statistics["argument_mean_upper"] == [[0.1]]
    assert statistics["std_upper"] == pytest.approx([0.15])


@pytest.mark.slow
def test_the_least_probability_inside_an_interval() -> None:
    """|a + 0.5 u| > 0.9, u normal(0, 0.6), a in [-0.2, 0.35]: both tails, least at a = 0, largest at a = 0.35."""
    found = study({ALONG: "normal(0,0.6)", ASIDE: (-0.2, 0.35)}, "abs(P.x) > 0.9", [0.5])
    between = found.limits[0].between
    assert between is not None
    least, largest = (float(stats.norm.sf((0.9 - a) / 0.3) + stats.norm.sf((0.9 + a) / 0.3)) for a in (0.0, 0.35))
    assert between.estimates == pytest.approx((least, largest), rel=0.12)
    assert between.at_lower[ASIDE] == pytest.approx(0.0, abs=0.06)
    assert between.at_upper[ASIDE] == 0.35
    assert between.outer[0] < least
    assert between.outer[1] > largest


def test_what_cannot_be_asked_is_refused() -> None:
    vary = {UP: "normal(5,0.3)", HEIGHT: (-0.05, 0.1)}
    scene = Scene.parse(THROWN)
    with pytest.raises(InputError, match="methods for both are auto, nested"):
        uncertain(scene, vary, method="monte-carlo")
    with pytest.raises(InputError, match="needs an interval and a distribution"):
        uncertain(scene, {HEIGHT: (-0.05, 0.1)}, method="nested")


@pytest.mark.slow
def test_the_command_and_its_files(tmp_path: Path) -> None:
    """The same numbers in the table, in JSON, in NetCDF and on the page; a study that is kept gives them again."""
    xr = pytest.importorskip("xarray")
    vary = {UP: "normal(5,0.3)", HEIGHT: (-0.05, 0.1)}
    found = uncertain(Scene.parse(THROWN), vary, [0.25, 0.5], limit=["P.y > 1.7"], limit_runs=500, verify=False)
    files.response(found, tmp_path / "study.nc")
    with xr.open_dataset(tmp_path / "study.nc") as data:
        y = data.sel(marker="P", axis="y")
        assert y["mean_upper"].sel(bound="inner").values[-1] == pytest.approx(1.35)
        assert y["argument_std_upper"].sizes == {"time": 2, "interval": 1}
        median = y["quantiles_lower"].sel(quantile=0.5, bound="inner").values
        assert median == pytest.approx(found.column("P", "y", found.boxes.quantiles[3].lower))  # type: ignore[union-attr]
    files.response(found, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "Where the mean and the 5 % and 95 % quantiles may lie" in page
    assert "most probable with initial.P.position.1 = 0.1" in page
    (tmp_path / "thrown.yaml").write_text(json.dumps(THROWN))
    words = [
        "uncertain",
        str(tmp_path / "thrown.yaml"),
        "--vary",
        f"{UP}~normal(5,0.3)",
        "--vary",
        f"{HEIGHT}=-0.05:0.1",
    ]
    words += ["--at", "0.25,0.5", "--limit", "P.y > 1.7", "--limit-runs", "500", "--no-verify"]
    kept = tmp_path / "runs"
    run = CliRunner().invoke(main, [*words, "--checkpoint", str(kept)])
    assert run.exit_code == 0, run.output
    assert "is exceeded at the 2 instants looked at with a probability between" in run.stdout
    assert "largest with initial.P.position.1 = 0.1" in run.stdout
    again = json.loads(CliRunner().invoke(main, [*words, "--json", "--checkpoint", str(kept)]).stdout)
    assert {**again, "wall_s": 0} == {**json.loads(json.dumps(found.to_json())), "wall_s": 0}
