"""One study within a flow: the parent run, its optimisations side by side, and what they found together."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from shoal.identification import Measurement

from shoal_flows import pictures, workers
from shoal_flows.flows.tasks import optimise
from shoal_flows.jobs import Cell, Fit
from shoal_flows.pictures import Picture
from shoal_flows.results import Study
from shoal_flows.tracking.identification import log_outcome, open_study
from shoal_flows.tracking.model.register import register
from shoal_flows.tracking.store import Run

Draw = Callable[[Sequence[Fit], str], Picture]


@dataclass
class Running:
    """A study whose optimisations have not all ended."""

    name: str
    run: Run
    measurement: Measurement
    cells: Sequence[Cell]
    futures: dict[str, Any]

    def submit(self, cell: Cell) -> None:
        """Queue one of the optimisations."""
        self.futures[cell.name] = optimise.submit(cell, self.measurement, self.run.run_id)

    def finish(self, title: str, draw: Mapping[str, Draw], ended: Callable[[], None] = lambda: None) -> Study:
        """Wait for all, draw what they found together (`draw`: by the name of the file), log it.

        ended: called after each optimisation
        """
        fits: list[Fit] = []
        failures: dict[str, str] = {}
        for cell in self.cells:
            result = self.futures[cell.name].result(raise_on_failure=False)
            if isinstance(result, Fit):
                fits.append(result)
            else:
                failures[cell.name] = str(result)
            ended()
        drawn = {}
        if fits:
            waiting = {name: workers.submit(function, fits, title) for name, function in draw.items()}
            drawn = {name: picture.result() for name, picture in waiting.items()}
        log_outcome(self.run, fits, failures, {f"{name}.png": picture[0] for name, picture in drawn.items()})
        return Study(self.name, self.run.run_id, fits, failures, drawn)

    def check_any(self) -> None:
        """Raise the error of the first optimisation if none came to its end."""
        results = [self.futures[cell.name].result(raise_on_failure=False) for cell in self.cells]
        if not any(isinstance(result, Fit) for result in results):
            raise results[0]

    def publish(self, found: Study) -> None:
        """The page of what `finish` found, and the best of it in MLflow's registry of models."""
        if not found.fits:
            return
        page = workers.submit(pictures.page, found.fits)
        register(self.run, found.fits)
        self.run.text(page.result(), "report.html")


@contextmanager
def open_running(name: str, cells: Sequence[Cell], measurement: Measurement) -> Iterator[Running]:
    """A study with its parent run open and nothing queued yet."""
    with open_study(name, cells, measurement) as run:
        yield Running(name, run, measurement, cells, {})
