"""A desk with everything on it, and a browser that remembers what pages say and ask for."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from deployed import SERVICES, free_port, running

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


@dataclass(frozen=True)
class Desk:
    """`make up` without the engines' services. home: its state; at: its addresses; pages: MLflow's, by `shoal ui`."""

    home: Path
    at: Mapping[str, str]
    pages: str


@pytest.fixture(scope="session")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Desk]:
    home = tmp_path_factory.mktemp("desk")
    with running(home, *(word for name in SERVICES for word in ("--without", name))) as at:
        port = free_port()
        environment = {k: v for k, v in os.environ.items() if not k.startswith(("PREFECT_", "MLFLOW_"))}
        log = home / "ui.log"
        with log.open("wb") as out:
            command = [str(Path(sys.executable).with_name("shoal")), "ui", "--port", str(port)]
            environment |= {"SHOAL_HOME": str(home)}
            pages = subprocess.Popen(command, env=environment, stdout=out, stderr=subprocess.STDOUT)
        try:
            deadline = time.monotonic() + 600
            while "MLflow:" not in log.read_text():
                assert pages.poll() is None, log.read_text()
                assert time.monotonic() < deadline, log.read_text()
                time.sleep(0.2)
            yield Desk(home, at, f"http://127.0.0.1:{port}")
        finally:
            pages.terminate()
            pages.wait(300)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    if CHROMIUM is None:
        pytest.skip("needs a Chromium (on Debian: apt install chromium)")
    api = pytest.importorskip("playwright.sync_api", reason="needs playwright")
    with api.sync_playwright() as playwright:
        # A container often runs as root and lacks what Chromium's sandbox needs; the pages are this machine's.
        # A name under .example leads to this machine, as one does whose owner has rebound it.
        arguments = ["--no-sandbox", "--host-resolver-rules=MAP *.example 127.0.0.1"]
        started = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        api.expect.set_options(timeout=180_000)
        yield started
        started.close()


@dataclass
class Visit:
    """One engineer's page. said: errors in the console; elsewhere: requests that leave this machine."""

    page: Any
    screens: Path
    said: list[str] = field(default_factory=list)
    elsewhere: list[str] = field(default_factory=list)

    def shoot(self, name: str) -> None:
        """Keep what is to be seen."""
        self.page.screenshot(path=self.screens / f"{name}.png")


@pytest.fixture
def visit(browser: Any, tmp_path: Path) -> Iterator[Callable[[], Visit]]:
    """Opens a page with a memory of its own, as on a machine on which nobody has been."""
    opened = []

    def open_one() -> Visit:
        one = Visit(browser.new_page(viewport={"width": 1500, "height": 1100}), tmp_path)
        one.page.on(
            "console", lambda m: one.said.append(f"{m.text} {m.location['url']}") if m.type == "error" else None
        )
        one.page.on("pageerror", lambda error: one.said.append(str(error)))
        local = ("http://127.0.0.1:", "data:", "blob:")
        one.page.on("request", lambda r: None if r.url.startswith(local) else one.elsewhere.append(r.url))
        opened.append(one)
        return one

    yield open_one
    for one in opened:
        one.page.close()
