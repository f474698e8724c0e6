# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue's effects with random sizes, each written in one or two physical ways.

Every function takes a random generator, the valve and the length of the record [s], and returns
what changes in the valve.
"""

from collections.abc import Callable

import numpy as np

from .physics import FAR, Physics
from .valves import either_sign, log_uniform

Rng = np.random.Generator
Changes = dict[str, float]


def ip_dead_time(rng: Rng, valve: Physics, length: float) -> Changes:
    """Delay the command."""
    return {'ip_delay': log_uniform(rng, 0.05, 3.0)}


def ip_lag(rng: Rng, valve: Physics, length: float) -> Changes:
    """Lag the inlet pressure, or the command before the play."""
    tau = log_uniform(rng, 0.05, 4.0)
    return {'ip_tau': tau} if rng.random() < 0.7 else {'smoothing': tau, 'smoothing_error': FAR}


def off_line(rng: Rng, device: str, zero: float, span: float, one: float) -> Changes:
    """Shift and stretch a device's line by up to this much; only one with this probability."""
    changes = {
        f'{device}_zero': either_sign(rng, 0.5, zero),
        f'{device}_span': 1.0 + either_sign(rng, 0.01, span),
    }
    if rng.random() < one:
        del changes[f'{device}_{rng.choice(("zero", "span"))}']
    return changes


def ip_calibration(rng: Rng, valve: Physics, length: float) -> Changes:
    """Shift or stretch the transducer's line, or both."""
    return off_line(rng, 'ip', 5.0, 0.12, one=0.5)


def ip_nonlinearity(rng: Rng, valve: Physics, length: float) -> Changes:
    """Bow the transducer's line by this much at mid span, by a parabola or a power."""
    bow = either_sign(rng, 1.0, 15.0)
    if rng.random() < 0.6:
        return {'ip_bow': bow}
    return {'ip_power': float(np.log(0.5 + 0.01 * bow) / np.log(0.5))}


def supply_limit(rng: Rng, valve: Physics, length: float) -> Changes:
    """Cap the inlet pressure."""
    return {'supply': rng.uniform(55.0, 95.0)}


def positioner_loop(rng: Rng, valve: Physics, length: float) -> Changes:
    """Feed the position back, with integral action or rails in some."""
    changes = {'loop_gain': log_uniform(rng, 0.3, 3.0)}
    if rng.random() < 0.25:
        changes['loop_reset'] = 1.0 / rng.uniform(15.0, 80.0)
    if rng.random() < 0.4 or 'loop_reset' in changes:
        changes['loop_low'] = -float(rng.choice((0.0, 5.0, 20.0)))
        changes['loop_high'] = 100.0 + float(rng.choice((0.0, 5.0, 30.0)))
    if 'loop_reset' in changes and rng.random() < 0.4:
        changes['loop_windup'] = rng.uniform(10.0, 40.0)
    return changes


def tubing_dead_time(rng: Rng, valve: Physics, length: float) -> Changes:
    """Delay the pressure on its way to the chamber."""
    return {'tube_delay': log_uniform(rng, 0.05, 3.0)}


def air_leak(rng: Rng, valve: Physics, length: float) -> Changes:
    """Leak at a rate proportional to p2, or as an orifice does."""
    loss = rng.uniform(0.03, 0.30)
    return {'leak': loss / (1.0 - loss) / valve.T_g1, 'leak_orifice': float(rng.random() < 0.25)}


def chamber_volume(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let the chamber grow with the stroke; half of them compress the air they displace."""
    changes = {'volume': log_uniform(rng, 0.3, 3.0)}
    if rng.random() < 0.5:
        changes['volume_absolute'] = rng.uniform(15.0, 150.0)
    return changes


def nonlinear_flow(rng: Rng, valve: Physics, length: float) -> Changes:
    """Bend the flow law: a power, or an orifice by ISO 6358."""
    reference = rng.uniform(5.0, 20.0)
    if rng.random() < 0.7:
        return {'flow_exponent': rng.uniform(0.5, 0.8), 'flow_reference': reference}
    return {
        'flow_critical': rng.uniform(0.1, 0.45),
        'flow_absolute': rng.uniform(15.0, 130.0),
        'flow_reference': reference,
    }


def quick_exhaust(rng: Rng, valve: Physics, length: float) -> Changes:
    """Empty faster above a threshold, at once or over a small range."""
    changes = {
        'exhaust_gain': rng.uniform(2.0, 6.0),
        'exhaust_threshold': rng.uniform(4.0, 15.0),
    }
    if rng.random() < 0.25:
        changes['exhaust_soft'] = rng.uniform(0.5, 2.0)
    elif rng.random() < 0.3:
        changes['exhaust_reseat'] = rng.uniform(0.3, 0.8)
    return changes


def rate_limit(rng: Rng, valve: Physics, length: float) -> Changes:
    """Limit the speed of p2, both ways or one, or by direction, or that of the stem so."""
    rate, kind = log_uniform(rng, 1.0, 30.0), rng.random()
    other = rate * log_uniform(rng, 0.4, 2.5)
    ways = ('p2_rate_up', 'p2_rate_down')
    if kind < 0.4:
        return dict.fromkeys(ways if kind < 0.2 else (str(rng.choice(ways)),), rate)
    return dict(zip(ways if kind < 0.6 else ('v_up', 'v_down'), (rate, other), strict=True))


def hysteresis(rng: Rng, valve: Physics, length: float) -> Changes:
    """Remember, distributed: plays or Bouc-Wen, of the transducer or of x; or a force on it."""
    size = log_uniform(rng, 0.6, 5.0)
    kind, place = float(rng.choice((1.0, 2.0))), rng.random()
    return {
        'hysteresis_kind': kind,
        'hysteresis_at': 2.0 if place < 0.2 and kind == 2.0 else float(place < 0.4),
        'hysteresis_size': size,
        'hysteresis_width': size * rng.uniform(1.0, 2.5),
        'hysteresis_direct': max(rng.uniform(-0.4, 0.4), 0.0),
    }


def friction_asymmetry(rng: Rng, valve: Physics, length: float) -> Changes:
    """Rub differently by direction."""
    return {'asymmetry': either_sign(rng, 0.1, 0.7)}


def position_dependent_friction(rng: Rng, valve: Physics, length: float) -> Changes:
    """Rub more along the stroke, or at one place."""
    more = rng.uniform(1.3, 4.0) - 1.0
    if rng.random() < 0.5:
        return {'friction_slope': more}
    return {'bump': more, 'bump_at': rng.uniform(30, 70), 'bump_width': rng.uniform(5, 15)}


def stribeck_friction(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let friction fall with speed instead of at once, along a Gaussian or an exponential."""
    power = 2.0 if rng.random() < 0.7 else 1.0
    return {'stribeck': log_uniform(rng, 0.5, 30.0), 'stribeck_power': power}


def presliding(rng: Rng, valve: Physics, length: float) -> Changes:
    """Hold the stem by bristles that give by this share of the band, slide late, or break."""
    if rng.random() < 0.3:
        return {'brittle': 1.0 / rng.uniform(0.1, 0.6)}
    changes = {'bristle': 1.0 / rng.uniform(0.1, 0.6), 'dahl': float(rng.random() < 0.4)}
    if not changes['dahl']:
        changes['bristle_stribeck'] = log_uniform(rng, 0.01, 0.1)
    if rng.random() < 0.4:
        changes['bristle_elastic'] = rng.uniform(0.4, 0.8)
    return changes


def dwell_friction(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let the breakaway force grow at rest, exponentially, rationally or with each decade."""
    if rng.random() < 0.3:
        return {'dwell_decade': rng.uniform(0.15, 0.6), 'dwell_time': log_uniform(rng, 0.3, 5.0)}
    return {
        'dwell_gain': rng.uniform(0.1, 1.5),
        'dwell_time': log_uniform(rng, 4.0, 60.0),
        'dwell_rational': float(rng.random() < 0.5),
    }


def friction_drift(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let friction grow or shrink through the record, or settle while the valve warms up."""
    end = rng.uniform(1.3, 3.0) if rng.random() < 0.7 else rng.uniform(0.4, 0.75)
    if rng.random() < 0.7:
        return {'friction_drift': (end - 1.0) / length}
    warm_up = rng.uniform(0.15, 0.4) * length
    return {'friction_drift': (end - 1.0) / warm_up, 'friction_warm_up': warm_up}


def spring_preload(rng: Rng, valve: Physics, length: float) -> Changes:
    """Preload the spring; most have the seat that gives a dead zone at the closed end."""
    changes = {'preload': rng.uniform(2.0, 15.0)}
    if rng.random() < 0.6:
        changes['stop_low'] = 0.0
    return changes


def spring_rate(rng: Rng, valve: Physics, length: float) -> Changes:
    """Take a harder or softer spring."""
    return {'spring_rate': 1.0 + either_sign(rng, 0.05, 0.4)}


def spring_nonlinearity(rng: Rng, valve: Physics, length: float) -> Changes:
    """Take a hardening spring, or one whose line bows."""
    if rng.random() < 0.6:
        return {'spring_cubic': log_uniform(rng, 0.03, 1.0)}
    return {'spring_bow': either_sign(rng, 1.5, 15.0)}


def travel_stops(rng: Rng, valve: Physics, length: float) -> Changes:
    """Limit the stroke, hard or yielding, at one end or both."""
    changes = {}
    which = rng.integers(3)
    if which != 1:
        changes['stop_high'] = rng.uniform(50.0, 95.0)
    if which != 0:
        changes['stop_low'] = rng.uniform(5.0, 40.0)
    if rng.random() < 0.3:
        changes['stop_stiffness'] = log_uniform(rng, 15.0, 60.0)
    return changes


def fluid_force(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let the flow push the stem, most near the seat."""
    return {
        'fluid': either_sign(rng, 3.0, 20.0),
        'fluid_fall': rng.uniform(12.0, 45.0),
        'fluid_kind': float(rng.random() < 0.4),
    }


def vibration(rng: Rng, valve: Physics, length: float) -> Changes:
    """Shake the stem periodically."""
    return {
        'vibration': log_uniform(rng, 0.5, 5.0),
        'vibration_omega': 2.0 * np.pi * log_uniform(rng, 0.03, 1.0),
    }


def linkage_backlash(rng: Rng, valve: Physics, length: float) -> Changes:
    """Leave play between stem and sensor."""
    return {'linkage': log_uniform(rng, 0.2, 2.5)}


def sensor_lag(rng: Rng, valve: Physics, length: float) -> Changes:
    """Lag the position."""
    return {'sensor_tau': log_uniform(rng, 0.05, 4.0)}


def sensor_calibration(rng: Rng, valve: Physics, length: float) -> Changes:
    """Shift and stretch the sensor's line; a shift alone looks like preload, if no stop is met."""
    return off_line(rng, 'sensor', 5.0, 0.15, one=0.15)


def sensor_quantisation(rng: Rng, valve: Physics, length: float) -> Changes:
    """Round the position."""
    return {'sensor_step': log_uniform(rng, 0.1, 4.0)}


def sensor_drift(rng: Rng, valve: Physics, length: float) -> Changes:
    """Let the sensor's zero drift by this much over the record, or settle while it warms up."""
    total = either_sign(rng, 1.0, 10.0)
    if rng.random() < 0.7:
        return {'sensor_drift': total / length}
    warm_up = rng.uniform(0.15, 0.4) * length
    return {'sensor_drift': total / warm_up, 'sensor_warm_up': warm_up}


EFFECTS: dict[str, Callable[[Rng, Physics, float], Changes]] = {
    draw.__name__: draw
    for draw in (
        ip_dead_time,
        ip_lag,
        ip_calibration,
        ip_nonlinearity,
        supply_limit,
        positioner_loop,
        tubing_dead_time,
        air_leak,
        chamber_volume,
        nonlinear_flow,
        quick_exhaust,
        rate_limit,
        hysteresis,
        friction_asymmetry,
        position_dependent_friction,
        stribeck_friction,
        presliding,
        dwell_friction,
        friction_drift,
        spring_preload,
        spring_rate,
        spring_nonlinearity,
        travel_stops,
        fluid_force,
        vibration,
        linkage_backlash,
        sensor_lag,
        sensor_calibration,
        sensor_quantisation,
        sensor_drift,
    )
}
