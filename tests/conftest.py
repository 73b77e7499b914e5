"""Tests share the compiled kernels and nothing else with the user's state."""

from __future__ import annotations

import os

import pytest
from hypothesis import settings
from shoal.home import prepare_kernel_cache

# Before SHOAL_HOME moves: the kernels compiled ahead of the tests lie in the real home.
prepare_kernel_cache()
os.environ["MPLBACKEND"] = "Agg"

settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """What waits for servers, minutes long, begins first, so that the others are done beside it."""
    items.sort(key=lambda item: item.path.name != "test_up.py")


@pytest.fixture(autouse=True, scope="session")
def own_home(tmp_path_factory: pytest.TempPathFactory) -> None:
    """No test reads or writes the state of the user's own runs."""
    os.environ["SHOAL_HOME"] = str(tmp_path_factory.mktemp("home"))
