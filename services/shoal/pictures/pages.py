"""Common parts of pages: the templates in `page`, the data of a motion, the provenance of numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from jinja2 import BaseLoader, ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from shoal.pictures.motion import DrawnMotion, plain_motion
from shoal.pictures.views import views
from shoal.versions import versions

_SPEEDS = {
    "five times real time": 5.0,
    "real time": 1.0,
    "half of real time": 0.5,
    "a fifth of real time": 0.2,
    "a tenth of real time": 0.1,
    "1/50 of real time": 0.02,
    "1/200 of real time": 0.005,
}
_SHOWN = 5.0
"""Seconds that a motion should take on the screen."""
_FEW = 4
"""So many names are listed."""
_SPACE = (
    "hatched is the ground, chain lines are axes of joints, clear boxes and cylinders have the mass and inertia of a "
    "body. Rods are drawn with their section, at least a few dots thick, and shadows fall on a floor below. Drag to "
    "turn, with Shift to move; wheel or pinch to zoom. On the picture the arrow keys turn, + and − zoom, Home goes "
    "back, the space bar plays."
)
_LOADED = " Green arrows are drives and loads, each as long as it is large over time."


def environment(*more: BaseLoader) -> Environment:
    """Jinja's environment with the parts of every page: base.html.j2, macros.html.j2; more: where other pages are."""
    loader = ChoiceLoader([PackageLoader("shoal.pictures", "page"), *more])
    return Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, loader=loader)


def render(template: str, **content: Any) -> str:
    """A page as HTML without a reference to anything outside."""
    return environment().get_template(template).render(**content)


def animation(found: DrawnMotion, what: str) -> dict[str, Any]:
    """Return the arguments of the macro `animation`; what: the machine in words."""
    shown = [f"{what} (blue) with its markers (red-orange)"]
    if found.measured:
        shown.append("the measured places (black circles)")
    if found.behind:
        shown.append("the machine as it is stated (grey)")
    if found.directions:
        shown.append("the measured directions (orange)")
    over = " over " + " and ".join(shown[1:]) if shown[1:] else ""
    # "</" would end the script element.
    data = json.dumps(plain_motion(found), allow_nan=False).replace("</", "<\\/")
    loaded = _LOADED if found.drawing.parts("load", "drive") else ""
    caption = f"{shown[0]}{over}; hatched is the ground.{loaded} The arrow keys move the slider."
    if found.up is not None:
        caption = f"{shown[0]}{over}; {_SPACE}{loaded}"
    if found.stress is not None:
        caption += " Rods are coloured by their largest normal stress, of bending and normal force."
    if found.note:
        caption += f" The {found.note}: about the undeformed rod, and no motion is to scale there."
    return {
        "name": found.name,
        "aspect": round(found.aspect, 3),
        "speeds": list(_SPEEDS.items()),
        "speed": min(_SPEEDS.values(), key=lambda factor: abs(found.span / factor - _SHOWN)),
        "alt": f"Animation of {', '.join(found.outlines)}, {found.span:.3g} s. A picture below shows poses of it.",
        "caption": caption,
        "views": [] if found.up is None else [view.name for view in views(found.up)],
        "data": Markup(data),
    }


def settings(model: Mapping[str, Any]) -> str:
    """Describe the settings of a model; bodies with equal settings stand together."""
    parts = [f"{name} = {_number(value)}" for name, value in model.items() if not isinstance(value, dict | None)]
    alike: dict[str, list[str]] = {}
    for name, body in model.get("bodies", {}).items():
        made = ", ".join(_number(value) if key == "element" else f"{value} {key}" for key, value in body.items())
        alike.setdefault(made, []).append(name)
    for made, names in alike.items():
        parts.append(f"{', '.join(names) if len(names) <= _FEW else f'{len(names)} bodies'}: {made}")
    return "; ".join(parts)


def _number(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def software() -> str:
    """Versions of what shapes the numbers."""
    return ", ".join(
        f"{package} {number}" for package, number in versions(("shoal", "numpy", "scipy", "numba")).items()
    )
