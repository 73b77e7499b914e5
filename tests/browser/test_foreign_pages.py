"""A page of another origin neither reads nor writes anything of a server that Shoal starts; nor does a rebound name."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit
from urllib.request import urlopen

import pytest
from deployed import call, free_port

pytestmark = pytest.mark.slow

NAME = "foreign"
"""Of what the pages try to make."""
ASK = """
async (asks) => {
  const found = [];
  for (const [kind, url, options] of asks) {
    let got = null;
    try {
      if (kind === "fetch") {
        const answer = await fetch(url, {credentials: "include", ...options});
        const text = await answer.text();
        got = answer.ok ? text : null;
      } else if (kind === "socket") {
        got = await new Promise((resolve) => {
          const socket = new WebSocket(url, options);
          socket.onopen = () => { socket.close(); resolve("open"); };
          socket.onerror = () => resolve(null);
        });
      } else if (kind === "form") {
        const frame = document.createElement("iframe");
        frame.name = "sink";
        const form = Object.assign(document.createElement("form"), {action: url, method: "post", target: "sink"});
        form.enctype = "text/plain";
        // {"name": "foreign", "rest": "="} in the only form that a form can send it.
        form.append(Object.assign(document.createElement("input"), options));
        document.body.append(frame, form);
        const loaded = new Promise((resolve) => { frame.onload = resolve; setTimeout(resolve, 3000); });
        form.submit();
        await loaded;
        frame.remove();
      } else {
        const element = Object.assign(document.createElement(kind), {src: url});
        await new Promise((resolve) => {
          element.onload = element.onerror = resolve;
          document.body.append(element);
          setTimeout(resolve, 3000);
        });
        if (kind === "iframe") try { got = element.contentDocument.body.innerText || null; } catch { got = null; }
        if (kind === "img") got = element.naturalWidth ? "size" : null;
        element.remove();
      }
    } catch { got = null; }
    found.push(got);
  }
  return found;
}
"""


@pytest.fixture(scope="module")
def elsewhere() -> Iterator[int]:
    """The port of a server with an empty page, which is none of Shoal's."""

    class Empty(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><link rel=icon href=data:,><body>")

        def log_message(self, format: str, *args: Any) -> None:
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Empty) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_port
        server.shutdown()


@pytest.fixture(scope="module")
def service(desk: Any) -> Iterator[str]:
    """The address of an engine's service without keys."""
    port = free_port()
    url = f"http://127.0.0.1:{port}"
    command = [str(Path(sys.executable).with_name("shoal")), "serve", "casadi", "--port", str(port)]
    environment = {**os.environ, "SHOAL_API_LIBRARY": str(desk.home / "library"), "SHOAL_API_WORKERS": "1"}
    log = desk.home / "service.log"
    with log.open("wb") as out:
        process = subprocess.Popen(command, env=environment, stdout=out, stderr=subprocess.STDOUT)
    try:
        deadline = time.monotonic() + 600
        while True:
            try:
                urlopen(f"{url}/ready", timeout=5).close()
                break
            except OSError:
                assert process.poll() is None, log.read_text()
                assert time.monotonic() < deadline, log.read_text()
                time.sleep(0.2)
        yield url
    finally:
        process.terminate()
        process.wait(60)


def asks_of(kind: str, url: str) -> list[tuple[str, str, Any]]:
    """Ways in which a page may try to read a server, and to write to it."""
    socket = url.replace("http", "ws", 1)
    plain = {"method": "POST", "headers": {"Content-Type": "text/plain"}}
    named = json.dumps({"name": NAME})
    ways: list[tuple[str, str, Any]] = []
    read: list[str]
    write: list[tuple[str, str, str]]
    sockets: list[tuple[str, list[str]]] = []
    if kind == "prefect":
        read = ["/", "/ui-settings", "/api/admin/settings", "/api/admin/version", f"/api/csrf-token?client={NAME}"]
        write = [
            ("POST", "/api/flows/", named),
            ("POST", "/api/block_documents/filter", '{"include_secrets": true}'),
            ("POST", "/api/flow_runs/filter", "{}"),
        ]
        sockets = [("/api/events/in", []), ("/api/events/out", ["prefect"]), ("/api/logs/out", ["prefect"])]
    elif kind == "mlflow":
        search = "2.0/mlflow/experiments/search?max_results=9"
        read = ["/", f"/ajax-api/{search}", f"/api/{search}", "/ajax-api/3.0/mlflow/server-info", "/version"]
        write = [(*("POST", f"/{api}/2.0/mlflow/experiments/create"), named) for api in ("api", "ajax-api")]
    else:
        read = ["/health", "/ready", "/Info", "/v1/library", "/v1/version", "/openapi.json"]
        write = [
            ("POST", "/ModelInfo", '{"name": "misfit"}'),
            ("PUT", f"/v1/library/scenes/{NAME}", '{"files": {}}'),
            ("DELETE", f"/v1/library/scenes/{NAME}", ""),
        ]
    for path in read:
        ways += [("fetch", url + path, {}), ("fetch", url + path, {"mode": "no-cors"})]
        ways += [(element, url + path, None) for element in ("iframe", "script", "img")]
    for method, path, body in write:
        json_body = {"method": method, "headers": {"Content-Type": "application/json"}, "body": body or None}
        ways += [("fetch", url + path, json_body)]
        if method == "POST":
            ways += [("fetch", url + path, {**plain, "body": body, "mode": "no-cors"})]
            ways += [("form", url + path, {"name": body[:-1] + ', "rest": "', "value": '"}'})]
    return ways + [("socket", socket + path, protocols) for path, protocols in sockets]


def tried(page: Any, at: str, asks: list[tuple[str, str, Any]]) -> tuple[list[str], set[tuple[int, str]]]:
    """What a page at this address gets, and the answers of the servers that are asked."""
    statuses: set[tuple[int, str]] = set()
    page.goto(at)
    servers = {urlsplit(url).netloc for _, url, _ in asks}

    def note(response: Any) -> None:
        if urlsplit(response.url).netloc in servers:
            statuses.add((response.status, f"{response.request.method} {response.url}"))

    page.on("response", note)
    got = page.evaluate(ASK, asks)
    page.wait_for_timeout(500)
    # A frame of the same origin shows the refusal itself.
    read = [(ask, text) for ask, text in zip(asks, got, strict=True) if text and '"urn:shoal:host"' not in text]
    return [f"{ask[0]} {ask[1]}: {text[:80]}" for ask, text in read], statuses


def left(desk: Any, service: str) -> list[Any]:
    """What the pages have made."""
    flows = call(f"{desk.at['PREFECT']}/api/flows/filter", {"flows": {"name": {"like_": NAME}}})
    found = call(f"{desk.at['MLFLOW']}/api/2.0/mlflow/experiments/search", {"max_results": 1000})
    experiments = [one for one in found["experiments"] if one["name"] == NAME]
    entries = [one for one in call(f"{service}/v1/library")["entries"] if one["name"] == NAME]
    return [*flows, *experiments, *entries]


@pytest.mark.parametrize("kind", ["prefect", "mlflow", "ui", "service"])
def test_another_origin_gets_nothing(desk: Any, browser: Any, elsewhere: int, service: str, kind: str) -> None:
    """From another port of this machine, from its other name, and from a name elsewhere."""
    url = {"prefect": desk.at["PREFECT"], "mlflow": desk.at["MLFLOW"], "ui": desk.pages, "service": service}[kind]
    asks = asks_of("mlflow" if kind == "ui" else kind, url)
    for host in ("127.0.0.1", "localhost", "evil.example"):
        page = browser.new_page()
        got, statuses = tried(page, f"http://{host}:{elsewhere}/", asks)
        page.close()
        assert got == [], host
        assert {status for status, _ in statuses} == {403}, (host, statuses)
        assert left(desk, service) == []


@pytest.mark.parametrize("kind", ["prefect", "mlflow", "ui", "service"])
def test_a_rebound_name_gets_nothing(desk: Any, browser: Any, service: str, kind: str) -> None:
    """evil.example leads to this machine: to the browser, all is of one origin."""
    url = {"prefect": desk.at["PREFECT"], "mlflow": desk.at["MLFLOW"], "ui": desk.pages, "service": service}[kind]
    rebound = url.replace("127.0.0.1", "evil.example")
    page = browser.new_page()
    got, statuses = tried(page, rebound, asks_of("mlflow" if kind == "ui" else kind, rebound))
    page.close()
    assert got == []
    assert {status for status, _ in statuses} == {400}, statuses
    assert left(desk, service) == []


def test_what_is_tried_succeeds_where_it_may(desk: Any, browser: Any, service: str) -> None:
    """From a server's own page the same requests read and open: none fails because it is asked wrongly."""
    for kind, url in (("prefect", desk.at["PREFECT"]), ("mlflow", desk.at["MLFLOW"]), ("service", service)):
        page = browser.new_page()
        asks = [ask for ask in asks_of(kind, url) if ask[0] in ("fetch", "socket") and "scenes" not in ask[1]]
        reading = [ask for ask in asks if ask[0] == "socket" or not ask[2].get("body")]
        page.goto(
            f"{url}/ui-settings" if kind == "prefect" else f"{url}/version" if kind == "mlflow" else f"{url}/health"
        )
        got = page.evaluate(ASK, reading)
        assert [ask for ask, text in zip(reading, got, strict=True) if text is None] == []
        page.close()


def test_another_page_may_lead_here(desk: Any, browser: Any, elsewhere: int) -> None:
    """As links from MLflow's pages to Prefect's do."""
    page = browser.new_page()
    for url in (desk.at["PREFECT"], desk.at["MLFLOW"]):
        page.goto(f"http://127.0.0.1:{elsewhere}/")
        page.evaluate("(url) => { location.href = url; }", url)
        page.wait_for_url(f"{url}/**")
        assert "Prefect" in page.title() or "MLflow" in page.title()
    page.close()


def test_nothing_leaves_the_machine_and_neither_banner_nor_bubble_is_seen(desk: Any, visit: Any) -> None:
    """Prefect's second set of pages asks amplitude.com, MLflow's assistant a language model."""
    one = visit()
    page = one.page
    for name in ("127.0.0.1", "localhost"):
        page.goto(desk.at["PREFECT"].replace("127.0.0.1", name))
        page.get_by_text("Work pools", exact=False).first.wait_for()
        page.wait_for_timeout(2000)
        assert page.get_by_text("V2 UI").count() == 0
    page.goto(f"{desk.at['PREFECT']}/v2/dashboard")
    page.get_by_text("Work pools", exact=False).first.wait_for()
    one.shoot("prefect")
    for pages in (desk.at["MLFLOW"], desk.pages):
        page.goto(pages)
        page.get_by_role("link", name="Experiments").first.wait_for()
        page.wait_for_timeout(2000)
        bubbles = page.locator("[data-assistant-ui]")
        assert not any(bubbles.nth(k).is_visible() for k in range(bubbles.count()))
        assert page.get_by_text("Assistant", exact=False).filter(visible=True).count() == 0
        one.shoot("mlflow")
        status = page.evaluate("async () => (await fetch('/ajax-api/3.0/mlflow/assistant/config')).status")
        assert status == 404
    for path in ("/docs", "/redoc", "/api/docs", "/api/redoc"):
        page.goto(desk.at["PREFECT"] + path)
        page.wait_for_timeout(500)
    blocked = page.evaluate("() => fetch('http://localhost:9/').then(() => 'sent', (error) => String(error))")
    assert "Failed to fetch" in blocked
    assert [url for url in one.elsewhere if not url.startswith("http://localhost:")] == []
