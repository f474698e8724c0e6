# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The way of a sample: command u, inlet pressure p1, chamber pressure p2, stem position x.

`advance` is the one step function. The compiled run over a record, the compiled single step and
the interpreted single step are three makes of it (see `kernels.py`), so they cannot drift apart.
State and parameters are tuples of numbers: they live in registers, and nothing is counted or
allocated per sample.

The names `*_slot` are the places where an effect plugs in. Each is a function
`slot(value, state, effects, memory, dt) -> value`; the base valve's slots return what they get.
Their dt is that of the step, and `state` is that at its start, but for the sensor at its end.
"""

import math
from typing import Any

from numba import njit
import numpy as np
import numpy.typing as npt

from .borrowing import borrowed
from .electro_pneumatic import backlash
from .pneumatic import chamber_pressure, is_filling
from .slip import free_motion, stem_poles
from .state import (
    BASE_STEP,
    Lag,
    lag_over,
    Motion,
    State,
    Theta,
    Transition,
    transition_after,
    transition_over,
)
from .stem import Friction, Stem, stem_step

Array = npt.NDArray[np.float64]

STEADY, GLIDE = 0.1, 8.0
"""A stem whose speed changes by less than this part glides: its steps may be so much longer."""


@njit(forceinline=True)
def unchanged(value: Any, state: Any, effects: Any, memory: Any, dt: float) -> Any:
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
reach_slot = unchanged
"""How far that force may lie from its value in a step [% of span]: forces that come and go."""
stride_slot = unchanged
"""Longest step while the stem moves [s]: friction that follows its speed or its place."""
motion_slot = unchanged
"""Motion after each step: stops, limits of speed, what the moved stem does to the chamber."""
sensor_slot = unchanged
"""x as measured [% of span]: linkage, lag, calibration, quantisation, drift."""


@njit(forceinline=True)
def pushed(
    inlet: float,
    lag: Lag,
    state: State,
    theta: Theta,
    transition: Transition,
    effects: Any,
    memory: Any,
) -> Motion:
    """Return what chamber and stem do in one step, before the effects on their motion.

    Parameters
    ----------
    inlet : float
        p1 as the chamber sees it [% of span].
    lag : Lag
        Of the chamber over the step.
    state, theta, transition, effects, memory
        As in `advance`.
    """
    dt = transition.step
    target, rate = flow_slot((inlet, lag.rate), state, effects, memory, dt)
    offset, friction = force_slot(
        (0.0, Friction(theta.f_s, theta.f_s, theta.f_d, theta.f_d, 1.0)),
        state,
        effects,
        memory,
        dt,
    )
    poles, phi1, phi2 = transition.poles, transition.phi1, transition.phi2
    # written so that it falls away in a valve without effects: != may be true of NaN
    if rate < lag.rate or rate > lag.rate or friction.stiffness != 1.0:
        lag = lag_over(rate, dt, theta.a_1, theta.a_2, friction.stiffness)
    if friction.stiffness != 1.0:
        poles = stem_poles(theta.a_1 * friction.stiffness, theta.a_2)
        phi1, phi2 = free_motion(dt, poles)
    excess = state.p2 - target
    stem = stem_step(
        Stem(state.x, state.v, state.direction, state.armed != 0.0),
        target + offset,
        excess,
        dt,
        friction,
        theta.delta,
        (lag.gain, lag.stem_rate),
        poles,
        lag.decay,
        phi1,
        phi2,
    )
    p2 = chamber_pressure(state.p2, target, lag.decay)
    return Motion(stem, p2, target + offset, excess, rate, friction, theta)


@njit(forceinline=True)
def may_slip(motion: Motion, x: float, dt: float, reach: float) -> bool:
    """Tell whether a stem that rests in a step may slip, as the force lies up to `reach` off."""
    friction, spring = motion.friction, motion.friction.stiffness * x
    first = motion.target + motion.excess
    last = motion.target + motion.excess * math.exp(-motion.rate * dt)
    high, low = max(first, last) + reach - spring, min(first, last) - reach - spring
    return high > friction.static_up or low < -friction.static_down


@njit(forceinline=True)
def advance(
    u: float,
    state: State,
    theta: Theta,
    transition: Transition,
    effects: Any,
    memory: Any,
) -> tuple[State, float]:
    """Take the valve through one step, at whose end the command becomes `u`.

    Parameters
    ----------
    u : float
        Command from the end of the step on [% of span].
    state : State
        At the start of the step.
    theta : Theta
        Parameters.
    transition : Transition
        `transition_over` the sample; the step is `transition.step` seconds long.
    effects, memory : tuple or ndarray
        Parameters and states of the effects in the slots; empty tuples for the base valve.

    Returns
    -------
    state : State
        p1, p2 and the true stem at the end of the step.
    x : float
        Stem position as the sensor reports it [% of span].
    """
    dt = transition.step
    command = command_slot(u, state, effects, memory, dt)
    play = backlash(state.play, command, theta.f_d1)
    p1 = inlet_slot(play, state, effects, memory, dt)
    inlet = tubing_slot(state.p1, state, effects, memory, dt)
    filling = is_filling(inlet, p1, state.p2, theta.printed != 0.0)
    lag = transition.filling if filling else transition.emptying
    step, now, left = transition, state, 1
    while left > 0:
        motion = pushed(inlet, lag, now, theta, step, effects, memory)
        if step.step == dt:
            moves = motion.stem.direction != 0.0 or motion.stem.x != state.x or state.v != 0.0
            reach = reach_slot(0.0, state, effects, memory, dt)
            longest = BASE_STEP
            if moves or (reach > 0.0 and may_slip(motion, state.x, dt, reach)):
                longest = stride_slot(BASE_STEP, state, effects, memory, dt)
                if reach == 0.0 and abs(motion.stem.v - state.v) < STEADY * abs(state.v):
                    longest *= GLIDE
            if longest < dt:  # again, in short steps
                left = math.ceil(dt / longest)
                step = transition_after(transition, dt / left, BASE_STEP)
                lag = step.filling if filling else step.emptying
                continue
        stem, p2 = motion_slot(motion, now, effects, memory, step.step)[:2]
        armed = 1.0 if stem.armed else 0.0
        time = now.time + step.step
        now = State(now.p1, p2, stem.x, stem.v, stem.direction, armed, now.play, now.command, time)
        left -= 1
    time = state.time + dt
    after = State(p1, now.p2, now.x, now.v, now.direction, now.armed, play, u, time)
    return after, sensor_slot(after.x, after, effects, memory, dt)


@njit(forceinline=True)
def advance_sample(
    u: float,
    state: State,
    theta: Theta,
    transition: Transition,
    effects: Any,
    memory: Any,
) -> tuple[State, float]:
    """Take the valve through one sample of `transition.dt` seconds; see `advance`."""
    x = state.x
    for left in range(transition.substeps, 0, -1):
        command = u if left == 1 else state.command
        state, x = advance(command, state, theta, transition, effects, memory)
    return state, x


@njit(forceinline=True)
def state_from(values: Array) -> State:
    """Return an array of nine numbers as a state."""
    v = values
    return State(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8])


@njit(forceinline=True)
def theta_from(values: Array) -> Theta:
    """Return an array of nine numbers as parameters."""
    v = values
    return Theta(v[0], v[1], v[2], v[3], v[4], v[5], v[6], v[7], v[8])


@njit
def step(
    u: float, dt: float, state: Any, theta: Any, finest: float, effects: Any, memory: Any
) -> float:
    """Take the valve through one sample of `dt` seconds; arguments as for `run`, returns x."""
    parameters = theta_from(theta)
    effects, memory = borrowed(effects), borrowed(memory)
    transition = transition_over(dt, parameters, finest)
    now, x = advance_sample(u, state_from(state), parameters, transition, effects, memory)
    for index, value in enumerate(now):
        state[index] = value
    return x


@njit
def run(
    u: Array,
    dt: Array,
    state: Array,
    theta: Array,
    finest: float,
    effects: Any,
    memory: Any,
    outputs: Array,
) -> None:
    """Take the valve through a record.

    Parameters
    ----------
    u : ndarray, shape (n,)
        Commands [% of span].
    dt : ndarray, shape (n,) or (1,)
        Time since the sample before [s]. Of length 1: that step after a first one of 0 s.
    state : ndarray, shape (9,), a `State`
        Updated in place.
    theta : ndarray, shape (9,), a `Theta`
        Parameters.
    finest : float
        Longest step inside a sample [s]; infinite where the closed forms are exact.
    effects, memory : tuple or ndarray
        As for `advance`.
    outputs : ndarray, shape (3, n)
        Receives p1, p2, x [% of span].
    """
    parameters = theta_from(theta)
    effects, memory = borrowed(effects), borrowed(memory)
    now = state_from(state)
    transition = transition_over(0.0, parameters, finest)
    uniform = dt.size == 1
    for k in range(u.size):
        duration = dt[0] if uniform else dt[k]
        if uniform and k == 0:
            duration = 0.0
        if duration != transition.dt:
            transition = transition_after(transition, duration, finest)
        now, x = advance_sample(u[k], now, parameters, transition, effects, memory)
        outputs[0, k] = now.p1
        outputs[1, k] = now.p2
        outputs[2, k] = x
    for index, value in enumerate(now):
        state[index] = value
