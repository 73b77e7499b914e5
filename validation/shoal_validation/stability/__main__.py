"""`python -m shoal_validation.stability`: run the maps, draw them, and write their sections of docs.

Those of contacts stand in docs/contact-checks.md, the others in docs/stability.md.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from rich import box
from rich.console import Console
from rich.table import Table

from shoal_validation.document import rewrite
from shoal_validation.judge import Outcome
from shoal_validation.stability import MAPS
from shoal_validation.stability.charts import draw
from shoal_validation.stability.page import section
from shoal_validation.stability.survey import Result, stored, survey

DOCS = Path(__file__).parents[3] / "docs"
CONTACTS = "contacts-"
"""How names of maps of contacts begin."""


def main() -> None:
    """Run what was asked for; maps that were not keep in the data and the page what an earlier run found."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.stability", description=__doc__)
    parser.add_argument("--only", choices=MAPS, action="append", help="run this map only; may be repeated")
    parser.add_argument("--quick", action="store_true", help="three values of each axis; needs --out")
    parser.add_argument("--out", type=Path, default=DOCS / "charts", help="folder of charts and stability.json")
    parser.add_argument("--redraw", action="store_true", help="charts from the cells that the folder holds")
    asked = parser.parse_args()
    if asked.quick and asked.out == DOCS / "charts":
        parser.error("--quick: name a folder by --out; the charts of docs/ come from complete maps")
    began = time.perf_counter()
    maps, data = [MAPS[name] for name in asked.only or MAPS], asked.out / "stability.json"
    kept = json.loads(data.read_text(encoding="utf-8")) if data.exists() else {}
    asked.out.mkdir(parents=True, exist_ok=True)
    results = []
    for one in maps:
        if asked.redraw:
            result = stored(one, kept[one.name])
        else:
            result = survey(one.reduced() if asked.quick else one, _note)
            kept[one.name] = result.to_json()
            data.write_text(json.dumps(kept, separators=(",", ":")) + "\n", encoding="utf-8")
        draw(result, asked.out / f"stability-{result.name}.png")
        results.append(result)
    if asked.out == DOCS / "charts":
        known = [stored(one, kept[name]) for name, one in MAPS.items() if name in kept]
        touching = [one for one in known if one.name.startswith(CONTACTS)]
        others = [one for one in known if one not in touching]
        for page, shown in (("stability.md", others), ("contact-checks.md", touching)):
            rewrite(DOCS / page, "stability", section(shown))
    _note(f"{time.perf_counter() - began:.0f} s")
    Console(highlight=False, width=150).print(table(results))


def table(results: Sequence[Result]) -> Table:
    """Table of the cells of each class by method over all maps, silently wrong first."""
    counts: dict[str, Counter[Outcome]] = {}
    for result in results:
        for panel in result.panels:
            name = f"ours: {panel.method}" if panel.ours else panel.method
            counts[name] = counts.get(name, Counter()) + panel.count
    kinds = [Outcome.SILENT, *(kind for kind in Outcome if kind is not Outcome.SILENT)]
    shown = Table("method", *map(str, kinds), box=box.SIMPLE_HEAD)
    for name, count in sorted(counts.items(), key=lambda item: -item[1][Outcome.SILENT]):
        shown.add_row(name, *(str(count[kind] or "") for kind in kinds))
    return shown


def _note(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
