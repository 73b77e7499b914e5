"""Trends as inline SVG: one small chart per quantity of a line, nights to the right, logarithmic upwards."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from math import log10

WIDTH, HEIGHT = 250, 130
LEFT, RIGHT, TOP, BOTTOM = 46, 8, 26, 22
ROUND = [float(f"{digit}e{power}") for power in range(-18, 19) for digit in (1, 2, 5)]
"""Numbers that a scale may begin and end with."""
BLUE, VERMILION, GREY = "#0072B2", "#D55E00", "#767676"


def trend(
    title: str, unit: str, values: Sequence[float | None], days: Sequence[str], bound: float | None, about: str
) -> str:
    """A chart of one value per night, the latest to the right; a night without a value is a cross at the top.

    days: what each night is called; bound: a dashed line, named by `about`.
    """
    shown = [value for value in (*values, bound) if value]
    if not shown:
        return ""
    ticks = _ticks(min(shown), max(shown))
    low, high = log10(ticks[0]), log10(ticks[-1])

    def x(night: int) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * (night + 0.5) / len(values)

    def y(value: float) -> float:
        return TOP + (HEIGHT - TOP - BOTTOM) * (high - log10(value)) / (high - low)

    known = [(x(night), y(value)) for night, value in enumerate(values) if value]
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in known)
    return "".join(
        [
            f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(_spoken(title, values, unit))}">',
            f'<text x="{LEFT}" y="14" font-weight="600">{escape(title)} [{escape(unit)}]</text>',
            *(_tick(tick, y(tick)) for tick in ticks),
            *([] if bound is None else [_bound(y(bound), about)]),
            f'<polyline points="{line}" fill="none" stroke="{BLUE}" stroke-width="1.5"/>',
            *(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="3" fill="{BLUE}"/>' for a, b in known),
            *(_cross(x(night)) for night, value in enumerate(values) if value is None),
            *_ends(x(0), days),
            "</svg>",
        ]
    )


def _spoken(title: str, values: Sequence[float | None], unit: str) -> str:
    """The chart for those who do not see it."""
    known = [value for value in values if value is not None]
    missing = len(values) - len(known)
    span = f"between {min(known):.1e} and {max(known):.1e} {unit}" if known else "no values"
    last = f"{values[-1]:.1e} {unit}" if values and values[-1] is not None else "none"
    return f"{title} over {len(values)} nights: {span}, last {last}" + (f"; {missing} without" if missing else "")


def _ticks(least: float, most: float) -> list[float]:
    """Up to six round numbers, the first and the last around all values."""
    first = max([0, *(k for k, tick in enumerate(ROUND) if tick <= least)])
    last = min([len(ROUND) - 1, *(k for k, tick in enumerate(ROUND) if tick >= most and k > first)])
    if last - first < 4:
        return ROUND[first : last + 1]
    first -= first % 3
    stride = 3 * -(-(last - first) // 15)
    return ROUND[first : last + stride : stride]


def _tick(value: float, y: float) -> str:
    text = f"{value:g}" if 1e-2 <= value < 1e5 else f"{value:.0e}".replace("e-0", "e-").replace("e+0", "e")
    label = f'<text x="{LEFT - 6}" y="{y + 4:.1f}" text-anchor="end">{text}</text>'
    return f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" stroke="#ddd"/>{label}'


def _bound(y: float, about: str) -> str:
    at = y + 12 if y < TOP + 12 else y - 4
    halo = 'stroke="#fff" stroke-width="3" paint-order="stroke"'
    label = f'<text x="{LEFT + 4}" y="{at:.1f}" fill="{GREY}" {halo}>{escape(about)}</text>'
    return f'<path d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}" stroke="{GREY}" stroke-dasharray="5 4"/>{label}'


def _cross(x: float) -> str:
    return f'<path d="M{x - 4:.1f} {TOP - 2}l8 8m0 -8l-8 8" stroke="{VERMILION}" stroke-width="2" fill="none"/>'


def _ends(first: float, days: Sequence[str]) -> list[str]:
    """The names of the first and the last night."""
    at = HEIGHT - 6
    if len(days) == 1:
        return [f'<text x="{first:.1f}" y="{at}" text-anchor="middle">{escape(days[0])}</text>']
    return [
        f'<text x="{LEFT}" y="{at}">{escape(days[0])}</text>',
        f'<text x="{WIDTH - RIGHT}" y="{at}" text-anchor="end">{escape(days[-1])}</text>',
    ]
