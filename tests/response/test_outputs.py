"""Files of a study: one page that needs nothing else, NetCDF."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from shoal.notebook import uncertain
from shoal.pictures import files
from shoal.pictures.probability import probability
from shoal.response import Response
from shoal.scene import Scene
from shoal.terminal.tables import response_table
from thrown import ALONG, THROWN, UP

HEIGHT = "initial.P.position.1"


@pytest.fixture(scope="module")
def intervals() -> Response:
    return uncertain(Scene.parse(THROWN), {UP: (4.7, 5.3), ALONG: (1.7, 2.3)}, [0.25, 0.5, 0.75], limit=["P.y > 1.3"])


@pytest.fixture(scope="module")
def distributions() -> Response:
    return uncertain(
        Scene.parse(THROWN),
        {UP: "normal(5,0.2)", HEIGHT: "normal(0,0.1)"},
        [0.25, 0.5, 0.75],
        limit=["P.y > 1.75"],
        limit_runs=1000,
    )


def test_the_page_of_intervals(intervals: Response, tmp_path: Path) -> None:
    """Worst case in motion over the stated machine, bounds, gaps, the limit with the run that passes it."""
    files.response(intervals, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page
    data = page.split('<script type="application/json">')[1].split("</script>")[0]
    moving = json.loads(data)
    assert moving["name"] == "P.y &gt; 1.3" or moving["name"] == "P.y > 1.3"
    assert set(moving["behind"]) == set(moving["drawing"]["carriers"]) == {"P"}
    assert "Widths, gaps and errors" in page
    assert "exceeded" in page


def test_the_page_of_distributions(distributions: Response, tmp_path: Path) -> None:
    files.response(distributions, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "95 % interval" in page
    assert "Total Sobol indices" in page
    assert "exceeded at an instant looked at" in page


def test_a_limit_that_is_kept_is_kept_at_the_instants_looked_at(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Thrown up at 5 m/s, the point is above 1.2 m at its top (v^2 / 2 g = 1.25 m), not at the two instants stated."""
    looked = [0.1, 0.9]
    found = uncertain(Scene.parse(THROWN), {UP: (4.99, 5.01)}, looked, limit=["P.y > 1.2"])
    (judged,) = found.limits
    assert judged.kept
    assert judged.shown is not None
    first = (5.0 - np.sqrt(25.0 - 2 * 10.0 * 1.2)) / 10.0
    assert judged.shown.between == pytest.approx(first, abs=0.01)
    response_table(found)
    told = " ".join(capsys.readouterr().out.split())
    assert "is kept for all values at the 2 instants looked at" in told
    assert "the run shown exceeds it between the instants looked at" in told
    assert "exceeded-between-instants" in found.codes
    files.response(found, tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "kept at the 2 instants looked at" in page
    assert "exceeds it between the instants looked at" in page
    below = uncertain(Scene.parse(THROWN), {UP: (4.99, 5.01)}, looked, limit=["P.y > 1.3"]).limits[0]
    assert below.kept
    assert below.findings == []
    assert below.shown is not None
    assert below.shown.between is None


@pytest.mark.parametrize(("limit", "passes"), [("abs(P.vy) < 1e-4", 0.5), ("abs(P.vy) < 0", None), ("P.vy < -4", None)])
def test_a_quantity_that_changes_sign_passes_its_least_size_between_instants(limit: str, passes: float | None) -> None:
    """At 5 m/s upwards vy vanishes at its top after 0.5 s, for a tenth of the time between two of 200 instants."""
    found = uncertain(Scene.parse(THROWN), {UP: (4.99, 5.01)}, [0.1, 0.3, 0.74, 0.89], limit=[limit])
    (judged,) = found.limits
    assert judged.kept
    assert judged.shown is not None
    assert judged.shown.between == (passes if passes is None else pytest.approx(passes, abs=2e-3))


def test_netcdf(intervals: Response, distributions: Response, tmp_path: Path) -> None:
    """The same numbers by name, as another reader finds them."""
    xr = pytest.importorskip("xarray")
    for found in (intervals, distributions):
        files.response(found, tmp_path / "study.nc")
        with xr.open_dataset(tmp_path / "study.nc") as data:
            assert list(data["axis"].values) == ["x", "y", "angle"]
            assert list(data["parameter"].values) == found.inputs.names
            if found.bounds is not None:
                upper = data["upper"].sel(marker="P", axis="y", bound="attained").values
                assert np.array_equal(upper, found.column("P", "y", found.bounds.upper))
                assert data["argument_upper"].sel(marker="P", axis="y", parameter=UP).values == pytest.approx(5.3)
            else:
                assert found.statistics is not None
                median = data["quantiles"].sel(marker="P", axis="y", quantile=0.5).values
                assert np.array_equal(median, found.column("P", "y", found.statistics.quantiles)[3])


@pytest.mark.parametrize(("way", "known"), [("auto", True), ("form", False)])
def test_a_limit_that_no_run_has_passed_is_drawn_below_what_it_may_be(way: str, known: bool) -> None:
    """At the instants looked at; no probability is below zero, and one that is not known may be anything."""
    found = uncertain(
        *(Scene.parse(THROWN), {UP: "normal(5,0.2)"}, [0.25, 0.75]),
        limit=["P.x > 9"],
        limit_runs=300,
        limit_method=way,
    )
    (judged,) = found.limits
    assert judged.exceedance is not None
    (axes,) = probability(judged).axes
    most = judged.exceedance.estimate.interval[1][-1]
    assert bool(most < 1) is known
    low, high = axes.get_ylim()
    assert -0.1 * most < low <= 0 < most <= high < 1.2 * most
    first, last = axes.get_xlim()
    assert 0 < first < 0.25 < 0.75 < last < 1
