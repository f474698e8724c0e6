# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Distributed hysteresis of the converter or of the stem."""

from typing import Any

from numba import njit

from ..declarations import Effect, EffectParameter
from ..memory import bouc_wen, mean_of_plays
from ..stem import Friction

PLAYS = 5
STEP, SHORTEST = 0.04, 0.1
"""Longest step of a stem that moves against such a force [s]; least reach of it."""


@njit
def command(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the command behind its hysteresis."""
    return behind(value, p[0], p[4], p[5], memory[:PLAYS])


@njit
def inlet(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return p1 behind its hysteresis."""
    return behind(value, p[1], p[4], p[5], memory[PLAYS : 2 * PLAYS])


@njit
def sensor(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return x behind its hysteresis."""
    return behind(value, p[2], p[4], p[5], memory[2 * PLAYS : 3 * PLAYS])


@njit
def force(value: Any, state: Any, p: Any, memory: Any, dt: float) -> tuple[float, Friction]:
    """Return the tangent at x of a force w z(x) that opposes the stem, Bouc-Wen's z."""
    width, reach = p[3], p[3] * max(p[4], SHORTEST)
    if width <= 0.0:
        return value
    offset, f = value
    held = state.x - bouc_wen(state.x, width, reach, memory[3 * PLAYS :])
    way = state.direction
    if way == 0.0:
        way = 1.0 if state.p2 + offset - held >= f.stiffness * state.x else -1.0
    tangent = (width - max(way * held, 0.0)) / reach
    offset -= held - tangent * state.x
    return offset, Friction(
        f.static_up, f.static_down, f.dynamic_up, f.dynamic_down, f.stiffness + tangent
    )


@njit
def stride(value: float, state: Any, p: Any, memory: Any, dt: float) -> float:
    """Return the longest step while the stem moves: its force follows its place."""
    return min(value, STEP) if p[3] > 0.0 else value


@njit
def behind(value: float, width: float, reach: float, direct: float, memory: Any) -> float:
    """Return a signal behind plays, or behind a memory that fills gradually."""
    if width <= 0.0:
        return value
    if reach <= 0.0:
        return direct * value + (1.0 - direct) * mean_of_plays(value, width, memory)
    return bouc_wen(value, width, width * max(reach, 1.0), memory)


def held_behind(
    f_s: float,
    command: float,
    inlet: float,
    stem: float,
    force: float,
    reach: float,
    direct: float,
) -> float:
    """Return the friction that holds a stem whose x is seen behind plays as f_s does without."""
    lag = stem if reach > 0.0 else 0.5 * (1.0 - direct) * (1.0 + 1.0 / PLAYS) * stem
    return max(f_s - lag, 0.1 * f_s)


EFFECT = Effect(
    id='hysteresis',
    title='Distributed hysteresis',
    stage='u-p1',
    parameters=(
        EffectParameter(
            'command_width',
            'w_u',
            '%',
            0.0,
            0.0,
            30.0,
            'linear',
            'Half-width of the widest play, or of the loop, that u passes through before f_d1',
            starts=(1.0, 3.0),
            usual=(0.6, 15.0),
        ),
        EffectParameter(
            'inlet_width',
            'w_1',
            '%',
            3.0,
            0.0,
            30.0,
            'linear',
            'Half-width of the widest play, or of the loop, that p1 passes through',
            usual=(0.6, 15.0),
        ),
        EffectParameter(
            'stem_width',
            'w_x',
            '%',
            0.0,
            0.0,
            30.0,
            'linear',
            'Half-width of the widest play, or of the loop, that x passes through',
            stage='p2-x',
            starts=(2.0, 6.0),
            usual=(0.6, 15.0),
        ),
        EffectParameter(
            'force_width',
            'w_f',
            '%',
            0.0,
            0.0,
            30.0,
            'linear',
            'Half-width of the loop of the force with which spring or diaphragm oppose the stem',
            stage='p2-x',
            starts=(1.5, 5.0),
            usual=(0.6, 15.0),
        ),
        EffectParameter(
            'reach',
            'r',
            '-',
            0.0,
            0.0,
            20.0,
            'linear',
            '0: plays; else Bouc-Wen, which falls behind over 1 or more times the width (a force '
            'over any share of it)',
            starts=(1.2, 2.5),
        ),
        EffectParameter(
            'direct',
            'd',
            '-',
            0.0,
            0.0,
            0.9,
            'linear',
            'Share that passes without any play',
            starts=(0.25,),
        ),
    ),
    slots={
        'command_slot': command,
        'inlet_slot': inlet,
        'force_slot': force,
        'stride_slot': stride,
        'sensor_slot': sensor,
    },
    memory=3 * PLAYS + 2,
    order=20,
    variants=(
        ('inlet_width',),
        ('inlet_width', 'direct'),
        # plays may change places with f_d1, Bouc-Wen may not
        ('inlet_width', 'reach'),
        ('command_width', 'reach'),
        ('stem_width',),
        ('stem_width', 'direct'),
        ('stem_width', 'reach'),
        ('force_width', 'reach'),
    ),
    balance=held_behind,
    explanation='Many small plays, as in a worn linkage or a flapper, instead of a single one.',
    symptom='Rounded loops, with minor loops inside them, after each reversal.',
    confirm='Run small reversals of growing size slowly.',
    twins={
        'presliding': 'presliding acts on p2-x only: record p1 and p2',
        'linkage_backlash': 'a single play holds x completely after a reversal: slow reversals',
    },
    references=(
        'Prandtl-Ishlinskii operator with a uniform density of play widths',
        'Ismail, Ikhouane, Rodellar 2009, The hysteresis Bouc-Wen model, a survey',
    ),
)
