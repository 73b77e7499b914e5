"""The built-in scenes, and the way of a scene through YAML and back."""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml
from shoal.scene import Scene, load_scene, scene_names


def test_the_library_holds_the_scenes_of_the_paper_and_their_rigid_relatives() -> None:
    assert set(scene_names()) >= {
        "flexible-double-pendulum",
        "flexible-double-pendulum-case-2",
        "flexible-double-pendulum-hanging",
        "flexible-double-pendulum-hanging-case-2",
        "rigid-double-pendulum",
        "single-pendulum",
    }


@pytest.mark.parametrize("name", scene_names())
def test_a_built_in_scene_loads_under_its_own_name(name: str) -> None:
    scene = load_scene(name)
    assert scene.name == name
    assert scene.description


@pytest.mark.parametrize("name", scene_names())
@pytest.mark.by_day(3)
def test_a_scene_survives_yaml(name: str, tmp_path: Path) -> None:
    scene = load_scene(name)
    text = yaml.safe_dump(scene.model_dump(mode="json"))
    assert Scene.parse(yaml.safe_load(text)).fingerprint == scene.fingerprint
    file = tmp_path / "scene.yaml"
    file.write_text(text, encoding="utf-8")
    assert load_scene(str(file)) == scene


def test_an_edited_file_is_read_again(tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    for gravity in (-9.81, -1.62):
        scene = load_scene("single-pendulum").with_values({"gravity": [0.0, gravity]})
        file.write_text(yaml.safe_dump(scene.model_dump(mode="json")), encoding="utf-8")
        assert load_scene(str(file)).gravity == (0.0, gravity)


def test_a_scene_survives_yaml_as_plain_python_data() -> None:
    scene = load_scene("rigid-double-pendulum")
    data = yaml.safe_load(yaml.safe_dump(_listed(scene.model_dump())))
    assert Scene.parse(data).fingerprint == scene.fingerprint


def _listed(value: object) -> object:
    """Tuples as lists, which is all that YAML's safe dump can write."""
    if isinstance(value, dict):
        return {key: _listed(item) for key, item in value.items()}
    return [_listed(item) for item in value] if isinstance(value, tuple | list) else value


def test_the_fingerprint_changes_with_any_number() -> None:
    scene = load_scene("flexible-double-pendulum")
    changes = {"bodies.OA.length": 1.1, "gravity": [0.0, -9.8], "solver.step": 1e-4, "initial.OA.rate": 1e-9}
    prints = {scene.fingerprint, *(scene.with_values({path: value}).fingerprint for path, value in changes.items())}
    assert len(prints) == len(changes) + 1
    assert all(len(print_) == 12 for print_ in prints)


@pytest.mark.parametrize(
    ("name", "angles"),
    [
        # mechanics of the paper: case 1 (pi/4, pi/6), case 2 (pi/3, pi/4), and the same hanging
        ("flexible-double-pendulum", (0.7853981633974483, 0.5235987755982988)),
        ("flexible-double-pendulum-case-2", (1.0471975511965976, 0.7853981633974483)),
        ("flexible-double-pendulum-hanging", (-0.7853981633974483, -0.5235987755982988)),
        ("flexible-double-pendulum-hanging-case-2", (-1.0471975511965976, -0.7853981633974483)),
    ],
)
def test_the_cases_of_the_paper_start_at_their_angles(name: str, angles: tuple[float, float]) -> None:
    scene = load_scene(name)
    assert (scene.start("OA").angle, scene.start("AB").angle) == angles
    assert scene.start("OA").rate == scene.start("AB").rate == 0
    assert (scene.bodies["OA"].length, scene.bodies["AB"].length) == (1.0, 2.0)
    assert (scene.bodies["OA"].youngs_modulus, scene.bodies["AB"].youngs_modulus) == (2e8, 2e7)
    assert {body.density for body in scene.bodies.values()} == {5540.0}
