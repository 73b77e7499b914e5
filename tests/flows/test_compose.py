"""The compose file keeps its promises: nothing runs as root, unpinned, unbounded, unchecked or open to the network."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from shoal_flows import settings
from shoal_flows.deployment import processes, up

ROOT = Path(__file__).parents[2]
COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "docker-compose.yml").read_text())
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
OURS = sorted(set(SERVICES) - {"postgres"})


def plain(line: str) -> list[str]:
    """Words of a command with the default of every ${NAME:-default} and without settings before the program."""
    words = shlex.split(re.sub(r"\$\{\w+:-([^}]*)\}", r"\1", line))
    while re.match(r"[A-Z_]+=", words[0]):
        del words[0]
    return words


def procfile() -> dict[str, list[str]]:
    lines = (line.partition(":") for line in (ROOT / "Procfile").read_text().splitlines())
    return {name: plain(command) for name, _, command in lines}


def local(word: str) -> str:
    """A word with its host name replaced by that of this machine."""
    return re.sub(r"^(tcp://)?(0\.0\.0\.0|dask-scheduler)(?=:|$)", r"\g<1>127.0.0.1", word)


def elsewhere(words: list[str]) -> list[str]:
    """A command without the address on which it listens."""
    return [word for k, word in enumerate(words) if "--host" not in words[max(k - 1, 0) : k + 1]]


def test_every_command_is_the_line_of_the_procfile() -> None:
    lines = {name: elsewhere(words) for name, words in procfile().items()}
    assert set(lines) == set(OURS)
    assert {name: elsewhere([local(str(word)) for word in SERVICES[name]["command"]]) for name in OURS} == lines


@pytest.mark.parametrize("line", (ROOT / "Procfile").read_text().splitlines())
def test_every_process_listens_on_this_machine_alone(line: str) -> None:
    """Unless told so, the health server of a Prefect worker, and a Dask worker, which runs what it is sent, do not."""
    hosts = re.findall(r"(?:--host |PREFECT_WORKER_WEBSERVER_HOST=)(\S+)", line)
    assert hosts == ([] if line.startswith("deploy:") else ["127.0.0.1"])
    assert all(address.startswith("127.0.0.1:") for address in re.findall(r"--dashboard-address (\S+)", line))


@pytest.mark.parametrize("name", sorted(SERVICES))
def test_service_is_confined(name: str) -> None:
    service = SERVICES[name]
    assert service["cap_drop"] == ["ALL"]
    assert "no-new-privileges:true" in service["security_opt"]
    assert service["read_only"] is True
    assert not service.get("privileged")
    assert int(service["user"].split(":")[0]) > 0
    limits = service["deploy"]["resources"]["limits"]
    assert set(limits) == {"cpus", "memory", "pids"}
    assert service["restart"] == ("on-failure:3" if name == "deploy" else "unless-stopped")


@pytest.mark.parametrize("name", sorted(SERVICES))
def test_service_is_pinned_checked_and_local(name: str) -> None:
    service = SERVICES[name]
    assert re.fullmatch(r"[a-z]+:\d+\.\d+[\w.-]*", service["image"])
    assert service["healthcheck"]["test"][0] == "CMD"
    assert len(service["healthcheck"]["test"]) > 2
    assert all(port.startswith("127.0.0.1:") for port in service.get("ports", []))


def test_services_wait_until_what_they_need_is_healthy() -> None:
    needs = {name: service.get("depends_on", {}) for name, service in SERVICES.items()}
    assert all(need == {"condition": "service_healthy"} for of in needs.values() for need in of.values())
    assert set(needs["mlflow"]) == set(needs["prefect"]) == {"postgres"}
    assert set(needs["worker"]) == set(needs["nightly"]) == {"mlflow", "prefect"}
    assert set(needs["deploy"]) == {"worker"}


def test_one_service_builds_the_image_of_all() -> None:
    """Compose refuses to build the same tag for several services."""
    assert [name for name, service in SERVICES.items() if "build" in service] == ["mlflow"]
    assert {SERVICES[name]["image"] for name in OURS} == {SERVICES["mlflow"]["image"]}


@pytest.mark.parametrize("name", ["worker", "nightly", "deploy"])
def test_links_lead_to_where_a_browser_finds_the_servers(name: str) -> None:
    stated = SERVICES[name]["environment"]
    for link, server in (("SHOAL_MLFLOW_URL", "mlflow"), ("PREFECT_UI_URL", "prefect")):
        port = SERVICES[server]["ports"][0].rpartition(":")[0]
        assert stated[link] == f"http://{port}"


def test_kernels_and_the_library_outlive_their_containers() -> None:
    """Kernels for another processor than that of the build take minutes; entries of the library are a user's."""
    text = (ROOT / "Dockerfile").read_text()
    for name in ("worker", "nightly", "gauss", "dask-worker"):
        mounted = dict(volume.split(":")[1::-1] for volume in SERVICES[name]["volumes"])
        assert SERVICES[name]["environment"]["NUMBA_CACHE_DIR"] in mounted
    of_gauss = {v.partition(":")[0] for v in SERVICES["gauss"]["volumes"]}
    shared = of_gauss & {v.partition(":")[0] for v in SERVICES["worker"]["volumes"]}
    assert shared == {"library"}, "whoever writes machine code has it run"
    for name in ("worker", "nightly", "deploy", "gauss", "exudyn", "casadi", "dask-worker"):
        assert any(volume.startswith("library:/var/lib/library") for volume in SERVICES[name]["volumes"])
    assert "SHOAL_LIBRARY=/var/lib/library" in text
    made = re.search(r"install -d -o shoal -g shoal (.+)", text)
    assert made is not None
    assert {"/var/lib/library", "/var/lib/kernels"} <= set(made[1].split())
    assert SERVICES["gauss"]["healthcheck"]["start_period"] == "300s"
    assert SERVICES["gauss"]["deploy"]["resources"]["limits"]["memory"] == "3g"


def test_containers_that_begin_together_find_the_kernels_of_their_image(tmp_path: Path) -> None:
    image, cache = tmp_path / "image", tmp_path / "cache"
    (image / "kernels").mkdir(parents=True)
    (image / "kernels" / "one.nbi").write_text("code")
    for version in ("first", "second"):
        (image / "kernels.version").write_text(f"{version}\n")
        environment = {"PATH": "/usr/bin:/bin", "SHOAL_IMAGE": str(image), "NUMBA_CACHE_DIR": str(cache)}
        command = ["sh", str(ROOT / "deploy/entrypoint.sh"), "printenv", "NUMBA_CACHE_DIR"]
        running = [subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(8)]
        assert {process.communicate()[0] for process in running} == {f"{cache / version}\n"}
        assert (cache / version / "one.nbi").read_text() == "code"
        (cache / version / "two.nbi").write_text("compiled here")
    assert sorted(path.name for path in cache.iterdir()) == ["first", "second"]
    assert (cache / "first" / "two.nbi").exists()


def test_a_checkout_that_others_may_not_read_starts(tmp_path: Path) -> None:
    """Files are 0600 then; what containers read as other users is made readable, the passwords' folder is not."""
    for name in ("secrets.sh", "postgres-init.sh"):
        shutil.copy(ROOT / "deploy" / name, tmp_path)
        (tmp_path / name).chmod(0o600)
    subprocess.run(["sh", "-c", f"umask 077 && sh {tmp_path / 'secrets.sh'}"], check=True)
    read = [tmp_path / "postgres-init.sh", *(tmp_path / "secrets").iterdir()]
    assert all(path.stat().st_mode & 0o004 for path in read)
    assert (tmp_path / "secrets").stat().st_mode & 0o077 == 0
    copied = re.findall(r"^COPY (?!--from)(.+) /opt/shoal/\S+$", (ROOT / "Dockerfile").read_text(), re.MULTILINE)
    assert len(copied) == 2
    assert all(line.startswith("--chmod=") for line in copied)


def test_secrets_come_from_files_and_every_volume_is_named() -> None:
    used = {secret for service in SERVICES.values() for secret in service.get("secrets", [])}
    assert used == set(COMPOSE["secrets"])
    assert all(set(secret) == {"file"} for secret in COMPOSE["secrets"].values())
    made = re.findall(r"\b(\w+_password|api_keys)\b", (ROOT / "deploy/secrets.sh").read_text())
    assert set(made) == used
    for service in SERVICES.values():
        for name, value in (service.get("environment") or {}).items():
            assert "PASSWORD" not in name or name.endswith("_FILE"), name
            assert not re.search(r"//[^/@]*:[^/@]*@", str(value)), f"{name} holds a password"
        mounted = {str(volume).partition(":")[0] for volume in service.get("volumes", [])}
        assert {source for source in mounted if not source.startswith("./")} <= set(COMPOSE["volumes"])


def test_who_is_told_of_a_bad_night_is_one_setting() -> None:
    """And what is told leads to a page that a browser on this machine opens: the server writes the link."""
    assert SERVICES["deploy"]["environment"]["SHOAL_ALERT"] == "${SHOAL_ALERT:-}"
    assert SERVICES["prefect"]["environment"]["PREFECT_UI_URL"] == SERVICES["worker"]["environment"]["PREFECT_UI_URL"]


def test_profiles_are_those_of_make_up() -> None:
    profiles = {profile for service in SERVICES.values() for profile in service.get("profiles", [])}
    of_compose = {p: {name for name, s in SERVICES.items() if p in s.get("profiles", [])} for p in profiles}
    assert of_compose == {profile: set(names) for profile, names in processes.PROFILES.items()}
    staged = {name for stage in processes.STAGES for name in stage}
    assert staged | {"deploy"} == set(procfile())


def test_servers_are_as_quiet_as_on_a_desk(tmp_path: Path) -> None:
    quiet = settings.defaults(tmp_path)
    stated = SERVICES["prefect"]["environment"]
    for name in (
        "DO_NOT_TRACK",
        "PREFECT_SERVER_ANALYTICS_ENABLED",
        "PREFECT_SERVER_UI_V2_ENABLED",
        "PREFECT_SERVER_CSRF_PROTECTION_ENABLED",
        "MLFLOW_DISABLE_TELEMETRY",
    ):
        assert stated[name] == quiet[name]


def test_who_may_use_the_servers_is_as_on_a_desk(tmp_path: Path) -> None:
    """Pages of Prefect's own origins; names of the other containers and what an operator adds; no pages of Dask's."""
    stated = SERVICES["prefect"]["environment"]
    origins = stated["PREFECT_SERVER_CORS_ALLOWED_ORIGINS"].replace("${SHOAL_PREFECT_PORT:-4200}", "4200")
    assert origins == settings.guarded(4200)["PREFECT_SERVER_CORS_ALLOWED_ORIGINS"]
    for name in ("mlflow", "prefect", "gauss", "exudyn", "casadi", "dask-scheduler", "dask-worker"):
        hosts = SERVICES[name]["environment"]["SHOAL_ALLOWED_HOSTS"].split(",")
        assert "${SHOAL_ALLOWED_HOSTS:-}" in hosts
        assert {"mlflow", "prefect", "gauss", "exudyn", "casadi"} <= set(hosts)
    routes = {name: value for name, value in settings.defaults(tmp_path).items() if name.endswith("HTTP__ROUTES")}
    for name in ("dask-scheduler", "dask-worker"):
        assert routes.items() <= SERVICES[name]["environment"].items()


def test_the_server_keeps_the_same_and_as_long_as_on_a_desk(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Who holds the slot of the nights is written to a folder that outlives the server, as its database does."""
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))
    monkeypatch.delenv("PREFECT_HOME", raising=False)
    desk, stated = up.environment_of({}), SERVICES["prefect"]["environment"]
    for name in ("PREFECT_SERVER_CONCURRENCY_LEASE_STORAGE", "PREFECT_SERVER_SERVICES_DB_VACUUM_ENABLED"):
        assert stated[name] == desk[name]
    assert Path(desk["PREFECT_HOME"]).is_relative_to(tmp_path)
    assert any(volume.endswith(f":{stated['PREFECT_HOME']}") for volume in SERVICES["prefect"]["volumes"])
    assert stated["PREFECT_HOME"] in (ROOT / "Dockerfile").read_text()


def test_what_goes_wrong_in_a_server_is_printed(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A background service of Prefect logs its failures as errors, to the console alone."""
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))
    name = "PREFECT_LOGGING_HANDLERS_CONSOLE_LEVEL"
    monkeypatch.delenv(name, raising=False)
    assert up.environment_of({})[name] == "ERROR"
    assert all(name not in service.get("environment", {}) for service in SERVICES.values())


def test_dockerfile_has_the_versions_of_the_project() -> None:
    text = (ROOT / "Dockerfile").read_text()
    uv = re.search(r"UV_VERSION := (\S+)", (ROOT / "Makefile").read_text())
    assert uv is not None
    assert f"uv=={uv[1]}" in text
    version = re.search(r'^version = "(.+)"', (ROOT / "pyproject.toml").read_text(), re.MULTILINE)
    assert version is not None
    assert SERVICES["worker"]["image"] == f"shoal:{version[1]}"
    assert re.search(r"^ARG PYTHON=3\.11\.\d+-slim", text, re.MULTILINE)
    users = re.findall(r"^USER (.+)", text, re.MULTILINE)
    assert users[-1] == SERVICES["worker"]["user"]


def test_the_image_leaves_out_what_no_service_reads(tmp_path: Path) -> None:
    """Headers, tests of others, and what a wheel holds twice for want of links; whoever opens a library finds it."""
    files = {
        "casadi/libipopt.so.3.14": b"code",
        "casadi/libipopt.so": b"code",
        "casadi/libother.so": b"other code",
        "casadi/libuno.a": b"archive",
        "casadi/include/casadi.hpp": b"header",
        "pandas/core/tests/test_it.py": b"test",
        "pandas/core/api.py": b"program",
        "own/tests/kept.py": b"not of a package that is known",
    }
    for name, content in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(content)
    command = [sys.executable, str(ROOT / "deploy" / "slim.py"), str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    gone = {"casadi/libuno.a", "casadi/include/casadi.hpp", "pandas/core/tests/test_it.py"}
    left = {path.relative_to(tmp_path).as_posix(): path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert left == {name: content for name, content in files.items() if name not in gone}
    assert (tmp_path / "casadi/libipopt.so").is_symlink()


def test_the_image_keeps_the_pages_that_prefect_serves(tmp_path: Path) -> None:
    """Those of the first set; without their files the server has no pages, and says nothing."""
    import prefect

    packages = Path(prefect.__file__).parents[1]
    pages = [Path(path).relative_to(packages) for path in (prefect.__ui_static_path__, prefect.__ui_v2_static_path__)]
    for folder in pages:
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "index.html").write_text("page")
    subprocess.run([sys.executable, str(ROOT / "deploy" / "slim.py"), str(tmp_path)], check=True, capture_output=True)
    assert [(tmp_path / folder).exists() for folder in pages] == [True, False]
    assert (Path(prefect.__ui_static_path__) / "index.html").exists()


@pytest.mark.skipif(shutil.which("strip") is None, reason="needs binutils, as the stage that builds the image has")
def test_the_image_keeps_libraries_usable_without_their_symbols(tmp_path: Path) -> None:
    """A real extension module: smaller or equal, and it still works; what is no library is left alone."""
    import _cffi_backend

    module = tmp_path / Path(_cffi_backend.__file__).name
    shutil.copy(_cffi_backend.__file__, module)
    (tmp_path / "broken.so").write_bytes(b"no library")
    command = [sys.executable, str(ROOT / "deploy" / "slim.py"), str(tmp_path)]
    subprocess.run(command, check=True, capture_output=True, timeout=60)
    assert module.stat().st_size <= Path(_cffi_backend.__file__).stat().st_size
    assert (tmp_path / "broken.so").read_bytes() == b"no library"
    code = "import _cffi_backend; print(_cffi_backend.__file__)"
    used = subprocess.run(
        [sys.executable, "-c", code], env={"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True, check=True
    )
    assert used.stdout.strip() == str(module)


def test_entrypoint_reads_the_password_from_its_file(tmp_path: Path) -> None:
    (tmp_path / "password").write_text("from a file\n")
    environment = {"PATH": "/usr/bin:/bin", "PGPASSWORD_FILE": str(tmp_path / "password")}
    command = ["sh", str(ROOT / "deploy/entrypoint.sh"), "printenv", "PGPASSWORD"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout == "from a file\n"


def test_secrets_are_made_once_and_kept_from_others(tmp_path: Path) -> None:
    script = shutil.copy(ROOT / "deploy/secrets.sh", tmp_path)
    made = []
    for _ in range(2):
        subprocess.run(["sh", script], check=True)
        made.append({path.name: path.read_text() for path in (tmp_path / "secrets").iterdir()})
    assert made[0] == made[1]
    assert set(made[0]) == set(COMPOSE["secrets"])
    assert all(len(text) == 48 for text in made[0].values())
    assert len(set(made[0].values())) == len(made[0])
    assert (tmp_path / "secrets").stat().st_mode & 0o077 == 0
