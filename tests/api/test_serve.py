"""`shoal serve` as a program of its own: TLS, and what is left when it is killed."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import ssl
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest
from click.testing import CliRunner
from running import eventually, listening, port_of
from shoal.api import connection
from shoal.api.program import create_program
from shoal.api.serve import configured
from shoal.api.settings import Settings
from shoal.cli import main
from shoal.engines import get_engine
from shoal.errors import ComputationError
from shoal.scene import load_scene

SHOAL = [sys.executable, "-c", "from shoal.cli import main; main()"]
needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="there is no openssl to make a certificate")


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A certificate of this machine that signs itself, and its key."""
    folder = tmp_path_factory.mktemp("tls")
    made = "openssl req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost -addext subjectAltName=IP:127.0.0.1"
    command = [*made.split(), "-keyout", str(folder / "key"), "-out", str(folder / "crt")]
    subprocess.run(command, check=True, capture_output=True)
    return folder / "crt", folder / "key"


@contextmanager
def served(*options: str, **environment: str) -> Iterator[tuple[int, subprocess.Popen[str]]]:
    """Port and process of a service that answers; the process has a group of its own."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [*SHOAL, "serve", "gauss", "--port", str(port), *options]
    with subprocess.Popen(command, env=os.environ | environment, stderr=subprocess.PIPE, text=True) as process:
        try:
            yield port, process
        finally:
            process.terminate()


def ready(url: str, trusted: ssl.SSLContext | bool = True) -> bool:
    try:
        return httpx.get(f"{url}/ready", verify=trusted).is_success
    except httpx.ConnectError:
        return False


@pytest.mark.slow
@needs_openssl
def test_tls(pair: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """A client that trusts the certificate gets the engine's own bits, one that does not gets a line."""
    certificate, key = pair
    scene = load_scene("single-pendulum")
    with served("--certificate", str(certificate), "--key", str(key)) as (port, _):
        url, trusted = f"https://127.0.0.1:{port}", ssl.create_default_context(cafile=str(certificate))
        eventually(lambda: ready(url, trusted))
        monkeypatch.setattr("shoal.engines.remote.RETRIES", 0)
        monkeypatch.delenv("SSL_CERT_FILE", raising=False)
        with pytest.raises(ComputationError, match=r"does not answer: .*certificate verify failed"):
            get_engine(url).simulate(scene, [0.1])
        with pytest.raises(ComputationError, match="does not answer"):
            get_engine(url.replace("https", "http")).simulate(scene, [0.1])
        monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
        far, near = (get_engine(name).simulate(scene, [0.1]) for name in (url, "gauss"))
        assert far.points.tobytes() == near.points.tobytes()


@needs_openssl
@pytest.mark.parametrize(
    ("files", "line"),
    [
        (("crt", None), "certificate: TLS needs both --certificate and --key"),
        ((None, "key"), "certificate: TLS needs both --certificate and --key"),
        (("none", "key"), "No such file or directory"),
        (("key", "crt"), "cannot be used"),
    ],
)
def test_what_is_no_certificate(files: tuple[str | None, str | None], line: str, pair: tuple[Path, Path]) -> None:
    given = zip(("--certificate", "--key"), files, strict=True)
    options = [word for option, name in given if name for word in (option, str(pair[0].with_name(name)))]
    result = CliRunner().invoke(main, ["serve", "gauss", *options])
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1), result.exception
    assert line in result.stderr


@needs_openssl
def test_a_handshake_that_never_ends(pair: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch) -> None:
    """It is not yet a connection of which the protocol knows."""
    monkeypatch.setattr(connection, "HANDSHAKE_SECONDS", 0.5)
    program = create_program("gauss", Settings())
    config = configured(program, port=0, log_config=None, lifespan="off", ssl_certfile=pair[0], ssl_keyfile=pair[1])
    with listening(config) as server, socket.create_connection(("127.0.0.1", port_of(server)), 60) as half:
        assert half.recv(1) == b""


@pytest.mark.slow
def test_a_killed_service_leaves_nothing(tmp_path: Path) -> None:
    """SIGKILL leaves no time to clean up; the workers notice, end, and take all temporary files with them."""
    with served(TMPDIR=str(tmp_path)) as (port, process):
        eventually(lambda: ready(f"http://127.0.0.1:{port}"))
        assert len(list(tmp_path.glob("*/shoal-worker-*"))) == 3
        process.send_signal(signal.SIGKILL)
        eventually(lambda: not list(tmp_path.iterdir()))


@pytest.mark.parametrize(("url", "warned"), [("http://192.0.2.1:1", 1), ("http://127.0.0.1:1", 0), ("https://a:1", 0)])
def test_a_key_in_the_clear_is_told(
    url: str, warned: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("SHOAL_API_KEY", "secret")
    get_engine(url)
    assert [record.levelname for record in caplog.records] == ["WARNING"] * warned
    assert "secret" not in caplog.text
