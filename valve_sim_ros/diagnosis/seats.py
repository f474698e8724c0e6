# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ends of the stroke: a seat at 0 %, a stop at 100 %, as every valve has them.

The base valve never gets there, for friction holds it back. What an effect presses beyond, the
ends hold: they are part of the valve then, and no effect.
"""

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ..model.effects.travel_stops import EFFECT
from ..model.pipeline import Array

STOPS = EFFECT.id
ENDS = {'lower': 0.0, 'upper': 100.0}
"""Where the stroke ends [% of span], by the parameter of the stops."""
SEAT = 1.0
"""Stops this near to the ends of the stroke are no others [% of span]."""
NEAR, BEYOND = 3.0, 4.0
"""A stem at the end of the stroke is within, one that has none is beyond so much [noise]."""
PRESSED, OUTSIDE = 0.002, 0.002
"""Least share of the samples at an end after x has left it, largest of those beyond."""


def seats_of(x: Array, noise: float) -> dict[str, float]:
    """Return the stops at those ends of the stroke against which x was pressed.

    Parameters
    ----------
    x : ndarray, shape (n,)
        As measured [% of span].
    noise : float
        Of x [% of span].

    Returns
    -------
    dict of str to float
        The parameters of the effect, with the ends that are none out of reach; empty if no end
        shows, or x goes beyond one that does: then this stem has none, or its sensor is off.
    """
    if not x.size:
        return {}
    found = {}
    for name, end in ENDS.items():
        inward = x - end if name == 'lower' else end - x
        at_end = np.abs(inward) <= NEAR * noise
        left = np.maximum.accumulate(inward > 2.0 * NEAR * noise)
        if np.mean(at_end & left) >= PRESSED:
            if np.mean(inward < -BEYOND * noise) > OUTSIDE:
                return {}
            found[f'{STOPS}.{name}'] = end
    neutral = {f'{STOPS}.{each.name}': each.neutral for each in EFFECT.parameters}
    return {**neutral, **found} if found else {}


def seated(
    values: Mapping[str, float], effects: Sequence[str], seats: Mapping[str, float]
) -> tuple[Mapping[str, float], Sequence[str]]:
    """Return values and effects of a valve, one with effects between its `seats`."""
    if not (seats and effects) or STOPS in effects:
        return values, effects
    return {**values, **seats}, (*effects, STOPS)


def ends_of(values: Mapping[str, float], names: Iterable[str] = tuple(ENDS)) -> list[float]:
    """Return the ends of the stroke that stops with these parameters are [% of span]."""
    return [ENDS[name] for name in names if abs(values[f'{STOPS}.{name}'] - ENDS[name]) <= SEAT]
