"""Servers that are told the names of the library: none, one that hangs, one of something else; entries of services."""

from __future__ import annotations

import base64
import json
import socket
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from shoal import library
from shoal.cli import main
from shoal.errors import InputError
from shoal.scene.load import scene_library
from shoal.shelf import shelf
from shoal_flows import choices, inputs

PENDULUM = (scene_library() / "single-pendulum.yaml").read_text(encoding="utf-8")
ANSWERS: dict[str, Any] = {}
CHANGED: list[Any] = []


class Server(BaseHTTPRequestHandler):
    """Answers what stands in ANSWERS, and keeps what it is told to change."""

    def do_POST(self) -> None:
        self.do_GET()

    def do_PATCH(self) -> None:
        CHANGED.append(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def do_GET(self) -> None:
        found = ANSWERS.get(self.path)
        content = json.dumps({"detail": "no"} if found is None else found).encode()
        self.send_response(404 if found is None else 200)
        self.end_headers()
        self.wfile.write(content)

    def log_message(self, format: str, *arguments: Any) -> None:
        pass


@pytest.fixture(scope="module")
def url() -> Iterator[str]:
    server = ThreadingHTTPServer(("127.0.0.1", 0), Server)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}"
    server.shutdown()
    server.server_close()


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))
    monkeypatch.setenv("SHOAL_LIBRARY", str(tmp_path / "library"))
    monkeypatch.delenv("PREFECT_API_URL", raising=False)
    ANSWERS.clear()
    CHANGED.clear()
    return tmp_path


def test_nothing_is_sent_where_there_is_no_server(monkeypatch: pytest.MonkeyPatch) -> None:
    assert choices.refresh() == ""
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        monkeypatch.setenv("PREFECT_API_URL", f"http://127.0.0.1:{taken.getsockname()[1]}/api")
        assert choices.refresh() == ""
        taken.listen()  # and never answers
        begin = time.monotonic()
        monkeypatch.setattr(choices, "SECONDS", 0.2)
        assert choices.refresh() == ""
        assert time.monotonic() - begin < 30.0


@pytest.mark.parametrize("answer", [None, {}, [], [1], "text", [{"id": 1}], [{"id": 1, "parameter_openapi_schema": 3}]])
def test_a_server_of_something_else_is_left_alone(url: str, answer: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PREFECT_API_URL", url)
    ANSWERS["/deployments/filter"] = answer
    assert choices.refresh() == choices.difference() == ""
    assert CHANGED == []


def test_only_lists_of_names_are_renewed(url: str) -> None:
    """By the server of the `make up` of this home, and of the names that are told."""
    choices.remember(url)
    listed = {"enum": ["old"], choices.MARK: "recordings"}
    forms = [{"properties": {"data": {"anyOf": [listed, {"type": "string"}]}, "engine": {"enum": ["gauss"]}}}, {}]
    ANSWERS["/deployments/filter"] = [{"id": k, "parameter_openapi_schema": form} for k, form in enumerate(forms)]
    assert choices.refresh({"recordings": ["run"]}) == ""
    listed["enum"] = ["", "run"]
    assert [told["parameter_openapi_schema"] for told in CHANGED] == forms[:1]
    choices.remember(None)
    assert choices.refresh() == ""
    assert len(CHANGED) == 1


def form(names: list[str]) -> dict[str, Any]:
    listed = {"enum": names, choices.MARK: "recordings", choices.LIBRARY: choices.library()}
    return {"properties": {"data": {"anyOf": [{"type": "string"}, listed]}}}


def test_forms_offer_the_names_of_the_library_that_the_worker_has(
    url: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By whatever path it is reached. Another home, or the library of another service, changes nothing and says so."""
    monkeypatch.setenv("PREFECT_API_URL", url)
    identity = shelf().identity(make=True)
    assert identity == shelf().identity() != ""
    ANSWERS["/deployments/filter"] = [{"id": 1, "parameter_openapi_schema": form(["old"])}]
    (place / "link").symlink_to(place / "library")
    for folder in (place / "link", place / "library"):
        monkeypatch.setenv("SHOAL_LIBRARY", str(folder))
        assert choices.difference() == choices.refresh({"recordings": ["run"]}) == ""
        assert choices.refresh({"recordings": ["run"]}, identity) == ""
    assert len(CHANGED) == 4
    monkeypatch.setenv("SHOAL_LIBRARY", str(place / "other"))
    for made in (False, True):
        assert bool(shelf().identity(make=made)) == made
        assert f"uses the library {place / 'library'} on " in choices.difference()
        assert f", not the library {place / 'other'}:" in choices.refresh()
    assert ", not the library of that service:" in choices.refresh({"recordings": ["theirs"]}, "another")
    added = CliRunner().invoke(main, ["library", "add", str(scene_library() / "single-pendulum.yaml"), "--name", "arm"])
    assert (added.exit_code, added.stderr) == (0, f"note: {choices.difference()}\n")
    assert len(CHANGED) == 4


def test_an_entry_is_taken_from_the_library_of_a_service(url: str, place: Path) -> None:
    run = {"run.yaml": b"path: swing.csv   # by camera 2\n", "swing.csv": b"t,x\n0,1\n1,2\n2,3\n"}
    arm = {"arm.yaml": PENDULUM.encode()}
    for kind, name, files in (("recordings", "run", run), ("scenes", "arm", arm)):
        content = {path: base64.b64encode(text).decode() for path, text in files.items()}
        ANSWERS[f"/v1/library/{kind}/{name}"] = {"files": content}
        held = Path(inputs.held("given", kind, f"{url}/v1/library/{kind}/{name}"))
        assert {path.name: path.read_bytes() for path in held.parent.iterdir()} == files
        assert held.parent.parent == place / "library" / "held"


def test_the_title_is_the_name_that_a_document_states(place: Path) -> None:
    """In MLflow and Prefect as in the registry: files of one name may hold machines that have nothing in common."""
    text = PENDULUM.replace("name: single-pendulum", "name: Kran Größe 1")
    assert text != PENDULUM
    for folder in ("one", "two"):
        (place / folder).mkdir()
        (place / folder / "machine.yaml").write_text(text.replace("Größe 1", f"Größe {folder}"))
    one, two = (str(place / folder / "machine.yaml") for folder in ("one", "two"))
    assert [inputs.title(given) for given in (one, two)] == ["Kran Größe one", "Kran Größe two"]
    assert inputs.headed(one, "scenes") == inputs.title(inputs.held("scene", "scenes", one)) == "Kran Größe one"
    typed = inputs.held("scene", "scenes", text)
    assert inputs.headed(text, "scenes") == inputs.title(typed) == "Kran Größe 1"
    assert Path(typed).stem == "Kran-Grosse-1"
    library.add(place / "one" / "machine.yaml")
    assert inputs.headed("machine", "scenes") == "Kran Größe one"
    assert inputs.headed("http://127.0.0.1:1/v1/library/scenes/arm", "scenes") == "arm"
    assert inputs.headed("single-pendulum", "scenes") == inputs.title("single-pendulum") == "single-pendulum"
    assert inputs.headed("bodies: [\n", "scenes") == "own"


@pytest.mark.parametrize(
    ("kind", "given", "why"),
    [
        ("recordings", "{url}/v1/library/scenes/arm", "data: .* no address of an entry, such as .*/recordings/NAME"),
        ("recordings", "{url}/", "data: .* no address of an entry"),
        ("recordings", "{url}/v1/library/recordings/../../keys", "data: .* no address of an entry"),
        ("recordings", "{url}/v1/library/recordings/none", "data: .* is not a service of Shoal"),
        ("scenes", "{url}/v1/library/scenes/bad", "data: name: Field required"),
        ("scenes", "{url}/v1/library/scenes/out", "out: files: '../out' is not a plain path"),
        ("scenes", "name: a\nbodies: [", "data: line 3: "),
        ("scenes", "name: a\nbodies: 7", "data: bodies: "),
        ("problems", "name: a\nscene: arn\n", "data: "),
        ("scenes", "single-pendolum", "data: single-pendolum: no such scene, .*did you mean single-pendulum "),
    ],
)
def test_what_is_wrong_is_one_line_that_names_the_parameter(url: str, kind: str, given: str, why: str) -> None:
    for name, files in (("bad", {"bad.yaml": b"bodies: 1"}), ("out", {"out.yaml": b"bodies: 1", "../out": b""})):
        content = {path: base64.b64encode(text).decode() for path, text in files.items()}
        ANSWERS[f"/v1/library/scenes/{name}"] = {"files": content}
    with pytest.raises(InputError, match=why) as refusal:
        inputs.held("data", kind, given.format(url=url))
    assert "\n" not in str(refusal.value)
