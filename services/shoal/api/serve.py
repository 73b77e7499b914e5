"""Run the program of an engine until Ctrl-C."""

from __future__ import annotations

import logging
import ssl
from pathlib import Path

import uvicorn

from shoal.api.program import create_program
from shoal.api.settings import Settings
from shoal.engines.remote import loopback
from shoal.errors import InputError
from shoal.ports import PORTS, check_free

log = logging.getLogger("shoal.api")


def serve(engine: str, host: str, port: int | None, certificate: Path | None = None, key: Path | None = None) -> None:
    """Serve an engine, over TLS with a certificate and its key (PEM). Raises InputError."""
    settings = Settings.read()
    program = create_program(engine, settings)
    if certificate or key:
        _check_pair(certificate, key)
    elif program.state.keys and not loopback(host):
        log.warning("API keys cross the network readable: give --certificate and --key, or put a proxy with TLS ahead")
    port = port or PORTS[engine.partition("-")[0]]
    check_free(host, port)
    uvicorn.run(
        program,
        host=host,
        port=port,
        ssl_certfile=certificate,
        ssl_keyfile=key,
        limit_concurrency=settings.connections,
        timeout_graceful_shutdown=5,
        access_log=False,
        server_header=False,
    )


def _check_pair(certificate: Path | None, key: Path | None) -> None:
    """Refuse what is no certificate with its key."""
    if certificate is None or key is None:
        raise InputError("certificate: TLS needs both --certificate and --key")
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(certificate, key)
    except OSError as error:  # as ssl.SSLError is
        reason = getattr(error, "reason", None) or error.strerror or error
        raise InputError(f"certificate: {certificate} with the key {key} cannot be used: {reason}") from None
