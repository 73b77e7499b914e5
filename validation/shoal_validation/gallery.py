"""`python -m shoal_validation.gallery`: simulate the machines of docs/gallery.md and draw them in motion.

Each is a scene of about ten lines in docs/gallery, or a built-in one. A machine whose run is rejected is not drawn.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import shoal
from PIL import Image, ImageSequence
from rich.console import Console
from shoal.pictures.files import trajectory
from shoal.scene import Scene

FOLDER = Path(__file__).parents[2] / "docs" / "gallery"
BUILT_IN = "flexible-double-pendulum", "andrews-squeezer", "bricard", "flexible-spherical-double-pendulum"
SAMPLES = 240
"""Instants of a motion: four for each of the picture's sixty frames, so that the paths of markers are smooth."""
WIDTH = 360
"""Of a picture [pixels]: three stand side by side on a desktop, one fills a phone."""


@dataclass(frozen=True)
class Machine:
    """A machine of the gallery."""

    name: str
    scene: Scene
    own: bool
    """Whether its scene is a file of the gallery, else built in."""

    def motion(self) -> shoal.Trajectory:
        """Simulate it. Raises ComputationError where the run is rejected."""
        duration = min(self.scene.solver.duration, 6.0)
        times = [duration * k / SAMPLES for k in range(SAMPLES + 1)]
        run = shoal.simulate(self.scene, times)
        if not run.ok:
            raise shoal.ComputationError(f"{self.name}: {run.status[0]}: {run.message}")
        return run


def machines() -> Iterator[Machine]:
    """Yield the machines, planar ones first."""
    own = [Machine(path.stem, shoal.load_scene(path), own=True) for path in sorted(FOLDER.glob("*.yaml"))]
    built_in = [Machine(name, shoal.load_scene(name), own=False) for name in BUILT_IN]
    yield from sorted([*own, *built_in], key=lambda machine: (machine.scene.dimensions, machine.name))


def picture(machine: Machine) -> bytes:
    """Return a machine in motion as GIF, at the width of the gallery. Raises ComputationError."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "motion.gif"
        trajectory(machine.motion(), machine.scene, path)
        with Image.open(path) as large:
            palette = large.copy()
            height = round(large.height * WIDTH / large.width)
            wait = large.info["duration"]
            frames = [
                frame.convert("RGB").resize((WIDTH, height), Image.Resampling.LANCZOS)
                for frame in ImageSequence.Iterator(large)
            ]
    reduced = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    stream = BytesIO()
    reduced[0].save(stream, "GIF", save_all=True, append_images=reduced[1:], duration=wait, loop=0, optimize=True)
    return stream.getvalue()


def main() -> None:
    """Draw all machines, or those that are named."""
    parser = argparse.ArgumentParser(prog="python -m shoal_validation.gallery", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="machines to draw (default: all)")
    parser.add_argument("--out", type=Path, default=FOLDER, help="folder of the pictures")
    asked = parser.parse_args()
    known = list(machines())
    if unknown := sorted(set(asked.names) - {machine.name for machine in known}):
        parser.error(f"{unknown[0]}: no such machine; there are {', '.join(machine.name for machine in known)}")
    asked.out.mkdir(parents=True, exist_ok=True)
    console = Console(highlight=False)
    for machine in known:
        if not asked.names or machine.name in asked.names:
            drawn = picture(machine)
            (asked.out / f"{machine.name}.gif").write_bytes(drawn)
            console.print(f"{machine.name}: {len(drawn) / 1000:.0f} kB")


if __name__ == "__main__":
    main()
