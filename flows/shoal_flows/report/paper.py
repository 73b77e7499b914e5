"""Values of the paper's tables 2 and 3, misprint included (0.7584 where its text says 0.7854)."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Printed:
    """A row of a table: angles [rad] and fitness as printed."""

    theta1: str
    theta2: str
    fitness: str

    @property
    def value(self) -> float:
        """The fitness as a number."""
        return float(self.fitness.replace(" × 10", "e").translate(str.maketrans("⁻⁶⁷⁸", "-678")))


TABLES: dict[str, tuple[str, dict[str, Printed]]] = {
    "paper-case-1": (
        "Table 2",
        {
            "afsa": Printed("0.7584", "0.5236", "6.0323 × 10⁻⁶"),
            "iafsa": Printed("0.7584", "0.5236", "1.6541 × 10⁻⁸"),
        },
    ),
    "paper-case-2": (
        "Table 3",
        {
            "afsa": Printed("1.0472", "0.7584", "6.6317 × 10⁻⁷"),
            "iafsa": Printed("1.0472", "0.7584", "2.1591 × 10⁻⁸"),
        },
    ),
}
"""By problem: the number of the table and its rows by method."""

AS = {
    "afsa": {"afsa": "as published"},
    "iafsa": {"iafsa-printed": "as printed", "iafsa": "repaired", "iafsa-unseeded": "without seeds"},
}
"""By row of the paper: the methods that stand for it, and what each is."""
NAMES = {"afsa": "AFSA", "iafsa": "IAFSA"}
