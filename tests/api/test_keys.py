"""API keys and settings."""

from __future__ import annotations

import asyncio
from pathlib import Path

import httpx
import pytest
from shoal.api.program import create_program
from shoal.api.settings import Settings
from shoal.errors import InputError


def test_keys(tmp_path: Path) -> None:
    """Every endpoint but health asks for one of the keys."""
    keys = tmp_path / "keys"
    keys.write_text("first\n\nsecond\n")
    # Without its lifespan the program starts no worker.
    program = create_program("gauss", Settings(keys_file=keys))

    async def status(path: str, method: str, key: str) -> int:
        async with httpx.AsyncClient(transport=httpx.ASGITransport(program), base_url="http://127.0.0.1") as client:
            answer = await client.request(
                method, path, json={"name": "misfit"}, headers={"X-API-Key": key.encode()} if key else {}
            )
            return answer.status_code

    for path, methods in program.openapi()["paths"].items():
        for method in methods:
            for key in ("", "wrong", "first ", "second\u00e9"):
                if path not in ("/health", "/ready"):
                    assert asyncio.run(status(path, method, key)) == 401
    assert asyncio.run(status("/health", "get", "")) == 200
    assert asyncio.run(status("/Info", "get", "second")) == 200


def test_keys_file_that_holds_none(tmp_path: Path) -> None:
    """A file meant to protect that is missing or empty is an error, not an open door."""
    with pytest.raises(InputError, match=r"KEYS_FILE.*cannot be read"):
        create_program("gauss", Settings(keys_file=tmp_path / "none"))
    (tmp_path / "empty").write_text("\n")
    with pytest.raises(InputError, match="holds no key"):
        create_program("gauss", Settings(keys_file=tmp_path / "empty"))


def test_settings_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_API_WALL_SECONDS", "7.5")
    assert Settings.read().wall_seconds == 7.5
    monkeypatch.setenv("SHOAL_API_WORKERS", "many")
    with pytest.raises(InputError, match=r"^SHOAL_API_WORKERS: .*found 'many'"):
        Settings.read()
