"""The rows of the report's tables, as text."""

from __future__ import annotations

import numpy as np
from shoal.pictures.numbers import length, power

from shoal_flows.jobs import Fit
from shoal_flows.plan import MESHES, mesh_values, same_mesh_cells
from shoal_flows.report.paper import AS, NAMES, TABLES
from shoal_flows.report.words import covered, degrees, errors, largest_error
from shoal_flows.results import Compared, Study


def paper_rows(case: str, same: Study, study: Study) -> list[list[str]]:
    """The paper's rows, each followed by ours on data of the fitted mesh, as the paper's must be, and on other data."""
    rows = []
    for row, printed in TABLES[case][1].items():
        rows.append([f"{NAMES[row]}, paper", "not said", printed.theta1, printed.theta2, "", printed.fitness, ""])
        for method, kind in AS[row].items():
            for data, fits in (("the fitted mesh", same.by_method()), ("a finer model", study.by_method())):
                if (fit := fits.get(method)) is not None:
                    angles = [f"{value.value:.4f}" for value in fit.estimate.parameters.values()]
                    off, found = degrees(largest_error(fit), 3), fit.estimate
                    label = f"{NAMES[row]}, {kind}"
                    rows.append([label, data, *angles, off, power(found.fitness), str(found.verdict)])
    truth = study.fits[0].estimate.truth if study.fits else {}
    return [["true value", "", *(f"{value:.4f}" for value in truth.values()), "", "", ""], *rows]


def method_rows(study: Study) -> list[list[str]]:
    """Every method: verdict, angles, errors, fitness, RMS, evaluations, time, whether the interval holds."""
    rows = []
    for fit in study.fits:
        e = fit.estimate
        angles = [f"{np.degrees(value.value):.4f}" for value in e.parameters.values()]
        numbers = [power(e.fitness), length(e.rms), f"{e.evaluations}", f"{e.wall_s:.1f}"]
        off = [degrees(error) for error in errors(fit).values()]
        rows.append([fit.cell.method, str(e.verdict), *angles, *off, *numbers, "yes" if covered(fit) else "no"])
    return [*rows, *([name, f"failed: {reason}", *[""] * 9] for name, reason in study.failures.items())]


def mesh_rows(study: Study) -> list[list[str]]:
    """Every mesh: true error, the error that the estimate predicts, half its interval, the mesh's own error."""
    rows = []
    for fit in study.fits:
        e = fit.estimate
        row = [fit.cell.name]
        for name, error in errors(fit).items():
            value = e.parameters[name]
            predicted = None if value.correction is None else abs(value.correction)
            row += [degrees(abs(error), 5), degrees(predicted, 5), degrees((value.upper - value.lower) / 2, 5)]
        rows.append([*row, length(e.model_error_rms), length(e.rms), str(e.evaluations)])
    return rows


def engine_rows(compared: Compared) -> list[list[str]]:
    """Every pair of engines and marker: largest distance and distance at the end."""
    return [
        [" and ".join(row["engines"]), row["marker"], length(row["largest"]), length(row["final"])]
        for row in compared.answer.differences()
    ]


def commands(case: str, scene: str, study: Study, compared: Compared) -> list[list[str]]:
    """Return the command for each number."""
    rows = [
        [f"{fit.cell.method}", f"shoal identify {case} --method {fit.cell.method} --seed {fit.cell.seed}"]
        for fit in study.fits
    ]
    for label, elements, quadrature, step in MESHES:
        values = mesh_values(elements, quadrature, step)
        options = " ".join(f"--set {path}={value}" for path, value in values.items())
        rows.append([f"mesh {label}", f"shoal identify {case} --method least-squares {options}"])
    for same in same_mesh_cells(case):
        options = " ".join(f"--set {path}={value}" for path, value in same.values.items())
        rows.append([f"{same.method}, same mesh", f"shoal identify {same.problem} --method {same.method} {options}"])
    engines = ",".join(compared.answer.trajectories)
    return [*rows, ["engines", f"shoal compare {scene} --engines {engines}"]]


def fingerprints(fits: list[Fit]) -> dict[str, str]:
    """Fingerprint of the identified scene by cell."""
    return {f"{fit.cell.problem}, {fit.cell.name}": fit.estimate.scene.fingerprint for fit in fits}
