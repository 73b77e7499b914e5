"""Work-precision study: every method on every problem of the library, timed and measured against its reference.

A method (`contract.py`) is one family's way on one mesh, run at settings from coarse to fine; one file per family lists
its methods. `measure.py` runs them, `front.py` picks those that nothing beats, `charts.py` and `page.py` show them.
"""
