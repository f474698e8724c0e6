# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the data-driven models share: signals, start, and the declarations of their levels."""

from typing import Any

from numba import njit
import numpy as np

from ..declarations import Parameter
from ..pipeline import Array
from .layout import P1, P2, X

FIRST = 3
"""Index of the first number of the state that is the model's own."""


@njit
def at_rest(p1: float, p2: float, x: float, theta: Array) -> Array:
    """Return the start of a model whose only memory is x."""
    state = np.zeros(FIRST)
    state[P1], state[P2], state[X] = p1, p2, x
    return state


@njit
def follow(u: float, state: Array) -> None:
    """Let both pressures be the command: these models know none."""
    state[P1] = u
    state[P2] = u


@njit
def sign(value: float) -> float:
    """Return -1, 0 or 1."""
    if value > 0.0:
        return 1.0
    return -1.0 if value < 0.0 else 0.0


def stick_band() -> Parameter:
    """Declare deadband plus stickband; the default is the base valve's slow signature."""
    return Parameter(
        'S', 'S', '%', 17.5874, 0.0, 120.0, 'linear', 'Deadband plus stickband, f_s + f_d'
    )


def slip_jump() -> Parameter:
    """Declare the slip jump; the default is the base valve's slow signature."""
    return Parameter('J', 'J', '%', 3.5376, 0.0, 120.0, 'linear', 'Slip jump, f_s - f_d')


def static_level(name: str = 'f_s') -> Parameter:
    """Declare the static level on the command's side."""
    return Parameter(
        name,
        name,
        '%',
        10.5625,
        0.0,
        60.0,
        'linear',
        'Static friction: a stopped valve moves when |u - x| exceeds it',
    )


def dynamic_level(name: str = 'f_d', default: float = 7.0249) -> Parameter:
    """Declare the dynamic level on the command's side."""
    return Parameter(
        name,
        name,
        '%',
        default,
        -60.0,
        60.0,
        'linear',
        'Dynamic friction: |u - x| while the valve moves; below 0 it overshoots',
    )


def levels(f_s: Any, f_d: Any) -> dict[str, Any]:
    """Return f_s and f_d as they are."""
    return {'f_s': f_s, 'f_d': f_d}


def bands(f_s: Any, f_d: Any) -> dict[str, Any]:
    """Return S and J: the same signature in the other parametrisation."""
    return {'S': f_s + f_d, 'J': f_s - f_d}
