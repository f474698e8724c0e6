# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether an effect changes what is measured by more than noise and a shift of a sample."""

import numpy as np

from .plant import Trace

WANTED = 3.0
"""Least change of some measured signal [multiples of its noise]."""
SHARE = 0.05
"""Share of the record over which the change is averaged: where it is largest."""


def change(with_effect: np.ndarray, without: np.ndarray) -> float:
    """Return the root mean square change where it is largest, at the most lenient shift [%]."""
    index = np.arange(without.size, dtype=float)
    found = np.inf
    for shift in (-1.0, -0.5, 0.0, 0.5, 1.0):
        difference = np.sort(np.abs(with_effect - np.interp(index + shift, index, without)))
        largest = difference[-max(int(SHARE * difference.size), 20) :]
        found = min(found, float(np.sqrt(np.mean(largest**2))))
    return found


def visible(
    with_effect: Trace, without: Trace, noise: dict[str, float], signals: tuple[str, ...]
) -> dict[str, float]:
    """Return the change of each measured signal [multiples of its noise]."""
    return {
        name: change(getattr(with_effect, name), getattr(without, name)) / noise[name]
        for name in signals
    }
