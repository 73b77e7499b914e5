"""The XML of a file as a tree that knows its lines: read beside MuJoCo, which passes over elements it does not know."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from xml.parsers import expat

from shoal.errors import InputError

_NESTED = 10
"""Depth of files that include files; beyond it one includes itself (MuJoCo refuses that too)."""


@dataclass
class XmlElement:
    """An element of XML.

    line: where its tag begins, from 1; begin, end: the bytes of the file from its tag to the end of its closing tag
    """

    tag: str
    attributes: dict[str, str]
    line: int = 0
    file: Path | None = None
    begin: int = 0
    end: int = 0
    text: str = ""
    children: list[XmlElement] = field(default_factory=list)

    def named(self, *tags: str) -> Iterator[XmlElement]:
        """Yield its children of these tags."""
        return (child for child in self.children if child.tag in tags)

    def walk(self) -> Iterator[XmlElement]:
        """Yield itself and everything inside, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.walk()

    def __str__(self) -> str:
        name = self.attributes.get("name")
        return f"<{self.tag}{f' {name}' if name else ''}> in line {self.line}"


def parse(file: Path, data: bytes) -> XmlElement:
    """Return the root element of a file. Names keep their prefixes, declared or not. Raises InputError."""
    parser = expat.ParserCreate()
    parser.buffer_text = True
    top = XmlElement("", {}, file=file)
    open_ = [top]

    def begins(tag: str, attributes: dict[str, str]) -> None:
        element = XmlElement(tag, attributes, parser.CurrentLineNumber, file, parser.CurrentByteIndex)
        open_[-1].children.append(element)
        open_.append(element)

    def ends(tag: str) -> None:
        element, close = open_.pop(), parser.CurrentByteIndex
        empty = not (element.children or element.text) and data[close - 2 : close] == b"/>"
        element.end = close if empty else data.find(b">", close) + 1

    def says(text: str) -> None:
        open_[-1].text += text

    parser.StartElementHandler, parser.EndElementHandler, parser.CharacterDataHandler = begins, ends, says
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code)
        raise InputError(f"{file}: no well-formed XML: {what} in line {error.lineno}") from None
    return top.children[0]


def with_includes(root: XmlElement, folder: Path, depth: int = 0) -> XmlElement:
    """Put the contents of files of `<include file="...">` in the place of these elements, as MuJoCo does."""
    children: list[XmlElement] = []
    for child in root.children:
        path = folder / child.attributes.get("file", "")
        if child.tag == "include" and depth < _NESTED and path.is_file():
            children += with_includes(parse(path, path.read_bytes()), folder, depth + 1).children
        else:
            children.append(with_includes(child, folder, depth))
    root.children = children
    return root
