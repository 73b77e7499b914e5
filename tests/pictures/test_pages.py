"""Every page is valid HTML, needs no network, can be read aloud and is small."""

from __future__ import annotations

import re
from collections.abc import Callable
from itertools import pairwise
from xml.etree.ElementTree import Element

import html5lib
import pytest

KINDS = ["estimate", "rejected", "study", "simulation", "selection"]
COSTLY = "rejected", "study"


def parsed(text: str) -> Element:
    """The page as a tree; strict: whatever HTML 5 calls a parse error is raised."""
    tree: Element = html5lib.HTMLParser(strict=True, namespaceHTMLElements=False).parse(text)
    return tree


@pytest.fixture(params=[pytest.param(kind, marks=[pytest.mark.slow] * (kind in COSTLY)) for kind in KINDS])
def text(request: pytest.FixtureRequest, pages: Callable[[str], str]) -> str:
    return pages(request.param)


def test_page_is_valid_and_needs_nothing_else(text: str) -> None:
    tree = parsed(text)
    links = [value for element in tree.iter() for key in ("src", "href") if (value := element.get(key))]
    assert any(link.startswith("data:image/") for link in links)
    assert all(link.startswith(("#", "data:")) for link in links)
    # Namespaces of SVG are names, not addresses.
    assert not re.search(r"https?://(?!www\.w3\.org)", text)
    assert "@import" not in text
    assert "url(" not in text
    assert "fetch(" not in text
    assert len(text) < 3e6


def test_page_can_be_read_aloud(text: str) -> None:
    tree = parsed(text)
    assert all(len(image.get("alt", "")) > 30 for image in tree.iter("img"))
    assert all(len(canvas.get("aria-label", "")) > 30 for canvas in tree.iter("canvas"))
    assert all(control.get("aria-label") for kind in ("input", "select") for control in tree.iter(kind))
    assert all(table.find("caption") is not None for table in tree.iter("table"))
    levels = [int(element.tag[1]) for element in tree.iter() if re.fullmatch("h[1-6]", str(element.tag))]
    assert levels[0] == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))
    ids = [found for element in tree.iter() if (found := element.get("id"))]
    assert len(ids) == len(set(ids))


def test_a_strict_parser_would_see_a_fault(pages: Callable[[str], str]) -> None:
    with pytest.raises(html5lib.html5parser.ParseError):
        parsed(pages("simulation").replace("</table>", "</tabel>", 1))
