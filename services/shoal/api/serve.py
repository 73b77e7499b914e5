"""Run the program of an engine until Ctrl-C."""

from __future__ import annotations

import logging
import os
import ssl
from copy import deepcopy
from pathlib import Path
from typing import Any

import uvicorn
from fastapi import FastAPI

from shoal.api import access
from shoal.api.connection import HandshakeLoop, Patience, bounded
from shoal.api.guard import SETTING, is_wildcard
from shoal.api.program import create_program
from shoal.api.settings import Settings
from shoal.engines.remote import loopback
from shoal.errors import InputError
from shoal.ports import PORTS, check_free

log = logging.getLogger("shoal.api")
_GRACE = 2.0
"""Seconds by which the connection waits longer for a body than the endpoint, whose refusal says more."""


def serve(engine: str, host: str, port: int | None, certificate: Path | None = None, key: Path | None = None) -> None:
    """Serve an engine, over TLS with a certificate and its key (PEM). Raises InputError."""
    settings = Settings.read()
    program = create_program(engine, settings, listening=host)
    if is_wildcard(host) and not os.environ.get(SETTING):
        log.warning("%s is empty: requests under other names than localhost are refused", SETTING)
    if certificate or key:
        _check_pair(certificate, key)
    elif program.state.keys and not loopback(host):
        log.warning("API keys cross the network readable: give --certificate and --key, or put a proxy with TLS ahead")
    port = port or PORTS[engine.partition("-")[0]]
    check_free(host, port)
    config = configured(program, host=host, port=port, ssl_certfile=certificate, ssl_keyfile=key)
    uvicorn.Server(config).run()


def configured(program: FastAPI, **options: Any) -> uvicorn.Config:
    """Return how uvicorn serves a program: bounded connections, no websockets, and an access log of our own."""
    settings: Settings = program.state.settings
    patience = Patience(
        header_seconds=settings.header_seconds,
        body_seconds=settings.receive_seconds + _GRACE,
        body_bytes=settings.body_bytes,
        connections=settings.connections,
    )
    defaults: dict[str, Any] = {
        "http": bounded(patience),
        "ws": "none",
        "loop": f"{HandshakeLoop.__module__}:{HandshakeLoop.__name__}",
        "timeout_graceful_shutdown": 5,
        "access_log": False,
        "server_header": False,
        "log_config": _logging(),
        # Whom a proxy speaks for is believed where an operator says so: the log names clients.
        "forwarded_allow_ips": os.environ.get("FORWARDED_ALLOW_IPS", ""),
    }
    return uvicorn.Config(program, **(defaults | options))


def _logging() -> dict[str, Any]:
    """Return uvicorn's logging with the lines of the access log on standard output, as they are."""
    found = deepcopy(uvicorn.config.LOGGING_CONFIG)
    found["formatters"]["line"] = {"format": "%(message)s"}
    found["handlers"]["line"] = {"class": "logging.StreamHandler", "formatter": "line", "stream": "ext://sys.stdout"}
    found["loggers"][access.log.name] = {"handlers": ["line"], "level": "INFO", "propagate": False}
    return found


def _check_pair(certificate: Path | None, key: Path | None) -> None:
    """Refuse what is no certificate with its key."""
    if certificate is None or key is None:
        raise InputError("certificate: TLS needs both --certificate and --key")
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(certificate, key)
    except OSError as error:  # as ssl.SSLError is
        reason = getattr(error, "reason", None) or error.strerror or error
        raise InputError(f"certificate: {certificate} with the key {key} cannot be used: {reason}") from None
