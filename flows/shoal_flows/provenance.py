"""Provenance of results: versions, revision of the source, platform."""

from __future__ import annotations

import os
import platform
import subprocess
from functools import cache
from pathlib import Path

from shoal.versions import versions as of_packages

PACKAGES = ("shoal", "numpy", "scipy", "numba", "exudyn", "casadi", "prefect", "mlflow")


@cache
def versions() -> dict[str, str]:
    """Versions of the packages that shape the numbers, and of Python."""
    return of_packages(PACKAGES)


@cache
def revision() -> str | None:
    """The git revision of the source, with `+changes` if files differ from it; None outside a repository.

    SHOAL_REVISION says it where there is no repository, as in a container.
    """
    if stated := os.environ.get("SHOAL_REVISION"):
        return stated
    commit = _git("rev-parse", "HEAD")
    if commit is None:
        return None
    return commit + ("+changes" if _git("status", "--porcelain", "--untracked-files=no") else "")


def machine() -> str:
    """Operating system and processor architecture."""
    return f"{platform.system()} {platform.release()}, {platform.machine()}"


def _git(*arguments: str) -> str | None:
    command = ["git", "-C", str(Path(__file__).parent), *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
