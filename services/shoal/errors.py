"""The two ways a request can go wrong, as the outer edge reports them."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""No room: on the disk, for this user, in this file."""


class ShoalError(Exception):
    """Base of every error a user is meant to read; one line, no traceback needed."""

    exit_status = 1


class InputError(ShoalError):
    """The request is wrong: names the field, the value found and what would be right."""

    exit_status = 2


class UnstableStepError(InputError):
    """The step of an explicit integrator is longer than a machine allows."""


class ComputationError(ShoalError):
    """The computation ran and cannot be trusted, or could not run to its end."""

    exit_status = 3


@contextmanager
def needs_extra(extra: str) -> Iterator[None]:
    """Name the extra of this package that brings a module whose import fails. Raises InputError."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise InputError(f"{error.name} is not installed; install shoal with its extra {extra!r}") from None


def check_trusted(trusted: bool, reason: str) -> None:
    """End where an answer cannot be trusted. Raises ComputationError."""
    if not trusted:
        raise ComputationError(reason)
