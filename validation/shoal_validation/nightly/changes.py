"""Changes since the night before, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from shoal_validation.nightly.history import LESS_ACCURATE
from shoal_validation.nightly.result import Night, Result


def changes(night: Night, nights: Sequence[Night]) -> tuple[str, ...]:
    """Since the last of these nights, if there is one; machines, verdicts, errors, then versions of packages."""
    if not nights:
        return ()
    last = nights[-1]
    before = {line.key: line for line in last.lines}
    found = list(_machines(night, last))
    for line in night.lines:
        if (past := before.get(line.key)) is not None:
            found += _line(line, past)
    for name, version in night.versions.items():
        if (was := last.versions.get(name)) not in (None, version):
            found.append(f"{name} {version}, was {was}")
    return tuple(found)


def _machines(night: Night, last: Night) -> Iterator[str]:
    """Problems and versions of machines that changed; those of nights of another kind do not compare."""
    if (night.quick, night.only) != (last.quick, last.only):
        return
    now, then = ({line.problem: line.version for line in one.lines} for one in (night, last))
    yield from (f"{name}: new" for name in now if name not in then)
    yield from (f"{name}: gone" for name in then if name not in now)
    yield from (
        f"{name}: version {now[name]}, was {then[name]}" for name in now if then.get(name, now[name]) != now[name]
    )


def _line(line: Result, past: Result) -> Iterator[str]:
    where = ", ".join(line.key)
    if line.verdict is not past.verdict:
        yield f"{where}: {line.verdict}, was {past.verdict}"
    elif line.error is not None and past.error is not None:
        least, most = sorted((line.error, past.error))
        if most > max(LESS_ACCURATE * least, line.noise):
            yield f"{where}: error {line.error:.1e} {line.unit}, was {past.error:.1e} {line.unit}"
