"""Machines whose loads follow signals, as fields of scenes."""

from __future__ import annotations

import math
from typing import Any

FINE = {"relative_tolerance": 1e-12, "absolute_tolerance": 1e-12, "duration": 4.0}
SIDE = 0.01


def rod(length: float, mass: float) -> dict[str, Any]:
    return {"kind": "rod", "length": length, "height": SIDE, "width": SIDE, "density": mass / (length * SIDE**2)}


def ground(*point: float) -> dict[str, Any]:
    return {"body": "ground", "point": list(point)}


def pendulum(torque: str = "60*(ref - phi) - 6*rate(hinge)", **signals: Any) -> dict[str, Any]:
    """A hanging rod with a motor in its hinge; phi from hanging down."""
    return {
        "name": "pd-pendulum",
        "bodies": {"arm": rod(0.8, 2.0)},
        "joints": {"hinge": {"first": ground(0, 0), "second": {"body": "arm"}}},
        "loads": {"motor": {"kind": "torque", "at": {"body": "arm"}, "torque": torque}},
        "signals": {"ref": 1.0, "phi": "angle(hinge) + pi/2", **signals},
        "markers": {"tip": {"body": "arm", "point": "end"}},
        "initial": {"arm": {"angle": 0.2 - math.pi / 2}},
        "solver": {**FINE, "integrator": "dop853"},
    }


def cart_pole() -> dict[str, Any]:
    return {
        "name": "cart-pole-lqr",
        "bodies": {"cart": {"kind": "point-mass", "mass": 1.0}, "pole": rod(0.6, 0.2)},
        "joints": {
            "rail": {"kind": "slider", "first": ground(0, 0), "second": {"body": "cart"}},
            "pin": {"first": {"body": "cart"}, "second": {"body": "pole"}},
        },
        "signals": {"x": "slide(rail)", "phi": "pi/2 - angle(pole)", "v": "slide_rate(rail)", "w": "-rate(pole)"},
        "loads": {
            "drive": {
                "kind": "force",
                "at": {"body": "cart"},
                "force": [1, 0],
                "scale": "10*x + 57.644549*phi + 10.174577*v + 11.597209*w",
            }
        },
        "markers": {"cart": {"body": "cart"}, "tip": {"body": "pole", "point": "end"}},
        "initial": {"pole": {"angle": math.pi / 2 - 0.3}},
        "solver": {**FINE, "integrator": "dop853"},
    }


def two_link() -> dict[str, Any]:
    """Torques that make the error of each angle obey e'' + Kd e' + Kp e = 0, by the exact model of the arm."""
    return {
        "name": "two-link-computed-torque",
        "bodies": {"upper": rod(0.5, 2.0), "fore": rod(0.4, 1.5)},
        "joints": {
            "shoulder": {"first": ground(0, 0), "second": {"body": "upper"}},
            "elbow": {"first": {"body": "upper", "point": "end"}, "second": {"body": "fore"}},
        },
        "signals": {
            "q1": "angle(shoulder)",
            "q2": "angle(elbow)",
            "v1": "rate(shoulder)",
            "v2": "rate(elbow)",
            "a1": "-1.2*sin(2*t) + 20*(0.6*cos(2*t) - v1) + 100*(0.3*sin(2*t) - q1)",
            "a2": "3.6*cos(3*t) + 8*(1.2*sin(3*t) - v2) + 100*(0.5 - 0.4*cos(3*t) - q2)",
            "k": "1.5*0.5*0.2",
            "m12": "1.5*0.16/3 + k*cos(q2)",
            "m11": "2*0.25/3 + 1.5*0.25 + 1.5*0.16/3 + 2*k*cos(q2)",
            "far": "1.5*0.2*9.81*cos(q1 + q2)",
            "u1": "m11*a1 + m12*a2 - k*sin(q2)*(2*v1*v2 + v2**2) + (2*0.25 + 1.5*0.5)*9.81*cos(q1) + far",
            "u2": "m12*a1 + 1.5*0.16/3*a2 + k*sin(q2)*v1**2 + far",
        },
        "loads": {
            "first": {"kind": "torque", "at": {"body": "upper"}, "torque": "u1"},
            "second": {"kind": "torque", "at": {"body": "fore"}, "torque": "u2", "reaction": {"body": "upper"}},
        },
        "markers": {"elbow": {"body": "upper", "point": "end"}, "hand": {"body": "fore", "point": "end"}},
        "initial": {"upper": {"angle": 0.2, "rate": 0.6}, "fore": {"angle": 0.2, "rate": 0.6}},
        "solver": {**FINE, "integrator": "dop853"},
    }


def ball() -> dict[str, Any]:
    """A ball in wind: its drag is along the motion against the air."""
    drag = {"kind": "force", "at": {"body": "ball"}}
    return {
        "name": "thrown-ball-in-wind",
        "bodies": {"ball": {"kind": "point-mass", "mass": 0.145}},
        "joints": {},
        "signals": {
            "along": "velocity(ball, x) - 5*tanh(t/0.5)",
            "up": "velocity(ball, y)",
            "size": "-0.004*sqrt(along**2 + up**2)",
        },
        "loads": {
            "x": {**drag, "force": [1, 0], "scale": "size*along"},
            "y": {**drag, "force": [0, 1], "scale": "size*up"},
        },
        "markers": {"ball": {"body": "ball"}},
        "initial": {"ball": {"position": [0, 1], "velocity": [30, 20]}},
        "solver": {**FINE, "integrator": "dop853"},
    }


def stribeck() -> dict[str, Any]:
    """A mass on a belt that sticks and slips by a smooth law."""
    return {
        "name": "stribeck-oscillator",
        "bodies": {"mass": {"kind": "point-mass", "mass": 1.0}},
        "joints": {"rail": {"kind": "slider", "first": ground(0, 0), "second": {"body": "mass"}}},
        "signals": {
            "slip": "0.2 - velocity(mass, x)",
            "mu": "(0.3 + 0.3*exp(-(slip/0.1)**2))*tanh(slip/0.005)",
        },
        "loads": {
            "belt": {"kind": "force", "at": {"body": "mass"}, "force": [10, 0], "scale": "mu"},
            "wall": {
                "kind": "force", "at": {"body": "mass"}, "force": [1, 0],
                "scale": "-100*position(mass, x) - 0.5*velocity(mass, x)",
            },
        },
        "markers": {"mass": {"body": "mass"}},
        "initial": {"mass": {"position": [0.02, 0]}},
        "solver": {**FINE, "integrator": "dop853"},
    }  # fmt: skip


AXIS = [1.0, 2.0, -0.5]
POST = {
    "kind": "spring", "first": {"body": "arm", "point": "end"}, "second": {"body": "bead"}, "length": 0.2,
    "stiffness": 50, "damping": 2,
}  # fmt: skip


def in_space(**loads: Any) -> dict[str, Any]:
    """A bead on a rod that turns about an oblique axis, with a torque about it and a force that turns with the rod."""
    turn = {"kind": "torque", "at": {"body": "arm"}, "axis": AXIS, "torque": "8*(0.3 - angle(hinge)) - 0.5*rate(hinge)"}
    push = {"kind": "force", "at": {"body": "arm", "point": "end"}, "force": [0, 1, 2], "follows": True}
    return {
        "name": "space",
        "dimensions": 3,
        "gravity": [0, 0, -9.81],
        "bodies": {"arm": rod(0.8, 2.0), "bead": {"kind": "point-mass", "mass": 0.3}},
        "joints": {
            "hinge": {"first": ground(0, 0, 0), "second": {"body": "arm"}, "axis": AXIS},
            "rail": {"kind": "slider", "first": {"body": "arm"}, "second": {"body": "bead"}, "axis": [1, 0, 0]},
        },
        "loads": loads or {
            "turn": turn,
            "push": {**push, "scale": "distance(bead, tip) - velocity(bead, z)*slide(rail) + 0.1*slide_rate(rail)"},
        },
        "markers": {"tip": {"body": "arm", "point": "end"}, "bead": {"body": "bead"}},
        "initial": {"arm": {"rotation": [0.1, 0.0, 0.0]}, "bead": {"position": [0.3, 0.0, 0.0]}},
        "solver": {**FINE, "duration": 1.0, "integrator": "dop853"},
    }  # fmt: skip


def on_rail(mass: float, friction: float, scale: str, **more: Any) -> dict[str, Any]:
    """A mass on a slider, without gravity, pushed by a formula."""
    return {
        "name": "on-rail",
        "gravity": [0, 0],
        "bodies": {"mass": {"kind": "point-mass", "mass": mass}},
        "joints": {"rail": {"kind": "slider", "first": ground(0, 0), "second": {"body": "mass"}, "friction": friction}},
        "loads": {"push": {"kind": "force", "at": {"body": "mass"}, "force": [1, 0], "scale": scale}},
        "markers": {"mass": {"body": "mass"}},
        "solver": {**FINE, "integrator": "dop853"},
        **more,
    }


def saturated(size: float = 1.0) -> dict[str, Any]:
    """PID with a limit and back-calculation as anti-windup."""
    return on_rail(
        1.5,
        0.8,
        "force",
        signals={
            "error": "1 - slide(rail)",
            "wanted": "30*error + integral - 9*slide_rate(rail)",
            "force": "min(max(wanted, -6), 6)",
        },
        states={"integral": {"rate": "40*error + (force - wanted)/0.25", "size": size}},
    )


def filtered() -> dict[str, Any]:
    """Force by a transfer function of the error, of the same degree above and below, in controllable form.

    20 (s/3 + 1)(s^2/400 + 1)/((s/30 + 1)(s/20 + 1)^2), with numerator b and denominator a divided by that of s^3.
    """
    num, den = [1 / 60, 0.05, 20 / 3, 20.0], [1 / 12000, 7 / 1200, 2 / 15, 1.0]
    a, b = [one / den[0] for one in den[1:]], [one / den[0] for one in num]
    c = [high - b[0] * low for high, low in zip(b[1:], a, strict=True)]
    return on_rail(
        1.0,
        0.0,
        f"{b[0]}*error + {c[0]}*x1 + {c[1]}*x2 + {c[2]}*x3",
        signals={"error": "1 - slide(rail)"},
        states={
            "x1": {"rate": f"error - {a[0]}*x1 - {a[1]}*x2 - {a[2]}*x3", "size": 0.01},
            "x2": {"rate": "x1", "size": 0.001},
            "x3": {"rate": "x2", "size": 0.0001},
        },
    )
