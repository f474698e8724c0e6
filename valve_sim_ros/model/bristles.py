# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stem on bristles: LuGre, or elastoplastic, in steps as long as its motion allows.

Bristles are stiff: a stuck stem hardly moves, and settles within milliseconds. Linearly implicit
steps (Rosenbrock) are stable at any length, so that only accuracy asks for short ones.
"""

import math
from typing import Any, NamedTuple

from numba import njit

from .stem import Friction

SLOW, FAST = 1e-3, 6.0
"""Speeds below which all of f_s - f_d is left, and beyond which nothing [v_s]."""
LEAST, SHARE = 1e-2, 0.03
"""The least that is left of friction [% of span, f_s]: where bristles carry nothing the law itself
runs away."""
TOLERANCE = 3e-4
"""Error of a step [% of span]: of x, of the bristles, of the speed over the fastest rate."""
FIRST, SHORTEST = 0.1, 2e-5
"""First step times the fastest rate, and shortest step [s]."""
LESS, MORE, SAFE = 0.2, 4.0, 0.9
"""A step is at least and at most so many times the one before, and so much of what would do."""
NOTHING = 1e-9
"""Time left [s] that is none."""

# Shampine (1982), Implementation of Rosenbrock methods, ACM TOMS 8, 93-113: order 4, embedded 3
GAMMA = 0.5
A_21, A_31, A_32 = 2.0, 48.0 / 25.0, 6.0 / 25.0
C_21, C_31, C_32 = -8.0, 372.0 / 25.0, 12.0 / 5.0
C_41, C_42, C_43 = -112.0 / 125.0, -54.0 / 125.0, -2.0 / 5.0
B_1, B_2, B_3, B_4 = 19.0 / 9.0, 1.0 / 2.0, 25.0 / 108.0, 125.0 / 108.0
E_1, E_2, E_4 = 17.0 / 54.0, 7.0 / 36.0, 125.0 / 108.0
G_1, G_2, G_3, G_4 = 0.5, -1.5, 121.0 / 50.0, 29.0 / 250.0
FIFTHS = 0.2
"""Its stages lie at the beginning of a step, its end, and twice at three fifths of it."""


class Bristles(NamedTuple):
    """Constants of the stem on its bristles.

    k/m [1/s^2], F_v/m [1/s], stiffness and damping [s] of the bristles relative to the spring, v_s
    [%/s], share of f_d up to which they do not slide, and friction.
    """

    inertia: float
    damping: float
    stiffness: float
    bristle_damping: float
    drop_speed: float
    elastic: float
    friction: Friction


class Bent(NamedTuple):
    """Stem on bent bristles: position [%], speed [%/s], deflection of the bristles [%]."""

    x: float
    v: float
    z: float


class Slopes(NamedTuple):
    """Derivatives of the stem's acceleration and of the bristles' rate by v and z."""

    a_v: float
    a_z: float
    z_v: float
    z_z: float


@njit(forceinline=True)
def friction_at(v: float, b: Bristles) -> tuple[float, float, float]:
    """Return friction at a speed, what of it is f_d, and its derivative by the speed."""
    f = b.friction
    static, dynamic = (f.static_up, f.dynamic_up) if v >= 0.0 else (f.static_down, f.dynamic_down)
    dynamic = max(dynamic, SHARE * static)
    ratio, rise = v / b.drop_speed, 0.0
    if abs(ratio) < FAST:
        rise = max(static - dynamic, 0.0)
        if abs(ratio) > SLOW:
            rise *= math.exp(-ratio * ratio)
    if dynamic + rise < LEAST:
        return LEAST, dynamic, 0.0
    return dynamic + rise, dynamic, -2.0 * ratio / b.drop_speed * rise


@njit(forceinline=True)
def sliding(z: float, v: float, level: float, dynamic: float, b: Bristles) -> tuple[float, float]:
    """Return the share of the bristles that slide, and its derivative by their force.

    All do, or none while they are bent but little.
    """
    if b.elastic <= 0.0:
        return 1.0, 0.0
    first = b.elastic * dynamic
    force, width = b.stiffness * abs(z), level - first
    if z * v <= 0.0 or force <= first:
        return 0.0, 0.0
    if force >= level:
        return 1.0, 0.0
    angle = math.pi * (force - first) / width
    return 0.5 - 0.5 * math.cos(angle), 0.5 * math.pi / width * math.sin(angle)


@njit(forceinline=True)
def rates(p2: float, bent: Bent, b: Bristles) -> tuple[float, float]:
    """Return the rates of the stem's speed [%/s^2] and of the bristles [%/s]."""
    x, v, z = bent
    level, dynamic, _ = friction_at(v, b)
    share, _ = sliding(z, v, level, dynamic, b)
    slope = v - b.stiffness * abs(v) * z / level * share
    force = p2 - b.friction.stiffness * x - b.stiffness * z - b.bristle_damping * slope
    return b.inertia * force - b.damping * v, slope


@njit(forceinline=True)
def slopes(bent: Bent, b: Bristles) -> Slopes:
    """Return the derivatives of `rates`."""
    _, v, z = bent
    level, dynamic, fall = friction_at(v, b)
    share, more = sliding(z, v, level, dynamic, b)
    load, speed = b.stiffness * z / level, abs(v)
    sign = 1.0 if v >= 0.0 else -1.0
    # where the bristles begin to slide depends on how far friction has fallen
    narrower = -more * (b.stiffness * abs(z) - b.elastic * dynamic) / (level - b.elastic * dynamic)
    z_v = 1.0 - load * (sign * share + speed * fall * (narrower - share / level))
    z_z = -speed * b.stiffness * (share / level + abs(load) * more)
    return Slopes(
        -b.inertia * b.bristle_damping * z_v - b.damping,
        -b.inertia * (b.stiffness + b.bristle_damping * z_z),
        z_v,
        z_z,
    )


@njit(forceinline=True)
def stage(right: Bent, s: Slopes, a_x: float, pole: float) -> Bent:
    """Return what of one stage solves (pole - Jacobian) g = right."""
    one, two = pole - s.a_v - a_x / pole, pole - s.z_z
    force = right.v + a_x * right.x / pole
    both = one * two - s.a_z * s.z_v
    v = (force * two + s.a_z * right.z) / (both if both != 0.0 else 1.0)
    return Bent((right.x + v) / pole, v, (right.z + s.z_v * v) / two)


@njit
def step(
    bent: Bent, target: float, excess: float, rate: float, h: float, b: Bristles
) -> tuple[Bent, float]:
    """Return the stem after `h` seconds, and the error in tolerances.

    The opening force is target + excess exp(-rate tau).
    """
    a_x, pole, per = -b.inertia * b.friction.stiffness, 1.0 / (GAMMA * h), 1.0 / h
    s = slopes(bent, b)
    push = -h * b.inertia * rate * excess
    fifth = math.exp(-FIFTHS * rate * h)
    most = fifth * fifth * fifth
    acceleration, slope = rates(target + excess, bent, b)
    g1 = stage(Bent(bent.v, acceleration + G_1 * push, slope), s, a_x, pole)
    there = Bent(bent.x + A_21 * g1.x, bent.v + A_21 * g1.v, bent.z + A_21 * g1.z)
    acceleration, slope = rates(target + excess * most * fifth * fifth, there, b)
    right = Bent(
        there.v + per * C_21 * g1.x,
        acceleration + G_2 * push + per * C_21 * g1.v,
        slope + per * C_21 * g1.z,
    )
    g2 = stage(right, s, a_x, pole)
    there = Bent(
        bent.x + A_31 * g1.x + A_32 * g2.x,
        bent.v + A_31 * g1.v + A_32 * g2.v,
        bent.z + A_31 * g1.z + A_32 * g2.z,
    )
    acceleration, slope = rates(target + excess * most, there, b)
    right = Bent(
        there.v + per * (C_31 * g1.x + C_32 * g2.x),
        acceleration + G_3 * push + per * (C_31 * g1.v + C_32 * g2.v),
        slope + per * (C_31 * g1.z + C_32 * g2.z),
    )
    g3 = stage(right, s, a_x, pole)
    right = Bent(
        there.v + per * (C_41 * g1.x + C_42 * g2.x + C_43 * g3.x),
        acceleration + G_4 * push + per * (C_41 * g1.v + C_42 * g2.v + C_43 * g3.v),
        slope + per * (C_41 * g1.z + C_42 * g2.z + C_43 * g3.z),
    )
    g4 = stage(right, s, a_x, pole)
    after = Bent(
        bent.x + B_1 * g1.x + B_2 * g2.x + B_3 * g3.x + B_4 * g4.x,
        bent.v + B_1 * g1.v + B_2 * g2.v + B_3 * g3.v + B_4 * g4.v,
        bent.z + B_1 * g1.z + B_2 * g2.z + B_3 * g3.z + B_4 * g4.z,
    )
    error = max(
        abs(E_1 * g1.x + E_2 * g2.x + E_4 * g4.x),
        abs(E_1 * g1.z + E_2 * g2.z + E_4 * g4.z),
        abs(E_1 * g1.v + E_2 * g2.v + E_4 * g4.v) / fastest(b),
    )
    return after, error / TOLERANCE


@njit(forceinline=True)
def fastest(b: Bristles) -> float:
    """Return how fast the stuck stem swings on its bristles [1/s]."""
    return math.sqrt(b.inertia * b.stiffness)


@njit
def through(
    bent: Bent,
    target: float,
    excess: float,
    rate: float,
    duration: float,
    b: Bristles,
    memory: Any,
) -> Bent:
    """Take the stem through `duration` seconds; `memory` keeps the length of its next step."""
    h, left = memory[1], duration
    # none carries more than static friction, however short of time a step is
    most_up = (b.friction.static_up + LEAST) / b.stiffness
    most_down = (b.friction.static_down + LEAST) / b.stiffness
    if math.isnan(h):
        h = FIRST / fastest(b)
    while left > NOTHING:
        part = min(h, left)
        if part < left < 2.0 * part:
            part = 0.5 * left
        after, error = step(bent, target, excess, rate, part, b)
        # a run that blew up must go on
        factor = min(max(SAFE * error**-0.25, LESS), MORE) if error > 1e-9 else MORE
        then = max(factor * part, SHORTEST)
        if error > 1.0 and part > SHORTEST:
            h = then
            continue
        bent = Bent(after.x, after.v, min(max(after.z, -most_down), most_up))
        left -= part
        excess *= math.exp(-rate * part)
        h = then if part == h else max(h, then)
    memory[1] = h
    return bent
