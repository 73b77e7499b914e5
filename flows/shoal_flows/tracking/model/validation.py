"""Conditions for a model to become the champion: its own verdict, a second engine, the latest night."""

from __future__ import annotations

from shoal.identification import Estimate
from shoal_validation.nightly import history
from shoal_validation.nightly.result import Verdict
from shoal_validation.nightly.run import machine

from shoal_flows.tracking.model.confirmation import Confirmation

_WRONG = (Verdict.LESS_ACCURATE, Verdict.FAILED)


def doubts(estimate: Estimate, confirmation: Confirmation) -> list[str]:
    """Every reason in words; none if the model has passed."""
    found = []
    if not estimate.verdict.trusted:
        found.append(f"the identification ended with: {estimate.verdict}")
    if not confirmation.ok:
        found.append(str(confirmation))
    return found + _night()


def _night() -> list[str]:
    """Return the failures of the latest night of all problems on this machine, if any; slow lines count as right."""
    nights, _ = history.load(history.folder(), machine())
    whole = [night for night in nights if night.only is None]
    wrong = [line for line in whole[-1].lines if line.verdict in _WRONG] if whole else []
    if not wrong:
        return []
    return [f"the night of {whole[-1].started} has {len(wrong)} lines not as they should be: {wrong[0].complaint}"]
