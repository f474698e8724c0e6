# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is handed from step to step: state, parameters, what depends on them and the step alone."""

import math
from typing import NamedTuple

from numba import njit

from .slip import forced_gain, free_motion, Poles, stem_poles
from .stem import Friction, Stem


class State(NamedTuple):
    """The valve between two samples.

    p1, p2, x [% of span], v [%/s], slip direction, arming, output of the backlash [% of span]
    (p1, unless an effect stands between them), command in force [% of span], time since the
    first sample [s].
    """

    p1: float
    p2: float
    x: float
    v: float
    direction: float
    armed: float
    play: float
    command: float
    time: float


class Theta(NamedTuple):
    """The parameters: `parameters.BASE` in order, then 1 for branch = printed."""

    f_d1: float
    t_g1: float
    t_g2: float
    f_s: float
    f_d: float
    a_1: float
    a_2: float
    delta: float
    printed: float


class Lag(NamedTuple):
    """The chamber over one step: rate [1/s], decay over it, and what the stem makes of it."""

    rate: float
    decay: float
    gain: float
    stem_rate: float


class Motion(NamedTuple):
    """The stem and the pressure p2 [% of span] after a step, and what drove them.

    The opening force was target + excess exp(-rate tau) [% of span]; theta are the valve's
    parameters.
    """

    stem: Stem
    p2: float
    target: float
    excess: float
    rate: float
    friction: Friction
    theta: Theta


@njit(forceinline=True)
def moved(motion: Motion, stem: Stem, p2: float) -> Motion:
    """Return the motion with another stem and pressure p2 [% of span] after the step."""
    m = motion
    return Motion(stem, p2, m.target, m.excess, m.rate, m.friction, m.theta)


class Transition(NamedTuple):
    """What depends on the parameters and the step alone, kept between equal steps.

    A sample of `dt` seconds is taken in `substeps` equal steps of `step` seconds.
    """

    dt: float
    substeps: int
    step: float
    filling: Lag
    emptying: Lag
    poles: Poles
    phi1: float
    phi2: float


BASE_STEP = math.inf
"""The base valve is exact over a step of any length."""


@njit
def lag_over(rate: float, dt: float, a_1: float, a_2: float, stiffness: float) -> Lag:
    """Return the chamber's lag over a step of `dt` seconds and the stem's answer to it."""
    gain, stem_rate = forced_gain(rate, a_1, a_2, stiffness)
    return Lag(rate, math.exp(-dt * rate), gain, stem_rate)


@njit
def transition_over(dt: float, theta: Theta, finest: float) -> Transition:
    """Return what a sample of `dt` seconds needs, taken in steps of at most `finest` seconds."""
    filling = lag_over(1.0 / theta.t_g1, 0.0, theta.a_1, theta.a_2, 1.0)
    emptying = lag_over(1.0 / theta.t_g2, 0.0, theta.a_1, theta.a_2, 1.0)
    poles = stem_poles(theta.a_1, theta.a_2)
    phi1, phi2 = free_motion(0.0, poles)
    still = Transition(0.0, 1, 0.0, filling, emptying, poles, phi1, phi2)
    return transition_after(still, dt, finest)


@njit
def transition_after(before: Transition, dt: float, finest: float) -> Transition:
    """Return the same over another sample, from what does not depend on its length."""
    if dt == before.dt:
        return before
    substeps = max(1, math.ceil(dt / finest))
    step = dt / substeps
    filling, emptying = before.filling, before.emptying
    phi1, phi2 = free_motion(step, before.poles)
    return Transition(
        dt,
        substeps,
        step,
        Lag(filling.rate, math.exp(-step * filling.rate), filling.gain, filling.stem_rate),
        Lag(emptying.rate, math.exp(-step * emptying.rate), emptying.gain, emptying.stem_rate),
        before.poles,
        phi1,
        phi2,
    )
