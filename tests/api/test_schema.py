"""Requests that are generated from the service's own OpenAPI description: none may break it or surprise its schema."""

from __future__ import annotations

from typing import TYPE_CHECKING

import httpx
import pytest
from hypothesis import HealthCheck, given, settings

if TYPE_CHECKING:  # takes a second, in every process that collects this file
    import schemathesis

REPEATABLE = settings(
    derandomize=True, deadline=None, suppress_health_check=list(HealthCheck), max_examples=2, database=None
)


@pytest.fixture(scope="session")
def described(gauss: httpx.Client) -> schemathesis.BaseSchema:
    import schemathesis

    return schemathesis.openapi.from_url(f"{gauss.base_url}/openapi.json")


@pytest.fixture(scope="session")
def excluded() -> list[object]:
    """Right in form is not right in content: a name that is none of the library's is refused."""
    from schemathesis.specs.openapi.checks import positive_data_acceptance

    return [positive_data_acceptance]


@pytest.mark.parametrize("kind", ["positive", "negative"])
def test_generated_requests(described: schemathesis.BaseSchema, excluded: list[object], kind: str) -> None:
    """Right and wrong ones: documented statuses and bodies, no server error, nothing wrong accepted."""
    from schemathesis import GenerationMode

    mode = GenerationMode(kind)
    operations = [found.ok() for found in described.get_all_operations()]
    assert len(operations) > 15
    for operation in operations:
        if mode is GenerationMode.NEGATIVE and not (operation.body or operation.path_parameters):
            continue

        @REPEATABLE
        @given(case=operation.as_strategy(generation_mode=mode))
        def answered(case: schemathesis.Case) -> None:
            case.call_and_validate(excluded_checks=excluded)

        answered()


@pytest.mark.slow
def test_generated_sequences(described: schemathesis.BaseSchema, excluded: list[object]) -> None:
    """Jobs made, asked for, cancelled in every order: at least 2000 requests."""
    asked = 0

    class Sequences(described.as_state_machine()):  # type: ignore[misc]
        def after_call(self, response: object, case: object) -> None:
            nonlocal asked
            asked += 1

        def validate_response(self, response: object, case: schemathesis.Case, **options: object) -> None:
            case.validate_response(response, excluded_checks=excluded)

    Sequences.run(settings=settings(REPEATABLE, max_examples=300, stateful_step_count=10))
    assert asked >= 2000
