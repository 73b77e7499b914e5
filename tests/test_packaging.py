"""The lock names exact versions only, the command line stays light, the state stays in its folder."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner
from numba import config
from shoal import home
from shoal.cli import main
from shoal.errors import InputError

ROOT = Path(__file__).parents[1]
HEAVY = ("numpy", "numba", "scipy", "matplotlib", "mlflow", "prefect", "exudyn", "casadi")


def test_lock_pins_every_package_with_hashes_and_names_no_host() -> None:
    text = (ROOT / "requirements.lock").read_text()
    packages = re.split(r"\n(?=\S)", text.strip())
    assert len(packages) > 50
    assert "://" not in text
    pinned = r"[a-z0-9][a-z0-9.-]*==[0-9][\w.+!]*( \\\n    --hash=sha256:[0-9a-f]{64})+"
    assert [package for package in packages if not re.fullmatch(pinned, package)] == []


def test_uv_in_the_makefile_is_pinned() -> None:
    assert re.search(r"^UV_VERSION := \d+\.\d+\.\d+$", (ROOT / "Makefile").read_text(), re.MULTILINE)


def test_help_imports_nothing_heavy() -> None:
    """The commands of all three packages are listed with their texts."""
    program = f"""
import sys
from click.testing import CliRunner
from shoal.cli import main
print(CliRunner().invoke(main, ["--help"]).stdout)
print([name for name in {HEAVY!r} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    *text, heavy = done.stdout.splitlines()
    assert heavy == "[]"
    commands = [line.split(maxsplit=1) for line in text[text.index("Commands:") + 1 :] if line]
    assert {"simulate", "run", "validate"} < {name for name, _ in commands}
    assert commands == sorted(commands)


@pytest.mark.by_day(1)
@pytest.mark.parametrize(
    ("command", "missing", "extra"),
    [
        ("report 0123", "mlflow", "pipeline"),
        ("serve gauss", "uvicorn", "services"),
        ("export-fmu single-pendulum", "pythonfmu", "fmu"),
        ("import pyproject.toml", "mujoco", "mujoco"),
    ],
)
def test_what_only_an_extra_brings_is_named_in_one_line(command: str, missing: str, extra: str) -> None:
    """The command itself is listed even so."""
    program = f"""
import sys
from shoal.cli import main

class Missing:
    def find_spec(name, *_):
        if name.split(".")[0] == {missing!r}:
            raise ModuleNotFoundError(name, name=name)

sys.meta_path.insert(0, Missing)
main(sys.argv[1:])
"""
    asked = [sys.executable, "-c", program]
    done = subprocess.run([*asked, *command.split()], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == f"shoal: {missing} is not installed; install shoal with its extra '{extra}'\n"
    listed = subprocess.run([*asked, "--help"], capture_output=True, text=True, check=True)
    assert f"  {command.split()[0]}" in listed.stdout


def test_home_is_the_folder_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path / "deep" / "home"))
    assert home.home() == tmp_path / "deep" / "home"
    assert home.home().is_dir()
    assert home.origin() == "$SHOAL_HOME"


def installed(folder: Path, environment: dict[str, str], code: str, cwd: Path) -> str:
    """What a program prints that imports the package from below a folder."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("SHOAL_", "XDG_"))}
    command = [sys.executable, "-c", f"import sys; sys.path.insert(0, {str(folder)!r}); {code}"]
    done = subprocess.run(command, env=kept | environment, cwd=cwd, capture_output=True, text=True, check=True)
    return done.stdout.strip()


@pytest.mark.parametrize("stated", [False, True])
@pytest.mark.parametrize("checkout", [False, True])
def test_home_is_the_same_from_every_folder(tmp_path: Path, checkout: bool, stated: bool) -> None:
    """Of a checkout by where the package lies, else of the user; kernels of the user are in the cache directory."""
    package = tmp_path / ("checkout/services" if checkout else "site-packages")
    shutil.copytree(ROOT / "services/shoal", package / "shoal", ignore=shutil.ignore_patterns("__pycache__"))
    if checkout:
        shutil.copy(ROOT / "pyproject.toml", tmp_path / "checkout")
    places = [tmp_path / "work", tmp_path / "elsewhere", package]
    for place in places[:2]:
        (place / ".shoal").mkdir(parents=True)
    environment = {"HOME": str(tmp_path / "user"), **({"SHOAL_HOME": str(tmp_path / "stated")} if stated else {})}
    code = "from shoal import home; print(home.home(), home.kernel_cache().parent, sep='\\n')"
    (found,) = {installed(package, environment, code, place) for place in places}
    data, cache = tmp_path / "user/.local/share/shoal", tmp_path / "user/.cache/shoal"
    if checkout:
        data = cache = tmp_path / "checkout/.shoal"
    if stated:
        data = cache = tmp_path / "stated"
    assert found.splitlines() == [str(data), str(cache)]


def test_a_state_folder_that_is_no_longer_used_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In one line, wherever it holds a library or runs; not an empty one, nor the home itself."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SHOAL_HOME")
    monkeypatch.setattr(home, "_of_checkout", lambda: tmp_path / "home")
    assert home.unused_home() == ""
    (tmp_path / ".shoal/library/scenes").mkdir(parents=True)
    assert CliRunner().invoke(main, ["scenes"]).stderr == f"note: {home.unused_home()}\n"
    assert home.unused_home().startswith(f"{tmp_path}/.shoal holds a library that this command does not use")
    (tmp_path / ".shoal/mlflow.db").touch()
    assert "holds a library and runs" in home.unused_home()
    monkeypatch.setattr(home, "_of_checkout", lambda: tmp_path / ".shoal")
    assert home.unused_home() == ""


def test_home_that_cannot_be_made_is_refused_and_kernels_go_elsewhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path / "file" / "home"))
    with pytest.raises(InputError, match="SHOAL_HOME"):
        home.home()
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(home.tempfile, "tempdir", str(tmp_path / "temporary"))
    assert home.kernel_cache().is_relative_to(tmp_path / "temporary")
    assert home.kernel_cache() == home.kernel_cache()


def test_temporary_folder_that_others_can_fill_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path / "file" / "home"))
    monkeypatch.setattr(home.tempfile, "tempdir", str(tmp_path))
    shared = tmp_path / f"shoal-{os.getuid()}"
    shared.mkdir()
    shared.chmod(0o777)
    assert not home.kernel_cache().is_relative_to(shared)


def test_the_choice_of_the_user_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SHOAL_HOME", str(tmp_path))
    monkeypatch.setenv("NUMBA_CACHE_DIR", "elsewhere")
    monkeypatch.setattr(config, "CACHE_DIR", config.CACHE_DIR)  # which it sets, too
    home.prepare_kernel_cache()
    assert os.environ["NUMBA_CACHE_DIR"] == "elsewhere"
    monkeypatch.delenv("NUMBA_CACHE_DIR")
    home.prepare_kernel_cache()
    assert os.environ["NUMBA_CACHE_DIR"] == str(home.kernel_cache())
