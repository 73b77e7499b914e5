"""The flexible elements: one file each, listed here."""

from __future__ import annotations

from shoal.mechanics.elements import ancf_full, cubic, quintic
from shoal.mechanics.elements.element import Element

ELEMENTS: dict[str, Element] = {
    "ancf-cable": cubic.ELEMENT,
    "ancf-quintic": quintic.ELEMENT,
    "ancf-full": ancf_full.ELEMENT,
}

FAMILIES: tuple[type, ...] = tuple(dict.fromkeys(element.family for element in ELEMENTS.values()))
"""The types of the kernels' arrays, in the order in which a model holds them."""
