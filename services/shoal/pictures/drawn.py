"""A picture with what it shows in words."""

from __future__ import annotations

import base64
from dataclasses import dataclass

from matplotlib.figure import Figure

from shoal.pictures.style import png, svg

_HEAVY = 400_000
"""An SVG of more bytes is shown as PNG."""


@dataclass(frozen=True)
class Drawn:
    """A picture by its name; alt: its content for those who cannot see it; caption: how to read it."""

    name: str
    figure: Figure
    alt: str
    caption: str

    def embedded(self) -> dict[str, str]:
        """For a page that needs nothing else: `source` (a data URL), `alt`, `caption`."""
        drawn, kind = svg(self.figure), "svg+xml"
        if len(drawn) > _HEAVY:
            drawn, kind = png(self.figure), "png"
        source = f"data:image/{kind};base64,{base64.b64encode(drawn).decode()}"
        return {"source": source, "alt": self.alt, "caption": self.caption}
