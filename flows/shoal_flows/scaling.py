"""Strong scaling of workers: `python -m shoal_flows.scaling` times a sweep of 20 000 simulations on Dask."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from typing import Any

import numpy as np
from shoal.engines.sweep import joined, pieces
from shoal.errors import ComputationError
from shoal.requests.sweep import Sweep

from shoal_flows import cluster, jobs, workers

SCENE = "flexible-double-pendulum"
VARY = {"initial.OA.angle": np.linspace(0.0, 1.5, 200), "initial.AB.angle": np.linspace(0.0, 1.5, 100)}
TIME = 0.5
"""Instant [s] at which the sweep looks; the run ends there."""
REPEATS = 5


@dataclass(frozen=True)
class Cost:
    """Cost of a sweep [s]: wall time, and processor time of the workers, which other programs lengthen less."""

    wall: float
    processor: float


def cost(number: int) -> Cost:
    """Return the best of a few sweeps on a local cluster of warm workers."""
    os.environ["SHOAL_CLUSTER"] = f"local:{number}"
    cluster.client.cache_clear()
    client = cluster.client()
    client.wait_for_workers(number)
    small = pieces({path: values[:: len(values) // 8] for path, values in VARY.items()}, number)[0]
    for worker in client.nthreads():
        client.submit(jobs.swept, Sweep(SCENE, small, TIME), workers=[worker], pure=False).result()
    costs = [_once(client) for _ in range(REPEATS)]
    client.cluster.close()
    client.close()
    return Cost(min(one.wall for one in costs), min(one.processor for one in costs))


def _once(client: Any) -> Cost:
    used = sum(client.run(time.process_time).values())
    begin = time.perf_counter()
    pending = [workers.submit(jobs.swept, Sweep(SCENE, piece, TIME)) for piece in pieces(VARY, workers.count())]
    whole = joined([part.result() for part in pending])
    wall = time.perf_counter() - begin
    if not whole.ok:
        raise ComputationError("a point failed")
    return Cost(wall, sum(client.run(time.process_time).values()) - used)


def main() -> None:
    """Print what one and two workers cost, and the efficiency."""
    one, two = cost(1), cost(2)
    print(f"{SCENE} to {TIME} s, 20000 simulations, best of {REPEATS}; load of the machine {os.getloadavg()[0]:.1f}")
    print(f"wall time:      1 worker {one.wall:.2f} s, 2 workers {two.wall:.2f} s")
    print(f"processor time: 1 worker {one.processor:.2f} s, 2 workers {two.processor:.2f} s")
    print(f"efficiency of two workers: {one.wall / (2 * two.wall):.2f}")


if __name__ == "__main__":
    main()
