# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a recording can tell about its valve and what it cannot, before anything is fitted."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from .excitation import Flow, flow, Move, moves, slips, Span, span, turns
from .recording import Recording
from .visibility import counted, Facts, HIDDEN, PARAMETERS, Verdict, VISIBLE, WEAK

__all__ = ['HIDDEN', 'PARAMETERS', 'Examination', 'Verdict', 'examine', 'together']


FULL_STROKE = 80.0


@dataclass(frozen=True)
class Examination:
    """What was found in a recording.

    Attributes
    ----------
    sample_time, duration : float
        [s]
    signals : mapping of str to Span
        Range, noise and resolution by signal, u included.
    turning_points : tuple of float
        Of u, its first and last value included [%].
    filling, emptying : Flow
        Of the chamber.
    moves : tuple of Move
        Of the stem; empty if x was not measured.
    verdicts : tuple of Verdict
        One per parameter.
    warnings : tuple of str
        What is wrong with the recording as a whole.
    quality : tuple of str
        How it was recorded.
    """

    sample_time: float
    duration: float
    signals: Mapping[str, Span]
    turning_points: tuple[float, ...]
    filling: Flow
    emptying: Flow
    moves: tuple[Move, ...]
    verdicts: tuple[Verdict, ...]
    warnings: tuple[str, ...]
    quality: tuple[str, ...]

    @property
    def reversals(self) -> int:
        """Turns of u from up to down or back."""
        return max(len(self.turning_points) - 2, 0)

    @property
    def missing(self) -> tuple[Verdict, ...]:
        """The verdicts that ask for more."""
        return tuple(each for each in self.verdicts if each.cure)

    def lines(self) -> list[str]:
        """Return everything in words, one finding per line."""
        lines = [*self.quality, *self._what_happened()]
        lines += [f'warning: {each}' for each in self.warnings]
        lines += [f'{each.parameter}: {each.visibility}: {each.reason}' for each in self.verdicts]
        cures = dict.fromkeys(each.cure for each in self.missing)
        lines += [f'record next: {cure}' for cure in cures]
        return lines or ['nothing to say']

    def _what_happened(self) -> list[str]:
        """Return range and noise by signal, and what u, p2 and the stem did."""
        lines = [
            f'{name}: from {each.low:.4g} to {each.high:.4g} %, noise at most {each.noise:.2g} %'
            for name, each in self.signals.items()
            if name != 'u'
        ]
        points = self.turning_points
        lines.append(
            f'u: {counted(self.reversals, "reversal")} between {min(points):.4g} and '
            f'{max(points):.4g} %'
        )
        for name, each in (('fills', self.filling), ('empties', self.emptying)):
            known = each.time_constant > 0.0
            about = f'about {each.time_constant:.3g} s' if known else 'unknown'
            lines.append(
                f'the chamber {name} for up to {each.longest:.4g} s in one go, by '
                f'{each.swing:.3g} % (time constant {about})'
            )
        if 'x' in self.signals:
            strokes = sum(abs(move.distance) >= FULL_STROKE for move in self.moves)
            up = sum(move.distance > 0 for move in self.moves)
            lines.append(
                f'x: {counted(len(self.moves), "move")} ({up} up, {len(self.moves) - up} down), '
                f'{strokes} of them full strokes'
            )
        return lines


def examine(recording: Recording) -> Examination:
    """Look at a recording as a doctor would: what is there, what is missing, what to do.

    Parameters
    ----------
    recording : Recording
        As read; nothing is fitted.

    Returns
    -------
    Examination
    """
    signals = {
        name: span(getattr(recording, name))
        for name in ('u', *recording.signals)
        if np.isfinite(getattr(recording, name)).any()
    }
    x = recording.x if 'x' in signals else None
    noise = signals['x'].noise if x is not None else 0.0
    found = [] if x is None else [m for part in recording.segments for m in moves(x[part], noise)]
    chamber = max((signals[name].noise for name in ('x', 'p2') if name in signals), default=0.0)
    facts = Facts(
        recording,
        signals,
        np.concatenate([turns(recording.u[part]) for part in recording.segments]),
        flow(recording, 1, chamber),
        flow(recording, -1, chamber),
        found,
        (0, 0.0) if x is None else slips(x, noise),
    )
    return Examination(
        sample_time=recording.sample_time,
        duration=float(recording.time[-1]),
        signals=signals,
        turning_points=tuple(facts.points.tolist()),
        filling=facts.filling,
        emptying=facts.emptying,
        moves=tuple(found),
        verdicts=(
            facts.backlash(),
            facts.time_constant('T_g1', facts.filling),
            facts.time_constant('T_g2', facts.emptying),
            facts.static_friction(),
            facts.dynamic_friction(),
            facts.slip(),
        ),
        warnings=tuple(facts.warnings()),
        quality=tuple(recording.quality.lines()),
    )


def together(examinations: Sequence[Examination]) -> tuple[Verdict, ...]:
    """Return the best verdict on each parameter: what one recording lacks another may have."""
    order = (VISIBLE, WEAK, HIDDEN)
    return tuple(
        min(verdicts, key=lambda each: order.index(each.visibility))
        for verdicts in zip(*(each.verdicts for each in examinations), strict=True)
    )
