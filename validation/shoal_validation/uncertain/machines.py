"""Machines drawn at random: each a function of a few fields, of which some are uncertain.

All but one are closed forms.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import ellipj, ellipk
from shoal.trajectory import Array

Random = np.random.Generator
STEP = 0.01
"""Of the machine that is integrated [s]."""
Motion = Callable[[Array, Array], Array]
"""Fields, (fields, runs, 1), and instants [s], (instants,), to answers, (signals, runs, instants)."""


@dataclass(frozen=True)
class Kind:
    """fields: nominal values, positive; period: of one cycle [s]; motion: of these fields."""

    name: str
    fields: tuple[float, ...]
    period: float
    motion: Motion


def oscillator(random: Random) -> Kind:
    """m x'' + c x' + k x = 0 from x0, v0: k, m, damping ratio, x0, v0 > 0; place and velocity."""
    w, ratio = random.uniform(2, 20), 10 ** random.uniform(-3.5, -0.5)
    fields = (w * w, 1.0, ratio, random.uniform(0.2, 1), w * random.uniform(0.1, 1))

    def motion(f: Array, t: Array) -> Array:
        k, m, zeta, x0, v0 = f
        w0 = np.sqrt(k / m)
        wd = w0 * np.sqrt(1 - zeta**2)
        fade, c, s = np.exp(-zeta * w0 * t), np.cos(wd * t), np.sin(wd * t)
        b = (v0 + zeta * w0 * x0) / wd
        return np.stack([fade * (x0 * c + b * s), fade * (v0 * c - (zeta * w0 * b + wd * x0) * s)])

    return Kind("oscillator", fields, 2 * math.pi / w, motion)


def pendulum(random: Random) -> Kind:
    """Released at rest: length, gravity, angle up to 3.1 rad; x, y and the angle (Jacobi's elliptic functions)."""
    fields = (random.uniform(0.3, 3), 9.81, random.choice([random.uniform(0.1, 2), random.uniform(2, 2.9)]))

    def motion(f: Array, t: Array) -> Array:
        length, g, angle = f
        k = np.sin(angle / 2)
        sine = ellipj(ellipk(k * k) - np.sqrt(g / length) * t, k * k)[0]
        at = 2 * np.arcsin(np.clip(k * sine, -1, 1))
        return np.stack([length * np.sin(at), -length * np.cos(at), at])

    k = math.sin(fields[2] / 2)
    return Kind("pendulum", fields, 4 * ellipk(k * k) * math.sqrt(fields[0] / 9.81), motion)


def thrown_pendulum(random: Random) -> Kind:
    """Started at the bottom with a rate: it swings, or turns over; near the separatrix it is undecided.

    length, gravity, rate; x, y of its end: sin(angle / 2) = k sn(w t, k^2), and with k > 1 sn(k w t, 1 / k^2).
    """
    length = random.uniform(0.3, 3)
    w = math.sqrt(9.81 / length)
    fields = (
        length,
        9.81,
        2 * w * random.choice([random.uniform(0.3, 0.9), random.uniform(0.9, 1.1), random.uniform(1.1, 2)]),
    )

    def motion(f: Array, t: Array) -> Array:
        length, g, rate = f
        w = np.sqrt(g / length)
        k = rate / (2 * w)
        over = k > 1
        m = np.where(over, 1 / k**2, k**2)
        sn, cn, dn, _ = ellipj(np.where(over, k, 1.0) * w * t, m)
        half = np.where(over, sn, k * sn)
        cosine = np.where(over, cn, dn)
        return np.stack([length * 2 * half * cosine, -length * (1 - 2 * half**2)])

    return Kind("thrown pendulum", fields, 2 * math.pi / w, motion)


def rod(random: Random) -> Kind:
    """Free axial vibration of a rod, clamped at one end, let go from an end force: six modes, Kelvin-Voigt damping.

    E, density, length, damping ratio of the first mode, end strain; places of the end and the middle.
    """
    length, speed = random.uniform(0.5, 2), random.uniform(20, 60)
    fields = (speed**2, 1.0, length, 10 ** random.uniform(-4, -1), random.uniform(0.01, 0.1))

    def motion(f: Array, t: Array) -> Array:
        modulus, density, length, ratio, strain = f
        found = np.zeros((2, *np.broadcast_shapes(modulus.shape, t.shape)))
        for n in range(6):
            q = (n + 0.5) * np.pi
            w = q / length * np.sqrt(modulus / density)
            zeta = np.minimum(ratio * (2 * n + 1), 0.95)
            wd = w * np.sqrt(1 - zeta**2)
            course = np.exp(-zeta * w * t) * (np.cos(wd * t) + zeta / np.sqrt(1 - zeta**2) * np.sin(wd * t))
            part = 2 * strain * length * (-1) ** n / q**2 * course
            found += np.stack([part * math.sin(q), part * math.sin(q / 2)])
        return found

    return Kind("rod", fields, 4 * length / speed, motion)


def forced(random: Random) -> Kind:
    """m x'' + c x' + k x = a sin(p t) from rest, near resonance or not: k, m, ratio, a, p."""
    w = random.uniform(2, 15)
    p = w * random.choice([random.uniform(0.97, 1.03), random.uniform(0.3, 3)])
    fields = (w * w, 1.0, 10 ** random.uniform(-2.5, -0.7), random.uniform(0.5, 2), p)

    def motion(f: Array, t: Array) -> Array:
        k, m, zeta, a, p = f
        w0 = np.sqrt(k / m)
        wd = w0 * np.sqrt(1 - zeta**2)
        below = (w0**2 - p**2) ** 2 + (2 * zeta * w0 * p) ** 2
        s, c = a / m * (w0**2 - p**2) / below, -a / m * 2 * zeta * w0 * p / below
        b = (-p * s - zeta * w0 * c) / wd
        fade = np.exp(-zeta * w0 * t)
        steady = s * np.sin(p * t) + c * np.cos(p * t)
        return np.asarray(steady + fade * (b * np.sin(wd * t) - c * np.cos(wd * t)))[None]

    return Kind("forced oscillator", fields, 2 * math.pi / w, motion)


def bouncing(random: Random) -> Kind:
    """A ball that bounces: gravity, height, restitution. Every bounce is a kink."""
    fields = (9.81, random.uniform(0.2, 2), random.uniform(0.7, 0.99))

    def motion(f: Array, t: Array) -> Array:
        g, height, restitution = np.broadcast_arrays(*f)
        begin, v = np.sqrt(2 * height / g), np.sqrt(2 * g * height)
        found = np.broadcast_to(height - 0.5 * g * t**2, (len(g), len(t))).copy()
        for _ in range(60):
            v = restitution * v
            flight = 2 * v / g
            since = t - begin
            found = np.where((since >= 0) & (since < flight), v * since - 0.5 * g * since**2, found)
            begin = begin + flight
        return np.where(t >= begin, 0.0, found)[None]

    return Kind("bouncing ball", fields, 2 * math.sqrt(2 * fields[1] / 9.81), motion)


def rubbing(random: Random) -> Kind:
    """A mass on a spring with dry friction: k, m, friction over k, start. Half cycles shrink until it sticks."""
    w = random.uniform(2, 15)
    fields = (w * w, 1.0, 10 ** random.uniform(-2.5, -1), 1.0)

    def motion(f: Array, t: Array) -> Array:
        k, m, slip, start = np.broadcast_arrays(*f)
        w0 = np.sqrt(k / m)
        half = np.floor(w0 * t / np.pi)
        last = np.ceil((start / slip - 1) / 2)
        half, phase = np.minimum(half, last), np.where(half >= last, 0.0, w0 * t)
        middle = slip * (-1.0) ** half
        size = start - (2 * half + 1) * slip
        stuck = (-1.0) ** last * (start - 2 * last * slip)
        return np.asarray(np.where(half >= last, stuck, middle + size * np.cos(phase)))[None]

    return Kind("dry friction", fields, 2 * math.pi / w, motion)


def coupled(random: Random) -> Kind:
    """Three masses in a row with springs, undamped; stiffnesses of near values veer. Two places."""
    near = random.random() < 0.5
    k = random.uniform(20, 200) * (1 + (0.02 if near else 0.8) * random.uniform(-1, 1, 3))
    link = k[0] * (10 ** random.uniform(-2.5, -1) if near else random.uniform(0.2, 1))
    fields = (float(k[0]), float(k[1]), float(k[2]), float(link), 1.0)

    def motion(f: Array, t: Array) -> Array:
        one, two, three, link, start = (x[:, 0] for x in f)
        matrix = np.zeros((len(one), 3, 3))
        matrix[:, 0, 0], matrix[:, 1, 1], matrix[:, 2, 2] = one + link, two + 2 * link, three + link
        matrix[:, 0, 1] = matrix[:, 1, 0] = matrix[:, 1, 2] = matrix[:, 2, 1] = -link
        squares, modes = np.linalg.eigh(matrix)
        course = np.cos(np.sqrt(np.maximum(squares, 0))[:, :, None] * t)
        places = np.moveaxis(modes[:, [0, 2]], 1, 0)
        return np.asarray(np.einsum("rm,srm,rmt->srt", modes[:, 0] * start[:, None], places, course))

    return Kind("three masses", fields, 2 * math.pi / math.sqrt(fields[0]), motion)


def slider_crank(random: Random) -> Kind:
    """Crank at a constant rate: crank, rod, offset, rate; place of the slider."""
    crank, rate = random.uniform(0.2, 1), random.uniform(2, 20)
    fields = (crank, crank * random.uniform(1.3, 4), 0.1 * crank, rate)

    def motion(f: Array, t: Array) -> Array:
        crank, length, offset, rate = f
        height = crank * np.sin(rate * t) - offset
        return np.asarray(crank * np.cos(rate * t) + np.sqrt(np.maximum(length**2 - height**2, 0)))[None]

    return Kind("slider-crank", fields, 2 * math.pi / rate, motion)


def tumbling(random: Random) -> Kind:
    """A free body that spins about an axis near the middle one: I2, I3 over I1, rate, tilt; its three rates.

    Landau and Lifshitz, Mechanics, section 37.
    """
    fields = (
        random.uniform(1.2, 1.6),
        random.uniform(1.9, 2.4),
        random.uniform(2, 10),
        10 ** random.uniform(-2.5, -0.3),
    )

    def motion(f: Array, t: Array) -> Array:
        i2, i3, rate, tilt = f
        # Started with w1 = 0, w2 = rate cos(tilt), w3 = rate sin(tilt): M^2 > 2 E I2.
        w2, w3 = rate * np.cos(tilt), rate * np.sin(tilt)
        energy, square = i2 * w2**2 + i3 * w3**2, (i2 * w2) ** 2 + (i3 * w3) ** 2
        m = (i2 - 1) * (i3 * energy - square) / ((i3 - i2) * (square - energy))
        speed = np.sqrt((i3 - i2) * (square - energy) / (i2 * i3))
        sn, cn, dn, _ = ellipj(speed * t + ellipk(m), m)
        first = np.sqrt((i3 * energy - square) / (i3 - 1))
        second = np.sqrt((i3 * energy - square) / (i2 * (i3 - i2)))
        third = np.sqrt((square - energy) / (i3 * (i3 - 1)))
        return np.stack([first * cn, second * sn, third * dn])

    return Kind("tumbling body", fields, 2 * math.pi / fields[2], motion)


def double_pendulum(random: Random) -> Kind:
    """Two point masses on massless rods released from rest, by classical Runge-Kutta steps.

    l1, l2, m2 / m1, both angles; x and y of the end. Not in closed form: both sides use the same steps.
    """
    size = random.choice([0.3, 1.0, 2.0])
    fields = (1.0, random.uniform(0.5, 1.5), random.uniform(0.3, 2), *(size * random.uniform(0.3, 1, 2)))

    def rates(state: Array, l1: Array, l2: Array, ratio: Array) -> Array:
        a, b, u, v = state
        m1, m2, g = 1.0, ratio, 9.81
        s, c = np.sin(a - b), np.cos(a - b)
        below = m1 + m2 * s * s
        du = (-m2 * s * (l1 * u * u * c + l2 * v * v) - g * ((m1 + m2) * np.sin(a) - m2 * np.sin(b) * c)) / (l1 * below)
        dv = (s * ((m1 + m2) * l1 * u * u + m2 * l2 * v * v * c) + (m1 + m2) * g * (np.sin(a) * c - np.sin(b))) / (
            l2 * below
        )
        return np.stack([u, v, du, dv])

    def motion(f: Array, t: Array) -> Array:
        l1, l2, ratio, a, b = (x[:, 0] for x in np.broadcast_arrays(*f))

        def step(state: Array, h: float) -> Array:
            one = rates(state, l1, l2, ratio)
            two = rates(state + 0.5 * h * one, l1, l2, ratio)
            three = rates(state + 0.5 * h * two, l1, l2, ratio)
            return np.asarray(state + h / 6 * (one + 2 * two + 2 * three + rates(state + h * three, l1, l2, ratio)))

        state = np.stack([a, b, np.zeros_like(a), np.zeros_like(a)])
        found, now = np.empty((2, len(a), len(t))), 0
        for k, end in enumerate(t):
            while (now + 1) * STEP <= end:
                state, now = step(state, STEP), now + 1
            # From the grid, so that an answer is the same whichever other instants are asked for.
            one, other, *_ = step(state, float(end) - now * STEP)
            found[:, :, k] = l1 * np.sin(one) + l2 * np.sin(other), -l1 * np.cos(one) - l2 * np.cos(other)
        return found

    return Kind("double pendulum", fields, 2.0, motion)


KINDS = (
    *(oscillator, pendulum, thrown_pendulum, rod, forced, bouncing),
    *(rubbing, coupled, slider_crank, tumbling, double_pendulum),
)
"""The list."""
