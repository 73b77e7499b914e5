"""Checks of modal bodies: amplitudes at the start, and points on bodies with given modes."""

from __future__ import annotations

from typing import Any

from shoal.scene.bodies import Body, Rod
from shoal.scene.joints import Attachment
from shoal.scene.solids import ModalBody


def check_amplitudes(name: str, body: Body, start: Any) -> None:
    """Raises ValueError unless an initial state has as many amplitudes as the body has modes, or none."""
    count = 0
    if isinstance(body, ModalBody):
        count = len(body.modes)
    elif isinstance(body, Rod) and body.element == "modal":
        count = body.modes + body.axial_modes
    for field in ("modes", "mode_rates"):
        stated = len(getattr(start, field))
        if stated not in (0, count):
            has = f"has {count} modes" if count else "has no modes; they are for element: modal and modal-body"
            raise ValueError(f"initial.{name}.{field}: {stated} numbers, but {name} {has}")


def check_place(where: str, attachment: Attachment, body: ModalBody) -> None:
    """Raises ValueError for a place where the modes of a body are not known."""
    if attachment.point in (*body.points, *body.points.values()):
        return
    named = ", ".join(body.points)
    if isinstance(attachment.point, str):
        raise ValueError(f"{where}.point: {attachment.body} has no point {attachment.point!r}; there are {named}")
    raise ValueError(f"{where}.point: the modes of {attachment.body} are known at its named points; there are {named}")
