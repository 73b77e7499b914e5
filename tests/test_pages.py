"""Every fenced block of README and docs/ is run as a newcomer would run it, or its title says why it is not.

A page is a session: its blocks run in their order in one folder, bash blocks until a line fails, Python blocks in one
interpreter, and a YAML block below "`NAME.yaml`:" is that file. The title of a fence says what is not run at all ("Not
tested: ...") or only with `-m slow` ("Tested at night: ..."). What is run elsewhere: the pages of docs/extend/ on a
copy of the package that has their changes (test_docs.py), and the scripts that pages include (test_examples.py).
"""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NamedTuple
from urllib.request import urlopen

import pytest
from deployed import free_port

ROOT = Path(__file__).parents[1]
ALL = ["README.md", *sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "docs").rglob("*.md"))]
PAGES = [page for page in ALL if not page.startswith("docs/extend/")]
FENCE = re.compile(r"^(?P<indent> *)(?P<mark>```+)(?P<info>[^\n]*)\n(?P<code>.*?)^(?P=indent)(?P=mark) *$", re.M | re.S)
TITLE = re.compile(r'title="(Not tested|Tested at night): [^"]{5,}"')
RUN, SHOWN = ("bash", "python"), ("text", "yaml", "json", "diff", "nginx")
SERVICES = {"gauss": "http://127.0.0.1:8001", "exudyn": "http://127.0.0.1:8002"}
"""Engines that pages expect to be served, and where they say so."""
PYTHON = """
import json, os, sys, traceback
replies, names = os.fdopen(os.dup(1), "w"), {"__name__": "__main__"}
os.dup2(2, 1)
for line in sys.stdin:
    try:
        exec(compile(json.loads(line), "block", "exec"), names)
        said = ""
    except BaseException:
        said = traceback.format_exc()
    print(json.dumps(said), file=replies, flush=True)
"""


class Block(NamedTuple):
    """A fenced block. when: "Not tested", "Tested at night" or empty; file: as which a YAML block is to be written."""

    language: str
    when: str
    code: str
    line: int
    file: str


def blocks(page: str) -> list[Block]:
    """The fenced blocks of a page that are not read from elsewhere."""
    text, found = (ROOT / page).read_text(encoding="utf-8"), []
    for match in FENCE.finditer(text):
        if match["code"].lstrip().startswith("--8<--"):
            continue
        language, _, title = match["info"].partition(" ")
        marked, named = TITLE.fullmatch(title), re.search(r"`([\w.-]+\.yaml)`:\n\n$", text[: match.start()])
        code = re.sub(rf"^{match['indent']}", "", match["code"], flags=re.M)
        when = marked[1] if marked else title
        found.append(Block(language, when, code, text.count("\n", 0, match.start()) + 1, named[1] if named else ""))
    return found


@pytest.mark.parametrize("page", ALL)
def test_every_block_has_a_language_and_a_reason_if_it_is_not_run(page: str) -> None:
    for block in blocks(page):
        assert block.language in (*RUN, *SHOWN), f"{page}:{block.line}: {block.language!r}"
        assert block.when in ("", "Not tested", "Tested at night"), f"{page}:{block.line}: {block.when!r}"
        assert block.language in RUN or not block.when, f"{page}:{block.line}: is not run anyway"


@contextmanager
def serving(environment: Mapping[str, str], needed: list[str]) -> Iterator[dict[str, str]]:
    """Services of engines on free ports, by the addresses that stand for them on the pages."""
    started, places = [], {}
    try:
        for engine in needed:
            port = free_port()
            command = [sys.executable, "-c", "from shoal.cli import main; main()", "serve", engine, "--port", str(port)]
            started.append(subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL))
            places[SERVICES[engine]] = f"http://127.0.0.1:{port}"
        for process, place in zip(started, places.values(), strict=True):
            deadline = time.monotonic() + 600
            while True:
                with suppress(OSError), urlopen(f"{place}/ready", timeout=5):
                    break
                assert process.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.2)
        yield places
    finally:
        for process in started:
            process.send_signal(signal.SIGTERM)
            process.wait(60)


class Session:
    """A newcomer's terminal in a folder, and an interpreter there."""

    def __init__(self, folder: Path, environment: Mapping[str, str], places: Mapping[str, str]) -> None:
        self._folder, self._environment, self._places = folder, environment, places
        self._python: subprocess.Popen[str] | None = None

    def run(self, block: Block) -> None:
        """Run a block, which has to succeed; a file is written."""
        code = block.code
        for said, place in self._places.items():
            code = code.replace(said, place)
        if block.language == "bash":
            done = subprocess.run(
                ["bash", "-euo", "pipefail", "-c", code],
                cwd=self._folder,
                env=self._environment,
                capture_output=True,
                text=True,
                check=False,
            )
            assert done.returncode == 0, f"line {block.line}:\n{code}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"
        elif block.language == "python":
            said = self._execute(code)
            assert said == "", f"line {block.line}:\n{code}\n{said}"
        elif block.file:
            (self._folder / block.file).write_text(code)

    def _execute(self, code: str) -> str:
        if self._python is None:
            self._python = subprocess.Popen(
                [sys.executable, "-c", PYTHON],
                cwd=self._folder,
                env=self._environment,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
            )
        assert self._python.stdin is not None
        assert self._python.stdout is not None
        self._python.stdin.write(json.dumps(code) + "\n")
        self._python.stdin.flush()
        return str(json.loads(self._python.stdout.readline() or '"the interpreter ended"'))

    def close(self) -> None:
        """End the interpreter."""
        if self._python is not None:
            self._python.communicate()


def newcomer(folder: Path) -> dict[str, str]:
    """The environment of somebody who has activated .venv and owns nothing yet; the kernels are compiled."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("SHOAL_", "PREFECT_", "MLFLOW_", "XDG_"))
    }
    home = folder / "user"
    home.mkdir()
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    stated = {"HOME": str(home), "SHOAL_HOME": str(folder / "home"), "PATH": path, "COLUMNS": "80"}
    return kept | stated


def check(page: str, folder: Path, *, night: bool) -> None:
    """Run a page: by day without what its title leaves to the night."""
    wanted = [block for block in blocks(page) if block.when == "" or (night and block.when == "Tested at night")]
    text = "".join(block.code for block in wanted if block.language in RUN)
    environment = newcomer(folder)
    work = folder / "work"
    work.mkdir()
    (work / ".venv").symlink_to(sys.prefix)
    needed = [engine for engine, place in SERVICES.items() if place in text]
    with serving(environment, needed) as places:
        session = Session(work, environment, places)
        try:
            for block in wanted:
                session.run(block)
        finally:
            session.close()


FIRST = "README.md"
"""The page that is run first; by day test_docs.py runs the tutorial and the notebook, with their figures."""


def having(when: str) -> list[str]:
    """Pages with blocks that are run then."""
    return [page for page in PAGES if any(b.language in RUN and b.when == when for b in blocks(page))]


@pytest.mark.slow
def test_the_readme(tmp_path: Path) -> None:
    check(FIRST, tmp_path, night=False)


@pytest.mark.slow
@pytest.mark.parametrize("page", sorted({*having(""), *having("Tested at night")}))
def test_a_page_at_night(page: str, tmp_path: Path) -> None:
    check(page, tmp_path, night=True)


BROKEN: dict[str, Any] = {
    "bash": "true\nfalse\ntrue\n",
    "python": "import shoal\nshoal.no_such_name\n",
}


@pytest.mark.parametrize("language", BROKEN)
def test_a_line_that_fails_is_found(language: str, tmp_path: Path) -> None:
    """Also one that is not the last."""
    session = Session(tmp_path, newcomer(tmp_path), {})
    try:
        with pytest.raises(AssertionError, match="line 7"):
            session.run(Block(language, "", BROKEN[language], 7, ""))
    finally:
        session.close()
