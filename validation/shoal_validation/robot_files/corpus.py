"""Robot files of public repositories, taken from mirrors of Git and chosen by digest, so that a study can be repeated.

Nothing of them is kept in this repository. A mirror is FOLDER/OWNER+NAME/repo, bare; files it lacks count as absent.
"""

from __future__ import annotations

import hashlib
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

NEEDED = (".urdf", ".xacro", ".xml", ".stl", ".obj", ".msh", ".png", ".skn", ".bin", ".yaml")
"""Endings of files that machines consist of; textures stand for heights too."""


def unpack(mirrors: Path, folder: Path) -> list[str]:
    """Write the files of all mirrors under a folder, each repository in its own; return its names."""
    names = []
    for mirror in sorted(mirrors.glob("*+*/repo")):
        git = mirror / ".git" if (mirror / ".git").is_dir() else mirror
        listed = subprocess.run(["git", "-C", str(git), "ls-tree", "-rz", "HEAD"], capture_output=True, check=False)
        rows = (row.split("\t", 1) for row in listed.stdout.decode(errors="replace").split("\0") if "\t" in row)
        wanted = [(about.split()[2], path) for about, path in rows if path.lower().endswith(NEEDED)]
        for path, data in _contents(git, wanted):
            target = folder / mirror.parent.name / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
        names.append(mirror.parent.name)
    return names


def _contents(git: Path, wanted: list[tuple[str, str]]) -> Iterator[tuple[str, bytes]]:
    """Yield the contents of those blobs that a mirror has."""
    with subprocess.Popen(
        ["git", "-C", str(git), "cat-file", "--batch"], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        for blob, path in wanted:
            process.stdin.write(f"{blob}\n".encode())
            process.stdin.flush()
            head = process.stdout.readline().split()
            if head[-1] != b"missing":
                data = process.stdout.read(int(head[2]))
                process.stdout.read(1)
                yield path, data


def choose(folder: Path, count: int, kind: str) -> list[Path]:
    """Return `count` files of a kind, urdf or mjcf, in turn from each repository, by digest of their paths."""
    is_machine: Callable[[Path], bool] = {"urdf": _is_urdf, "mjcf": _is_mjcf}[kind]
    groups: dict[str, list[Path]] = {}
    seen = set[bytes]()
    ending = "*.urdf" if kind == "urdf" else "*.xml"
    for path in sorted(
        folder.rglob(ending), key=lambda one: hashlib.sha256(str(one.relative_to(folder)).encode()).digest()
    ):
        content = hashlib.sha256(path.read_bytes()).digest()
        if content not in seen and is_machine(path):
            seen.add(content)
            groups.setdefault(path.relative_to(folder).parts[0], []).append(path)
    chosen: list[Path] = []
    turn = 0
    while len(chosen) < count and any(len(group) > turn for group in groups.values()):
        chosen += [groups[name][turn] for name in sorted(groups) if len(groups[name]) > turn]
        turn += 1
    return chosen[:count]


def _is_urdf(path: Path) -> bool:
    """Return whether it is a machine of its own, none of thousands of shapes that a script drew at random."""
    return "random_urdfs" not in path.parts


def _is_mjcf(path: Path) -> bool:
    """Return whether it is a machine of MuJoCo's, and none of its tests' malformed files."""
    text = path.read_bytes()
    return b"<mujoco" in text and b"<worldbody" in text and "malformed" not in str(path)
