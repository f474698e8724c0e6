# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which parameters the data can show, judged by what the recording did to the valve."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .excitation import FAINT_SWING, Flow, Move, Span
from .quality import Array
from .recording import OUTPUTS, Recording

VISIBLE, WEAK, HIDDEN = 'visible', 'weakly visible', 'not visible'
PARAMETERS = ('f_d1', 'T_g1', 'T_g2', 'f_s', 'f_d', 'a_1/a_2')
FEWEST_REVERSALS = 3
FEWEST_MOVES = 3
FEWEST_SLIPS = 5
CLEAR_SWING = 100.0
"""A swing of p2 by so many times its noise shows a time constant clearly."""
LONG_ENOUGH = 0.5
"""Share of a time constant that air has to flow in one go, to see the curve bend."""
COARSE = 5.0
"""Fewer samples than this per time constant are too few."""
SLOW_SLIP = 0.1
"""If less of a slip than this is left after two samples, it was over within one."""
MUCH_LOSS, MUCH_JITTER, MUCH_NOISE = 10.0, 0.25, 1.0
END_OF_TRAVEL, MUCH_REST = 1.0, 0.2


@dataclass(frozen=True)
class Verdict:
    """What the data can tell about one parameter.

    Attributes
    ----------
    parameter : str
        'f_d1' or another of the seven, or 'a_1/a_2'.
    visibility : str
        'visible', 'weakly visible' or 'not visible'.
    reason : str
        Why.
    cure : str
        What to record to see it better; empty if nothing is missing.
    """

    parameter: str
    visibility: str
    reason: str
    cure: str = ''


@dataclass(frozen=True)
class Facts:
    """What the verdicts are made of.

    Attributes
    ----------
    recording : Recording
    signals : mapping of str to Span
        u and the outputs that hold any value.
    points : ndarray, shape (m,)
        Turning points of u, first and last value included [%].
    filling, emptying : Flow
    moves : sequence of Move
    slips : tuple of int and float
        How many, and the share left after two samples.
    """

    recording: Recording
    signals: Mapping[str, Span]
    points: Array
    filling: Flow
    emptying: Flow
    moves: Sequence[Move]
    slips: tuple[int, float]

    def backlash(self) -> Verdict:
        """Judge f_d1: only turns of u show it."""
        count = max(self.points.size - 2, 0)
        cure = f'at least {FEWEST_REVERSALS} reversals of u, each by 10 % or more'
        if not self.recording.signals:
            return Verdict('f_d1', HIDDEN, 'no output was measured', 'p1, p2 and x beside u')
        if count == 0:
            return Verdict('f_d1', HIDDEN, 'u never turns back', cure)
        swings = np.abs(np.diff(self.points))
        words = f'{counted(count, "reversal")} of u, the largest by {swings.max():.3g} %'
        if count < FEWEST_REVERSALS or swings.max() < 5.0:
            return Verdict('f_d1', WEAK, words, cure)
        if 'p1' not in self.signals:
            reason = f'{words}, but without p1 it is hard to tell from f_d'
            return Verdict('f_d1', WEAK, reason, 'p1 too, if there is a sensor')
        return Verdict('f_d1', VISIBLE, words)

    def time_constant(self, name: str, air: Flow) -> Verdict:
        """Judge T_g1 or T_g2: air has to flow long enough one way."""
        way, step = ('fills', 'up') if name == 'T_g1' else ('empties', 'down')
        chamber = next((each for each in ('p2', 'x') if each in self.signals), '')
        if not chamber:
            return Verdict(name, HIDDEN, 'neither p2 nor x was measured', 'p2, or at least x')
        noise = max(self.signals[chamber].noise, 0.01)
        long = 2.0 * air.time_constant if air.time_constant > 0.0 else 300.0
        cure = f'a large step {step} of u and {min(long, 600.0):.0f} s without another command'
        if air.swing < FAINT_SWING * noise:
            return Verdict(name, HIDDEN, f'the chamber never {way} by much', cure)
        share = air.longest / air.time_constant if air.time_constant > 0.0 else 0.0
        words = (
            f'the chamber {way} by {air.swing:.3g} % in one go, over {share:.2g} time constants'
        )
        if air.time_constant < COARSE * self.recording.sample_time:
            return Verdict(name, WEAK, f'{words}, but within few samples', 'faster sampling')
        both = {'p1', 'p2'} <= set(self.signals)
        if air.swing < CLEAR_SWING * noise or (share < LONG_ENOUGH and not both):
            return Verdict(name, WEAK, words, cure)
        return Verdict(name, VISIBLE, words)

    def static_friction(self) -> Verdict:
        """Judge f_s: the stem has to break away from rest, both ways."""
        if 'x' not in self.signals:
            return Verdict('f_s', HIDDEN, 'x was not measured', 'x')
        up = sum(move.distance > 0 for move in self.moves)
        down = len(self.moves) - up
        cure = 'steps of u up and down with the stem at rest before each'
        words = f'the stem starts {counted(up, "time")} up and {counted(down, "time")} down'
        if not self.moves:
            return Verdict('f_s', HIDDEN, 'the stem never moves', f'{cure}, larger than so far')
        if min(up, down) == 0 or len(self.moves) < FEWEST_MOVES:
            return Verdict('f_s', WEAK, words, cure)
        return Verdict('f_s', VISIBLE, words)

    def dynamic_friction(self) -> Verdict:
        """Judge f_d: the stem has to move steadily, with p2 beside it."""
        if 'x' not in self.signals:
            return Verdict('f_d', HIDDEN, 'x was not measured', 'x')
        farthest = max((abs(move.distance) for move in self.moves), default=0.0)
        cure = 'large steps of u both ways, so that the stem travels 20 % or more in one go'
        words = f'the stem travels up to {farthest:.3g} % in one go'
        ways = {np.sign(move.distance) for move in self.moves if abs(move.distance) >= 10.0}
        if farthest < 5.0:
            return Verdict('f_d', HIDDEN, words, cure)
        if len(ways) < 2:
            return Verdict('f_d', WEAK, f'{words}, far only one way', cure)
        if 'p2' not in self.signals and 'p1' not in self.signals:
            reason = f'{words}, but without a pressure it is hard to tell from f_d1'
            return Verdict('f_d', WEAK, reason, 'p1 or p2 too, if there is a sensor')
        return Verdict('f_d', VISIBLE, words)

    def slip(self) -> Verdict:
        """Judge a_1/a_2: a slip has to last for several samples."""
        name = 'a_1/a_2'
        if 'x' not in self.signals:
            return Verdict(name, HIDDEN, 'x was not measured', 'x')
        count, left = self.slips
        if count == 0:
            return Verdict(name, HIDDEN, 'no slip of the stem stands out of the noise')
        if left < SLOW_SLIP:
            faster = 1e3 * self.recording.sample_time / 10.0
            return Verdict(
                name,
                WEAK,
                f'{counted(count, "slip")}, over within a sample',
                f'x every {faster:.3g} ms, if the slip itself matters',
            )
        words = f'{counted(count, "slip")} that last for more than a sample'
        if count < FEWEST_SLIPS:
            return Verdict(
                name, WEAK, words, 'steps of u up and down with the stem at rest before each'
            )
        return Verdict(name, VISIBLE, words)

    def warnings(self) -> list[str]:
        """Return what is wrong with the recording as a whole."""
        found, quality = [], self.recording.quality
        if np.ptp(self.recording.u) == 0.0:
            found.append(f'u stays at {self.recording.u[0]:g} %: nothing can be identified')
        missing = [name for name in OUTPUTS if name not in self.signals]
        if missing:
            found.append(f'{" and ".join(missing)} not measured')
        if quality.loss > MUCH_LOSS:
            found.append(f'{quality.loss:.2g} % of the samples are lost: find out where')
        if quality.jitter > MUCH_JITTER * quality.period:
            found.append('the stamps jitter by more than a quarter of the sample time')
        for name, each in self.signals.items():
            if name == 'u':
                continue
            if each.high - each.low < 10.0 * each.noise:
                found.append(f'{name} hardly leaves its noise: dead sensor, or wrong topic?')
            elif each.noise > MUCH_NOISE:
                found.append(f'{name} is noisy, or faster than the samples ({each.noise:.2g} %)')
            if each.clipped > 0.0:
                found.append(
                    f'{name} is clipped for {100 * each.clipped:.2g} % of the time: its sensor '
                    'is at the end of its range'
                )
            if each.low < -5.0 or each.high > 105.0:
                found.append(
                    f'{name} goes from {each.low:.4g} to {each.high:.4g}: is it in per cent of '
                    f'span? Give scale and offset, as {name}=/TOPIC*SCALE+OFFSET'
                )
        if 'x' in self.signals:
            x = self.recording.output('x')
            rest = np.mean((x < END_OF_TRAVEL) | (x > 100.0 - END_OF_TRAVEL))
            if rest > MUCH_REST:
                found.append(
                    f'x is at an end of its travel for {100 * rest:.2g} % of the time: nothing '
                    'is learnt there'
                )
        return found


def counted(count: int, word: str) -> str:
    """Return a count with its word in singular or plural."""
    return f'{count} {word}' if count == 1 else f'{count} {word}s'
