"""Swarms that minimise a function over a box; pure numpy, independent of the rest of Shoal."""

from typing import Any

from shoal.swarm.afsa import Afsa
from shoal.swarm.counter import BatchFunction, BudgetExhausted, EvaluationCounter
from shoal.swarm.iafsa import Iafsa
from shoal.swarm.iafsa_printed import IafsaPrinted
from shoal.swarm.minimize import minimize
from shoal.swarm.protocol import Array, Optimizer, State

OPTIMIZERS: dict[str, type[Any]] = {
    "afsa": Afsa,
    "iafsa": Iafsa,
    "iafsa-printed": IafsaPrinted,
}
"""All take `lower`, `upper` and `size`; `traditional` and `previous` are fish of the first swarm, where it has them."""

__all__ = [
    "OPTIMIZERS",
    "Afsa",
    "Array",
    "BatchFunction",
    "BudgetExhausted",
    "EvaluationCounter",
    "Iafsa",
    "IafsaPrinted",
    "Optimizer",
    "State",
    "minimize",
]
