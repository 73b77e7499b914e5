"""In a browser: pages raise no error, ask for nothing, animate by mouse and keyboard, and pass axe-core."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(CHROMIUM is None, reason="needs a Chromium (on Debian: apt install chromium)"),
]


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    api = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    with api.sync_playwright() as playwright:
        # A container often runs as root and lacks what Chromium's sandbox needs; the pages are our own.
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield started
        started.close()


class Opened:
    """A page of a kind in a window of some width [px], with what it said and asked for."""

    def __init__(self, browser: Any, path: Path, width: int) -> None:
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page = browser.new_page(viewport={"width": width, "height": 900})
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto(path.as_uri())

    @property
    def clock(self) -> float:
        """What the first animation shows as its time [s]."""
        return float(self.page.locator("output").first.inner_text().split()[2])

    def until(self, met: Callable[[], bool]) -> None:
        """Wait until something is so, five minutes at most."""
        for _ in range(6000):
            if met():
                return
            self.page.wait_for_timeout(50)
        raise AssertionError("it did not come to that in time")

    def picture(self) -> Any:
        """The first canvas as it looks now."""
        return self.page.evaluate("document.querySelector('canvas').toDataURL()")


@pytest.fixture(params=["estimate", "rejected", "study", "simulation", "selection", "space"])
def path(request: pytest.FixtureRequest, pages: Callable[[str], str], tmp_path: Path) -> Path:
    file = tmp_path / f"{request.param}.html"
    file.write_text(pages(request.param), encoding="utf-8")
    return file


@pytest.mark.parametrize("width", [1280, 390])
def test_page_is_quiet_alone_and_fits(browser: Any, path: Path, width: int) -> None:
    opened = Opened(browser, path, width)
    opened.page.locator("figure.animation").first.wait_for()
    opened.page.wait_for_load_state("networkidle")
    assert opened.said == []
    assert [url for url in opened.asked if not url.startswith(("file:", "data:"))] == []
    assert opened.page.evaluate("document.documentElement.scrollWidth") <= width
    broken = "Array.from(document.images).filter((i) => !i.complete || i.naturalWidth === 0).length"
    assert opened.page.evaluate(broken) == 0
    opened.page.close()


def test_page_is_accessible(browser: Any, path: Path) -> None:
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="needs axe-playwright-python")
    opened = Opened(browser, path, 1280)
    found = axe.Axe().run(opened.page).response
    assert len(found["passes"]) > 10
    assert [(one["id"], one["impact"]) for one in found["violations"]] == []
    opened.page.close()


def test_animation_plays_pauses_and_is_scrubbed(browser: Any, pages: Callable[[str], str], tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    file.write_text(pages("estimate"), encoding="utf-8")
    opened = Opened(browser, file, 1280)
    page, button, slider = opened.page, opened.page.locator("button").first, opened.page.locator("input").first
    still = opened.picture()
    button.click()
    opened.until(lambda: opened.clock > 0 and opened.picture() != still)
    assert button.inner_text() == "Pause"
    page.keyboard.press("Space")
    opened.until(lambda: button.inner_text() == "Play")
    paused = opened.clock
    page.wait_for_timeout(200)
    assert opened.clock == paused
    # By keyboard.
    slider.focus()
    page.keyboard.press("End")
    last = opened.clock
    page.keyboard.press("ArrowLeft")
    assert 0 < opened.clock < last
    page.keyboard.press("Home")
    assert opened.clock == 0
    # By mouse, in the middle of the slider.
    box = slider.bounding_box()
    page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert opened.clock == pytest.approx(last / 2, rel=0.1)
    assert opened.picture() != still
    assert opened.said == []
    page.close()


@pytest.fixture
def space(pages: Callable[[str], str], tmp_path: Path) -> Path:
    file = tmp_path / "space.html"
    file.write_text(pages("space"), encoding="utf-8")
    return file


def test_a_machine_in_space_is_turned_moved_and_zoomed(browser: Any, space: Path) -> None:
    opened = Opened(browser, space, 1280)
    page, canvas = opened.page, opened.page.locator("canvas").first
    home = opened.picture()

    def changes(act: Callable[[], object]) -> None:
        """What is done changes the picture, and Home brings it back."""
        act()
        opened.until(lambda: opened.picture() != home)
        canvas.focus()
        page.keyboard.press("Home")
        opened.until(lambda: opened.picture() == home)

    def drag() -> None:
        box = canvas.bounding_box()
        page.mouse.move(box["x"] + 200, box["y"] + 200)
        page.mouse.down()
        page.mouse.move(box["x"] + 260, box["y"] + 230)
        page.mouse.up()

    def shifted() -> None:
        page.keyboard.down("Shift")
        drag()
        page.keyboard.up("Shift")

    changes(drag)
    changes(shifted)
    changes(lambda: page.mouse.wheel(0, -200))
    canvas.focus()
    for key in ("ArrowLeft", "ArrowUp", "+", "-"):
        changes(lambda key=key: page.keyboard.press(key))  # type: ignore[misc]
    for name in ("Front", "Top", "Right side", "nearer", "farther"):
        changes(page.get_by_role("button", name=name, exact=True).click)
    page.keyboard.press("Space")
    opened.until(lambda: opened.clock > 0)
    assert opened.said == []
    page.close()


def test_two_fingers_zoom(browser: Any, space: Path) -> None:
    context = browser.new_context(viewport={"width": 390, "height": 800}, has_touch=True)
    page = context.new_page()
    page.goto(space.as_uri())
    picture = "document.querySelector('canvas').toDataURL()"
    before, box = page.evaluate(picture), page.locator("canvas").first.bounding_box()
    touch = context.new_cdp_session(page)

    def fingers(kind: str, *across: float) -> None:
        points = [{"x": box["x"] + x, "y": box["y"] + 100, "id": k} for k, x in enumerate(across)]
        touch.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    fingers("touchStart", 150, 200)
    fingers("touchMove", 100, 250)
    fingers("touchEnd")
    assert page.evaluate(picture) != before
    context.close()


def test_views_are_taken_at_once_by_who_wants_no_motion(browser: Any, space: Path) -> None:
    context = browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    page = context.new_page()
    page.goto(space.as_uri())
    # In the same task as the click, before any frame of an animation.
    drawn = page.evaluate(
        """() => { const canvas = document.querySelector('canvas');
                   document.querySelector("[data-view='top']").click(); const at_once = canvas.toDataURL();
                   return new Promise((done) => setTimeout(() => done(at_once === canvas.toDataURL()), 600)); }"""
    )
    assert drawn
    context.close()
