"""Numbers as people read them: digits that mean something, units without zeros."""

from __future__ import annotations

import numpy as np

from shoal.trajectory import Array

_SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def handy(size: float, unit: str) -> tuple[float, str]:
    """Factor and unit in which numbers of a size [unit] need no zeros: 2e-4 m is 0.2 mm."""
    for prefix, power_of_ten in (("", 1.0), ("m", 1e-3), ("µ", 1e-6), ("n", 1e-9)):
        if size >= 0.1 * power_of_ten:
            return 1.0 / power_of_ten, prefix + unit
    return 1e12, "p" + unit


def looked_at(times: Array) -> str:
    """At which instants something is known: a limit or a bound says nothing between them."""
    return f"at the {len(times)} instants looked at" if len(times) > 1 else f"at {times[0]:g} s, the instant looked at"


def length(metres: float | None) -> str:
    """Return a length with three digits in the unit that needs no zeros."""
    if metres is None or not np.isfinite(metres):
        return "unknown"
    metres = float(f"{metres:.3g}")
    if metres == 0:
        return "0 m"
    for unit, size in (("m", 1.0), ("mm", 1e-3), ("µm", 1e-6)):
        if abs(metres) >= size:
            return f"{metres / size:.3g} {unit}"
    return f"{metres / 1e-9:.3g} nm" if abs(metres) >= 1e-9 else f"{metres:.1e} m"


def power(value: float | None, digits: int = 4) -> str:
    """A number in scientific notation, 2.1674 × 10⁻⁶."""
    if value is None or not np.isfinite(value):
        return "none"
    mantissa, _, exponent = f"{value:.{digits}e}".partition("e")
    return f"{mantissa} × 10{str(int(exponent)).translate(_SUPERSCRIPT)}"


def rounded(value: float, unit: float) -> str:
    """A number to two digits of its uncertainty."""
    if not np.isfinite([value, unit]).all() or unit <= 0:
        return f"{value:.6g}"
    decimals = 1 - int(np.floor(np.log10(unit)))
    if 0 <= decimals <= 9:
        return f"{value:.{decimals}f}"
    digits = max(0, int(np.floor(np.log10(max(abs(value), unit)))) + decimals)
    return f"{value:.{digits}e}"
