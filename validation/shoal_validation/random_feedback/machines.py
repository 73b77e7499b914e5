"""Planar machines under feedback, drawn at random: chains of links on the ground or on a cart."""

from __future__ import annotations

from typing import Any

import numpy as np

Data = dict[str, Any]
DURATION = 1.5
INTEGRATORS = {"auto": None, "dop853": None, "rk4": 5e-4, "leapfrog": 2e-4, "radau5": None, "generalized-alpha": 5e-4}
"""Integrators and their steps [s]; without one they choose it."""


def drawn(seed: int) -> Data:
    """Return a scene as data."""
    return _Machine(np.random.default_rng(seed)).scene(f"feedback-{seed}")


class _Machine:
    """A machine while it is drawn."""

    def __init__(self, random: np.random.Generator) -> None:
        self.random = random
        self.count = int(random.integers(1, 4))
        self.cart = bool(random.random() < 0.5)
        self.names = ["t"]
        """What formulas may use so far: of what is named after, a cycle could be made."""
        for k in range(self.count):
            self.names += [f"angle(pin{k})", f"rate(pin{k})", f"angle(link{k})", f"rate(link{k})"]
            self.names += [f"{kind}(tip{k}, {axis})" for kind in ("position", "velocity") for axis in "xy"]
            self.names += [f"distance(tip{k}, anchor)", f"distance_rate(tip{k}, anchor)"]
        if self.cart:
            self.names += ["slide(rail)", "slide_rate(rail)"]

    def scene(self, name: str) -> Data:
        """Return the machine as data."""
        bodies, joints, markers, start = self._parts()
        signals: Data = {}
        states, controllers = self._states(), {}
        for k in range(int(self.random.integers(0, 3))):
            signals[f"law{k}"] = self._formula(2)
            self.names.append(f"law{k}")
        if self.random.random() < 0.6:
            controllers["control"] = self._controller()
            self.names += 3 * ["control"]
        integrator = str(self.random.choice(list(INTEGRATORS)))
        step = INTEGRATORS[integrator]
        return {
            "name": name, "bodies": bodies, "joints": joints, "markers": markers, "initial": start,
            "ground_points": {"anchor": {"x": 0.1, "y": 1.7}},
            "signals": signals, "states": states, "controllers": controllers, "loads": self._loads(),
            "solver": {"duration": DURATION, "integrator": integrator} | ({"step": step} if step else {}),
        }  # fmt: skip

    def _parts(self) -> tuple[Data, Data, Data, Data]:
        bodies: Data = {}
        joints: Data = {}
        markers: Data = {}
        start: Data = {}
        place, before = np.zeros(2), {"body": "ground", "point": [0.0, 0.0]}
        if self.cart:
            bodies["cart"] = {"kind": "rigid-body", "mass": self._number(0.5, 2.0), "inertia": 0.1}
            before = {"body": "cart", "point": [0.0, 0.0]}
            joints["rail"] = {"kind": "slider", "direction": 0.0, "second": before,
                              "first": {"body": "ground", "point": [0.0, 0.0]}}  # fmt: skip
            markers["cart"] = {"body": "cart"}
            start["cart"] = _at(place, 0.0)
        for k in range(self.count):
            mass, length, angle = self._number(0.5, 2.0), self._number(0.3, 0.6), self._number(-1.5, 1.5)
            way = length * np.array([np.cos(angle), np.sin(angle)])
            bodies[f"link{k}"] = {"kind": "rigid-body", "mass": mass, "inertia": mass * length**2 / 12}
            near, far = ({"body": f"link{k}", "point": [side * length / 2, 0.0]} for side in (-1, 1))
            joints[f"pin{k}"] = {"kind": "revolute", "first": before, "second": near}
            markers[f"tip{k}"] = far
            start[f"link{k}"] = _at(place + way / 2, angle)
            place, before = place + way, far
        return bodies, joints, markers, start

    def _states(self) -> Data:
        """Up to two states; each may depend on all."""
        names = [f"memory{k}" for k in range(int(self.random.integers(0, 3)))]
        self.names += names
        return {
            name: {"rate": f"{self._formula(1)} - {self._number(0.5, 20.0)}*{name}", "start": self._number(-1.0, 1.0)}
            for name in names
        }

    def _controller(self) -> Data:
        kind, of = self.random.choice(["pid", "state-feedback", "transfer-function"]), self._formula(1)
        if kind == "state-feedback":
            count = int(self.random.integers(1, 4))
            return {"kind": "state-feedback", "of": [self._leaf() for _ in range(count)],
                    "gain": [self._number(-3.0, 3.0) for _ in range(count)],
                    "about": [self._number(-0.5, 0.5) for _ in range(count)]}  # fmt: skip
        if kind == "transfer-function":
            poles = -self.random.uniform(1.0, 30.0, int(self.random.integers(1, 4)))
            den = np.poly(poles)
            num = self.random.uniform(-1.0, 1.0, int(self.random.integers(1, len(den) + 1))) * abs(den[-1])
            return {"kind": "transfer-function", "of": of, "num": num.tolist(), "den": den.tolist()}
        pid: Data = {"kind": "pid", "of": of, "kp": self._number(0.0, 5.0), "ki": self._number(0.0, 10.0)}
        if self.random.random() < 0.5:
            pid |= {"limits": [self._number(-3.0, -0.5), self._number(0.5, 3.0)]}
            if self.random.random() < 0.7:
                pid |= {"tracking": self._number(0.05, 0.5)}
        if self.random.random() < 0.6:
            pid |= {"kd": self._number(0.0, 0.5), "filter": self._number(0.01, 0.1)}
            if self.random.random() < 0.5:
                pid |= {"rate": self._formula(1)}
        return pid

    def _loads(self) -> Data:
        loads: Data = {}
        for k in range(self.count):
            law = f"{self._number(0.5, 5.0)}*tanh({self._formula(2)}) - {self._number(0.01, 0.3)}*rate(pin{k})"
            loads[f"motor{k}"] = {"kind": "torque", "at": {"body": f"link{k}"}, "torque": law}
            if k:
                loads[f"motor{k}"] |= {"reaction": {"body": f"link{k - 1}"}}
        if self.cart:
            law = f"{self._number(1.0, 10.0)}*tanh({self._formula(2)}) - slide_rate(rail)"
            loads["push"] = {"kind": "force", "at": {"body": "cart"}, "force": [1.0, 0.0], "scale": law}
        tip = {"body": f"link{self.count - 1}", "point": [0.1, 0.0]}
        force = self.random.uniform(-1.0, 1.0, 2).tolist()
        loads["wind"] = {"kind": "force", "at": tip, "force": force, "scale": self._formula(1),
                         "follows": bool(self.random.random() < 0.3)}  # fmt: skip
        return loads

    def _formula(self, depth: int) -> str:
        if depth == 0:
            return self._leaf()
        a, b = self._formula(depth - 1), self._formula(int(self.random.integers(0, depth)))
        smooth = [f"({a} + {b})", f"({a} - ({b}))", f"({a})*tanh({b})", f"sin({a})", f"cos({a})", f"tanh({a})",
                  f"sqrt(1 + ({a})**2)", f"exp(-({a})**2)", f"({a})/(2 + ({b})**2)"]  # fmt: skip
        kinks = [f"abs({a})", f"min({a}, {b})", f"max({a}, {b})", f"ramp({a})"]
        jumps = [f"step({a})", f"sign({a})*({b})"]
        which = self.random.choice(3, p=[0.75, 0.2, 0.05])
        return str(self.random.choice((smooth, kinks, jumps)[which]))

    def _leaf(self) -> str:
        name = str(self.random.choice(self.names))
        return f"sin({self._number(1.0, 8.0)}*t)" if name == "t" else f"{self._number(-2.0, 2.0)}*{name}"

    def _number(self, low: float, high: float) -> float:
        return round(float(self.random.uniform(low, high)), 3)


def _at(place: Any, angle: float) -> Data:
    return {"position": place.tolist(), "angle": angle, "velocity": [0.0, 0.0], "rate": 0.0}
