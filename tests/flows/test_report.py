from __future__ import annotations

from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path

import pytest
from shoal.engines.compare import Comparison
from shoal_flows import pictures
from shoal_flows.jobs import Fit
from shoal_flows.plan import CASES, SAME_MESH
from shoal_flows.report import words
from shoal_flows.report.write import render, write_report
from shoal_flows.results import Compared, DemoResult, Study


class Page(HTMLParser):
    """Collects tags and checks that they are closed."""

    VOID = {"meta", "img", "br", "link", "input"}

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
def result(fits: list[Fit], comparison: Comparison) -> DemoResult:
    png, svg = pictures.draw_trajectory(fits, "Case")

    def study(name: str, *drawn: str) -> Study:
        return Study(name, "run", fits, {"afsa": "<went> wrong"}, dict.fromkeys(drawn, (png, svg)))

    swarm = [replace(fits[0], cell=replace(fits[0].cell, method="iafsa"))]
    return DemoResult(
        {case: replace(study(case, "convergence", "residuals"), fits=[*fits, *swarm]) for case in CASES},
        {case: study(case, "mesh_error") for case in CASES},
        {case: study(SAME_MESH[case]) for case in CASES},
        {case: Compared(comparison, "run", (png, svg)) for case in CASES},
    )


def test_report_is_one_valid_page_without_the_network(result: DemoResult, tmp_path: Path) -> None:
    path = write_report(result, tmp_path)
    text = path.read_text(encoding="utf-8")
    page = Page()
    page.feed(text)
    assert page.open == []
    links = [value for _, attributes in page.tags for key in ("src", "href") if (value := attributes.get(key))]
    assert links
    assert all(link.startswith(("#", "data:,", "data:image/svg+xml;base64,")) for link in links)
    assert "@import" not in text
    assert "url(" not in text
    targets = {attributes.get("id") for _, attributes in page.tags}
    assert {link[1:] for link in links if link.startswith("#")} <= targets


def test_report_can_be_read_aloud(result: DemoResult) -> None:
    page = Page()
    page.feed(render(result))
    assert len(page.of("canvas")) == 2
    assert all(len(canvas["aria-label"] or "") > 30 for canvas in page.of("canvas"))
    images = page.of("img")
    assert len(images) == 8
    assert all(len(image["alt"] or "") > 30 for image in images)
    assert len(page.of("caption")) == len(page.of("table"))
    headings = [int(tag[1]) for tag, _ in page.tags if tag in ("h1", "h2", "h3")]
    assert headings[0] == 1
    assert all(after - before <= 1 for before, after in pairwise(headings))


def test_report_prints_the_paper_beside_ours_and_escapes_reasons(result: DemoResult) -> None:
    text = render(result)
    for printed in ("6.0323 × 10⁻⁶", "1.6541 × 10⁻⁸", "6.6317 × 10⁻⁷", "2.1591 × 10⁻⁸", "0.7584"):
        assert printed in text
    assert "failed: &lt;went&gt; wrong" in text
    assert "shoal identify paper-case-1 --method least-squares --seed 0" in text


def test_doubts_are_told(result: DemoResult) -> None:
    assert result.trusted
    without = {case: replace(study, fits=[]) for case, study in result.studies.items()}
    doubtful = replace(result, studies=without)
    assert not doubtful.trusted
    assert "paper-case-1: iafsa failed: <went> wrong" in doubtful.doubts()
    assert "Not every answer can be trusted" in words.headline(doubtful)
