# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands that an engineer would send to learn about a valve."""

from collections.abc import Callable

import numpy as np
from scipy.signal import lfilter

Array = np.ndarray


class Writer:
    """Writes a command record piece by piece.

    Parameters
    ----------
    rng : Generator
        Source of all choices.
    period : float
        Time between commands [s].
    low, high : float
        Range of the commands [%].
    band : float
        Size of a reversal that just about moves the stem [%].
    """

    def __init__(
        self, rng: np.random.Generator, period: float, low: float, high: float, band: float
    ):
        self.rng, self.period, self.low, self.high, self.band = rng, period, low, high, band
        self.level = float(rng.uniform(low, high))
        self.pieces: list[Array] = []

    @property
    def length(self) -> int:
        """Return the number of commands so far."""
        return sum(piece.size for piece in self.pieces)

    def hold(self, level: float, seconds: float) -> None:
        """Step to a level and stay there."""
        self.level = float(np.clip(level, self.low, self.high))
        self.pieces.append(np.full(max(int(seconds / self.period), 1), self.level))

    def ramp(self, level: float, speed: float) -> None:
        """Go to a level at a speed [%/s]."""
        level = float(np.clip(level, self.low, self.high))
        n = max(int(abs(level - self.level) / speed / self.period), 1)
        self.pieces.append(np.linspace(self.level, level, n + 1)[1:])
        self.level = level


def staircase(w: Writer) -> None:
    """Go up and down in equal steps with holds."""
    levels = np.linspace(w.low, w.high, w.rng.integers(4, 8))
    hold = w.rng.uniform(10, 26)
    for level in (*levels, *levels[-2::-1]):
        w.hold(level, hold)


def big_steps(w: Writer) -> None:
    """Step far, both ways, and wait until the chamber has followed."""
    for _ in range(w.rng.integers(2, 4)):
        far = w.high if w.level < 0.5 * (w.low + w.high) else w.low
        w.hold(w.level + w.rng.uniform(0.5, 1.0) * (far - w.level), w.rng.uniform(20, 50))


def ramps(w: Writer) -> None:
    """Ramp slowly through most of the range and back."""
    speed = np.exp(w.rng.uniform(np.log(0.6), np.log(4.0)))
    w.ramp(w.low + w.rng.uniform(0, 10), 4 * speed)
    w.ramp(w.high - w.rng.uniform(0, 10), speed)
    w.hold(w.level, w.rng.uniform(3, 15))
    w.ramp(w.low + w.rng.uniform(0, 10), speed)


def random_stairs(w: Writer) -> None:
    """Step to random levels with random holds."""
    for _ in range(w.rng.integers(6, 12)):
        w.hold(w.rng.uniform(w.low, w.high), w.rng.uniform(5, 25))


def small_reversals(w: Writer) -> None:
    """Reverse around one level by growing amounts."""
    centre = w.rng.uniform(w.low + 10, w.high - 10)
    w.hold(centre, 15)
    for growth in np.linspace(0.3, 1.5, w.rng.integers(5, 9)):
        w.hold(centre + growth * w.band, w.rng.uniform(4, 12))
        w.hold(centre - growth * w.band, w.rng.uniform(4, 12))


def sine(w: Writer) -> None:
    """Swing around one level."""
    half = 0.5 * (w.high - w.low)
    amplitude = w.rng.uniform(0.25, 0.9) * half
    centre = 0.5 * (w.low + w.high) + w.rng.uniform(-1, 1) * (half - amplitude)
    period = w.rng.uniform(20, 90)
    w.ramp(centre, 5.0)
    n = int(w.rng.integers(2, 4) * period / w.period)
    w.pieces.append(centre + amplitude * np.sin(2 * np.pi * w.period / period * np.arange(n)))
    w.level = float(w.pieces[-1][-1])


def rest_and_nudge(w: Writer) -> None:
    """Rest for different times, then go on in small steps of either direction."""
    for rest in w.rng.permutation([6.0, 20.0, 60.0]):
        w.hold(w.level, rest * w.rng.uniform(0.7, 1.3))
        way = 1 if w.level < 0.5 * (w.low + w.high) else -1
        for sign in (1, 1, -1):
            w.hold(w.level + sign * way * w.rng.uniform(1.2, 2.5) * w.band, w.rng.uniform(5, 15))


def closed_loop(w: Writer) -> None:
    """Move as a controller does: swing towards changing levels, and never quite rest."""
    holds = [
        np.full(int(w.rng.uniform(30, 90) / w.period), 1.0) for _ in range(w.rng.integers(2, 5))
    ]
    wanted = np.concatenate([hold * w.rng.uniform(w.low, w.high) for hold in holds])
    swing = 2 * np.pi * w.period / w.rng.uniform(15, 60)
    poles = np.exp(swing * (-w.rng.uniform(0.3, 0.8) + 1j))
    filtered = lfilter(
        [abs(1 - poles) ** 2], [1, -2 * poles.real, abs(poles) ** 2], wanted - w.level
    )
    keep = np.exp(-w.period / 3.0)
    wander = lfilter([np.sqrt(1 - keep**2)], [1, -keep], w.rng.standard_normal(wanted.size))
    u = w.level + filtered + w.rng.uniform(0.05, 0.5) * wander
    w.pieces.append(np.clip(u, w.low - 2, w.high + 2))
    w.level = float(np.clip(u[-1], w.low, w.high))


WIDE: tuple[Callable[[Writer], None], ...] = (
    staircase,
    big_steps,
    ramps,
    random_stairs,
    sine,
    closed_loop,
)
NARROW = (small_reversals, rest_and_nudge)


def choose_pieces(rng: np.random.Generator) -> list[Callable[[Writer], None]]:
    """Return all kinds of pieces, or one to three of which one at least is wide."""
    if rng.random() < 0.5:
        return [*WIDE, *NARROW]
    first = int(rng.integers(len(WIDE)))
    others = [*WIDE[:first], *WIDE[first + 1 :], *NARROW]
    more = rng.choice(len(others), rng.integers(0, 3), replace=False)
    return [WIDE[first], *(others[k] for k in more)]


def commands(
    rng: np.random.Generator, seconds: float, period: float, span: tuple[float, float], band: float
) -> Array:
    """Return a record of commands: of every kind, or of a few.

    Parameters
    ----------
    rng : Generator
        Source of all choices.
    seconds, period : float
        Length and time between commands [s].
    span : (float, float)
        Lowest and highest command [%].
    band : float
        Size of a reversal that just about moves the stem [%].

    Returns
    -------
    ndarray, shape (round(seconds / period),)
        Commands [%].
    """
    writer = Writer(rng, period, *span, band)
    wanted = round(seconds / period)
    pieces = choose_pieces(rng)
    while writer.length < wanted:
        for k in rng.permutation(len(pieces)):
            pieces[k](writer)
    return np.clip(np.concatenate(writer.pieces)[:wanted], 0.0, 100.0)
