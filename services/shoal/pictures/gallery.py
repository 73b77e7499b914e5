"""All pictures of one identification, with what they show in words."""

from __future__ import annotations

import base64
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure

from shoal.pictures.answer import Answer
from shoal.pictures.correlations import correlations, strongest
from shoal.pictures.landscape import landscape, survey
from shoal.pictures.motion import Motion, motion, poses
from shoal.pictures.overlay import follows, overlay
from shoal.pictures.profiles import profiles
from shoal.pictures.residuals import residuals, white
from shoal.pictures.style import png, svg
from shoal.pictures.waterfall import waterfall

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


def motions(answer: Answer) -> list[Motion]:
    """The motion of every recording."""
    return [motion(answer, name) for name in answer.estimate.measurement.recordings]


def gallery(answer: Answer, moving: list[Motion]) -> list[Drawn]:
    """Every picture that this identification has something to show in."""
    estimate = answer.estimate
    drawn = [_overlay(answer), *(_poses(answer, one) for one in moving[:1]), _residuals(answer)]
    if estimate.minima:
        values = ", ".join(f"{other['fitness']:.3g}" for other in estimate.minima)
        alt = f"Fitness of the answer, {estimate.fitness:.3g}, and where other searches ended: {values}."
        caption = "Each point is a place where a local search ended; far apart is good, side by side is ambiguous."
        drawn.append(Drawn("waterfall", waterfall(estimate), alt, caption))
    if estimate.profiles:
        alt = f"Profile of the misfit over each of {', '.join(estimate.profiles)}."
        caption = (
            "The interval ends where the profile crosses the dashed line; the dotted parabola is its approximation."
        )
        drawn.append(Drawn("profiles", profiles(estimate, answer.problem), alt, caption))
    if len(answer.names) > 1 and np.all(np.isfinite(answer.point)):
        drawn += _around(answer)
    return drawn


def _around(answer: Answer) -> list[Drawn]:
    """What needs runs around the answer."""
    pair = strongest(answer)
    one, other = (answer.names[k] for k in pair)
    drawn = []
    for zoom in (False, True):
        name = "landscape-zoom" if zoom else "landscape"
        alt = f"Contours of the fitness over {one} and {other}, {'around the answer' if zoom else 'in the whole box'}."
        caption = "Dark is a good fit. The ellipse is what the interval takes the valley for."
        drawn.append(Drawn(name, landscape(answer, survey(answer, pair, zoom=zoom)), alt, caption))
    value = answer.correlation[pair]
    alt = f"Table of correlations of {', '.join(answer.names)}; the largest is {value:+.3f}, of {one} and {other}."
    caption = "Parameters with a correlation near +1 or −1 are known only together."
    return [*drawn, Drawn("correlations", correlations(answer), alt, caption)]


def _overlay(answer: Answer) -> Drawn:
    figure = overlay(answer.estimate)
    alt = f"Measured values as circles with the fitted model as a line. Overall, {follows(answer.estimate)}."
    return Drawn("overlay", figure, alt, "The fitted model over the data. Where nothing was measured it is grey.")


def _poses(answer: Answer, found: Motion) -> Drawn:
    title = f"{answer.problem.name}: the identified machine until {found.times[-1]:.3g} s"
    alt = f"The bodies {', '.join(found.outlines)} at several instants, later ones darker, over the measured places."
    return Drawn("poses", poses(found, title), alt, "The later, the darker.")


def _residuals(answer: Answer) -> Drawn:
    figure = residuals(answer.estimate)
    alt = f"Residuals against time and their autocorrelation. The {white(answer.estimate)}."
    caption = "Noise stays in the orange bands: 95 % of the points should. A wave is something the model lacks."
    return Drawn("residuals", figure, alt, caption)
