"""Tables of 80 columns, one function for every kind of answer."""

from shoal.terminal.tables.estimates import design_table, estimate_table
from shoal.terminal.tables.installation import doctor_table, import_table
from shoal.terminal.tables.motions import (
    comparison_table,
    equilibrium_table,
    linear_table,
    modes_table,
    reactions_table,
    selection_table,
    sweep_table,
    trajectory_table,
)
from shoal.terminal.tables.responses import response_table

__all__ = [
    "comparison_table",
    "design_table",
    "doctor_table",
    "equilibrium_table",
    "estimate_table",
    "import_table",
    "linear_table",
    "modes_table",
    "reactions_table",
    "response_table",
    "selection_table",
    "sweep_table",
    "trajectory_table",
]
