"""Uncertain parameters from the posterior of an identification: its estimate.json, or its draws.

The estimate states a joint normal distribution, of the logarithm for parameters that are sought by it. Draws (the .nc
of `identify --sample`) give every parameter their own distribution, and a Gaussian copula the correlation of their
ranks.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from scipy import special, stats

from shoal.errors import InputError, needs_extra
from shoal.read_estimate import checked_joint, read_estimate
from shoal.response.inputs import Joint, UncertainParameter
from shoal.response.marginals import Frozen, Marginal, Normal
from shoal.scene import Scene
from shoal.trajectory import Array

ENDINGS = ".json", ".nc"
DRAWS = 20_000
"""Draws that are kept, evenly, of more."""
LEAST = 100
"""Draws of a distribution, at least."""
FAR = 4.0
"""Standard deviations from the middle at which the scene must accept the values."""
ALIKE = 0.999999
"""Largest correlation: rounding makes larger ones contradict each other."""


def is_source(given: str) -> bool:
    """Return whether it names such a file."""
    return given.endswith(ENDINGS) and "=" not in given and "~" not in given


def from_posterior(file: str, scene: Scene) -> list[UncertainParameter]:
    """The parameters of the machine, named by their paths. Raises InputError."""
    path = Path(file)
    joint_data, left, draws = _draws(path) if path.suffix == ".nc" else (*_estimate(path), None)
    known: dict[str, dict[str, Any]] = joint_data["parameters"]
    if not known:
        raise InputError(f"vary: {file}: nothing of it is of the machine, only {', '.join(left) or 'nothing at all'}")
    if listed := ", ".join(name for name, one in known.items() if not one["known"]):
        raise InputError(f"vary: {file}: {listed} is not known from what was measured; fix it and identify anew")
    names = {name: one["path"] or name for name, one in known.items()}
    if draws is None:
        marginals, matrix = _normal(joint_data, path.name)
    else:
        marginals, matrix = _drawn([draws[name] for name in known], path.name)
    pairs = {
        (names[one], names[other]): float(np.clip(matrix[i, j], -ALIKE, ALIKE))
        for (i, one), (j, other) in combinations(enumerate(known), 2)
    }
    joint = Joint(path.name, pairs, joint_data["ties"], names, joint_data["constants"], left)
    found = [
        UncertainParameter(names[name], marginal, {one["path"]: 1.0} if one["path"] else {}, joint)
        for (name, one), marginal in zip(known.items(), marginals, strict=True)
    ]
    _accepted(found, scene, file)
    return found


def _estimate(path: Path) -> tuple[dict[str, Any], dict[str, str]]:
    """Read an estimate. Raises InputError."""
    data = read_estimate(path, "vary", "joint")
    if data.get("status") != "ok":
        raise InputError(
            f"vary: {path}: its verdict is {data['verdict']!r}: the spread of its values cannot be trusted"
        )
    return checked_joint(data["joint"], "vary", path), data["left_out"]


def _draws(path: Path) -> tuple[dict[str, Any], dict[str, str], dict[str, Array]]:
    """Read draws. Raises InputError."""
    with needs_extra("notebook"):
        import xarray as xr
    try:
        with xr.open_dataset(path, engine="scipy") as data:
            about = dict(data.attrs)
            joint_data, left = json.loads(about["joint"]), json.loads(about["left_out"])
            draws = {name: np.asarray(data[name].values, dtype=float).ravel() for name in joint_data["parameters"]}
    except OSError as error:
        raise InputError(f"vary: {path} cannot be read: {error.strerror or error}") from None
    except (ValueError, KeyError, TypeError):
        raise InputError(
            f"vary: {path} holds no draws; give what `shoal identify --sample --out FILE.nc` wrote"
        ) from None
    if not about.get("converged"):
        raise InputError(f"vary: {path}: its draws have not converged; draw more of them")
    count = len(next(iter(draws.values()), []))
    if draws and count < LEAST:
        raise InputError(f"vary: {path}: needs at least {LEAST} draws, found {count}")
    step = -(-count // DRAWS)
    return checked_joint(joint_data, "vary", path), left, {name: of[::step] for name, of in draws.items()}


def _normal(joint_data: Mapping[str, Any], source: str) -> tuple[list[Marginal], Array]:
    known, covariance = list(joint_data["parameters"].values()), joint_data["covariance"]
    middle = np.array([one["value"] for one in known])
    logarithmic = np.array([one["logarithmic"] for one in known])
    # d log(x) = dx / x, as the covariance of the values was made from that of the logarithms.
    slope = np.where(logarithmic, 1 / np.where(logarithmic, middle, 1.0), 1.0)
    spread = slope[:, None] * covariance * slope
    deviation = np.sqrt(np.maximum(np.diag(spread), 0.0))
    if not np.all(deviation > 0):
        name = list(joint_data["parameters"])[int(np.argmin(deviation))]
        raise InputError(f"vary: {source}: {name} has no spread")
    marginals: list[Marginal] = []
    for one, at, off in zip(known, middle.tolist(), deviation.tolist(), strict=True):
        kind = "lognormal" if one["logarithmic"] else "normal"
        stated = at * off if one["logarithmic"] else off
        text = f"{kind}({at:.6g},{stated:.3g}) of {source}"
        marginals.append(Normal(np.log(at) if one["logarithmic"] else at, off, text, one["logarithmic"]))
    return marginals, spread / (deviation[:, None] * deviation)


def _drawn(draws: list[Array], source: str) -> tuple[list[Marginal], Array]:
    text = f"{len(draws[0])} draws of {source}"
    if any(np.ptp(one) == 0 for one in draws):
        raise InputError(f"vary: {source}: all draws of a parameter are the same")
    scores = [special.ndtri((stats.rankdata(one) - 0.5) / len(one)) for one in draws]
    return [Frozen(_Draws(one), text) for one in draws], np.atleast_2d(np.corrcoef(scores))


class _Draws:
    """Draws by what distributions of scipy answer: their quantiles, straight between neighbours."""

    def __init__(self, draws: Array) -> None:
        self._sorted = np.sort(draws)
        self._at = (np.arange(len(draws)) + 0.5) / len(draws)

    def ppf(self, x: Array) -> Array:
        """Quantiles at probabilities x."""
        return np.asarray(np.interp(x, self._at, self._sorted))

    def mean(self) -> float:
        """The mean."""
        return float(self._sorted.mean())

    def std(self) -> float:
        """The standard deviation."""
        return float(self._sorted.std())


def _accepted(found: list[UncertainParameter], scene: Scene, file: str) -> None:
    """Check that the scene has these fields and accepts likely values. Raises InputError."""
    ends = [one.marginal.value(one.marginal.quantile(special.ndtr(np.array([-FAR, FAR])))) for one in found]
    for one, (low, high) in zip(found, ends, strict=True):
        for path in one.factors:
            for value in (low, high):
                try:
                    scene.with_values({path: float(value)})
                except InputError as error:
                    raise InputError(f"vary: {file}: {path}: does not fit scene {scene.name}: {error}") from None
    for path in found[0].joint.ties if found[0].joint else ():
        try:
            scene.value(path)
        except InputError as error:
            raise InputError(f"vary: {file}: {path}: does not fit scene {scene.name}: {error}") from None
