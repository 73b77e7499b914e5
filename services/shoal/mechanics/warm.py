"""Compile the kernels into the cache, for one lane and for tiles of lanes, so that no later run waits for it."""

from __future__ import annotations

import itertools
import multiprocessing
import os
import sys
import time
import zlib
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import config

from shoal.children import end_with_parent
from shoal.compile import clock
from shoal.compile.content import address_by_content
from shoal.compile.locks import described, seconds
from shoal.compile.progress import Note, reporting_to
from shoal.errors import ShoalError
from shoal.mechanics import kernels, tangent
from shoal.mechanics.analysis import evaluations
from shoal.mechanics.assembly.build import build
from shoal.mechanics.dynamics import work_space
from shoal.mechanics.integrators import INTEGRATORS, choose, facts, halting
from shoal.mechanics.integrators.scheme import connect, signatures
from shoal.mechanics.march import event_kernel, loop
from shoal.mechanics.marched import frame_type, framed
from shoal.mechanics.numerics.tile import SINGLE, tiles
from shoal.mechanics.simulate import simulate
from shoal.scene import Scene, load_scene


class KernelSignature(NamedTuple):
    """A kernel by its name, and the types of its arguments."""

    module: str
    name: str
    kinds: tuple[Any, ...]

    @property
    def function(self) -> Any:
        """The function that is compiled."""
        return getattr(sys.modules[self.module], self.name)

    @property
    def seconds(self) -> float:
        """About how long it takes to compile."""
        return seconds(self.name, self.kinds)

    @property
    def cached(self) -> bool:
        """Return whether the cache has it."""
        function = self.function
        address_by_content(function)
        found = function._cache
        return found._index_key(self.kinds, function.targetctx.codegen()) in found._cache_file._load_index()


def warm(integrators: Iterable[str] = tuple(INTEGRATORS), note: Note = lambda _: None, *, every: bool = True) -> float:
    """Compile kernels that the cache lacks, on all cores, and load them; return the time [s].

    every: for any scene, with constraints and all families of elements, and for statics, modes and reactions; else for
    planar cables that hang together. `note` takes lines of progress.
    """
    begin = time.perf_counter()
    runs = [(scene, lanes) for name in integrators for scene in _machines(name, every=every) for lanes in _lanes(name)]
    ahead([kernel for scene, lanes in runs for kernel in required(scene, lanes, every=every)], note)
    with reporting_to(note):  # what is small
        for scene, lanes in runs:
            angles = {"initial.OA.angle": np.linspace(0.7, 0.8, lanes)} if lanes > 1 else None
            simulate(scene, np.array([4e-4]), angles)
    return time.perf_counter() - begin


def warm_for(scenes: Iterable[Scene], lanes: Iterable[int], note: Note) -> None:
    """Compile what runs of scenes will need and the cache lacks: one by itself (1), many side by side (2).

    A mark in the cache says that it has been done for the like, so that later runs spend no time on it. Nothing is done
    for a scene that cannot be modelled: its run will say so.
    """
    wanted: dict[Path, list[KernelSignature]] = {}
    for scene, count in itertools.product(scenes, lanes):
        mark = Path(config.CACHE_DIR) / f"ahead-{_likeness(scene, count)}"
        if not mark.exists():
            with suppress(ShoalError):
                wanted[mark] = required(scene, count)
    ahead(itertools.chain(*wanted.values()), note)
    for mark in wanted:
        with suppress(OSError):  # the next run looks again
            mark.touch()


def _likeness(scene: Scene, lanes: int) -> str:
    """Scenes of the same need the same kernels, or nearly: what is missing is compiled when it is called."""
    bodies = {
        (type(body).__name__, body.element, str(getattr(body, "rotary_inertia", ""))) for body in scene.bodies.values()
    }
    features = scene.solver.integrator, sorted(bodies), sorted({joint.kind for joint in scene.joints.values()}), lanes
    return f"{zlib.crc32(repr(features).encode()):08x}"


def ahead(wanted: Iterable[KernelSignature], note: Note) -> None:
    """Compile what is missing in the cache, longest first, in as many processes as there are cores.

    Where there can be no processes, as in a worker of Dask, which is a daemon, nothing is done but to say so.
    """
    begin = time.perf_counter()
    missing = sorted((one for one in dict.fromkeys(wanted) if not one.cached), key=lambda one: -one.seconds)
    if not missing:
        return
    workers = min(os.cpu_count() or 1, len(missing))
    wait = max(missing[0].seconds, sum(one.seconds for one in missing) / workers)
    cores = f"{workers} cores" if workers > 1 else "one core"
    what = f"compiling {len(missing)} kernels for this machine, once"
    note(f"{what}: about {wait:.0f} s on {cores}, which time limits do not count")
    try:
        if multiprocessing.current_process().daemon:
            raise NotImplementedError("a daemon may start none")
        pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), end_with_parent)
        with clock.stopped(), pool:
            for number, done in enumerate(as_completed([pool.submit(_compile, one) for one in missing]), 1):
                note(f"  {done.result()} ({number} of {len(missing)}, {time.perf_counter() - begin:.0f} s so far)")
    except (OSError, NotImplementedError, BrokenProcessPool) as error:
        note(f"  no further processes ({error}): the run compiles what it calls, one after the other")


def required(scene: Scene, lanes: int, *, every: bool = False) -> list[KernelSignature]:
    """Return the large kernels of a run of n lanes; every: also for constraints and families that the scene lacks.

    Under `auto` those of its usual choice. Raises InputError if the scene cannot be modelled.
    """
    model, (tile, _) = build(scene), tiles(lanes)
    name = scene.solver.integrator
    if name == "auto":
        name = "leapfrog" if model.flexible else "dop853"
    lane = slice(0, 1)
    arrays = model.tile(tile, lane)
    room = work_space(tile, arrays)
    with kernels.planned():
        settings = choose(scene.solver, model, tile, lane, name)
        scheme = connect(tile, settings, arrays, room)
        steps = signatures(tile, settings, arrays, room)
        if not facts(name).explicit:
            steps.append(tangent.assembly(tile, arrays, room, tangent.tangent_tile(model, tile, lane)))
    stops = halting(scene.solver, model, name, scene.solver.duration)
    frame = framed(tile, scheme, arrays, room, 0.0, 0, np.zeros(1), model.marker_rows.ravel(), 0.0, stops)
    found = [(loop, (frame_type(frame),)), *steps]
    found += kernels.signatures(tile, arrays, room, every=every)
    if arrays.gaps.size > 0 and tile == SINGLE:
        found.append(event_kernel(frame))
    if every:  # limits of stability
        found += tangent.signatures(tile, arrays, room)
    if every and tile == SINGLE:  # statics, modes and reactions
        found += evaluations.signatures(tile, arrays, room)
    named = [KernelSignature(kernel.__module__, kernel.__name__, kinds) for kernel, kinds in found]
    if lanes > 1 and not every:  # lanes mostly differ in their start alone, and share one stability limit
        named = [kernel for kernel in named if kernel.name != "_stiffness"]
    return named


def _compile(kernel: KernelSignature) -> str:
    begin = time.perf_counter()
    kernel.function.compile(kernel.kinds)
    return f"{described(kernel.name, kernel.kinds)}: {time.perf_counter() - begin:.1f} s"


def _lanes(name: str) -> tuple[int, ...]:
    return (1, 2) if facts(name).warm_lanes else (1,)


def _machines(integrator: str, *, every: bool) -> list[Scene]:
    """Return a planar machine, and once a spatial one for its elements, to compile the kernels of an integrator for."""
    names = ["flexible-double-pendulum"]
    if every and integrator == "leapfrog":
        names.append("flexible-spherical-double-pendulum")
    return [load_scene(name).with_values({"solver.integrator": integrator, "solver.step": 2e-4}) for name in names]


if __name__ == "__main__":
    from shoal.mechanics import warm as itself  # the processes know its kernels by this name, not as __main__

    try:
        itself.warm(note=lambda line: print(line, file=sys.stderr, flush=True))  # noqa: T201 - a command
    except ShoalError as error:
        sys.exit(f"shoal: {error}")
