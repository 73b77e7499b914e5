"""The flexible elements: one file each, listed here."""

from __future__ import annotations

from shoal.mechanics.elements import ancf_full, cubic, director, quintic, simo_reissner
from shoal.mechanics.elements.element import Element

ELEMENTS: dict[str, Element] = {
    "ancf-cable": cubic.ELEMENT,
    "ancf-quintic": quintic.ELEMENT,
    "ancf-full": ancf_full.ELEMENT,
    "simo-reissner": simo_reissner.ELEMENT,
}

SPATIAL: dict[str, Element] = {
    "ancf-cable": cubic.SPATIAL_ELEMENT,
    "ancf-quintic": quintic.SPATIAL_ELEMENT,
    "director-rod": director.ELEMENT,
}
"""The elements of scenes in space."""

FAMILIES: tuple[type, ...] = tuple(dict.fromkeys(element.family for element in ELEMENTS.values()))
"""The types of the kernels' arrays, in the order in which a model of the plane holds them."""

SPATIAL_FAMILIES: tuple[type, ...] = tuple(dict.fromkeys(element.family for element in SPATIAL.values()))
"""The same in space."""
