# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The way of a sample: command u, inlet pressure p1, chamber pressure p2, stem position x.

`advance` is the one step function. The compiled run over a record, the compiled single step and
the interpreted single step are three makes of it (see `compile.py`), so they cannot drift apart.

The names `*_slot` are the places where an effect plugs in. Each is a function
`slot(value, state, extras, memory, dt) -> value`; the base valve's slots return what they get.
"""

import math
from typing import Any

from numba import njit
import numpy as np
import numpy.typing as npt

from .electro_pneumatic import backlash
from .pneumatic import chamber_pressure, is_filling
from .stem import forced_gain, free_motion, Friction, Poles, Stem, stem_poles, stem_step

Array = npt.NDArray[np.float64]

P1, P2, X, V, DIRECTION, ARMED = range(6)
STATE_SIZE = 6
"""Layout of the state: p1, p2, x [% of span], v [%/s], slip direction, arming."""

F_D1, T_G1, T_G2, F_S, F_D, A_1, A_2, DELTA, PRINTED = range(9)
THETA_SIZE = 9
"""Layout of the parameters: `parameters.BASE` in order, then 1 for branch = printed."""

DT, FILL_DECAY, EMPTY_DECAY, REGIME, POLE_1, POLE_2, PHI_1, PHI_2 = range(8)
FILL_GAIN, FILL_RATE, EMPTY_GAIN, EMPTY_RATE = range(8, 12)
TRANSITION_SIZE = 12
"""Layout of what depends on the parameters and the step alone, kept between equal steps."""


@njit
def unchanged(value: Any, state: Array, extras: Array, memory: Array, dt: float) -> Any:
    """Return `value`: the slot of a valve without effects."""
    return value


command_slot = unchanged
"""u before the converter [% of span]: dead time, positioner, calibration."""
inlet_slot = unchanged
"""p1 after the backlash [% of span]: lag of the converter, supply limit, hysteresis."""
tubing_slot = unchanged
"""The p1 held over the sample as the chamber sees it [% of span]: tubing."""
flow_slot = unchanged
"""(target [% of span], rate [1/s]) of p2: leak, volume, nonlinear flow, quick exhaust."""
force_slot = unchanged
"""(opening force offset [% of span], Friction): spring, friction and fluid effects."""
sensor_slot = unchanged
"""x as measured [% of span]: linkage, lag, calibration, quantisation, drift."""


@njit
def fill_transition(transition: Array, theta: Array, dt: float) -> None:
    """Compute what a step of `dt` seconds needs from the parameters alone."""
    transition[DT] = dt
    transition[FILL_DECAY] = math.exp(-dt / theta[T_G1])
    transition[EMPTY_DECAY] = math.exp(-dt / theta[T_G2])
    poles = stem_poles(theta[A_1], theta[A_2])
    transition[REGIME], transition[POLE_1], transition[POLE_2] = poles
    transition[PHI_1], transition[PHI_2] = free_motion(dt, poles)
    transition[FILL_GAIN], transition[FILL_RATE] = forced_gain(
        1.0 / theta[T_G1], theta[A_1], theta[A_2], 1.0
    )
    transition[EMPTY_GAIN], transition[EMPTY_RATE] = forced_gain(
        1.0 / theta[T_G2], theta[A_1], theta[A_2], 1.0
    )


@njit
def advance(
    u: float,
    dt: float,
    state: Array,
    theta: Array,
    transition: Array,
    extras: Array,
    memory: Array,
) -> float:
    """Take the valve through one sample and return the measured stem position.

    Parameters
    ----------
    u : float
        Command from now on [% of span].
    dt : float
        Time since the sample before [s]; 0 for the first sample.
    state : ndarray, shape (STATE_SIZE,)
        Updated in place.
    theta : ndarray, shape (THETA_SIZE,)
        Parameters.
    transition : ndarray, shape (TRANSITION_SIZE,)
        Kept between calls; set `transition[DT]` to NaN after a change of parameters.
    extras, memory : ndarray
        Parameters and states of the effects in the slots; empty for the base valve.

    Returns
    -------
    float
        x as the sensor reports it [% of span]; `state` holds p1, p2 and the true x.
    """
    if transition[DT] != dt:
        fill_transition(transition, theta, dt)
    p1_held, p2 = state[P1], state[P2]
    command = command_slot(u, state, extras, memory, dt)
    p1 = inlet_slot(backlash(p1_held, command, theta[F_D1]), state, extras, memory, dt)
    state[P1] = p1
    inlet = tubing_slot(p1_held, state, extras, memory, dt)
    if is_filling(inlet, p1, p2, theta[PRINTED] != 0.0):
        nominal = 1.0 / theta[T_G1]
        decay, gain, stem_rate = (
            transition[FILL_DECAY],
            transition[FILL_GAIN],
            transition[FILL_RATE],
        )
    else:
        nominal = 1.0 / theta[T_G2]
        decay = transition[EMPTY_DECAY]
        gain, stem_rate = transition[EMPTY_GAIN], transition[EMPTY_RATE]
    target, rate = flow_slot((inlet, nominal), state, extras, memory, dt)
    offset, friction = force_slot(
        (0.0, Friction(theta[F_S], theta[F_S], theta[F_D], theta[F_D], 1.0)),
        state,
        extras,
        memory,
        dt,
    )
    poles = Poles(int(transition[REGIME]), transition[POLE_1], transition[POLE_2])
    phi1, phi2 = transition[PHI_1], transition[PHI_2]
    if rate != nominal or friction.stiffness != 1.0:
        decay = math.exp(-rate * dt)
        poles = stem_poles(theta[A_1] * friction.stiffness, theta[A_2])
        phi1, phi2 = free_motion(dt, poles)
        gain, stem_rate = forced_gain(rate, theta[A_1], theta[A_2], friction.stiffness)
    stem = stem_step(
        Stem(state[X], state[V], state[DIRECTION], state[ARMED] != 0.0),
        target + offset,
        p2 - target,
        dt,
        friction,
        theta[DELTA],
        (gain, stem_rate),
        poles,
        decay,
        phi1,
        phi2,
    )
    state[P2] = chamber_pressure(p2, target, decay)
    state[X], state[V], state[DIRECTION] = stem.x, stem.v, stem.direction
    state[ARMED] = 1.0 if stem.armed else 0.0
    return sensor_slot(stem.x, state, extras, memory, dt)


@njit
def run(
    u: Array,
    dt: Array,
    state: Array,
    theta: Array,
    extras: Array,
    memory: Array,
    outputs: Array,
) -> None:
    """Take the valve through a record.

    Parameters
    ----------
    u : ndarray, shape (n,)
        Commands [% of span].
    dt : ndarray, shape (n,) or (1,)
        Time since the sample before [s]. Of length 1: that step after a first one of 0 s.
    state, theta, extras, memory : ndarray
        As for `advance`.
    outputs : ndarray, shape (3, n)
        Receives p1, p2, x [% of span].
    """
    transition = np.full(TRANSITION_SIZE, np.nan)
    uniform = dt.size == 1
    for k in range(u.size):
        step = dt[0] if uniform else dt[k]
        if uniform and k == 0:
            step = 0.0
        outputs[2, k] = advance(u[k], step, state, theta, transition, extras, memory)
        outputs[0, k] = state[P1]
        outputs[1, k] = state[P2]
