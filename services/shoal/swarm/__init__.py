"""Swarms that minimise a function over a box; pure numpy, independent of the rest of Shoal."""

from shoal.swarm.afsa import Afsa
from shoal.swarm.counter import BatchFunction, BudgetExhausted, EvaluationCounter
from shoal.swarm.iafsa import Iafsa
from shoal.swarm.iafsa_printed import IafsaPrinted
from shoal.swarm.minimize import minimize
from shoal.swarm.protocol import Array, Optimizer, State

OPTIMIZERS: dict[str, type[Afsa] | type[Iafsa] | type[IafsaPrinted]] = {
    "afsa": Afsa,
    "iafsa": Iafsa,
    "iafsa-printed": IafsaPrinted,
}

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
