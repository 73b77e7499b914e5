"""Scripts and manifests for clusters: a task is its line, and containers are those of the compose file."""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

DEPLOY = Path(__file__).parents[1] / "deploy"
COMPOSE = yaml.safe_load((DEPLOY.parent / "docker-compose.yml").read_text(encoding="utf-8"))
MANIFESTS = sorted((DEPLOY / "kubernetes").glob("*.yaml"))


def documents(path: Path) -> list[Any]:
    """The resources of a manifest."""
    return list(yaml.safe_load_all(path.read_text(encoding="utf-8")))


def containers() -> Iterator[tuple[str, Any, Any]]:
    """File, pod and container of each container."""
    for path in MANIFESTS:
        for one in documents(path):
            if pod := one["spec"].get("template", {}).get("spec"):
                yield from ((path.name, pod, each) for each in [*pod.get("initContainers", ()), *pod["containers"]])


@pytest.fixture
def tasks(tmp_path: Path) -> dict[str, str]:
    """An environment with a stand-in for `shoal` that prints its arguments, and a file of two tasks."""
    stand_in = tmp_path / "bin" / "shoal"
    stand_in.parent.mkdir()
    stand_in.write_text('#!/bin/sh\nprintf "%s\\n" "$@"\nexit 3\n')
    stand_in.chmod(0o755)
    (tmp_path / "tasks.txt").write_text("scenes\nsimulate arm --set 'initial.rod={angle: 0.6, rate: 1}' > out.txt\n")
    return {**os.environ, "PATH": f"{stand_in.parent}:{os.environ['PATH']}", "HOME": str(tmp_path)}


def said(folder: Path) -> list[str]:
    """What the stand-in was asked for."""
    return (folder / "out.txt").read_text().splitlines()


WANTED = ["simulate", "arm", "--set", "initial.rod={angle: 0.6, rate: 1}"]


def test_task_of_a_slurm_array_is_its_line_with_its_status(tasks: dict[str, str], tmp_path: Path) -> None:
    command = ["bash", str(DEPLOY / "slurm" / "array.sh"), "tasks.txt"]
    done = subprocess.run(command, cwd=tmp_path, env={**tasks, "SLURM_ARRAY_TASK_ID": "2"}, check=False)
    assert (done.returncode, said(tmp_path)) == (3, WANTED)
    absent = subprocess.run(
        command, cwd=tmp_path, env={**tasks, "SLURM_ARRAY_TASK_ID": "3"}, check=False, capture_output=True, text=True
    )
    assert (absent.returncode, absent.stderr) == (2, "tasks.txt has no line 3\n")


def test_pod_of_an_indexed_job_is_its_line_with_its_status(tasks: dict[str, str], tmp_path: Path) -> None:
    (job,) = documents(DEPLOY / "kubernetes" / "array.yaml")
    (container,) = job["spec"]["template"]["spec"]["containers"]
    _, *shell = container["command"]
    command = [*shell, *container["args"]]
    done = subprocess.run(command, cwd=tmp_path, env={**tasks, "JOB_COMPLETION_INDEX": "1"}, check=False)
    assert (done.returncode, said(tmp_path)) == (3, WANTED)


@pytest.mark.parametrize(("file", "pod", "container"), list(containers()))
def test_container_of_a_pod_is_guarded_and_of_the_same_image(file: str, pod: Any, container: Any) -> None:
    gauss = COMPOSE["services"]["gauss"]
    assert container["image"] == gauss["image"], file
    assert f"{pod['securityContext']['runAsUser']}:{pod['securityContext']['runAsGroup']}" == gauss["user"]
    assert pod["securityContext"]["runAsNonRoot"]
    assert not pod["automountServiceAccountToken"]
    assert container["securityContext"] == {
        "allowPrivilegeEscalation": False,
        "readOnlyRootFilesystem": True,
        "capabilities": {"drop": ["ALL"]},
    }
    assert container["resources"]["limits"]["memory"]
    written = {mount["mountPath"] for mount in container["volumeMounts"]}
    assert {"/tmp", "/var/lib/shoal"} <= written


@pytest.mark.parametrize(
    ("file", "name", "service"),
    [
        ("service.yaml", "gauss", "gauss"),
        ("dask.yaml", "scheduler", "dask-scheduler"),
        ("worker.yaml", "worker", "worker"),
        ("worker.yaml", "deploy", "deploy"),
    ],
)
def test_program_of_a_pod_is_that_of_the_compose_file(file: str, name: str, service: str) -> None:
    (found,) = (container for path, _, container in containers() if (path, container["name"]) == (file, name))
    assert found["args"] == COMPOSE["services"][service]["command"]
