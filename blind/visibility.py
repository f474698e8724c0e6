# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether an effect changes what is measured by more than noise and a shift of a sample."""

import numpy as np

from .plant import Trace

WANTED = 3.0
"""Least change of some measured signal [multiples of its noise]."""
LEFT = 1.5
"""Least part of it that no other valve without the effect can imitate [multiples of noise]."""
IMITATED = 0.1
"""What leaves less in the first signal that it changes is imitated in those behind it, too, though
a rough refit may err there [multiples of noise]."""
STEPS, ROUNDED_NOISE = 4.0, 1.5
"""Least steps of a coarse sensor [multiples of noise]: noise on top, or rounded with it."""
SHARE = 0.05
"""Share of the record over which the change is averaged: where it is largest."""


def largest(values: np.ndarray) -> float:
    """Return the root mean square of the values where they are largest."""
    ordered = np.sort(np.abs(values))[-max(int(SHARE * values.size), 20) :]
    return float(np.sqrt(np.mean(ordered**2)))


def change(with_effect: np.ndarray, without: np.ndarray) -> float:
    """Return the root mean square change where it is largest, at the most lenient shift [%]."""
    index = np.arange(without.size, dtype=float)
    return min(
        largest(with_effect - np.interp(index + shift, index, without))
        for shift in (-1.0, -0.5, 0.0, 0.5, 1.0)
    )


def visible(
    with_effect: Trace, without: Trace, noise: dict[str, float], signals: tuple[str, ...]
) -> dict[str, float]:
    """Return the change of each measured signal [multiples of its noise]."""
    return {
        name: change(getattr(with_effect, name), getattr(without, name)) / noise[name]
        for name in signals
    }
