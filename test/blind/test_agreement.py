# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Two codes that share nothing do the same with each effect: the blind simulator and the model."""

from math import pi

import numpy as np
import pytest

from blind.physics import FAR, Physics
from blind.plant import simulate as blind_simulate
from valve_sim_ros import InitialState, simulate, ValveSpec
from valve_sim_ros.model.effects import CATALOGUE

VALVE = {name: Physics._field_defaults[name] for name in Physics._fields[:7]}
RAMP = np.linspace(30.0, 70.0, 200)
LEVELS = np.random.default_rng(11).uniform(15.0, 85.0, 24)
U = np.concatenate((np.repeat(LEVELS, 75), RAMP, RAMP[::-1], np.repeat(LEVELS[::-1], 40)))
T = 0.2 * np.arange(U.size)

SAME = {
    # constants of the blind simulator, parameters of the model
    'ip_dead_time': ({'ip_delay': 0.7}, {'dead_time': 0.7}),
    'ip_lag': ({'ip_tau': 1.5}, {'time_constant': 1.5}),
    'ip_calibration': ({'ip_zero': 3.0, 'ip_span': 0.9}, {'zero': 3.0, 'span': 0.9}),
    'ip_nonlinearity': ({'ip_bow': 6.0}, {'bow': 6.0}),
    'supply_limit': ({'supply': 70.0}, {'pressure': 70.0}),
    'positioner_loop': (
        {'loop_gain': 1.2, 'loop_low': 0.0, 'loop_high': 100.0},
        {'gain': 1.2, 'underdrive': 0.0, 'overdrive': 0.0},
    ),
    'tubing_dead_time': ({'tube_delay': 0.7}, {'dead_time': 0.7}),
    'air_leak': ({'leak': 0.02}, {'leak_rate': 0.02}),
    'chamber_volume': (
        {'volume': 1.5, 'volume_absolute': 150.0},
        {'ratio': 1.5, 'displacement': 1.0},
    ),
    'nonlinear_flow': ({'flow_exponent': 0.6}, {'exponent': 0.6}),
    'quick_exhaust': (
        {'exhaust_gain': 4.0, 'exhaust_threshold': 8.0},
        {'factor': 4.0, 'threshold': 8.0},
    ),
    'rate_limit': (
        {'v_up': 3.0, 'v_down': 4.0},
        {'pressure_rate': 1000.0, 'opening_rate': 3.0, 'closing_rate': 4.0},
    ),
    'hysteresis': (
        {'hysteresis_kind': 1.0, 'hysteresis_at': 1.0, 'hysteresis_size': 2.0},
        # ten plays here, five there, of the same mean width
        {'inlet_width': 0.0, 'stem_width': 2.0 * 5 / 3},
    ),
    'friction_asymmetry': ({'asymmetry': 0.4}, {'difference': 0.4}),
    'position_dependent_friction': (
        {'bump': 1.5, 'bump_at': 45.0, 'bump_width': 10.0},
        {'height': 1.5, 'centre': 45.0, 'width': 10.0 / 2.0**0.5},
    ),
    # at less speed each slip depends on the one before it and on the last digit
    'stribeck_friction': ({'stribeck': 15.0}, {'velocity': 15.0}),
    'presliding': (
        {'bristle': 4.0, 'bristle_stribeck': 1.0},
        {'compliance': 0.25, 'drop_speed': 1.0},
    ),
    'dwell_friction': (
        {'dwell_gain': 0.8, 'dwell_time': 10.0},
        {'growth': 0.8, 'time_constant': 10.0},
    ),
    'friction_drift': ({'friction_drift': 1e-3}, {'rate': 3.6}),
    'spring_preload': ({'preload': 6.0, 'stop_low': 0.0}, {'pressure': 6.0}),
    'spring_rate': ({'spring_rate': 1.25}, {'factor': 1.25}),
    'spring_nonlinearity': ({'spring_cubic': 0.4}, {'hardening': 0.4}),
    'travel_stops': ({'stop_low': 25.0, 'stop_high': 70.0}, {'lower': 25.0, 'upper': 70.0}),
    'fluid_force': ({'fluid': -8.0, 'fluid_fall': 30.0}, {'force': 8.0, 'reach': 30.0}),
    'vibration': (
        {'vibration': 2.0, 'vibration_omega': 2 * pi * 0.15},
        {'amplitude': 2.0, 'frequency': 0.15},
    ),
    'linkage_backlash': ({'linkage': 1.0}, {'width': 2.0}),
    'sensor_lag': ({'sensor_tau': 1.5}, {'time_constant': 1.5}),
    'sensor_calibration': ({'sensor_zero': 2.0, 'sensor_span': 0.9}, {'zero': 2.0, 'span': 0.9}),
    'sensor_quantisation': ({'sensor_step': 1.5}, {'step': 1.5}),
    'sensor_drift': ({'sensor_drift': 0.01}, {'rate': 36.0}),
}

OTHER_FORMS = [
    (
        'chamber_volume',
        {'volume': 1.5, 'volume_absolute': 40.0},
        {'ratio': 1.5, 'displacement': 1.0, 'absolute_pressure': 40.0},
    ),
    (
        'ip_lag',
        {'smoothing': 1.5, 'smoothing_error': FAR},
        {'time_constant': 1.5, 'upstream': 1.0},
    ),
    ('ip_nonlinearity', {'ip_power': 0.8}, {'bow': 0.0, 'exponent': 0.8}),
    ('rate_limit', {'p2_rate_up': 3.0}, {'pressure_rate': 1000.0, 'filling_rate': 3.0}),
    ('rate_limit', {'p2_rate_down': 3.0}, {'pressure_rate': 1000.0, 'emptying_rate': 3.0}),
    (
        'presliding',
        {'bristle': 4.0, 'bristle_stribeck': 0.03},
        {'compliance': 0.25, 'drop_speed': 0.03},
    ),
    (
        'stribeck_friction',
        {'stribeck': 8.0, 'stribeck_power': 1.0},
        {'velocity': 8.0, 'exponent': 1.0},
    ),
    (
        'presliding',
        {'bristle': 2.0, 'bristle_stribeck': 1.0, 'bristle_elastic': 0.6},
        {'compliance': 0.5, 'drop_speed': 1.0, 'elastic': 0.6},
    ),
    (
        'travel_stops',
        {'stop_low': 25.0, 'stop_high': 70.0, 'stop_stiffness': 25.0},
        {'lower': 25.0, 'upper': 70.0, 'compliance': 0.04},
    ),
    ('presliding', {'brittle': 5.0}, {'compliance': 0.0, 'stuck_compliance': 0.2}),
    (
        'nonlinear_flow',
        {'flow_critical': 0.3, 'flow_absolute': 60.0},
        {'exponent': 1.0, 'critical_ratio': 0.3, 'absolute_pressure': 60.0},
    ),
    (
        'hysteresis',
        {
            'hysteresis_kind': 1.0,
            'hysteresis_at': 1.0,
            'hysteresis_size': 2.0,
            'hysteresis_direct': 0.3,
        },
        {'inlet_width': 0.0, 'stem_width': 2.0 * 5 / 3, 'direct': 0.3},
    ),
    (
        'hysteresis',
        {'hysteresis_kind': 2.0, 'hysteresis_size': 3.0, 'hysteresis_width': 5.4},
        {'inlet_width': 0.0, 'command_width': 3.0, 'reach': 1.8},
    ),
    (
        'hysteresis',
        {
            'hysteresis_kind': 2.0,
            'hysteresis_at': 1.0,
            'hysteresis_size': 2.0,
            'hysteresis_width': 3.0,
        },
        {'inlet_width': 0.0, 'stem_width': 2.0, 'reach': 1.5},
    ),
    (
        'hysteresis',
        {
            'hysteresis_kind': 2.0,
            'hysteresis_at': 2.0,
            'hysteresis_size': 4.0,
            'hysteresis_width': 6.0,
        },
        {'inlet_width': 0.0, 'force_width': 4.0, 'reach': 1.5},
    ),
    (
        'quick_exhaust',
        {'exhaust_gain': 4.0, 'exhaust_threshold': 8.0, 'exhaust_reseat': 0.5},
        {'factor': 4.0, 'threshold': 8.0, 'reseat': 0.5},
    ),
    (
        'positioner_loop',
        {
            'loop_gain': 1.5,
            'loop_reset': 0.2,
            'loop_low': 0.0,
            'loop_high': 110.0,
            'loop_windup': 30.0,
        },
        {
            'gain': 1.5,
            'integral_gain': 0.3,
            'overdrive': 10.0,
            'underdrive': 0.0,
            'integral_limit': 30.0,
        },
    ),
    (
        'positioner_loop',
        {'loop_gain': 1.2, 'loop_low': -5.0, 'loop_high': 130.0},
        {'gain': 1.2, 'underdrive': 5.0, 'overdrive': 30.0},
    ),
    (
        'dwell_friction',
        {'dwell_gain': 0.8, 'dwell_time': 10.0, 'dwell_rational': 1.0},
        {'growth': 0.8, 'time_constant': 10.0, 'shape': 1.0},
    ),
    (
        'dwell_friction',
        {'dwell_decade': 0.3, 'dwell_time': 5.0},
        {'growth': 3.0, 'time_constant': 127.7, 'shape': 20.0},
    ),
    (
        'friction_drift',
        {'friction_drift': 0.01, 'friction_warm_up': 60.0},
        {'rate': 36.0, 'settling': 60.0},
    ),
    (
        'sensor_drift',
        {'sensor_drift': 0.05, 'sensor_warm_up': 60.0},
        {'rate': 180.0, 'settling': 60.0},
    ),
    ('air_leak', {'leak': 0.02, 'leak_orifice': 1.0}, {'leak_rate': 0.02, 'exponent': 0.5}),
]


def both(changes, values):
    """Return the traces of the blind simulator and of the model."""
    start = InitialState(*[U[0]] * 3)
    modelled = simulate(U, parameters=ValveSpec().changed(VALVE | values), time=T, initial=start)
    return blind_simulate(U, T, T, Physics(**changes)), modelled


def disagreement(one, other):
    """Return the difference that all but one in twenty samples stay below [%]."""
    return max(
        np.percentile(np.abs(getattr(one, name) - getattr(other, name)), 95)
        for name in ('p1', 'p2', 'x')
    )


def test_that_the_table_is_complete():
    assert set(SAME) == set(CATALOGUE)


def test_that_the_base_valve_agrees():
    assert disagreement(*both({}, {})) < 0.05


@pytest.mark.parametrize(
    ('effect', 'changes', 'values'),
    [*((effect, *same) for effect, same in SAME.items()), *OTHER_FORMS],
)
def test_that_an_effect_agrees(effect, changes, values):
    named = {f'{effect}.{name}': value for name, value in values.items()}
    blind, modelled = both(changes, {'effects': [effect], **named})
    plain, _ = both({}, {})
    left = disagreement(blind, modelled)
    assert left < 0.3
    assert left < 0.2 * disagreement(blind, plain)


def test_that_friction_along_the_stroke_agrees_for_a_stem_that_overshoots():
    """Its slips are over within a few steps: each must take the friction of its own middle."""
    quick = VALVE | {'a_1': 944.0, 'a_2': 35.0}
    slope = 2.5  # from the closed end; the model's is from mid stroke
    middle = 1.0 + 0.5 * slope
    friction = {name: VALVE[name] * middle for name in ('f_s', 'f_d')}
    effect = 'position_dependent_friction'
    own = {f'{effect}.slope': 0.5 * slope / middle, f'{effect}.height': 0.0}
    blind, modelled = both(
        quick | {'friction_slope': slope}, quick | friction | {'effects': [effect]} | own
    )
    assert disagreement(blind, modelled) < 0.1
