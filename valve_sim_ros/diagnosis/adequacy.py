# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Is what a model leaves over more than noise? The null model of the diagnosis."""

from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from ..model.pipeline import Array
from .coloured_noise import Colour, colour_of

WINDOW = 20
"""Samples of the windows in which noise is told from misfit."""
LARGE = 10.0
"""Errors beyond this are slips at other moments rather than misfit [noise]."""
FAR = 4.5
"""Errors beyond this are hardly ever noise [noise]."""
QUIET = 0.3
"""The quietest share of the windows shows the noise."""
ONE_SLIP = 0.01
"""The share of a record (one to three windows) in which a single slip is over, and the stem where
it should be."""
LOWEST, HIGHEST = 0.3, 8.0
"""What may be noise [that seen from sample to sample]: a swinging model leaves no quiet window."""
AS_QUIET = 0.85
"""Coloured noise shows at least this part of the noise that windows see of such noise: misfit has
windows that are quieter."""
TAILS, EXAMPLE = 1.1, 20_000
"""Mean square that coloured noise has at most [its variance]: slips are none; and how many samples
of it show what windows see."""


class Leftover(NamedTuple):
    """What a model leaves of a signal, in multiples of the noise seen from sample to sample.

    mean_square of the whole, single errors beyond LARGE growing linearly; the same with those
    cut off at LARGE; that of the noise alone, the number of samples that count, how many of them
    make one independent value (coloured noise), how many are beyond FAR times the noise, and
    whether all of it is coloured noise.
    """

    mean_square: float
    cut: float
    floor: float
    samples: int
    inflation: float
    far: int = 0
    noise: bool = False

    @property
    def excess(self) -> float:
        """Mean square beyond the noise, over the noise."""
        return max(self.cut / self.floor - 1.0, 0.0)

    @property
    def worth(self) -> float:
        """What of a cost one independent value makes up."""
        return self.inflation * (self.floor if self.noise else 1.0)

    def closed_by(self, after: 'Leftover') -> float:
        """Part of what is beyond the noise that `after` leaves no more, 0 to 1."""
        floor = after.floor if after.noise else min(self.floor, after.floor)
        missing = max(self.mean_square - floor, 1e-9)
        return min(max(1.0 - (after.mean_square - floor) / missing, 0.0), 1.0)


def leftover(residual: Array) -> Leftover:
    """Look at the residual of a signal over its noise, shape (n,), 0 or NaN where not counted."""
    values = residual[np.isfinite(residual) & (residual != 0.0)]
    if values.size < 4 * WINDOW:
        total = float(np.mean(values**2)) if values.size else 0.0
        return Leftover(total, total, 1.0, values.size, 1.0)
    quiet, inflation = _quiet(values)
    floor = min(max(quiet, LOWEST), HIGHEST)
    sizes = np.abs(values)
    cut = np.minimum(sizes, LARGE)
    square = float(np.mean(cut**2))
    colour = colour_of(residual) if inflation > 1.0 else None
    if colour and not _alike(colour, quiet, square):
        colour = None
    if colour:
        floor = max(floor, colour.variance)
        inflation = max(inflation, colour.inflation)
    return Leftover(
        float(np.mean(cut * (2.0 * sizes - cut))),
        square,
        floor,
        values.size,
        inflation,
        int(np.sum(sizes > FAR * floor**0.5)),
        colour is not None,
    )


def but_one_slip(residual: Array) -> Array:
    """Return the residual of a signal over its noise without the worst short span, shape (n,)."""
    far = np.flatnonzero(np.abs(residual) > FAR * leftover(residual).floor ** 0.5)
    if not far.size:
        return residual
    ends = far + int(np.clip(ONE_SLIP * residual.size, WINDOW, 3 * WINDOW))
    worst = np.argmax(np.searchsorted(far, ends) - np.arange(far.size))
    rest = residual.copy()
    rest[max(far[worst] - 1, 0) : ends[worst]] = np.nan
    return rest


def _alike(colour: Colour, quiet: float, square: float) -> bool:
    """Tell whether what quiet windows and the mean square show is as of noise of a colour."""
    if square > TAILS * colour.variance:
        return False
    return quiet >= AS_QUIET * _quiet(colour.example(EXAMPLE))[0]


def _quiet(values: Array) -> tuple[float, float]:
    """Return the noise that windows of an error show, and what `_inflation` tells of it."""
    windows = values[: values.size // WINDOW * WINDOW].reshape(-1, WINDOW)
    variances = windows.var(axis=1, ddof=1)
    expected = chi2.ppf(QUIET, WINDOW - 1) / (WINDOW - 1)
    inflation = _inflation(windows[variances <= np.quantile(variances, 0.6)])
    return float(np.quantile(variances, QUIET)) / expected * inflation**0.5, inflation


def _inflation(windows: Array) -> float:
    """Return how many samples of AR(1) noise make one independent value, from windows of it."""
    centred = windows - windows.mean(axis=1, keepdims=True)
    n = windows.shape[1]
    power = max(float(np.mean(centred**2)), 1e-12)
    first = float(np.mean(centred[:, 1:] * centred[:, :-1])) / power + 1.0 / n
    colour = min(max(first, 0.0), 0.9)
    return (1.0 + colour) / (1.0 - colour)
