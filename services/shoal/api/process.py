"""A process of the service: one engine, one task after the other, until its pipe closes."""

from __future__ import annotations

import logging
import multiprocessing as mp
import os
import resource
import shutil
import signal
import threading
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from shoal.api import held, models, tasks
from shoal.api.held import NoSuch
from shoal.api.limits import TooMuch
from shoal.api.settings import Settings
from shoal.api.tasks import Bench, Note
from shoal.compile import clock
from shoal.engines.contract import Engine
from shoal.engines.verification import verified
from shoal.errors import InputError, ShoalError
from shoal.identification import Problem
from shoal.scene import Scene, load_scene
from shoal.versions import versions

TASKS: dict[str, Callable[[Bench, Any, Note], bytes]] = {
    "call": tasks.call,
    "check": tasks.check,
    "model": models.bridge,
    "library": held.library,
}
PACKAGES = ("shoal", "numpy", "scipy", "numba", "exudyn", "casadi")
log = logging.getLogger("shoal.api")


def main(pipe: Connection, make_engine: Callable[[], Engine], settings: Settings, folder: str) -> None:
    """The process: make the engine, warm it up, then one task after the other until the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, args=(folder,), daemon=True).start()
    resource.setrlimit(resource.RLIMIT_DATA, (settings.max_memory_mb * 2**20, resource.RLIM_INFINITY))
    engine = _made(pipe, make_engine)
    if engine is None:
        return
    # Where it is does not depend on the folder that this process works in, nor on what a fork server was started with.
    os.environ["SHOAL_LIBRARY"] = str(settings.library.absolute())
    os.chdir(folder)
    bench = Bench(engine, settings)
    sending = threading.Lock()

    def send(kind: str, content: Any) -> None:
        with sending:
            pipe.send((kind, content))

    while True:
        try:
            task, request = pipe.recv()
        except (EOFError, OSError):
            return _end_with_parent(folder)
        with clock.heard(lambda stands: send("clock", stands)):
            result = _result(bench, task, request, lambda content: send("note", content))
        send(*result)
        _empty(Path(folder))


def _made(pipe: Connection, make_engine: Callable[[], Engine]) -> Engine | None:
    """Make the engine and run it briefly; send the service its capabilities, or why it failed."""
    try:
        engine = make_engine()
        scene = load_scene("flexible-double-pendulum")
        verified(engine, scene, [2 * scene.solver.step])
    except Exception as error:
        log.exception("the engine could not be made")
        pipe.send(("not-ready", f"the engine could not be made: {error}"))
        return None
    pipe.send(("done", about(engine)))
    return engine


def about(engine: Engine) -> dict[str, Any]:
    """Return the engine's capabilities, schemas and versions for clients."""
    able = engine.capabilities
    kinds = {name: sorted(getattr(able, name)) for name in ("elements", "joints", "loads", "features")}
    return {
        "capabilities": {"engine": engine.name, "lanes": able.lanes, **kinds},
        "schemas": {"scene": Scene.model_json_schema(), "problem": Problem.model_json_schema()},
        "version": {"engine": engine.name, "versions": versions(PACKAGES)},
    }


def _result(bench: Bench, task: str, request: Any, note: Note) -> tuple[str, Any]:
    """(`done`, JSON), or the kind of a refusal and its text."""
    try:
        return "done", TASKS[task](bench, request, note)
    except NoSuch as error:
        return "not-found", str(error)
    except TooMuch as error:
        return "too-much", str(error)
    except InputError as error:
        return "input", str(error)
    except ShoalError as error:
        return "computation", str(error)
    except MemoryError:
        return "too-much", f"it needs more memory than the {bench.settings.max_memory_mb} MiB of a worker"
    except Exception:
        log.exception("%s failed", task)
        return "internal", "the computation failed by a defect of the service; its log tells why"


def _end_with_parent(folder: str) -> None:
    """A service that is killed cannot clean up; its workers end and take its temporary files with them."""
    parent = mp.parent_process()
    if parent is not None:
        parent.join()
        shutil.rmtree(Path(folder).parent, ignore_errors=True)
        os._exit(1)


def _empty(folder: Path) -> None:
    for entry in folder.iterdir():
        shutil.rmtree(entry) if entry.is_dir() else entry.unlink()
