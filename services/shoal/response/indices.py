"""Sobol's indices by Jansen's estimator.

Jansen, Analysis of variance designs for model output, Computer Physics Communications 117, 1999; Saltelli et al.,
Variance based sensitivity analysis of model output, 2010, table 2 (c, f).
"""

from __future__ import annotations

import numpy as np
from scipy.stats import qmc

from shoal.response.inputs import Inputs, inside
from shoal.trajectory import Array


def designs(inputs: Inputs, base: int, seed: int) -> Array:
    """Germs of A, of B and of A with each parameter of B, (parameters + 2) times `base`, (places, parameters)."""
    parameters = len(inputs)
    x = inside(qmc.Sobol(2 * parameters, rng=seed).random(base))
    one, other = x[:, :parameters], x[:, parameters:]
    found = [one, other]
    for k in range(parameters):
        mixed = one.copy()
        mixed[:, k] = other[:, k]
        found.append(mixed)
    return inputs.germs(np.concatenate(found))


def jansen(values: Array, parameters: int) -> Array:
    """First and total indices, (2, parameters, columns), of the answers at `designs`, (places, columns)."""
    blocks = values.reshape(parameters + 2, len(values) // (parameters + 2), -1)
    one, other = blocks[0], blocks[1]
    variance = np.var(np.concatenate([one, other]), axis=0)
    found = np.full((2, parameters, values.shape[1]), np.nan)
    varies = variance > 0
    for k in range(parameters):
        mixed = blocks[2 + k]
        unexplained = 0.5 * np.mean((other - mixed) ** 2, axis=0)
        own = 0.5 * np.mean((one - mixed) ** 2, axis=0)
        found[0, k, varies] = 1 - unexplained[varies] / variance[varies]
        found[1, k, varies] = own[varies] / variance[varies]
    return found
