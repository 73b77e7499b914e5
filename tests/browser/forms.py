"""Prefect's forms, as a visitor fills them in."""

from __future__ import annotations

import re
from typing import Any


def choose(page: Any, shown: str, *wanted: str) -> list[str]:
    """Click on options of one of Prefect's lists, found by what it shows, if anything; returns all it offers."""
    lists = page.locator(".p-select-button__control").filter(has_not_text=re.compile(r"\S"))
    (page.get_by_role("button", name=shown, exact=True) if shown else lists.first).focus()
    page.keyboard.press("ArrowDown")
    page.get_by_role("option").first.wait_for()
    offered = [text.strip() for text in page.get_by_role("option").all_inner_texts()]
    assert set(wanted) <= set(offered), offered
    for name in wanted:
        page.get_by_role("option", name=name, exact=True).click()
    page.keyboard.press("Escape")
    return offered


def submit(page: Any) -> None:
    """Click on Submit; a list that was chosen from takes the first click where the button is out of sight."""
    form = page.url
    for _ in range(3):
        page.get_by_role("button", name="Submit").click()
        page.wait_for_timeout(3000)
        if page.url != form:
            return
    raise AssertionError(f"the form stays: {page.url}")


def finished(page: Any, state: str = "Completed") -> None:
    """Wait for the run whose page it is, and reload: Prefect asks for artifacts every five seconds while it runs."""
    page.locator(".page-heading-flow-run").get_by_text(state, exact=True).wait_for()
    page.reload()
