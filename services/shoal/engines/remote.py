"""Client of an engine behind a service; its address can stand in place of an engine's name.

Doubles cross as JSON in their shortest form, which gives back every bit; values that are not finite come back as NaN.
"""

from __future__ import annotations

import base64
import ipaddress
import logging
import os
import secrets
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from typing import Any

import httpx
import numpy as np
import orjson
from httpx_retries import Retry, RetryTransport

from shoal.arguments import numbers
from shoal.engines.contract import Capabilities
from shoal.errors import ComputationError, InputError
from shoal.findings import Finding
from shoal.scene import Scene
from shoal.trajectory import Array, Trajectory

RETRIES = 6
"""After a connection that failed, a full queue, a proxy without a service: 0.25 s, 0.5 s, ... up to 8 s apart."""
SECONDS = 600.0
"""A service that is silent for longer is given up."""
log = logging.getLogger(__name__)
_KINDS = ("elements", "joints", "loads", "features")
_ARRAYS = ("times", "points", "angles", "energy_drift", "constraint_drift")


class RemoteEngine:
    """The engine of the service at an http or https address. The key, if it asks for one, is SHOAL_API_KEY.

    A certificate is checked against the file that SSL_CERT_FILE names, else against the usual authorities.
    """

    def __init__(self, url: str, transport: httpx.BaseTransport | None = None) -> None:
        """transport: instead of the network's."""
        self.name = url.rstrip("/")
        retry = Retry(
            total=RETRIES,
            allowed_methods=["GET", "POST", "PUT", "DELETE"],
            status_forcelist=[429, 502, 503],
            retry_on_exceptions=[httpx.NetworkError, httpx.RemoteProtocolError, httpx.ConnectTimeout],
            backoff_factor=0.25,
            backoff_jitter=0.5,
            max_backoff_wait=8.0,
        )
        key, address = os.environ.get("SHOAL_API_KEY"), _address(self.name)
        if key and address.scheme == "http" and not loopback(address.host):
            log.warning("SHOAL_API_KEY crosses the network to %s readable; https would hide it", address.host)
        self._client = httpx.Client(
            base_url=address,
            headers={"X-API-Key": key} if key else {},
            timeout=httpx.Timeout(SECONDS, connect=5.0),
            transport=RetryTransport(transport or httpx.HTTPTransport(), retry=retry),
        )
        weakref.finalize(self, self._client.close)
        self._answered = False

    @cached_property
    def capabilities(self) -> Capabilities:
        """Return what the remote engine can simulate. Raises InputError, ComputationError."""
        found: Capabilities = self.ask("GET", "/v1/capabilities", read=_capabilities_of)
        return found

    def simulate(self, scene: Scene, times: Sequence[float] | Array | None = None) -> Trajectory:
        """Run one scene; see `Engine`. Raises ComputationError if the service cannot be had."""
        return self._simulate(scene, None, times)

    def simulate_many(
        self, scene: Scene, values: Mapping[str, Array], times: Sequence[float] | Array | None = None
    ) -> Trajectory:
        """Run one scene per lane; see `Engine`. Raises ComputationError if the service cannot be had."""
        lanes = {path: numbers(path, column).tolist() for path, column in values.items()}
        return self._simulate(scene, lanes, times)

    def _simulate(
        self, scene: Scene, lanes: dict[str, list[float]] | None, times: Sequence[float] | Array | None
    ) -> Trajectory:
        request = {
            "scene": scene.model_dump(mode="json"),
            "at": None if times is None else numbers("times", times, "times in s").tolist(),
            "lanes": lanes,
            "verify": False,
        }
        found: Trajectory = self.ask("POST", "/v1/simulate", orjson.dumps(request), trajectory_of)
        return found

    def put_entry(self, kind: str, name: str, files: Mapping[str, bytes]) -> None:
        """Put an entry into the service's library, checked there. Raises InputError, ComputationError."""
        content = {path: base64.b64encode(content).decode() for path, content in files.items()}
        self.ask("PUT", f"/v1/library/{kind}/{name}", orjson.dumps({"files": content}))

    def get_entry(self, kind: str, name: str) -> dict[str, bytes]:
        """The files of an entry of the service's library. Raises InputError, ComputationError."""
        found: dict[str, bytes] = self.ask("GET", f"/v1/library/{kind}/{name}", read=_files_of)
        return found

    def ask(
        self, method: str, path: str, content: bytes | None = None, read: Callable[[Any], Any] = lambda found: found
    ) -> Any:
        """The answer to a request. Raises InputError where it is refused, ComputationError where there is none.

        read: makes of the JSON what is returned; what it finds missing in there is not the answer of such a service
        """
        headers = {"Content-Type": "application/json"}
        if method == "POST":
            # Whoever is not answered asks again, and may have been heard the first time.
            headers["Idempotency-Key"] = secrets.token_urlsafe(16)
        try:
            response = self._client.request(method, path, content=content, headers=headers)
        except httpx.HTTPError as error:
            raise ComputationError(
                f"engine: {self.name} does not answer: {str(error) or type(error).__name__}; "
                "start it with `shoal serve`, or choose another engine"
            ) from None
        if response.status_code == 204:
            return None
        try:
            found = orjson.loads(response.content)
        except orjson.JSONDecodeError:
            found = None
        if response.is_success and found is not None:
            # Any other program may answer JSON as well.
            with suppress(KeyError, TypeError, ValueError, AttributeError):
                answer = read(found)
                self._answered = True
                return answer
        raise self._refused(response.status_code, found)

    def _refused(self, status: int, found: Any) -> InputError | ComputationError:
        # A service that has answered before is the right one: then this is a fault, and not the refusal of a scene,
        # which an identification would count as a point that cannot be.
        wrong = ComputationError if self._answered else InputError
        if not isinstance(found, dict) or not str(found.get("type", "")).startswith("urn:shoal:"):
            return wrong(f"engine: {self.name} is not a service of Shoal (HTTP {status})")
        detail = str(found.get("detail", ""))
        if found["type"] == "urn:shoal:unauthorized":
            return wrong(f"SHOAL_API_KEY: {self.name} asks for a key: {detail}")
        if status in (404, 413, 422):
            return InputError(detail)
        return ComputationError(f"engine: {self.name}: {detail}")


def _address(url: str) -> httpx.URL:
    """The address of a service. Raises InputError."""
    try:
        address = httpx.URL(url)
    except httpx.InvalidURL as error:
        raise InputError(f"engine: {url}: not an address: {error}") from None
    if not address.host or (address.port or 0) > 65535:
        raise InputError(f"engine: {url}: not an address; http://HOST:PORT is needed")
    return address


def loopback(host: str) -> bool:
    """Return whether a host's name or address is that of this machine only."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


def _capabilities_of(found: dict[str, Any]) -> Capabilities:
    return Capabilities(**{kind: frozenset(found[kind]) for kind in _KINDS}, lanes=found["lanes"])


def _files_of(found: dict[str, Any]) -> dict[str, bytes]:
    return {path: base64.b64decode(content) for path, content in found["files"].items()}


def trajectory_of(found: dict[str, Any]) -> Trajectory:
    """The motion that a service answers, to the last bit."""
    plain: dict[str, Any] = {name: found[name] for name in ("engine", "steps", "wall_s", "model")}
    arrays: dict[str, Any] = {name: np.array(found[name], dtype=float) for name in _ARRAYS}
    known = (name for name in ("velocities", "rates") if found[name] is not None)
    optional: dict[str, Any] = {name: np.array(found[name], dtype=float) for name in known}
    findings = [list(map(Finding.from_json, lane)) for lane in found["findings"]]
    markers, end = tuple(found["markers"]), found.get("end")
    changes = found.get("changes", ())
    return Trajectory(**plain, **arrays, **optional, changes=changes, markers=markers, lane_findings=findings, end=end)
