"""The tutorial as a new user goes through it: its files, its commands, and every word that it says to press."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from forms import choose, finished, submit

pytestmark = pytest.mark.slow

PAGE = (Path(__file__).parents[2] / "docs" / "tutorial.md").read_text(encoding="utf-8")
STEPS = re.findall(r"^\d\. (.*(?:\n   .*)*)$", PAGE, re.MULTILINE)
PATIENCE = 120_000
"""Milliseconds for a study on a busy machine, whose kernels may have to be compiled."""


def said(step: int, word: str) -> str:
    """A word, if that step says it."""
    assert f"`{word}`" in STEPS[step - 1], (step, word)
    return word


def own(home: Path, folder: Path) -> None:
    """Write the page's own machine, recording and problem, and put them into the library of `make up`."""
    for name, content in re.findall(r"`(\w+\.yaml)`:\n\n```yaml\n(.*?)```", PAGE, re.DOTALL):
        (folder / name).write_text(content)
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PREFECT_", "MLFLOW_"))}
    for line in re.findall(r"^\.venv/bin/shoal (.*)$", PAGE, re.MULTILINE):
        if "run.csv" in line or line.startswith("library"):
            command = [str(Path(sys.executable).with_name("shoal")), *shlex.split(line)]
            environment = {**kept, "SHOAL_HOME": str(home)}
            subprocess.run(command, cwd=folder, env=environment, check=True, timeout=600)


def test_a_machine_of_ones_own_comes_to_the_dashboard(desk: Any, visit: Callable[[], Any], tmp_path: Path) -> None:
    from playwright.sync_api import expect

    own(desk.home, tmp_path)
    one = visit()
    page = one.page
    page.set_default_timeout(PATIENCE)
    page.goto(desk.at["PREFECT"])
    page.get_by_text(said(1, "Deployments"), exact=True).first.click()
    # The page before links to a flow and to runs of that name, until it gives way.
    deployment = page.locator("[href*='/deployments/deployment/']")
    page.get_by_role("link", name=said(1, "identify")).and_(deployment).first.click()
    page.get_by_role("button", name=said(1, "Run"), exact=True).first.click()
    page.get_by_text(said(1, "Custom run")).click()

    page.get_by_role("button", name=said(2, "by name")).first.click()
    choose(page, "", said(2, "find"))
    expect(page.locator("textarea").first).to_have_value("find")
    one.shoot("form")
    said(2, "Submit")
    submit(page)

    page.get_by_role("link", name=said(3, "identify find")).first.click(timeout=PATIENCE)
    finished(page, said(3, "Completed"))
    page.get_by_text(said(3, "Artifacts"), exact=True).first.click()
    expect(page.get_by_text(re.compile(r"friction = 0\.05(0*)?, angle = -0\.3")).first).to_be_visible()
    one.shoot("answer")
    page.get_by_text(said(3, "result"), exact=True).first.click()
    expect(page.get_by_role("table")).to_contain_text("identified")

    address = page.get_by_role("link", name=re.compile(said(4, "in MLflow"))).first.get_attribute("href")
    assert address.startswith(desk.at["MLFLOW"])
    page.goto(address)
    expect(page.get_by_text("find · identify").first).to_be_visible()
    one.shoot("study")
    page.get_by_role("tab", name=said(4, "Artifacts")).click()
    page.get_by_text(said(4, "report.html")).click()
    report = page.frame_locator("iframe")
    report.get_by_role("button", name=said(4, "Play")).first.click()
    expect(report.locator("output").first).not_to_have_text(re.compile(r"t = 0(\.0*)? s"))
    one.shoot("moving")
    assert one.elsewhere == []
