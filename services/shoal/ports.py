"""Ports at which engines are served, and checks that a server can listen there, before it is started."""

from __future__ import annotations

import os
import socket

from shoal.engines import ENGINES
from shoal.errors import InputError

PORTS = {name: 8001 + k for k, name in enumerate(dict.fromkeys(name.partition("-")[0] for name in ENGINES))}
"""Where an engine is served unless somebody says otherwise; its variants, as exudyn-ge of exudyn, take its place."""


def port(name: str, default: int) -> int:
    """Return the port of a server of `make up` by its name: $SHOAL_NAME_PORT, else the default. Raises InputError."""
    setting = setting_of(name)
    text = os.environ.get(setting) or str(default)
    if not (text.isdecimal() and 0 < int(text) < 65536):
        raise InputError(f"{setting}: {text!r} is not a port between 1 and 65535")
    return int(text)


def setting_of(name: str) -> str:
    """Return the variable of the environment that chooses the port of a server."""
    return f"SHOAL_{name.upper().replace('-', '_')}_PORT"


def check_free(host: str, port: int, setting: str = "port") -> None:
    """Refuse a place where no server can listen. setting: what chooses the port. Raises InputError."""
    with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", None) or error
            advice = f"choose another with {'--port' if setting == 'port' else setting}"
            raise InputError(f"{setting}: cannot listen on {host}:{port}: {reason}; {advice}") from None
