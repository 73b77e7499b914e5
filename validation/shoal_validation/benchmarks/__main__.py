"""`make bench`: one table of speeds and ratios, and the same as JSON below the state folder."""

from __future__ import annotations

import argparse
import json
import os

from rich import box
from rich.console import Console
from rich.table import Table
from shoal.home import home, processor

from shoal_validation.benchmarks import forward, in_space, linkages


def main() -> None:
    """Measure everything, print, and write benchmarks.json."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    console = Console(highlight=False)
    rows = [row for quadrature in ("full", "reduced") for row in forward.measure(forward.scene(quadrature), quadrature)]
    spatial, closed = in_space.rows(), linkages.rows()
    parts = (("case 1, 2/4 cables, 1000 steps", rows), ("machines in space", spatial), ("closed linkages", closed))
    for title, part in parts:
        table = Table(title, "ms each", "times faster", box=box.SIMPLE_HEAD)
        for row in part:
            table.add_row(row.name, f"{row.seconds * 1e3:.4f}", f"{row.ratio:.1f}")
        console.print(table)

    out = home() / "benchmarks.json"
    machine = {"processor": processor(), "cores": os.cpu_count()}
    named = {"forward": rows, "space": spatial, "linkages": closed}
    data = {"machine": machine, **{name: [vars(row) for row in part] for name, part in named.items()}}
    out.write_text(json.dumps(data, indent=1), encoding="utf-8")
    console.print(f"written to {out}")


if __name__ == "__main__":
    main()
