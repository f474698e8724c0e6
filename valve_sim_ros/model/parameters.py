# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The base valve's parameters: the paper's seven, the velocity dead zone, and the options.

Defaults are the paper's estimates, eq. (12). This is the only place where they are declared.
"""

from .declarations import Option, Parameter

PAPER_SEVEN = (
    Parameter(
        'f_d1',
        'f_d1',
        '%',
        1.7647,
        0.0,
        30.0,
        'linear',
        'Half-width of the backlash between command u and inlet pressure p1, eq. (1)',
    ),
    Parameter(
        'T_g1',
        'T_g1',
        's',
        8.84,
        1e-3,
        2000.0,
        'log',
        'Time constant of the chamber pressure p2 while it fills (p1 > p2), eq. (5)',
    ),
    Parameter(
        'T_g2',
        'T_g2',
        's',
        150.74,
        1e-3,
        2000.0,
        'log',
        'Time constant of the chamber pressure p2 while it empties, eq. (5)',
    ),
    Parameter(
        'f_s',
        'f_s',
        '%',
        8.7978,
        0.0,
        60.0,
        'linear',
        'Static friction: the stem breaks away when |p2 - x| exceeds it, eq. (10)',
    ),
    Parameter(
        'f_d',
        'f_d',
        '%',
        5.2602,
        0.0,
        60.0,
        'linear',
        'Dynamic friction: offset between p2 and x while the stem moves, f_d <= f_s, eq. (10)',
    ),
    Parameter(
        'a_1',
        'a_1',
        '1/s^2',
        2000.0,
        1e-2,
        1e6,
        'log',
        'Spring constant over moving mass, k/m, eq. (9)',
    ),
    Parameter(
        'a_2',
        'a_2',
        '1/s',
        176.0,
        1e-4,
        1e6,
        'log',
        'Viscous friction over moving mass, F_v/m, eq. (9)',
    ),
)

DELTA = Parameter(
    'delta',
    'δ',
    '%/s',
    1e-5,
    0.0,
    100.0,
    'linear',
    'Stem speed below which it counts as stopped; 0.0984 is the value with the right '
    'dimension, the default is the one printed in eq. (9)',
)

BASE = (*PAPER_SEVEN, DELTA)
"""Parameters of the base valve, in the order in which the compiled code receives them."""

BRANCH = Option(
    'branch',
    'zoh',
    ('zoh', 'printed'),
    'Which pressure decides between filling and emptying: zoh compares the held p1(t-1), '
    'printed the new p1(t) as in eq. (5)',
)

SAMPLE_TIME = Parameter(
    'sample_time',
    'T_s',
    's',
    0.2,
    1e-4,
    60.0,
    'log',
    'Sampling period of the valve',
)
