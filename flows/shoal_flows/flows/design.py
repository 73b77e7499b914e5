"""Flow: what to measure to know the parameters of one problem."""

from __future__ import annotations

from prefect import flow
from shoal.identification import load_problem

from shoal_flows.flows import tables
from shoal_flows.flows.parameters import About, Data, ProblemName, Size, Values
from shoal_flows.flows.shown import ended, named, progress, show_result
from shoal_flows.flows.tasks import plan
from shoal_flows.inputs import held, title
from shoal_flows.results import Designed


@flow(name="design", flow_run_name=named("design", "problem"))
def design(
    problem: ProblemName = "paper-case-1",
    data: Data = "",
    about: About = None,
    noise: Size = None,
    angle_noise: Size = None,
    sensor_noise: dict[str, float] = {},  # noqa: B006 - as `values`
    duration: Size = None,
    rate: Size = None,
    parameter: str | None = None,
    values: Values = {},  # noqa: B006 - Prefect shows the default in its form; nothing changes it
) -> Designed:
    """Rank possible measurements by the information that they give about the parameters of a problem.

    Args:
        problem: The parameters: a name (see `shoal problems`), or its YAML.
        data: A recording: a name of the library, a path where the worker runs, or the address of one in a service's
            library; empty for the data of the problem.
        about: About the answer of the data, or about the start; else the first, where there are data.
        noise: Standard deviation of positions [m]; else the problem's.
        angle_noise: Standard deviation of angles [rad]; else the problem's.
        sensor_noise: Of sensors on the machine that are weighed too, in SI units, as {sensor: size}, such as
            {"acceleration": 0.05, "rate": 0.005, "strain": 1e-6}; force and torque are load cells in joints.
        duration: Of the measurement [s]; else that of the data.
        rate: Samples per second; else that of the data.
        parameter: To be sharpened; else the weakest.
        values: Fields of the scene to set, as {path: value}, such as {"bodies.OA.elements": 8}.
    """
    problem, data = held("problem", "problems", problem), held("data", "recordings", data)
    load_problem(problem).load_scene(values)
    name = title(problem)
    sizes = {"noise": noise, "angle_noise": angle_noise, "sensor_noise": sensor_noise}
    how = {**sizes, "about": about, "duration": duration, "rate": rate}
    with progress(1, f"a measurement for {name}"):
        result = Designed(*plan(problem, data or None, {**how, "parameter": parameter, "values": values}))
    show_result(f"{name}: what to measure", tables.of_design(result.answer), result)
    return ended(result)
