"""Answers that are a function of something simpler: the exponential of an expansion, or a function of one direction.

A product of many lognormal variables takes an expansion of high degree, its logarithm one of degree one. The cosine of
a sum is a function of a single variable (a ridge function: Hokanson and Constantine, Data-driven polynomial ridge
approximation using variable projection, SIAM Journal on Scientific Computing 40, 2018). Such a function tells a column
where it foretells runs that are left out of its fit clearly better than the expansion does.
"""

from shoal.response.links.linked import Linked, beside, linked, plainly

__all__ = ["Linked", "beside", "linked", "plainly"]
