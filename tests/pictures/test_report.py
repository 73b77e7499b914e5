"""The page of one identification is valid, needs no network, can be read aloud, and says what the numbers say."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from shoal.identification import Verdict
from shoal.pictures import files
from shoal.pictures.answer import Answer
from shoal.pictures.gallery import motions
from shoal.pictures.report import report

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")


class Page(HTMLParser):
    """Collects tags and checks that they are closed."""

    VOID = ("meta", "img", "br", "link", "input")

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def of(self, tag: str) -> list[dict[str, str | None]]:
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def text(several: Answer) -> str:
    return report(several)


def test_page_is_whole_and_needs_no_network(text: str) -> None:
    page = Page()
    page.feed(text)
    assert page.open == []
    links = [value for _, attributes in page.tags for key in ("src", "href") if (value := attributes.get(key))]
    assert links
    assert all(link.startswith(("#", "data:image/")) for link in links)
    assert not re.search(r"https?://(?!www\.w3\.org)", text)
    assert "@import" not in text
    assert "url(" not in text


def test_page_can_be_read_aloud(text: str) -> None:
    page = Page()
    page.feed(text)
    assert all(len(image["alt"] or "") > 30 for image in page.of("img"))
    assert all(len(canvas["aria-label"] or "") > 30 for canvas in page.of("canvas"))
    assert all(control["aria-label"] for control in [*page.of("input"), *page.of("select")])


def test_page_says_what_the_numbers_say(text: str, several: Answer) -> None:
    assert f"Verdict: {several.estimate.verdict}" in text
    for name, value in several.estimate.parameters.items():
        assert f">{name}</th>" in text
        assert f"{value.value:.8g}" in text


def test_an_untrusted_answer_is_not_sold(several: Answer) -> None:
    bad = Answer(several.problem, replace(several.estimate, verdict=Verdict.REJECTED, message="<too> far off"))
    text = report(bad, motions(several)[:1], [])
    assert "Verdict: model rejected (&lt;too&gt; far off). Do not use these numbers." in text


def test_each_recording_moves(text: str, several: Answer) -> None:
    data = re.findall(r'<script type="application/json">(.*?)</script>', text, re.DOTALL)
    runs = [json.loads(one) for one in data]
    assert [run["name"] for run in runs] == ["high", "low"]
    assert all(len(run["outlines"]["AB"]) == len(run["times"]) for run in runs)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="needs a Chromium")
def test_animation_plays_in_a_browser(several: Answer, tmp_path: Path) -> None:
    path = tmp_path / "page.html"
    files.estimate(several.estimate, several.problem, path)
    click = "<script>document.querySelector('button').click();</script></body>"
    path.write_text(path.read_text(encoding="utf-8").replace("</body>", click), encoding="utf-8")
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--virtual-time-budget=2000", "--dump-dom"]
    assert CHROMIUM is not None
    shown = subprocess.run([CHROMIUM, *options, path.as_uri()], capture_output=True, text=True, timeout=60, check=True)
    (first, *_) = re.findall(r"<output>t = ([0-9.]+) s</output>", shown.stdout)
    assert float(first) > 0.0
    assert ">Pause<" in shown.stdout


@pytest.mark.parametrize("ending", [".html", ".png", ".gif"])
def test_files_are_what_they_end_in(several: Answer, tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"estimate{ending}"
    files.estimate(several.estimate, several.problem, path)
    begin = {".html": b"<!DOCTYPE html>", ".png": b"\x89PNG", ".gif": b"GIF89a"}[ending]
    assert path.read_bytes().startswith(begin)
