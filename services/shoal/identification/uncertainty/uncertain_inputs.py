"""Uncertain inputs that a fit takes as given (signals, weighed masses), and their effect on the answer to first order.

No residual shows it: the model has the given values. The answer moves against what other values change of the channels.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from shoal.errors import InputError
from shoal.findings import Finding
from shoal.identification.conventions import NOTICED
from shoal.identification.findings import UNCERTAIN_INPUT
from shoal.identification.forward import ForwardModel
from shoal.identification.recording.units import unit
from shoal.identification.uncertainty.covariance import Noise
from shoal.identification.uncertainty.linearisation import Linearisation
from shoal.identification.uncertainty.model_error import difference, rms_of
from shoal.scene import Scene
from shoal.scene.function import MOST_ROWS, Function
from shoal.scene.measured import PARTS
from shoal.scene.smoothing import strength_of
from shoal.trajectory import Array

EXACT = 1e9
"""Freedom of a variance that is stated."""


@dataclass(frozen=True)
class Given:
    """moved: what independent standard deviations of it change of the residuals, (n, rows); freedom: of their size.

    what: in words, as the subject of a sentence; remedy: what would help, as the end of one
    one_of_many: whether it might as well have been something else, so that a systematic residual counts too
    """

    moved: Array
    freedom: float
    what: str
    remedy: str = ""
    one_of_many: bool = False

    def left(self, jacobian: Array, pseudo_inverse: Array) -> float:
        """Size of the residual that it leaves beside what the parameters follow, root mean square.

        Of rows that have derivatives: later ones of a chaotic motion are not compared.
        """
        rest = (self.moved - (self.moved @ pseudo_inverse.T) @ jacobian.T)[:, np.any(jacobian != 0.0, axis=1)]
        return float(np.sqrt(np.sum(rest**2) / max(rest.shape[1], 1)))

    def spread(self, at: Linearisation) -> Linearisation:
        """The linearisation with its share in the covariance."""
        noise = Noise(0.0, 0.0, self.freedom)
        parts = np.concatenate([at.parts, self._share(at)[None]])
        return replace(at, parts=parts, noise=(*at.noise, noise), given=at.given + 1)

    def findings(self, at: Linearisation, names: Sequence[str]) -> list[Finding]:
        """Return which parameters it makes less certain, at a linearisation that has its share, if any."""
        shares, variance = np.diag(self._share(at)), np.diag(at.covariance)
        widened = [
            name
            for name, part, all_ in zip(names, shares, variance, strict=True)
            if part > (1.0 - (1.0 - NOTICED) ** 2) * all_ > 0
        ]
        text = f"{self.what} widens the interval of {', '.join(widened)}{self.remedy}"
        return [UNCERTAIN_INPUT.found(text)] if widened else []

    def _share(self, at: Linearisation) -> Array:
        shifts = self.moved @ at.pseudo_inverse.T
        return np.asarray(shifts.T @ shifts)


_STEP = 1e-4
"""Of the differences by fields, of the size of each: the whole uncertainty may shift a long motion by turns."""
_NAMED = 3
"""Fields that a sentence lists."""


def uncertain_fields(model: ForwardModel, point: Array, predicted: Mapping[str, Array]) -> Given | None:
    """At a point whose channels by recording are known: two simulations of every recording for each uncertainty.

    None where the problem states none. Raises InputError where the scene cannot have them.
    """
    stated = model.problem.uncertainties
    if not stated:
        return None
    sizes = [f"{path} ({size:.2g} {unit(path)}".rstrip() + ")" for path, size in model.problem.uncertain.items()]
    more = f" and {len(sizes) - _NAMED} more" if len(sizes) > _NAMED else ""
    moved = np.array([_moved(model, point, predicted, entry) for entry in stated])
    return Given(moved, EXACT, f"what is uncertain of {', '.join(sizes[:_NAMED])}{more}")


def _moved(model: ForwardModel, point: Array, predicted: Mapping[str, Array], entry: Mapping[str, float]) -> Array:
    """Change of the residuals by one uncertainty, to first order, by differences on the sides that can be run."""
    at = {path: float(model.scene.value(path)) for path in entry}
    step = min(1.0, _STEP / max(abs(size / (at[path] or 1.0)) for path, size in entry.items()))
    sides = list[Array]()
    for part in (step, -step):
        try:
            scene = model.scene.with_values({path: at[path] + part * size for path, size in entry.items()})
        except InputError:
            continue
        rows = difference(model, point, predicted, scene)
        if rows is not None:
            sides.append(rows / part)
    if not sides:
        raise InputError(
            f"{model.problem.name}: uncertainties: the machine cannot be run with another {', '.join(entry)}; state no "
            "uncertainty of it, or set another value"
        )
    return np.asarray(np.mean(sides, axis=0))


_DRIVES = ("joints", "ground_points")
"""Parts of a scene whose functions of time are places and angles."""
_DRAWS = 24
"""Of the noise: their variance is that of the noise within a third."""
_FEWEST_DRAWS = 2
"""Draws that can be run at least."""
MATTERS = 0.03
"""Of what the residual leaves uncertain: what changes less, such as a signal's noise by its first draw, is nothing."""


def signal_noise(model: ForwardModel, point: Array, predicted: Mapping[str, Array], residual: Array) -> Given | None:
    """At a point whose channels by recording, and residuals (rows,), are known; None where no signal has noise.

    One simulation of every recording for each draw.
    """
    noisy = noisy_signals(model.scene)
    if not noisy:
        return None
    rng, moved = np.random.default_rng(0), list[Array]()
    least = MATTERS * rms_of(residual) / np.sqrt(len(residual))
    for _ in range(_DRAWS):
        drawn = {path: one.perturbed(noise, rng).model_dump(mode="json") for path, (one, noise) in noisy.items()}
        rows = difference(model, point, predicted, model.scene.with_values(drawn))
        if rows is None:
            continue
        moved.append(rows)
        if rms_of(moved[0]) < least:
            return None
    if len(moved) < _FEWEST_DRAWS:
        return None
    sizes = [f"{path} ({noise:.2g} {unit(path)}".rstrip() + ")" for path, (_, noise) in noisy.items()]
    shown = [path for path, (one, _) in noisy.items() if one.noise is None]
    remedy = f"; it is smoothed away if {' and '.join(shown)} state it as `noise`" if shown else ""
    scaled = np.array(moved) / np.sqrt(len(moved))
    return Given(scaled, float(len(moved)), f"the noise of {' and '.join(sizes)}", remedy)


def signals_of(scene: Scene) -> dict[str, Function]:
    """The functions of a scene that are tables, by path."""
    return {
        f"{part}.{name}.{field}": value
        for part in PARTS
        for name, member in getattr(scene, part).items()
        for field, value in member
        if isinstance(value, Function) and value.table is not None
    }


def noisy_signals(scene: Scene) -> dict[str, tuple[Function, float]]:
    """The functions of time of a scene that were measured with noise, and that, by path."""
    tables = {
        path: (signal, signal.noise if signal.noise is not None else _shown(path, signal))
        for path, signal in signals_of(scene).items()
    }
    return {path: found for path, found in tables.items() if found[1]}


def _shown(path: str, signal: Function) -> float:
    """The noise that the samples of a drive show, as far as they distinguish noise from motion."""
    if path.split(".")[0] not in _DRIVES or not signal.smooth:
        return 0.0
    times, values = np.array(signal.table).T
    return strength_of(times, values)[1]


_DEGREE = 7
"""Of the spline: at a third of the sampling rate it loses 0.4 %, a cubic one 6 %; the ninth rings at the ends."""
_FINER = 4
"""Rows of the finer table for each of the signal: the cubic spline through them then is that spline."""
_FEWEST_ROWS = 20
"""Rows, below which a table is drawn by hand rather than sampled."""
_APART = 0.1
"""Of the mean interval between samples: rows that are closer say where something happens, and are meant so."""


def between_samples(model: ForwardModel, point: Array, predicted: Mapping[str, Array], residual: Array) -> Given | None:
    """At a point whose channels by recording, and residuals (rows,), are known; None where no drive is too coarse.

    One simulation of every recording for each drive.
    """
    least = MATTERS * rms_of(residual) / np.sqrt(len(residual))
    moved, sizes = list[Array](), list[str]()
    for path, signal in signals_of(model.scene).items():
        # A force law is a function of a way.
        finer = None if path.endswith(".elastic") else finer_of(signal)
        if finer is None:
            continue
        drawn, size = finer
        try:
            rows = difference(model, point, predicted, model.scene.with_values({path: drawn.model_dump(mode="json")}))
        except InputError:
            continue
        if rows is not None and rms_of(rows) >= least:
            moved.append(rows)
            sizes.append(f"{path} ({size:.2g} {unit(path)}".rstrip() + ")")
    if not moved:
        return None
    what = f"what is not known of {' and '.join(sizes)} between its samples"
    return Given(np.array(moved), EXACT, what, "; sample the drive more finely", one_of_many=True)


def finer_of(signal: Function) -> tuple[Function, float] | None:
    """A table as a spline of high degree draws it, and by how much that is another function (root mean square).

    It is not farther off than the samples about the place are from each other. None for tables of few rows, of rows
    that lie together, and of more than leave place for a finer one.
    """
    # Importing scipy takes longer than most identifications take to look here.
    from scipy.interpolate import make_interp_spline

    times, values = np.array(signal.table).T
    gaps, finer = np.diff(times), min(_FINER, MOST_ROWS // len(times))
    if len(times) < _FEWEST_ROWS or finer < 2 or np.min(gaps) < _APART * np.mean(gaps):
        return None
    places = np.interp(np.arange(finer * len(gaps) + 1) / finer, np.arange(len(times)), times)
    near = np.lib.stride_tricks.sliding_window_view(np.pad(values, 1, mode="edge"), 4)
    reach = np.repeat(np.ptp(near, axis=1), finer)
    off = make_interp_spline(times, values, _DEGREE)(places) - signal(places)
    off[:-1] = np.clip(off[:-1], -reach, reach)
    table = tuple(zip(places.tolist(), (signal(places) + off).tolist(), strict=True))
    return signal.model_copy(update={"table": table, "smooth": True}), float(np.sqrt(np.mean(off**2)))


def taken_as_given(
    model: ForwardModel, point: Array, predicted: Mapping[str, Array], residual: Array
) -> tuple[list[Given], Given | None]:
    """At a point whose channels by recording, and residuals (rows,), are known: signals, and uncertain fields.

    Signals by their noise and by what they may do between their samples. Raises TimeIsUp, InputError.
    """
    signals = between_samples(model, point, predicted, residual), signal_noise(model, point, predicted, residual)
    return [one for one in signals if one is not None], uncertain_fields(model, point, predicted)
