"""Thresholds that all of identification shares: levels of tests, round-off, and when sizes are alike.

Each is stated once, with its theory. A file states another of its own only where it measures something else.
"""

from __future__ import annotations

LEVEL = 0.95
"""Confidence level of intervals and bands (convention)."""
DOUBT = 1e-3
"""Significance level of a test: of a residual, of its whiteness, or of all hypotheses together."""
OUTLIER = 5.0
"""Standard deviations beyond which a sample or a prior is an outlier: one normal number in two million is."""
MAD = 1.4826
"""Standard deviation over the median absolute deviation of a normal distribution, 1 / 0.6745 (Hampel 1974)."""
SEVERAL = 3.0
"""Factor between two sizes that are not alike, half a power of ten; of a noise, three standard deviations."""
NOTICED = 0.1
"""Share of an interval, or of a noise, from which on a contribution is reported: the second digit of the interval."""
GROSS = 0.05
"""Of the spread of the data: what leaves more is no fit, though nobody knows the noise (1 / 20; 99.75 % explained)."""
HARDLY = 0.3
"""Of the spread of the data: what leaves no less explains hardly more than a constant does (R squared below 0.91)."""
DIFFERENCE = 1e-6
"""Relative step of forward differences, the square root of the accuracy of a motion, where truncation and round-off are
equal (Press et al., Numerical Recipes, 2007, 5.7). What changes a result by less is not seen by them.
"""
PRECISION = 1e-12
"""Relative accuracy of a motion, the default tolerance of integrators: nothing below is held against a model."""
ROUND_OFF = 1e-9
"""Relative round-off of numbers that are computed from others, as eigenvalues, rotations and columns of a table are."""
MOSTLY = 0.5
"""Of the spread of the data: a residual above this explains hardly more than a constant; an unstated noise is less."""
HIDDEN = 1e-3
"""Share of a derivative along directions that the data leave open, from which on a quantity is open too."""
