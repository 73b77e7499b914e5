"""The rows of the report's tables, as text."""

from __future__ import annotations

import numpy as np
from shoal.pictures.numbers import length, power

from shoal_flows.jobs import Fit
from shoal_flows.plan import MESHES, mesh_values, same_mesh_cells
from shoal_flows.report.paper import TABLES
from shoal_flows.report.words import covered, degrees, errors
from shoal_flows.results import Compared, Study

_PRINTED_NAMES = {"afsa": "AFSA", "iafsa": "IAFSA"}


def paper_rows(case: str, study: Study) -> list[list[str]]:
    """The paper's table with our values beside the printed ones."""
    rows = []
    fits = study.by_method()
    for method, printed in TABLES[case][1].items():
        name = _PRINTED_NAMES[method]
        rows.append([f"{name}, paper", printed.theta1, printed.theta2, printed.fitness])
        shown = [(method, "as published" if method == "afsa" else "repaired")]
        shown += [("iafsa-printed", "as printed")] if method == "iafsa" else []
        for key, what in shown:
            if key in fits:
                e = fits[key].estimate
                angles = [f"{value.value:.4f}" for value in e.parameters.values()]
                rows.append([f"{name}, Shoal, {what}", *angles, power(e.fitness)])
    truth = study.fits[0].estimate.truth if study.fits else {}
    return [["true value", *(f"{value:.4f}" for value in truth.values()), ""], *rows]


def method_rows(study: Study) -> list[list[str]]:
    """Every method: angles, errors, fitness, RMS, evaluations, time, whether the interval holds, verdict."""
    rows = []
    for fit in study.fits:
        e = fit.estimate
        angles = [f"{np.degrees(value.value):.4f}" for value in e.parameters.values()]
        numbers = [power(e.fitness), length(e.rms), f"{e.evaluations}", f"{e.wall_s:.1f}"]
        off = [degrees(error) for error in errors(fit).values()]
        rows.append([fit.cell.method, *angles, *off, *numbers, "yes" if covered(fit) else "no", str(e.verdict)])
    return [*rows, *([name, *[""] * 9, f"failed: {reason}"] for name, reason in study.failures.items())]


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
        for row in compared.comparison.differences()
    ]


def commands(case: str, scene: str, study: Study, compared: Compared) -> list[list[str]]:
    """What to type for each number."""
    rows = [
        [f"{fit.cell.method}", f"shoal identify {case} --method {fit.cell.method} --seed {fit.cell.seed}"]
        for fit in study.fits
    ]
    for label, elements, quadrature, step in MESHES:
        values = mesh_values(elements, quadrature, step)
        options = " ".join(f"--set {path}={value}" for path, value in values.items())
        rows.append([f"mesh {label}", f"shoal identify {case} --method least-squares {options}"])
    same = same_mesh_cells(case)[0]
    options = " ".join(f"--set {path}={value}" for path, value in same.values.items())
    rows.append(["same mesh", f"shoal identify {same.problem} --method {same.method} {options}"])
    engines = ",".join(compared.comparison.trajectories)
    return [*rows, ["engines", f"shoal compare {scene} --engines {engines}"]]


def fingerprints(fits: list[Fit]) -> dict[str, str]:
    """Fingerprint of the identified scene by cell."""
    return {f"{fit.cell.problem}, {fit.cell.name}": fit.estimate.scene.fingerprint for fit in fits}
