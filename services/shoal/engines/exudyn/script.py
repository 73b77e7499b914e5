"""A scene as a Python script for Exudyn: the very items that the engine enters, and the very settings of its solver."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator
from functools import reduce
from itertools import groupby
from typing import Any

import numpy as np

from shoal.engines.capabilities import require
from shoal.engines.contract import sampling_times
from shoal.engines.exudyn import timed, user
from shoal.engines.exudyn.build import ExudynSystem, library
from shoal.engines.exudyn.engine import ExudynEngine
from shoal.engines.exudyn.record import Steps, choose_steps
from shoal.engines.exudyn.recorder import Recorder, Texts, is_number_of_item, key_of, source
from shoal.engines.exudyn.rolled import Statements, blocks
from shoal.errors import InputError
from shoal.scene import Rod, Scene
from shoal.versions import versions

WIDTH = 120


def script(scene: Scene) -> str:
    """A script that enters the scene into Exudyn, runs it and writes a table of its markers beside itself.

    It needs exudyn and numpy. Raises InputError that names what Exudyn has not.
    """
    try:
        return _written(scene)
    except InputError as error:
        # Which engine could run it is no help to who wants to go on in Exudyn.
        raise InputError(str(error).split("; use ")[0]) from None


def _written(scene: Scene) -> str:
    engine = ExudynEngine()
    require(engine, scene)
    exu = library()
    wanted = sampling_times(scene, None)
    machine = engine.machine(exu, scene, system_of=Recorder)
    if any(exchange.crossed is not None for exchange in machine.exchanges):
        # How short its steps must be is known after a run.
        step = engine.simulate(scene).model["step"]
        machine = engine.machine(exu, scene.with_values({"solver.step": step}), system_of=Recorder)
    return "\n".join(_Script(engine, exu, machine, wanted).lines()) + "\n"


class _Script:
    """The parts of a script."""

    def __init__(self, engine: ExudynEngine, exu: Any, machine: ExudynSystem, wanted: Any) -> None:
        self.exu, self.scene, self.machine = exu, machine.scene, machine
        system = machine.system
        assert isinstance(system, Recorder)
        self.steps = choose_steps(wanted, self.scene.solver.step, machine.unknowns, machine.clock.halts)
        self.settings = dict(_changes(exu.SimulationSettings(), engine.simulation_settings(exu, machine, self.steps)))
        self.markers = {}
        for name, at in self.scene.markers.items():
            system.enter(f"markers.{name}")
            self.markers[name] = system_marker = machine.parts[at.body].hold(system, self.scene.location(at))
            assert is_number_of_item(system_marker)
        self.entries = system.entries
        self.texts = Texts(system, exu)

    def lines(self) -> Iterator[str]:
        """All of it."""
        model = list(self._model())
        tail = list(self._run())
        functions = [line for lines in self.texts.functions.values() for line in lines]
        body = "\n".join([*functions, *model, *tail])
        helpers = {one for one in vars(timed).values() if getattr(one, "__module__", "") == timed.__name__}
        used = {one for one in helpers if re.search(rf"\b{one.__name__}\(", body)} | self.texts.used
        made_with = versions(["shoal"])["shoal"]
        title = f"{self.scene.name}: {self.scene.description}" if self.scene.description else self.scene.name
        yield from textwrap.wrap(f'"""{title.replace(chr(34), chr(39)).replace(chr(92), "/")}', WIDTH)
        yield ""
        yield f"Written by Shoal {made_with} for Exudyn {self.exu.__version__}; it needs exudyn and numpy. SI units."
        yield "It writes the places [m] of the markers over time [s] to the .csv beside it."
        yield '"""'
        yield from ("", "import sys", "from pathlib import Path", "", "import exudyn as exu", "import numpy as np")
        yield from _wrapped(f"from exudyn.itemInterface import {', '.join(sorted(self.kinds))}")
        for text in source(used, timed, user):
            yield from ("", "", *text.splitlines())
        if used:
            yield ""
        yield ""
        yield from ("SC = exu.SystemContainer()", "mbs = SC.AddSystem()")
        if "clock" in body:
            yield "clock = {'until': np.inf}  # no function of time is asked for later values than this"
        if functions:
            yield ""
            for line in functions:
                yield from _wrapped(line)
        yield from model
        yield from tail

    def _model(self) -> Iterator[str]:
        statements = Statements(self.texts, self.entries)
        statements.asked |= {key_of(marker) for marker in self.markers.values()}
        for where, entries in groupby(self.entries, key=lambda entry: entry.where):
            yield from ("", f"# {where}{self._about(where)}")
            for block in blocks(list(entries)):
                for line in statements.of(block):
                    yield from _wrapped(line)
        self.kinds = statements.kinds
        yield ""
        named = [f"{name!r}: {statements.name_of(key_of(marker))}" for name, marker in self.markers.items()]
        yield from _wrapped(f"markers = {{{', '.join(named)}}}")
        yield "mbs.Assemble()"

    def _about(self, where: str) -> str:
        """Describe a field of the scene in a few words."""
        parts = where.split(".")
        if len(parts) != 2 or parts[0] not in ("bodies", "joints", "loads"):
            return ""
        one = getattr(self.scene, parts[0])[parts[1]]
        flexible = isinstance(one, Rod) and one.element != "rigid"
        return f": {one.kind}" + (f", {one.element}, {one.elements} elements" if flexible else "")

    def _run(self) -> Iterator[str]:
        """The settings, the steps and the table."""
        runs = self.steps.runs
        yield from ("", "settings = exu.SimulationSettings()")
        for path, value in self.settings.items():
            if len(runs) == 1 or path not in ("timeIntegration.endTime", "timeIntegration.numberOfSteps"):
                yield f"settings.{path} = {value}"
        yield from _RECORD.splitlines()
        yield "try:"
        yield from (["    done = mbs.SolveDynamic(settings)"] if len(runs) == 1 else _runs(self.steps))
        yield from ("except exu.SolverError:", "    done = False")
        solver, axes = self.scene.solver, "xyz"[: self.scene.dimensions]
        yield from _TABLE.format(
            samples=solver.samples + 1, duration=repr(solver.duration), axes=axes, count=len(axes)
        ).splitlines()


_RECORD = """
times, places, speeds = [], [], []


def record(mbs, t):
    \"\"\"Exudyn's call at the start and after every step.\"\"\"
    if not times or t > times[-1]:
        times.append(t)
        places.append([mbs.GetMarkerOutput(m, exu.OutputVariableType.Position) for m in markers.values()])
        speeds.append([mbs.GetMarkerOutput(m, exu.OutputVariableType.Velocity) for m in markers.values()])
    return True


mbs.SetPostStepUserFunction(record)"""
_TABLE = """
if not done:
    sys.exit(f"Exudyn's solver gave up at {{times[-1]:g}} s")
wanted = np.linspace(0.0, {duration}, {samples})
table = sampled(wanted, np.array(times), *(np.array(of).reshape(len(times), -1) for of in (places, speeds)))
columns = [f"{{name}}.{{axis}}" for name in markers for axis in "{axes}"]
table = np.column_stack([wanted, table.reshape(len(wanted), -1, 3)[:, :, :{count}].reshape(len(wanted), -1)])
out = Path(__file__).with_suffix(".csv")
np.savetxt(out, table, delimiter=",", header=",".join(["t", *columns]), comments="", fmt="%.12g")
print(out)"""


def _runs(steps: Steps) -> Iterator[str]:
    """One run after the other, each up to where a function of time jumps or bends."""
    yield "    done, begin = True, 0.0"
    yield "    for steps, end in ["
    yield from (f"        ({count}, {end!r})," for count, end in steps.runs)
    yield "    ]:"
    yield "        clock['until'] = np.nextafter(end, 0.0)"
    yield "        settings.timeIntegration.startTime, settings.timeIntegration.endTime = begin, end"
    yield "        settings.timeIntegration.numberOfSteps = steps"
    yield "        done = done and mbs.SolveDynamic(settings, updateInitialValues=True)"
    yield "        begin = end"


def _changes(usual: Any, chosen: Any) -> Iterator[tuple[str, str]]:
    """Settings that are not the usual ones, by their paths."""

    def differing(one: dict[str, Any], other: dict[str, Any], path: str) -> Iterator[tuple[str, str]]:
        for name, value in other.items():
            if isinstance(value, dict):
                yield from differing(one[name], value, f"{path}{name}.")
            elif not np.array_equal(value, one[name]):
                yield f"{path}{name}", said(reduce(getattr, f"{path}{name}".split("."), chosen))

    def said(value: Any) -> str:
        return repr(value) if isinstance(value, bool | int | float | str) else f"exu.{value}"

    return differing(usual.GetDictionary(), chosen.GetDictionary(), "")


def _wrapped(line: str) -> Iterator[str]:
    """A statement in brackets as lines of at most WIDTH characters, cut at commas where that is possible."""
    indent = len(line) - len(line.lstrip())
    if len(line) <= WIDTH or line.lstrip().startswith("#"):
        yield line
        return
    if line.startswith("from "):
        head, tail = line.split(" import ")
        yield f"{head} import ("
        yield from textwrap.wrap(tail, WIDTH, initial_indent="    ", subsequent_indent="    ")
        yield ")"
        return
    if call := re.fullmatch(r"(.*?mbs\.Add\w+\(\w+\()(.*?)(\)+)", line):
        inner = " " * (indent + 4)
        options = re.split(r", (?=[A-Za-z]\w*=)", call[2] + call[3][: -2 - (".append(" in call[1])])
        rows = [""]
        for option in options:
            if rows[-1] and len(inner + rows[-1] + option) + 2 > WIDTH:
                rows.append("")
            rows[-1] += f"{option}, "
        yield call[1]
        for row in rows:
            yield from textwrap.wrap(
                row, WIDTH, initial_indent=inner, subsequent_indent=inner + "    ", break_long_words=False
            )
        yield " " * indent + call[3][-2 - (".append(" in call[1]) :]
        return
    yield from textwrap.wrap(
        line, WIDTH, subsequent_indent=" " * (indent + 4), break_long_words=False, break_on_hyphens=False
    )
