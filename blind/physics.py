# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every constant of the simulated valve, neutral where an effect is absent."""

from typing import NamedTuple

FAR = 1e9
"""A limit that is never reached [% or %/s]."""


class Physics(NamedTuple):
    """A valve: per cent of span, seconds; the defaults of the effects leave them out."""

    # the valve without any of the effects
    f_d1: float = 1.0
    T_g1: float = 4.0
    T_g2: float = 8.0
    f_s: float = 6.0
    f_d: float = 4.0
    a_1: float = 2000.0
    a_2: float = 176.0
    delta: float = 1e-5
    # command to inlet pressure
    ip_delay: float = 0.0
    ip_tau: float = 0.0
    ip_zero: float = 0.0
    ip_span: float = 1.0
    ip_bow: float = 0.0
    ip_power: float = 1.0
    supply: float = FAR
    loop_gain: float = 0.0
    loop_reset: float = 0.0
    loop_low: float = -FAR
    loop_high: float = FAR
    loop_windup: float = 0.0
    # distributed hysteresis: 1 plays beside a direct share, 2 Bouc-Wen; of the transducer (0), of
    # x (1), or Bouc-Wen of the force on the stem (2)
    hysteresis_kind: float = 0.0
    hysteresis_at: float = 0.0
    hysteresis_size: float = 0.0
    hysteresis_width: float = 1.0
    hysteresis_direct: float = 0.0
    # inlet to chamber pressure
    tube_delay: float = 0.0
    leak: float = 0.0
    leak_orifice: float = 0.0
    volume: float = 0.0
    volume_absolute: float = -1.0
    flow_exponent: float = 1.0
    flow_reference: float = 10.0
    flow_critical: float = -1.0
    flow_absolute: float = 100.0
    exhaust_gain: float = 1.0
    exhaust_threshold: float = FAR
    exhaust_soft: float = 0.0
    exhaust_reseat: float = 1.0
    p2_rate_up: float = FAR
    p2_rate_down: float = FAR
    # friction
    asymmetry: float = 0.0
    friction_slope: float = 0.0
    bump: float = 0.0
    bump_at: float = 50.0
    bump_width: float = 10.0
    stribeck: float = 0.0
    stribeck_power: float = 2.0
    bristle: float = 0.0
    bristle_damping: float = 0.0
    bristle_stribeck: float = 0.02
    bristle_elastic: float = 0.0
    brittle: float = 0.0
    dahl: float = 0.0
    dwell_gain: float = 0.0
    dwell_time: float = 10.0
    dwell_rational: float = 0.0
    dwell_decade: float = 0.0
    friction_drift: float = 0.0
    friction_warm_up: float = 0.0
    # forces on the stem, and its limits
    preload: float = 0.0
    spring_rate: float = 1.0
    spring_cubic: float = 0.0
    spring_bow: float = 0.0
    stop_low: float = -FAR
    stop_high: float = FAR
    stop_stiffness: float = 0.0
    fluid: float = 0.0
    fluid_fall: float = 30.0
    fluid_kind: float = 0.0
    vibration: float = 0.0
    vibration_omega: float = 1.0
    v_up: float = FAR
    v_down: float = FAR
    # position sensor
    linkage: float = 0.0
    sensor_tau: float = 0.0
    sensor_zero: float = 0.0
    sensor_span: float = 1.0
    sensor_step: float = 0.0
    sensor_drift: float = 0.0
    sensor_warm_up: float = 0.0
    # effects that no catalogue lists
    relaxation: float = 0.0
    relaxation_time: float = 20.0
    smoothing: float = 0.0
    smoothing_error: float = 10.0
    ripple: float = 0.0
    ripple_omega: float = 1.0
    warming: float = 0.0
    warming_omega: float = 0.01
    kick: float = 0.0
    kick_interval: float = 20.0
    swing: float = 0.0
    swing_omega: float = 0.03
    thermal: float = 0.0
    thermal_time: float = 20.0
    area_wave: float = 0.0
    area_period: float = 30.0
    dip: float = 0.0
    dip_interval: float = 60.0
    cyclic: float = 0.0
    cyclic_period: float = 25.0
