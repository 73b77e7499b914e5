"""Every server that Shoal starts refuses requests for other hosts and of other origins; without a browser."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from urllib.error import HTTPError
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import pytest
from background import until
from deployed import call, free_port, running
from shoal_flows import server, settings

ROOT = Path(__file__).parents[2]
EVIL = {
    "Host": ("evil.example", "127.0.0.1.evil.example", "10.evil.example", "192.168.evil.example", "localhost.", ""),
    "Origin": ("http://evil.example", "http://127.0.0.1:1", "http://localhost:1", "null"),
}
PATHS = {
    "PREFECT": ("/", "/ui-settings", "/api/health", "/api/admin/settings", "/api/csrf-token?client=a", "/nothing"),
    "MLFLOW": ("/", "/health", "/version", "/api/2.0/mlflow/experiments/search?max_results=1", "/graphql"),
}


def status(url: str, method: str = "GET", **headers: str) -> int:
    given = {name.replace("_", "-"): value for name, value in headers.items()}
    try:
        with urlopen(Request(url, headers=given, method=method, data=b"{}" if method == "POST" else None)) as answer:
            return int(answer.status)
    except HTTPError as error:
        error.close()
        return error.code


def refused(at: str, paths: tuple[str, ...]) -> None:
    for path in paths:
        for method in ("GET", "POST", "OPTIONS"):
            for name, values in EVIL.items():
                for value in values:
                    found = status(at + path, method, **{name: value})
                    assert found == (400 if name == "Host" else 403), (method, path, name, value)


def opened(at: str, path: str, host: str = "", **headers: str) -> bool:
    """Whether a websocket opens; where it does not, it is refused."""
    place = urlsplit(at)
    given = {
        "Host": host or place.netloc,
        "Connection": "Upgrade",
        "Upgrade": "websocket",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
        "Sec-WebSocket-Protocol": "prefect",
        **headers,
    }
    lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in given.items()), "", ""]
    with socket.create_connection((place.hostname, place.port), 60) as connection:
        connection.sendall("\r\n".join(lines).encode())
        found = int(connection.recv(1000).split()[1])
    assert found in (101, 403)
    return found == 101


@pytest.fixture(scope="module")
def at(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Mapping[str, str]]:
    """Addresses of `make up` with a cluster, without the engines' services."""
    without = [word for name in ("gauss", "exudyn", "casadi") for word in ("--without", name)]
    ports = {f"SHOAL_DASK{name}_PORT": str(free_port()) for name in ("", "_PAGES", "_WORKER")}
    with running(tmp_path_factory.mktemp("up"), "--with", "scale", *without, settings=ports) as found:
        yield found | {name[6:-5]: f"http://127.0.0.1:{port}" for name, port in ports.items()}


@pytest.mark.slow
@pytest.mark.parametrize("name", PATHS)
def test_servers_of_make_up(at: Mapping[str, str], name: str) -> None:
    refused(at[name], PATHS[name])
    port = urlsplit(at[name]).port
    for host in ("127.0.0.1", "localhost", "LocalHost"):
        assert (
            status(f"{at[name]}/version" if name == "MLFLOW" else f"{at[name]}/api/ready", Host=f"{host}:{port}") == 200
        )
    own = {"Origin": at[name], "Sec_Fetch_Site": "same-origin"}
    assert status(at[name] + PATHS[name][3], **own) == 200


@pytest.mark.slow
def test_websockets_of_prefect(at: Mapping[str, str]) -> None:
    """CORS does not cover them, and Prefect looks at no Origin."""
    for path in ("/api/events/in", "/api/events/out", "/api/logs/out"):
        assert opened(at["PREFECT"], path)
        assert opened(at["PREFECT"], path, Origin=at["PREFECT"])
        for origin in EVIL["Origin"]:
            assert not opened(at["PREFECT"], path, Origin=origin)
        assert not opened(at["PREFECT"], path, "evil.example")


@pytest.mark.slow
def test_prefect_asks_for_a_token_and_offers_one_set_of_pages(at: Mapping[str, str]) -> None:
    assert status(f"{at['PREFECT']}/api/flows/filter", "POST", Content_Type="application/json") == 403
    assert call(f"{at['PREFECT']}/api/flows/filter", {})
    assert call(f"{at['PREFECT']}/ui-settings")["available_uis"] == ["v1"]
    for path in ("/docs", "/redoc", "/api/docs", "/api/redoc"):
        assert status(at["PREFECT"] + path) == 404  # their scripts are elsewhere
    with urlopen(at["PREFECT"]) as answer:
        policy = answer.headers["Content-Security-Policy"]
    assert {"default-src 'self'", "frame-ancestors 'self'"} <= set(policy.split("; "))


@pytest.mark.slow
def test_mlflow_keeps_its_own_check_and_has_no_assistant(at: Mapping[str, str]) -> None:
    for path in (
        "/ajax-api/3.0/mlflow/assistant/config",
        "/ajax-api/3.0/mlflow/gateway/endpoints/list",
        "/gateway/a/b",
    ):
        assert status(at["MLFLOW"] + path) == 404
    names = {**os.environ, "SHOAL_ALLOWED_HOSTS": "shoal.example.org"}
    names.pop("MLFLOW_SERVER_ALLOWED_HOSTS", None)
    code = (
        "from shoal_flows.tracking.dashboard import mlflow; from starlette.testclient import TestClient; "
        "print([TestClient(mlflow, base_url=f'http://{h}').get('/nothing').status_code "
        "for h in ('localhost', 'shoal.example.org:8', '[::1]:5', '10.evil.example', 'evil.example')])"
    )
    done = subprocess.run([sys.executable, "-c", code], env=names, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "[404, 404, 404, 403, 403]", done.stderr


@pytest.mark.slow
def test_dask_shows_its_health_alone(at: Mapping[str, str]) -> None:
    for name in ("DASK_PAGES", "DASK_WORKER"):
        assert status(f"{at[name]}/health") == 200
        for header, values in EVIL.items():
            for value in values:
                assert status(f"{at[name]}/health", **{header: value}) == (400 if header == "Host" else 403)
        for path in ("/info/main/workers.html", "/json/identity.json", "/metrics", "/status", "/statics/css/base.css"):
            assert status(at[name] + path) == 404


@pytest.mark.slow
def test_the_server_of_one_command(monkeypatch: pytest.MonkeyPatch) -> None:
    """That of `shoal run`, which a page could find by trying ports."""
    monkeypatch.setattr(os, "environ", {k: v for k, v in os.environ.items() if not k.startswith("PREFECT_")})
    server.start()
    try:
        server.wait()
        api = os.environ["PREFECT_API_URL"]
        refused(api.removesuffix("/api"), PATHS["PREFECT"])
        assert call(f"{api}/flows/filter", {}) == []
        assert status(f"{api}/flows/filter", "POST", Content_Type="application/json") == 403
    finally:
        server.stop()


@pytest.mark.slow
def test_a_name_that_an_operator_adds(tmp_path: Path) -> None:
    """With a proxy in front that ends TLS."""
    port = free_port()
    environment = {**os.environ, **settings.defaults(tmp_path), "SHOAL_ALLOWED_HOSTS": "shoal.example.org"}
    command = [sys.executable, "-m", "shoal_flows.prefect_server", "--port", str(port)]
    process = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
    try:
        url = f"http://127.0.0.1:{port}/api/health"
        until(lambda: status(url) == 200, "the server answers")
        assert status(url, Host="shoal.example.org", Origin="https://shoal.example.org") == 200
        assert status(url, Host="shoal.example.org", Origin="https://example.org") == 403
        assert status(url, Host="other.example.org") == 400
    finally:
        process.terminate()
        process.wait(60)


def test_no_server_is_started_without_its_checks() -> None:
    """Neither Prefect's own command, nor MLflow's without Shoal's program."""
    files = [ROOT / name for name in ("Procfile", "docker-compose.yml", "Dockerfile", "Makefile", "prefect.yaml")]
    files += [*(ROOT / "flows").rglob("*.py"), *(ROOT / "deploy").glob("*")]
    for file in (file for file in files if file.is_file()):
        text = re.sub(r"[\"',\[\]]", " ", file.read_text(encoding="utf-8"))
        text = re.sub(r"`[^`]*`", "", text)
        assert not re.search(r"prefect\s+server\s+start", text), file
        for found in re.finditer(r"mlflow\s+server\s+(--\S+\s+\S+)", text):
            assert found[1].split() == ["--app-name", "shoal"], file


def test_the_environment_of_a_desk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("SHOAL_PREFECT_PORT", "4321")
    stated = settings.defaults(tmp_path)
    assert stated["PREFECT_SERVER_CORS_ALLOWED_ORIGINS"] == "http://127.0.0.1:4321,http://localhost:4321"
    assert stated["PREFECT_SERVER_CSRF_PROTECTION_ENABLED"] == "true"
