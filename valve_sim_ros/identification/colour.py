# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Residuals that remember: their autocovariance, and what it makes of the parameters' scatter."""

from collections.abc import Sequence

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from ..model.pipeline import Array
from .problem import Problem
from .stretches import Mask

MOST_LAGS = 30
"""Longest memory of the autoregressive model of the residuals [samples]."""
LEAST_FREEDOM = 0.25
"""Least share of the independent samples that the fit is taken to leave free."""


def scatter(problem: Problem, jacobian: Array, residuals: Array) -> Array:
    """Return J' Omega J, Omega being the covariance of the residuals; shape (size, size).

    Omega is that of an autoregressive process fitted to each signal's residuals (Yule-Walker,
    order by Akaike's criterion): noise that is white gives the usual sum, noise that is not gives
    the scatter that least squares really have (the middle of the sandwich formula). What the fit
    has taken out of the residuals is put back by the degrees of freedom, counted in samples that
    are as good as independent.
    """
    size = jacobian.shape[1]
    result, independent = np.zeros((size, size)), 0.0
    for name in problem.signals:
        parts = [part for signal, part in problem.blocks if signal == name]
        counts = [stretch[name] for stretch in problem.counts]
        found = _covariances(residuals, parts, counts)
        coefficients, variance = _autoregression(found)
        longest = variance / float(coefficients.sum()) ** 2
        independent += found[0] * min(float(found[1]) / max(longest, 1e-12), 1.0)
        for part in parts:
            result += _weighted(jacobian[part], coefficients, variance)
    return result / max(1.0 - size / max(independent, 1.0), LEAST_FREEDOM)


def _covariances(residuals: Array, parts: Sequence[slice], counts: Sequence[Mask]) -> Array:
    """Return the autocovariance at lags 0, 1, ... over all stretches, and how many samples."""
    total = sum(int(count.sum()) for count in counts)
    most = int(min(MOST_LAGS, total // 20, max(part.stop - part.start for part in parts) - 1))
    sums, pairs = np.zeros(most + 1), np.zeros(most + 1)
    for part, count in zip(parts, counts, strict=True):
        for values, into in ((residuals[part] * count, sums), (count.astype(float), pairs)):
            size = next_fast_len(values.size + most)
            products = irfft(np.abs(rfft(values, size)) ** 2, size)[: min(most + 1, values.size)]
            into[: products.size] += products
    # dividing all lags by the same number keeps the matrix positive where nothing is lost
    thinning = np.maximum(pairs, 0.5) / max(pairs[0], 1.0)
    fullness = (total - np.arange(most + 1)) / max(total, 1)
    return np.r_[total, sums / max(pairs[0], 1.0) * fullness / thinning]


def _autoregression(found: Array) -> tuple[Array, float]:
    """Return 1, a_1, ..., a_p and the variance of the innovations, the order by Akaike."""
    total, covariances = found[0], found[1:]
    variance = max(float(covariances[0]), 1e-12)
    coefficients = np.ones(1)
    best = (total * np.log(variance), coefficients, variance)
    for order in range(1, covariances.size):
        # Levinson's recursion
        memory = float(coefficients @ covariances[order:0:-1])
        reflection = -memory / variance
        if not abs(reflection) < 1.0:
            break
        longer = np.r_[coefficients, 0.0]
        coefficients = longer + reflection * longer[::-1]
        variance *= 1.0 - reflection**2
        score = total * np.log(variance) + 2.0 * order
        if score < best[0]:
            best = (score, coefficients, variance)
    return best[1], best[2]


def _weighted(rows: Array, coefficients: Array, variance: float) -> Array:
    """Return rows' Omega rows for a stretch, through the spectrum of the process."""
    size = next_fast_len(2 * rows.shape[0] + MOST_LAGS)
    spectrum = variance / np.abs(rfft(coefficients, size)) ** 2
    waves = rfft(rows, size, axis=0)
    # a real signal's negative frequencies are the mirror of the positive ones
    twice = np.full(spectrum.size, 2.0)
    twice[0] = 1.0
    if size % 2 == 0:
        twice[-1] = 1.0
    waves *= np.sqrt(spectrum * twice / size)[:, None]
    return np.asarray((waves.conj().T @ waves).real)
