# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Flow through the restriction that is not proportional to the pressure difference."""

import math
from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter

REFERENCE, MIDDLE = 10.0, 50.0
"""Pressure difference, and lower pressure, at which T_g1 and T_g2 keep their meaning [%]."""
LEAST = 1e-6
"""Share of the reference below which pressures are equal."""


@njit
def flow(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, float]:
    """Return the rate that leads to the exact end of the law of flow."""
    target, rate = value
    exponent, critical, absolute = p
    share = abs(state.p2 - target) / REFERENCE
    if dt <= 0.0 or share < LEAST or share == math.inf:  # nothing flows, or a run that blew up
        return target, rate
    if critical > 0.0:
        down = MIDDLE + absolute
        up = down + REFERENCE
        speed = rate * REFERENCE / (up * math.cos(angle(down / up, critical)))
        # a search may ask for less than a vacuum
        inside, outside = max(state.p2 + absolute, LEAST), max(target + absolute, LEAST)
        end = abs(orifice(inside, outside, critical, speed, dt) - outside) / REFERENCE
    elif abs(exponent - 1.0) >= 1e-9:
        # D' = -(D_0 / T_g) (D / D_0)^n
        power = share ** (1.0 - exponent) - (1.0 - exponent) * rate * dt
        end = power ** (1.0 / (1.0 - exponent)) if power > 0.0 else 0.0
    else:
        return target, rate
    return target, math.log(share / min(max(end, LEAST), share)) / dt + 1e-12


@njit
def angle(ratio: float, critical: float) -> float:
    """Return the angle whose cosine is the share of the choked flow: 0 where it chokes.

    By ISO 6358 the share is sqrt(1 - ((r - b) / (1 - b))^2) at a ratio r of pressures beyond b.
    """
    return math.asin(min(max((ratio - critical) / (1.0 - critical), 0.0), 1.0))


@njit
def orifice(inside: float, outside: float, critical: float, speed: float, dt: float) -> float:
    """Return the absolute pressure in the chamber after the flow of an orifice [%].

    The ratio of pressures is b + (1 - b) sin(angle): when filling, the angle grows evenly.
    """
    fills = inside < outside
    ratio = inside / outside if fills else outside / inside
    if ratio < critical:  # choked: the flow hangs on the pressure before the orifice alone
        if fills:
            choked = min((critical - ratio) / speed, dt)
            ratio += speed * choked
        else:
            choked = min(math.log(critical / ratio) / speed, dt)
            ratio *= math.exp(speed * choked)
        dt -= choked
    if dt > 0.0:
        begin = angle(ratio, critical)
        turn = speed * dt / (1.0 - critical)
        if not fills:
            middle = begin + 0.5 * turn * (critical + (1.0 - critical) * math.sin(begin))
            turn *= critical + (1.0 - critical) * math.sin(min(middle, 0.5 * math.pi))
        ratio = critical + (1.0 - critical) * math.sin(min(begin + turn, 0.5 * math.pi))
    return outside * ratio if fills else outside / ratio


EFFECT = Effect(
    id='nonlinear_flow',
    title='Nonlinear flow into the chamber',
    stage='p1-p2',
    parameters=(
        EffectParameter(
            'exponent',
            'n',
            '-',
            0.6,
            0.3,
            2.0,
            'linear',
            'Flow grows with this power of p1 - p2; 0.5 is turbulent, 1 laminar',
            neutral=1.0,
            usual=(0.15, 0.75),
        ),
        EffectParameter(
            'critical_ratio',
            'b',
            '-',
            0.0,
            0.0,
            0.7,
            'linear',
            'Ratio of pressures at which the flow chokes: orifice by ISO 6358; 0: the power law',
            starts=(0.15, 0.35),
        ),
        EffectParameter(
            'absolute_pressure',
            'p_abs',
            '%',
            100.0,
            5.0,
            400.0,
            'log',
            'Absolute pressure at 0 % of p2, for the orifice; 152 with 3 to 15 psi',
            neutral=100.0,
            starts=(25.0, 70.0, 140.0),
        ),
    ),
    slots={'flow_slot': flow},
    longest_step=0.1,
    order=0,
    variants=(('exponent',), ('critical_ratio', 'absolute_pressure')),
    explanation='Turbulent flow through the restriction grows less than the pressure difference.',
    symptom='The rate of p2 is not proportional to p1 - p2: small steps are relatively faster.',
    confirm='Compare the time constants of small and of large steps about the same level.',
    twins={
        'quick_exhaust': 'that one acts in one direction and above a threshold: large steps down',
        'rate_limit': 'a limit leaves small steps alone: small and large steps',
    },
    references=('ISO 6358-1:2013, sonic conductance and critical back-pressure ratio',),
)
