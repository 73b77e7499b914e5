"""`python -m shoal_validation.renew [--list] [--only NAME ...] [--since DATE] [--data FOLDER]` (`make charts`).

Runs every study whose charts and tables stand in docs/, one after the other, and records date, processor and duration
of each in docs/charts/measured.json, from which every page shows a table. since: leaves out what was measured on that
day (YYYY-MM-DD) or later, so that a stopped run continues; data: recordings of real machines, without which the study
of held-out windows is left out. For a machine that does nothing else; those whose duration is known take six hours.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from shoal.home import processor

from shoal_validation.document import publish, table

DOCS = Path("docs")
MEASURED = DOCS / "charts" / "measured.json"


@dataclass(frozen=True)
class Study:
    """A command with its results in the documentation.

    command: module below shoal_validation, and options; pages: where its charts and tables stand, in docs; section: the
    part of the first page that takes what the command prints, if it does not write there itself; counts: the last line
    that it prints is its outcome.
    """

    command: str
    pages: tuple[str, ...]
    section: str = ""
    counts: bool = False

    @property
    def arguments(self) -> list[str]:
        """The arguments of Python that run it."""
        module, *options = self.command.split()
        return ["-m", f"shoal_validation.{module}", *options]


STUDIES: dict[str, Study] = {
    "work-precision": Study("work_precision", ("accuracy-and-speed.md", "accuracy-figures.md", "accuracy-in-space.md")),
    "stability": Study("stability", ("stability.md",)),
    "contacts-maps": Study(
        "stability --only contacts-step --only contacts-gap --only contacts-grazing --only contacts-friction "
        "--only contacts-count",
        ("contact-checks.md",),
    ),
    "ablation": Study("ablation", ("swarm-charts.md",)),
    "methods": Study("inverse_precision", ("identification-charts.md",)),
    "chaos": Study("inverse_precision.chaos", ("identification-charts.md",)),
    "coverage": Study("coverage", ("verdict-charts.md",)),
    "posterior": Study("coverage.posterior", ("verdict-charts.md",)),
    "sensors": Study("coverage.sensors", ("verdict-charts.md",)),
    "systematic": Study("coverage.systematic --machines 12", ("verdict-charts.md",), "systematic"),
    "held-out": Study("coverage.held_out DATA", ("verdict-charts.md",)),
    "faults": Study("suspects --seeds 0:200", ("verdict-charts.md",), "faults"),
    "right-models": Study("suspects --kind right --seeds 0:200", ("verdict-charts.md",), "right-models"),
    "selection": Study("selection", ("model-choice.md",)),
    "uncertain": Study("uncertain", ("uncertain-charts.md",)),
    "contacts-identification": Study("coverage.impacts", ("contact-checks.md",)),
    "contacts-precision": Study("contacts.precision", ("contact-checks.md",)),
    "gallery": Study("gallery", ("gallery.md",)),
    "random-chains": Study("random_space --seeds 0:200", ("validation.md",), counts=True),
    "random-chains-tolerance": Study("random_space --seeds 0:200 --tolerance 1e-3", ("validation.md",), counts=True),
    "random-linkages": Study("random_space --kind linkages --seeds 0:60", ("validation.md",), counts=True),
    "random-directors": Study("random_space --kind directors --seeds 0:60", ("validation.md",), counts=True),
    "random-contacts": Study("random_contacts --seeds 0:30", ("contact-checks.md",), counts=True),
    "random-bent": Study("random_space --kind bent --seeds 0:20 --tolerance 1e-3", ("validation.md",), counts=True),
    "random-frames": Study("random_space --kind frames --seeds 0:24 --tolerance 1e-3", ("validation.md",), counts=True),
}
"""By name, in the order in which they run."""


def measured_table(page: str, records: Path = MEASURED) -> str:
    """Return when, where and how long each study of a page was measured, and its counts, as a Markdown table."""
    known = json.loads(records.read_text(encoding="utf-8"))
    shown = {name: study for name, study in STUDIES.items() if page in study.pages}
    counts = any(study.counts for study in shown.values())
    rows = []
    for name, study in shown.items():
        of = known[name]
        took = f"{of['minutes']:g} min" if of["minutes"] else "not recorded"
        row = (f"`python {' '.join(study.arguments)}`", of["date"], of["processor"] or "not recorded", took)
        rows.append((*row, of.get("counts", "")) if counts else row)
    return table(("command", "measured on", "processor", "took", "outcome")[: 5 if counts else 4], rows)


def _renew(name: str, study: Study, data: Path | None) -> None:
    """Run a study; write what it prints and what it took. Raises CalledProcessError."""
    begin = time.monotonic()
    command = [sys.executable, *(str(data) if word == "DATA" else word for word in study.arguments)]
    kept = subprocess.PIPE if study.section or study.counts else None
    done = subprocess.run(command, stdout=kept, text=True, check=True)
    if study.section:
        publish(DOCS / study.pages[0], {study.section: done.stdout})
    known = json.loads(MEASURED.read_text(encoding="utf-8"))
    known[name] = {
        "date": datetime.now(UTC).date().isoformat(),
        "processor": f"{processor()}, {os.cpu_count()} cores",
        "minutes": float(f"{(time.monotonic() - begin) / 60:.2g}"),
        **({"counts": done.stdout.strip().splitlines()[-1]} if study.counts else {}),
    }
    MEASURED.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")


def main(arguments: list[str]) -> None:
    """Renew the chosen studies."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.renew", description=__doc__)
    parser.add_argument("--list", action="store_true", help="print the studies and what they took, and run none")
    parser.add_argument("--only", nargs="+", choices=STUDIES, default=list(STUDIES), metavar="NAME")
    parser.add_argument("--since", default="9999", metavar="DATE", help="leave out what was measured since")
    parser.add_argument("--data", type=Path, metavar="FOLDER", help="recordings of real machines, for held-out")
    chosen = parser.parse_args(arguments)
    known = json.loads(MEASURED.read_text(encoding="utf-8"))
    for name in chosen.only:
        study, before = STUDIES[name], known.get(name, {"date": ""})
        if chosen.list:
            sys.stdout.write(f"{name}: {study.command}; {before}\n")
        elif before["date"] < chosen.since and ("DATA" not in study.command or chosen.data):
            sys.stderr.write(f"== {name}: {study.command}\n")
            _renew(name, study, chosen.data)


if __name__ == "__main__":
    main(sys.argv[1:])
