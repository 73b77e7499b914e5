"""What an engineer does in a browser: start a study in Prefect, find the best run in MLflow, compare, see it move."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from forms import choose, finished, submit
from shoal.identification.methods import METHODS
from shoal.identification.problem import problem_names
from shoal.scene.load import scene_library

pytestmark = pytest.mark.slow

PATIENCE = 180_000
"""Milliseconds for a study on a busy machine."""
THEIRS = (
    "/favicon.ico",  # Prefect's server has no icon,
    "/ico/undefined.svg",  # nor one for every state of a run.
    "/ajax-api/3.0/mlflow/assistant/config",  # MLflow's assistant is switched off.
    "/ajax-api/3.0/mlflow/assistant/providers",
    "/ajax-api/2.0/mlflow/users/current",  # MLflow's pages ask for a login, which a server without one lacks.
)
"""What a console may complain about: missing files of Prefect and MLflow, which no user sees."""
RESIZED = "ResizeObserver loop completed with undelivered notifications"
"""What browsers say of MLflow's panes where one is laid out again before it is drawn."""


def of_ours(said: list[str]) -> list[str]:
    return [line for line in said if not line.endswith(THEIRS) and RESIZED not in line]


def test_a_study_is_started_from_prefects_form_and_answers_there(desk: Any, visit: Callable[[], Any]) -> None:
    from playwright.sync_api import expect

    one = visit()
    page = one.page
    page.set_default_timeout(PATIENCE)
    page.goto(f"{desk.at['PREFECT']}/deployments")
    page.get_by_role("link", name="identify").first.click()
    page.get_by_role("button", name="Run", exact=True).first.click()
    page.get_by_text("Custom run").click()
    for words in (
        "Measured channels and unknown parameters",
        "Methods of the search",
        "empty for the data of the problem",
    ):
        expect(page.get_by_text(words)).to_be_visible()
    page.get_by_role("button", name="by name").first.click()
    assert set(choose(page, "", "paper-case-1")) == set(problem_names())
    expect(page.locator("textarea").first).to_have_value("paper-case-1")
    assert set(choose(page, "auto", "least-squares", "iafsa", "auto")) == set(METHODS)
    one.shoot("form")
    submit(page)
    # The flow names itself when it begins.
    page.get_by_role("link", name="identify paper-case-1").first.click(timeout=PATIENCE)
    finished(page)
    page.get_by_text("Artifacts", exact=True).first.click()
    expect(page.get_by_text("theta1 = 0.786015, theta2 = 0.523347").first).to_be_visible()
    one.shoot("artifacts")
    page.get_by_text("result", exact=True).first.click()
    table = page.get_by_role("table")
    expect(table).to_contain_text("least-squares · seed 0")
    expect(table).to_contain_text("identified")
    one.shoot("result")
    address = page.get_by_role("link", name=re.compile("in MLflow")).first.get_attribute("href")
    assert re.fullmatch(re.escape(desk.at["MLFLOW"]) + r"/#/experiments/\d+/runs/\w+", address)
    page.goto(address)
    expect(page.get_by_text("paper-case-1 · identify").first).to_be_visible()
    assert of_ours(one.said) == []
    assert one.elsewhere == []


def test_a_machine_of_ones_own_is_typed_into_the_form(desk: Any, visit: Callable[[], Any]) -> None:
    """Its YAML, key by key; what is wrong with it stands in the state of the run, with the field."""
    from background import until
    from deployed import call
    from playwright.sync_api import expect

    one = visit()
    page = one.page
    text = (scene_library() / "single-pendulum.yaml").read_text(encoding="utf-8")
    runs = f"{desk.at['PREFECT']}/api/flow_runs/filter"
    wanted = {"flow_runs": {"name": {"any_": ["forward own"]}}}
    for mass, state in (("2.0", "COMPLETED"), ("-1.0", "FAILED")):
        page.goto(f"{desk.at['PREFECT']}/deployments")
        page.get_by_role("link", name="simulate").first.click()
        page.get_by_role("button", name="Run", exact=True).first.click()
        page.get_by_text("Custom run").click()
        field = page.locator("textarea").first
        expect(field).to_have_value("flexible-double-pendulum")
        field.fill("")
        field.press_sequentially(text.replace("mass: 1.0", f"mass: {mass}"))
        expect(field).to_have_value(text.replace("mass: 1.0", f"mass: {mass}"))
        one.shoot(f"typed{mass}")
        submit(page)
        until(lambda state=state: any(run["state_type"] == state for run in call(runs, wanted)), f"it has {state}")  # type: ignore[misc]
    messages = [run["state"]["message"] for run in call(runs, wanted)]
    assert any("InputError: scene: bodies.OA.mass: " in str(message) for message in messages), messages
    page.goto(f"{desk.at['PREFECT']}/runs")
    expect(page.get_by_text("forward own").first).to_be_visible()
    one.shoot("runs")
    assert of_ours(one.said) == []


def test_the_best_run_is_found_compared_and_seen_moving(desk: Any, visit: Callable[[], Any]) -> None:
    """After the study of the first test."""
    from playwright.sync_api import expect

    one = visit()
    page = one.page
    page.goto(desk.pages)
    page.get_by_role("link", name="Experiments").first.click()
    page.get_by_role("link", name="Identification").click()
    # Not on traces of language models.
    expect(page.get_by_role("heading", name="Runs")).to_be_visible()
    page.get_by_role("button", name="Views").click()
    page.get_by_text("Fits of the last 24 hours, best first").click()
    for column in ("problem", "method", "verdict", "final/fitness", "final/rms"):
        expect(page.get_by_role("columnheader", name=column).first).to_be_visible()
    rows = page.get_by_role("row").filter(has_text="paper-case-1")
    expect(rows).to_have_count(2)
    fitness = [float(found) for text in rows.all_inner_texts() for found in re.findall(r"0\.00000\d+", text)]
    # Both methods end in the same minimum, up to rounding.
    assert fitness == pytest.approx(sorted(fitness), rel=1e-9)
    one.shoot("best")

    # Fitness against iteration, the methods over each other.
    page.locator("label").filter(has=page.locator("input[value='CHART']")).click()
    page.get_by_placeholder("Search metric charts").fill("fitness/best")
    expect(page.get_by_text("least-squares · seed 0 (fitness/best)").first).to_be_attached()
    expect(page.get_by_text("iafsa · seed 0 (fitness/best)").first).to_be_attached()
    expect(page.locator("svg .scatterlayer path.js-line").nth(1)).to_be_attached()
    one.shoot("charts")

    # Side by side.
    for name in ("iafsa · seed 0", "least-squares · seed 0"):
        page.get_by_role("row").filter(has_text=name).get_by_role("checkbox").first.check(force=True)
    page.get_by_role("button", name="Compare").click()
    expect(page.get_by_text("Comparing 2 Runs from 1 Experiment").first).to_be_visible()
    expect(page.get_by_text("final/evaluations").first).to_be_attached()
    one.shoot("compared")

    # The page of the study, and the machine in motion.
    page.get_by_role("link", name="Runs", exact=True).first.click()
    page.get_by_role("link", name="paper-case-1 · identify").first.click()
    expect(page.get_by_text("Registered models")).to_be_visible()
    one.shoot("study")
    page.get_by_role("tab", name="Artifacts").click()
    page.get_by_text("report.html").click()
    report = page.frame_locator("iframe")
    expect(report.get_by_text("2 of 2 identifications ended in an answer that can be used.")).to_be_visible()
    report.get_by_role("button", name="Play").first.click()
    expect(report.locator("output").first).not_to_have_text(re.compile(r"t = 0(\.0*)? s"))
    one.shoot("moving")

    page.get_by_role("link", name="Model registry").click()
    page.get_by_role("link", name="paper-case-1").click()
    expect(page.get_by_text("@ champion").first).to_be_visible()
    one.shoot("champion")
    assert of_ours(one.said) == []
    assert one.elsewhere == []


def test_a_flow_that_fails_or_is_not_to_be_trusted_says_why(desk: Any, visit: Callable[[], Any]) -> None:
    from deployed import run_deployment
    from playwright.sync_api import expect

    one = visit()
    wrong = {"problem": "paper-case-1", "methods": ["least-squares"], "set": {"solver.step": 0.01}}
    run = run_deployment(desk.at["PREFECT"], "identify/identify", wrong)
    one.page.goto(f"{desk.at['PREFECT']}/runs/flow-run/{run['id']}")
    expect(one.page.get_by_text("Failed", exact=True).first).to_be_visible()
    one.page.get_by_text("Details", exact=True).first.click()
    expect(one.page.get_by_text("InputError: solver.step: 0.01 s").first).to_be_visible()
    assert run["state"]["message"].endswith("use a smaller step or solver.integrator=generalized-alpha")
    one.shoot("failed")
    refused = {"scene": "n-four-bar-2", "engines": ["gauss", "casadi"]}
    run = run_deployment(desk.at["PREFECT"], "compare/compare", refused)
    assert run["state"]["name"] == "Not to be trusted"
    assert run["state"]["message"].startswith("casadi refuses the scene: joints.C1")
    one.page.goto(f"{desk.at['PREFECT']}/runs/flow-run/{run['id']}")
    expect(one.page.get_by_text("Not to be trusted", exact=True).first).to_be_visible()
    one.shoot("doubted")
    assert of_ours(one.said) == []
