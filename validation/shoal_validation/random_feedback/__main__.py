"""`python -m shoal_validation.random_feedback [--seeds A:B]`.

Draws chains of links on the ground or on a cart by seed (0:200), with random formulas of their measures, states and
controllers as loads and one of the integrators, runs each with the estimate of its errors, and compares it with
Lagrange's equations, integrated by scipy's DOP853, in which Python evaluates the formulas. A run that is rejected, as
of a relay that chatters, is `refused`.
"""

import sys

from shoal_validation.random_feedback.study import judged
from shoal_validation.random_machines import main

if __name__ == "__main__":
    main("random_feedback", __doc__, judged, sys.argv[1:])
