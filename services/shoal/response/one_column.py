"""Compiled sum of products of polynomials, one column at each place: most of a search is spent here."""

from __future__ import annotations

import numpy as np
from numba import njit

from shoal.response.inputs import IntArray
from shoal.response.polynomials import Terms
from shoal.trajectory import Array


@njit(cache=True, error_model="numpy")
def one_column(basis: Array, terms: Terms, coefficients: Array, columns: IntArray) -> Array:
    """Return the columns asked for, (places,).

    basis: polynomials, (degrees, parameters, places); terms: degrees, (terms, parameters); coefficients: (terms,
    columns); columns: (places,)
    """
    places, parameters = len(columns), terms.shape[1]
    found, product = np.zeros(places), np.empty(places)
    for t in range(len(terms)):
        for i in range(places):
            product[i] = coefficients[t, columns[i]]
        for k in range(parameters):
            degree = terms[t, k]
            if degree:
                for i in range(places):
                    product[i] *= basis[degree, k, i]
        for i in range(places):
            found[i] += product[i]
    return found
