"""Lagrange's equations of a chain of links on the ground or on a cart, under feedback, for the judge alone.

The formulas of the scene are evaluated by Python itself, controllers follow their definitions.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.signal import tf2ss

Array = Any
GRAVITY = np.array([0.0, -9.81])
_MOST = 100_000
"""Evaluations of a run; a relay that slides along its switch takes more."""


class UndecidedError(Exception):
    """The judge has no motion of its own."""


class Lagrange:
    """A machine of `machines.drawn`: coordinates are the place of the cart, where there is one, and absolute angles."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        self.cart = "cart" in data["bodies"]
        links = [body for name, body in data["bodies"].items() if name != "cart"]
        self.mass = np.array([link["mass"] for link in links])
        self.inertia = np.array([link["inertia"] for link in links])
        self.length = np.array([2.0 * data["markers"][f"tip{k}"]["point"][0] for k in range(len(links))])
        self.cart_mass = data["bodies"]["cart"]["mass"] if self.cart else 0.0
        self.count, self.first = len(links), int(self.cart)
        self.loads = {name: dict(load) for name, load in data["loads"].items()}
        self.formulas = {name: _compiled(text) for name, text in data["signals"].items()}
        self.rates = {name: _compiled(state["rate"]) for name, state in data["states"].items()}
        self.start = {name: state["start"] for name, state in data["states"].items()}
        for name, controller in data["controllers"].items():
            _CONTROLLERS[controller["kind"]](self, name, controller)
        for load in self.loads.values():
            load["law"] = _compiled(load["torque" if load["kind"] == "torque" else "scale"])
        angles = [data["initial"][f"link{k}"]["angle"] for k in range(self.count)]
        self.places = np.array([0.0] * self.first + angles)
        self.anchor = np.array([data["ground_points"]["anchor"][axis] for axis in "xy"])

    def run(self, times: Array, tolerance: float) -> Array:
        """Return the places of the cart and of the tips at some times, (times, markers, 2). Raises UndecidedError."""
        size, calls = len(self.places), 0

        def slope(t: float, y: Array) -> Array:
            nonlocal calls
            calls += 1
            if calls > _MOST:
                raise UndecidedError("the judge needs too many steps")
            return self._slope(t, y[:size], y[size : 2 * size], y[2 * size :])

        begin = np.concatenate([self.places, np.zeros(size), list(self.start.values())])
        found = solve_ivp(
            slope, (0.0, times[-1]), begin, "DOP853", times, rtol=tolerance, atol=tolerance, max_step=0.01
        )
        if not found.success or not np.all(np.isfinite(found.y)):
            raise UndecidedError("the judge's motion ends")
        return np.array([self._markers(q) for q in found.y[:size].T])

    def _slope(self, t: float, q: Array, v: Array, states: Array) -> Array:
        named = _Named(self, t, q, v, states)
        _, slopes = self._ends(q)
        mass = np.zeros((len(q), len(q)))
        force = np.zeros(len(q))
        mass[0, 0] += self.cart_mass
        whirl = np.zeros(2)
        for k in range(self.count):
            arm = 0.5 * (slopes[k] + slopes[k + 1])
            turn = -self.length[k] * v[self.first + k] ** 2 * _unit(q[self.first + k])
            mass += self.mass[k] * arm.T @ arm
            mass[self.first + k, self.first + k] += self.inertia[k]
            force += self.mass[k] * arm.T @ (GRAVITY - whirl - 0.5 * turn)
            whirl = whirl + turn
        for load in self.loads.values():
            force += self._force(load, named.value(load["law"]), q, slopes)
        rates = [named.value(rate) for rate in self.rates.values()]
        return np.concatenate([v, np.linalg.solve(mass, force), rates])

    def _force(self, load: Mapping[str, Any], law: float, q: Array, slopes: list[Array]) -> Array:
        body = load["at"]["body"]
        if load["kind"] == "torque":
            force = np.zeros(len(q))
            force[self.first + int(body[4:])] = law
            if "reaction" in load:
                force[self.first + int(load["reaction"]["body"][4:])] = -law
            return force
        way = law * np.array(load["force"])
        if body == "cart":
            return way @ slopes[0]
        k = int(body[4:])
        part = 0.5 + load["at"]["point"][0] / self.length[k]
        if load.get("follows"):
            cos, sin = _unit(q[self.first + k])
            way = np.array([[cos, -sin], [sin, cos]]) @ way
        return way @ (slopes[k] + part * (slopes[k + 1] - slopes[k]))

    def _ends(self, q: Array) -> tuple[list[Array], list[Array]]:
        """Return the places of the first pin and of all tips, and their slopes by the coordinates."""
        place, slope = np.zeros(2), np.zeros((2, len(q)))
        if self.cart:
            place[0], slope[0, 0] = q[0], 1.0
        places, slopes = [place], [slope]
        for k in range(self.count):
            cos, sin = _unit(q[self.first + k])
            slope = slopes[-1].copy()
            slope[:, self.first + k] += self.length[k] * np.array([-sin, cos])
            places.append(places[-1] + self.length[k] * np.array([cos, sin]))
            slopes.append(slope)
        return places, slopes

    def _markers(self, q: Array) -> Array:
        places, _ = self._ends(q)
        return np.array(places if self.cart else places[1:])


def _unit(angle: float) -> Array:
    return np.array([np.cos(angle), np.sin(angle)])


def _ramp(x: float) -> float:
    x = min(max(x, 0.0), 1.0)
    return float(x**3 * (10.0 - 15.0 * x + 6.0 * x**2))


_FUNCTIONS: dict[str, Any] = {
    "sin": np.sin, "cos": np.cos, "tanh": np.tanh, "sqrt": np.sqrt, "exp": np.exp, "abs": abs, "min": min, "max": max,
    "ramp": _ramp, "step": lambda x: float(x >= 0.0), "sign": np.sign,
}  # fmt: skip


def _compiled(text: str | float) -> Any:
    return compile(str(text), "formula", "eval")


class _Named(dict[str, Any]):
    """Values of names at an instant; signals are evaluated when they are asked for, other names are parts."""

    def __init__(self, machine: Lagrange, t: float, q: Array, v: Array, states: Array) -> None:
        super().__init__(_FUNCTIONS, t=t, **dict(zip(machine.rates, states, strict=True)))
        self._machine = machine
        places, slopes = machine._ends(q)
        first = machine.first

        def turn(of: str, values: Array) -> float:
            k = int(of[-1])
            return float(values[first + k] - (values[first + k - 1] if of.startswith("pin") and k else 0.0))

        def away(of: str) -> tuple[Array, Array]:
            k = int(of[-1]) + 1
            return places[k] - machine.anchor, slopes[k] @ v

        def distance(of: str, _: str) -> float:
            return float(np.linalg.norm(away(of)[0]))

        def distance_rate(of: str, _: str) -> float:
            way, rate = away(of)
            return float(way @ rate / np.linalg.norm(way))

        self |= {
            "angle": lambda of: turn(of, q), "rate": lambda of: turn(of, v), "slide": lambda _: q[0],
            "slide_rate": lambda _: v[0], "distance": distance, "distance_rate": distance_rate,
            "position": lambda of, axis: places[int(of[-1]) + 1]["xy".index(axis)],
            "velocity": lambda of, axis: (slopes[int(of[-1]) + 1] @ v)["xy".index(axis)],
        }  # fmt: skip

    def __missing__(self, name: str) -> Any:
        formula = self._machine.formulas.get(name)
        if formula is None:
            return name
        self[name] = self.value(formula)
        return self[name]

    def value(self, formula: Any) -> float:
        """Return the value of a formula."""
        return float(eval(formula, {"__builtins__": {}}, self) if not callable(formula) else formula(self))


def _pid(machine: Lagrange, name: str, stated: Mapping[str, Any]) -> None:
    """Add kp e + the integral of ki e + kd times the filtered rate, within limits, with back-calculation."""
    error, rate = _compiled(stated["of"]), _compiled(stated.get("rate", "0"))
    low, high = stated.get("limits", (-np.inf, np.inf))
    lag, back = stated.get("filter"), stated.get("tracking")

    def wanted(now: _Named) -> float:
        slope = 0.0
        if stated.get("kd"):
            slope = now["judge-lag"] if "rate" in stated else (now.value(error) - now["judge-lag"]) / lag
        return float(stated["kp"] * now.value(error) + now["judge-integral"] + stated.get("kd", 0.0) * slope)

    def output(now: _Named) -> float:
        return float(min(max(wanted(now), low), high))

    def integral(now: _Named) -> float:
        returned = (output(now) - wanted(now)) / back if back else 0.0
        return float(stated["ki"] * now.value(error) + returned)

    def lagging(now: _Named) -> float:
        return float((now.value(rate if "rate" in stated else error) - now["judge-lag"]) / lag) if lag else 0.0

    machine.formulas[name] = output
    machine.rates |= {"judge-integral": integral, "judge-lag": lagging}
    machine.start |= {"judge-integral": 0.0, "judge-lag": 0.0}


def _state_feedback(machine: Lagrange, name: str, stated: Mapping[str, Any]) -> None:
    parts = [(_compiled(of), gain, about) for of, gain, about in zip(*(stated[key] for key in ("of", "gain", "about")),
                                                                     strict=True)]  # fmt: skip
    machine.formulas[name] = lambda now: -sum(gain * (now.value(of) - about) for of, gain, about in parts)


def _transfer_function(machine: Lagrange, name: str, stated: Mapping[str, Any]) -> None:
    """Add a realisation of scipy."""
    a, b, c, d = tf2ss(stated["num"], stated["den"])
    given, names = _compiled(stated["of"]), [f"judge-{k}" for k in range(len(a))]

    def memory(now: _Named) -> Array:
        return np.array([now[one] for one in names])

    machine.formulas[name] = lambda now: float(c[0] @ memory(now) + d[0, 0] * now.value(given))
    for k, one in enumerate(names):
        machine.rates[one] = lambda now, k=k: float(a[k] @ memory(now) + b[k, 0] * now.value(given))
        machine.start[one] = 0.0


_CONTROLLERS: dict[str, Callable[[Lagrange, str, Mapping[str, Any]], None]] = {
    "pid": _pid,
    "state-feedback": _state_feedback,
    "transfer-function": _transfer_function,
}
