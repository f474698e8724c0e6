# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Noise of a colour: white noise and noise that lasts, an autoregression of first order.

Windows see too little of noise that lasts as long as they do. What tells it from misfit: foretold
from what came before it leaves white noise, as loud all the time.
"""

import math
from typing import NamedTuple

from numba import njit
import numpy as np
from scipy.signal import lfilter

from ..model.pipeline import Array

COLOURS, CLIPPED = (0.4, 0.95), 4.0
"""Correlation from sample to sample of what may be noise that lasts; values further out than this
are slips [standard deviations]."""
SEEN, ENOUGH = 8, 3000
"""Lags that show the colour, and samples that tell white noise beside it: in fewer misfit passes
for it."""
LAGS, WHITE, SURELY = 4, 0.04, 2.5
"""Innovations of noise are white: correlations over so many samples are no larger than this, or so
many times their own error."""
LONG_WINDOWS = {10: 0.2, 20: 0.3}
"""So much more than those of white noise may means of windows of so many samples vary."""
BLOCK, STEADY = 20, 1.7
"""So many times what chance makes of it may the power of blocks of so many innovations vary: noise
is as loud all the time, misfit comes and goes."""


class Colour(NamedTuple):
    """Noise that lasts, with its correlation from sample to sample, and white noise: variances."""

    correlation: float
    lasting: float
    white: float

    @property
    def variance(self) -> float:
        """Variance of both together."""
        return self.lasting + self.white

    @property
    def inflation(self) -> float:
        """How many samples make one independent value."""
        share = self.lasting / self.variance
        return 1.0 + 2.0 * share * self.correlation / (1.0 - self.correlation)

    def example(self, samples: int) -> Array:
        """Return noise like it, shape (samples,), always the same."""
        rng = np.random.default_rng(0)
        steps = math.sqrt(self.lasting * (1.0 - self.correlation**2)) * rng.standard_normal(
            samples
        )
        lasting = lfilter([1.0], [1.0, -self.correlation], steps)
        return np.asarray(lasting + math.sqrt(self.white) * rng.standard_normal(samples))


def colour_of(residual: Array) -> Colour | None:
    """Return what noise a residual may be, shape (n,), 0 or NaN where not counted, or None."""
    values = np.where(residual != 0.0, residual, np.nan)
    limit = CLIPPED * float(np.nanmedian(np.abs(values))) / 0.6745
    values = np.clip(values, -limit, limit)
    whole, *products = (
        float(np.nanmean(values[lag:] * values[: values.size - lag])) for lag in range(SEEN)
    )
    seen = np.array(products)
    correlation, lasting = seen[0] / max(whole, 1e-12), whole
    if np.count_nonzero(np.isfinite(values)) >= ENOUGH:
        correlation = float(seen[1:] @ seen[:-1] / max(float(seen[:-1] @ seen[:-1]), 1e-12))
        lasting = min(seen[0] / max(correlation, 1e-12), whole)
    if not (COLOURS[0] <= correlation <= COLOURS[1] and seen[0] > 0.0):
        return None
    colour = Colour(correlation, lasting, whole - lasting)
    innovations = _innovations(values, *colour)
    known = innovations[np.isfinite(innovations)]
    variance = float(np.mean(known**2))
    tolerance = max(WHITE, SURELY / known.size**0.5)
    for lag in range(1, LAGS + 1):
        if abs(float(np.nanmean(innovations[lag:] * innovations[:-lag]))) > tolerance * variance:
            return None
    for width, more in LONG_WINDOWS.items():
        means = known[: known.size // width * width].reshape(-1, width).mean(axis=1)
        if float(np.mean(means**2)) * width > (1.0 + more) * variance:
            return None
    blocks = known[: known.size // BLOCK * BLOCK].reshape(-1, BLOCK)
    by_chance = 2.0 / BLOCK * variance**2
    if float(np.var(np.mean(blocks**2, axis=1))) > STEADY * by_chance:
        return None
    return colour


@njit(cache=True, nogil=True)
def _innovations(values: Array, correlation: float, lasting: float, white: float) -> Array:
    """Return what each value differs from the one foretold (Kalman filter) by, over its error."""
    innovations = np.full(values.size, np.nan)
    mean, variance = 0.0, lasting
    for index, value in enumerate(values):
        if not math.isnan(value):
            total = variance + white
            innovations[index] = (value - mean) / math.sqrt(total)
            mean += variance / total * (value - mean)
            variance *= white / total
        mean *= correlation
        variance = correlation**2 * variance + (1.0 - correlation**2) * lasting
    return innovations
