"""A private PostgreSQL server below Shoal's home: made on first use, on a loopback port, behind a password."""

from __future__ import annotations

import os
import pwd
import secrets
import shutil
import subprocess
from collections.abc import Sequence
from contextlib import closing, suppress
from pathlib import Path
from typing import Any

from shoal.errors import ComputationError, InputError

DATABASES = ("prefect", "mlflow")
_ROLE = "shoal"


class Postgres:
    """The server, as a part of the whole.

    folder: of its data, made if need be. Raises InputError where PostgreSQL is not installed, ComputationError.
    """

    name = "postgres"
    needs: Sequence[str] = ()

    def __init__(self, folder: Path, port: int) -> None:
        self._data, self._log, self._port = folder / "data", folder / "server.log", port
        self._password = _prepare(folder)

    @property
    def stores(self) -> dict[str, str]:
        """The settings by which Prefect and MLflow find their databases."""
        return {
            "PGPASSWORD": self._password,
            "MLFLOW_BACKEND_STORE_URI": f"postgresql+psycopg2://{_ROLE}@127.0.0.1:{self._port}/mlflow",
            "PREFECT_SERVER_DATABASE_CONNECTION_URL": f"postgresql+asyncpg://{_ROLE}@127.0.0.1:{self._port}/prefect",
        }

    def begin(self) -> None:
        """Start it and wait until it answers; what a server that was killed left undone is put right first."""
        options = f"-p {self._port} -c listen_addresses=127.0.0.1 -c unix_socket_directories="
        _run("pg_ctl", "start", "-w", "-D", str(self._data), "-l", str(self._log), "-o", options)
        _make_databases(self._port, self._password)

    def is_ready(self) -> bool:
        """Return whether it can do its work: `begin` waits for that."""
        return not self.ended()

    def ended(self) -> bool:
        """Return whether its first process is gone."""
        with suppress(OSError, ValueError, IndexError):
            os.kill(int((self._data / "postmaster.pid").read_text().split()[0]), 0)
            return False
        return True

    def stop(self) -> None:
        """Stop it; open connections are closed."""
        if not self.ended():
            _run("pg_ctl", "stop", "-w", "-m", "fast", "-D", str(self._data))


def _prepare(folder: Path) -> str:
    """The password of the server's role; on first use the server's files are made with a new one."""
    kept = folder / "password"
    if not kept.exists():
        folder.mkdir(parents=True, exist_ok=True)
        password = secrets.token_urlsafe(24)
        fresh = folder / "password.new"
        fresh.touch(mode=0o600)
        fresh.write_text(password + "\n")
        for path in (folder, fresh):
            shutil.chown(path, _user())
        shutil.rmtree(folder / "data", ignore_errors=True)
        authentication = ("--auth-local=reject", "--auth-host=scram-sha-256", f"--pwfile={fresh}")
        _run("initdb", "-D", str(folder / "data"), "-U", _ROLE, "-E", "UTF8", "--no-locale", *authentication)
        fresh.rename(kept)
    return kept.read_text().strip()


def _make_databases(port: int, password: str) -> None:
    import psycopg2

    with closing(
        psycopg2.connect(host="127.0.0.1", port=port, user=_ROLE, password=password, dbname="postgres")
    ) as connection:
        connection.autocommit = True
        cursor = connection.cursor()
        cursor.execute("SELECT datname FROM pg_database")
        there = {row[0] for row in cursor.fetchall()}
        for name in DATABASES:
            if name not in there:
                cursor.execute(f"CREATE DATABASE {name}")


def _user() -> str:
    """Return the user that runs the server: PostgreSQL refuses to run as root."""
    if os.getuid() != 0:
        return pwd.getpwuid(os.getuid()).pw_name
    names = {entry.pw_name for entry in pwd.getpwall()}
    return "postgres" if "postgres" in names else "nobody"


def program(name: str) -> str:
    """The path of one of PostgreSQL's programs. Raises InputError."""
    # Debian keeps them apart from the path, by version.
    kept = sorted(Path("/usr/lib/postgresql").glob(f"*/bin/{name}"))
    if found := shutil.which(name) or (str(kept[-1]) if kept else None):
        return found
    raise InputError(f"postgres: {name} is not installed (on Debian: apt install postgresql)")


def _run(name: str, *arguments: str) -> None:
    command: Sequence[str] = (program(name), *arguments)
    other: dict[str, Any] = {"user": _user(), "group": pwd.getpwnam(_user()).pw_gid} if os.getuid() == 0 else {}
    # Not a pipe: the server would keep it open.
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        cwd="/",
        text=True,
        **other,
    ) as process:
        said = process.stderr.read() if process.stderr and name == "initdb" else ""
        if process.wait() != 0:
            raise ComputationError(f"postgres: {name} {arguments[0]} failed {' '.join(said.split())}".strip())
