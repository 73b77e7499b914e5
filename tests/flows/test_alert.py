"""A night that is not as it should be tells whom $SHOAL_ALERT names, by a real server of Prefect's."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Iterator
from email import message_from_string
from pathlib import Path
from typing import Any
from urllib.request import urlopen

import pytest
from deployed import call, free_port
from receivers import Kept, mail_server, web_hook
from shoal.errors import InputError
from shoal_flows import settings
from shoal_flows.deployment import alert

PATIENCE = 120.0
SAID = 'library/arm, gauss, tip: failed; expected "at most" 1.0e-09 m; found <2.5e-01> m'


@pytest.fixture(scope="module")
def prefect(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A server with its background services and the deployment of the night, which nobody runs."""
    home, port = tmp_path_factory.mktemp("alert"), free_port()
    address = f"http://127.0.0.1:{port}"
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PREFECT_", "SHOAL_"))}
    environment = {**kept, **settings.defaults(home), "PREFECT_API_URL": f"{address}/api"}
    command = [sys.executable, "-m", "shoal_flows.prefect_server", "--port", str(port)]
    log = home / "server.log"
    with log.open("wb") as out:
        server = subprocess.Popen(command, env=environment, stdout=out, stderr=subprocess.STDOUT)
    try:
        _answers(f"{address}/api/ready", server, log)
        flow = call(f"{address}/api/flows/", {"name": "nightly"})["id"]
        call(f"{address}/api/deployments/", {"name": "night", "flow_id": flow})
        call(f"{address}/api/deployments/", {"name": "another", "flow_id": flow})
        yield address
    finally:
        server.terminate()
        try:
            server.wait(30)
        except subprocess.TimeoutExpired:
            server.kill()


def _answers(address: str, server: subprocess.Popen[bytes], log: Path) -> None:
    deadline = time.monotonic() + PATIENCE
    while True:
        try:
            urlopen(address, timeout=5).close()
            return
        except OSError:
            assert server.poll() is None, log.read_text()
            assert time.monotonic() < deadline, log.read_text()
            time.sleep(0.1)


def told(prefect: str, address: str) -> None:
    """State the automation as `deploy` does."""
    program = "import sys; from shoal_flows.deployment import alert; alert.state(alert.whom(sys.argv[1]))"
    environment = {**os.environ, "PREFECT_API_URL": f"{prefect}/api"}
    subprocess.run([sys.executable, "-c", program, address], env=environment, check=True, timeout=PATIENCE)


def night(prefect: str, name: str, kind: str = "COMPLETED", deployment: str = "night") -> None:
    """A night that ends so."""
    found = call(f"{prefect}/api/deployments/name/nightly/{deployment}")["id"]
    run = call(f"{prefect}/api/deployments/{found}/create_flow_run", {"name": "nightly validation"})
    ended = {"state": {"type": kind, "name": name, "message": SAID}, "force": True}
    call(f"{prefect}/api/flow_runs/{run['id']}/set_state", ended)


def first(kept: Kept) -> str:
    """What has come, as soon as it has."""
    deadline = time.monotonic() + PATIENCE
    while not kept:
        assert time.monotonic() < deadline, "nobody was told"
        time.sleep(0.05)
    return kept[0]


def automations(prefect: str) -> list[Any]:
    return [one for one in call(f"{prefect}/api/automations/filter", {}) if one["name"] == alert.NAME]


@pytest.mark.slow
def test_a_web_hook_is_told_what_is_wrong_and_of_nothing_else(prefect: str) -> None:
    with web_hook() as (address, kept):
        told(prefect, address)
        told(prefect, address)
        assert len(automations(prefect)) == 1
        night(prefect, "Completed")
        night(prefect, "Not to be trusted", deployment="another")
        night(prefect, "Not to be trusted")
        text = json.loads(first(kept))["text"]
        assert text.startswith(f"nightly validation: Not to be trusted\n{SAID}\n{prefect}/")
        kept.clear()
        night(prefect, "Crashed", "CRASHED")
        assert json.loads(first(kept))["text"].startswith("nightly validation: Crashed\n")
        assert len(kept) == 1
    told(prefect, "")
    assert automations(prefect) == []


@pytest.mark.slow
def test_a_mail_says_the_same(prefect: str) -> None:
    with mail_server() as (address, kept):
        told(prefect, address)
        night(prefect, "Not to be trusted")
        mail = message_from_string(first(kept))
    assert mail["Subject"] == "nightly validation: Not to be trusted"
    assert mail["To"] == "me@example.org"
    part = next(one for one in mail.walk() if one.get_content_maintype() == "text")
    assert "library/arm, gauss, tip: failed" in part.get_payload(decode=True).decode()  # type: ignore[union-attr]


@pytest.mark.slow
def test_the_secret_of_an_address_is_not_shown(prefect: str) -> None:
    with web_hook() as (address, _):
        told(prefect, f"{address}?token=secret")
    found = call(f"{prefect}/api/block_documents/filter", {"include_secrets": False})
    (block,) = [one for one in found if one["name"] == alert.BLOCK and one["block_type"]["slug"] == "webhook"]
    assert "secret" not in json.dumps(block["data"])


def test_an_address_that_nobody_can_be_told_at_is_refused_without_its_secret() -> None:
    with pytest.raises(InputError, match=r"^SHOAL_ALERT: carrier-pigeon:\.\.\. is no address that can be told"):
        alert.whom("carrier-pigeon://me:secret@roof")
    assert alert.whom("  ") is None


def test_the_deployed_server_states_it_from_the_setting(tmp_path: Path) -> None:
    """A wrong one is said before anything is stated."""
    environment = {**os.environ, "SHOAL_ALERT": "nonsense", "SHOAL_HOME": str(tmp_path)}
    command = [sys.executable, "-m", "shoal_flows.deployment.deploy"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 2
    assert done.stderr.startswith("deploy: SHOAL_ALERT: ")
