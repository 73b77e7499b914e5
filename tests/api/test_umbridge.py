"""UM-Bridge 1.0 as its public client speaks it, and what its published conformity checks ask for.

The checks are after testing/protocol_conformity_1.0/test_model_schema.py of UM-Bridge.
"""

from __future__ import annotations

import json
from typing import Any

import httpx
import numpy as np
import pytest
import umbridge
from shoal.engines import get_engine
from shoal.scene import Scene

Machine = dict[str, Any]
NAMES = ("tip-motion", "misfit")


@pytest.fixture(scope="module")
def config(machine: Machine) -> Machine:
    """A problem whose data the native engine computes from 0.3 rad."""
    return {
        "problem": {
            "name": "start",
            "scene": machine,
            "parameters": {
                "theta": {"path": "initial.OA.angle", "lower": -1.0, "upper": 1.0},
                "mass": {"path": "bodies.OA.mass", "lower": 0.1, "upper": 10.0, "scale": "log"},
            },
            "channels": [{"marker": "A", "quantity": axis} for axis in ("x", "y")],
            "source": {
                "kind": "engine",
                "engine": "gauss",
                "values": {"initial.OA.angle": 0.3, "bodies.OA.mass": 1.5},
                "stop": 0.4,
                "count": 4,
            },
        }
    }


def model(client: httpx.Client, name: str) -> umbridge.HTTPModel:
    return umbridge.HTTPModel(str(client.base_url).rstrip("/"), name)


def test_models(gauss: httpx.Client) -> None:
    assert umbridge.supported_models(str(gauss.base_url).rstrip("/")) == list(NAMES)
    tip = model(gauss, "tip-motion")
    assert tip.supports_evaluate()
    assert tip.supports_gradient()
    assert tip.supports_apply_jacobian()
    assert not tip.supports_apply_hessian()


def test_tip_motion_is_the_engines(gauss: httpx.Client, config: Machine, machine: Machine) -> None:
    tip = model(gauss, "tip-motion")
    assert tip.get_input_sizes(config) == [2]
    assert tip.get_output_sizes(config) == [8]
    scene = Scene.parse(machine).with_values({"initial.OA.angle": 0.4, "bodies.OA.mass": 2.0})
    local = get_engine("gauss").simulate(scene, np.linspace(0.1, 0.4, 4)).marker("A")
    assert tip([[0.4, 2.0]], config)[0] == pytest.approx(local.ravel(), abs=1e-12)


def test_misfit_and_its_gradient(gauss: httpx.Client, config: Machine) -> None:
    """Zero at the truth; elsewhere the gradient is that of the values, in the parameters' own units."""
    misfit = model(gauss, "misfit")
    assert misfit([[0.3, 1.5]], config)[0][0] == pytest.approx(0.0, abs=1e-20)
    gradient = misfit.gradient(0, 0, [[0.4, 2.0]], [1.0], config)
    for k, step in enumerate(1e-4 * np.eye(2)):
        above, below = (misfit([[0.4 + s * step[0], 2.0 + s * step[1]]], config)[0][0] for s in (1, -1))
        assert gradient[k] == pytest.approx((above - below) / 2e-4, rel=1e-3, abs=1e-9)


def test_jacobian_both_ways(gauss: httpx.Client, config: Machine) -> None:
    """sens J vec is one number, whichever is applied first."""
    tip, point = model(gauss, "tip-motion"), [[0.4, 2.0]]
    sens, vec = np.linspace(-1.0, 1.0, 8), np.array([0.7, -0.2])
    forward = tip.apply_jacobian(0, 0, point, vec.tolist(), config)
    backward = tip.gradient(0, 0, point, sens.tolist(), config)
    assert sens @ forward == pytest.approx(np.array(backward) @ vec, rel=1e-12)


def test_scene_with_its_parameters(gauss: httpx.Client, machine: Machine) -> None:
    """A scene, paths and times make a model too."""
    parameters = {"angle": {"path": "initial.OA.angle", "lower": -1.0, "upper": 1.0}}
    config = {"scene": machine, "parameters": parameters, "times": [0.0, 0.1, 0.3]}
    tip = model(gauss, "tip-motion")
    assert tip.get_output_sizes(config) == [6]
    assert tip([[0.5]], config)[0][:2] == pytest.approx([np.cos(0.5), np.sin(0.5)])


@pytest.mark.parametrize(
    ("path", "changes", "error"),
    [
        ("Evaluate", {"name": "wrong_model_name"}, "ModelNotFound"),
        ("Evaluate", {"input": [[0.1, 1.0, 1.0]]}, "InvalidInput"),
        ("Evaluate", {"input": "x"}, "InvalidInput"),
        ("Evaluate", {"config": {"problem": "../x"}}, "InvalidInput"),
        ("Evaluate", {"config": {"surprise": 1}}, "InvalidInput"),
        ("Gradient", {"input": [[0.1]]}, "InvalidInput"),
        ("Gradient", {"inWrt": 1}, "InvalidInput"),
        ("Gradient", {"outWrt": 1}, "InvalidInput"),
        ("Gradient", {"sens": [0.0]}, "InvalidInput"),
        ("ApplyJacobian", {"vec": [0.0]}, "InvalidInput"),
    ],
)
def test_errors_have_the_protocols_form(
    gauss: httpx.Client, config: Machine, path: str, changes: Machine, error: str
) -> None:
    call = {"name": "tip-motion", "config": config, "input": [[0.1, 1.0]], "sens": [0.0] * 8, "vec": [0.0, 0.0]}
    # The clients post without a content type.
    answer = gauss.post(f"/{path}", content=json.dumps(call | changes).encode())
    assert "content-type" not in answer.request.headers
    assert answer.status_code == 400
    assert set(answer.json()) == {"error"}
    assert set(answer.json()["error"]) == {"type", "message"}
    assert answer.json()["error"]["type"] == error


def test_the_default_model(gauss: httpx.Client) -> None:
    """Without a configuration a model stands for the paper's first case: two angles, fifty samples of the tip."""
    tip = model(gauss, "tip-motion")
    assert (tip.get_input_sizes(), tip.get_output_sizes()) == ([2], [100])
    assert len(tip([[0.0, 0.0]])[0]) == 100


@pytest.mark.parametrize("path", ["Evaluate", "ModelInfo", "InputSizes", "ApplyHessian"])
def test_unknown_model_without_input(gauss: httpx.Client, path: str) -> None:
    answer = gauss.post(f"/{path}", json={"name": "wrong_model_name"})
    assert answer.status_code == 400
    assert answer.json()["error"]["type"] == "ModelNotFound"


def test_conformity(gauss: httpx.Client) -> None:
    """The shapes that the published checks ask of the default model at zero."""
    call = {"name": "tip-motion", "config": {}, "input": [[0.0, 0.0]], "outWrt": 0, "inWrt": 0}
    gradient = gauss.post("/Gradient", json={**call, "sens": [0.0] * 100}).json()
    assert gradient == {"output": [0.0, 0.0]}
    product = gauss.post("/ApplyJacobian", json={**call, "vec": [0.0, 0.0]}).json()
    assert product == {"output": [0.0] * 100}
    hessian = gauss.post("/ApplyHessian", json={"name": "tip-motion"})
    assert (hessian.status_code, hessian.json()["error"]["type"]) == (400, "UnsupportedFeature")
    assert gauss.get("/Info").json() == {"protocolVersion": 1.0, "models": list(NAMES)}
    support = gauss.post("/ModelInfo", json={"name": "tip-motion"}).json()
    assert support == {"support": {"Evaluate": True, "Gradient": True, "ApplyJacobian": True, "ApplyHessian": False}}
