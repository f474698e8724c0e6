# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands of the paper's experiments, as far as the paper prints them, Sect. 3.

What it does not print is reconstructed, and each assumption is named: lengths, the base of the
impulse, the frequencies of the cosine, the set points of the closed loop, the initial states.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..model.errors import ModelError
from ..model.pipeline import Array


@dataclass(frozen=True)
class Experiment:
    """An experiment on a valve.

    Attributes
    ----------
    name, title : str
        Name on the command line; what it is and where in the paper.
    sample_time : float
        [s].
    commands : callable
        Returns u [% of span], shape (n,); the set points if `closed_loop`.
    assumptions : tuple of str
        What the paper does not print.
    closed_loop : bool
        Whether a PI controller on x makes the command.
    """

    name: str
    title: str
    sample_time: float
    commands: Callable[[], Array]
    assumptions: tuple[str, ...]
    closed_loop: bool = False


def steps() -> Array:
    """Return a staircase from 0 to 100 % and back, each level held for four T_g2."""
    up = np.arange(0.0, 101.0, 10.0)
    return np.repeat(np.concatenate([up, up[-2::-1]]), 3000)


def step() -> Array:
    """Return a step from 0 to 50 %."""
    return np.concatenate([np.zeros(45), np.full(280, 50.0)])


def impulse() -> Array:
    """Return two samples of 80 % on 50 %."""
    parts = [(50, 0.0), (300, 50.0), (2, 80.0), (300, 50.0)]
    return np.concatenate([np.full(n, level) for n, level in parts])


def cosine() -> Array:
    """Return a cosine over the whole span whose frequency falls from 5 mHz to 0.3 mHz."""
    first, last, duration = 5e-3, 3e-4, 3000.0
    t = 0.2 * np.arange(round(duration / 0.2))
    fall = np.log(last / first)
    phase = 2.0 * np.pi * first * duration / fall * np.expm1(fall * t / duration)
    return 50.0 + 50.0 * np.cos(phase)


def set_points() -> Array:
    """Return 40, 60 and 30 %, 200 s each."""
    return np.repeat([40.0, 60.0, 30.0], 10_000)


def slow() -> Array:
    """Return two periods of a sine over the whole span, slow against T_g2."""
    t = 4.0 * np.arange(20_000)
    return 50.0 - 50.0 * np.cos(2.0 * np.pi * t / 40_000.0)


EXPERIMENTS = {
    experiment.name: experiment
    for experiment in (
        Experiment(
            'multi-step',
            'Steps up and down; the steady p2 against u is the loop of Fig. 10',
            0.2,
            steps,
            (
                'steps of 10 % from 0 to 100 % and back',
                'each level held for 600 s, four times T_g2: p2 has to be steady',
                'a vented, closed valve at the start',
            ),
        ),
        Experiment(
            'step',
            'Step response, Fig. 9, Sect. 3.4.1',
            0.2,
            step,
            (
                '9 s before and 56 s after the step, from the mean of x that the paper gives He',
                'a vented, closed valve at the start',
            ),
        ),
        Experiment(
            'impulse',
            'Short impulse of amplitude 30, two samples long, Fig. 11, Sect. 3.4.2',
            0.2,
            impulse,
            (
                "on a base of 50 %, since He's f_s must exceed f_d + 30 (38.78 against 39.53)",
                '10 s at 0, 60 s at 50 %, the impulse, 60 s at 50 %',
                'a vented, closed valve at the start',
            ),
        ),
        Experiment(
            'cosine',
            'Cosine of falling frequency, Fig. 12, Sect. 3.4.3',
            0.2,
            cosine,
            (
                'between 0 and 100 %, from 5 mHz down to 0.3 mHz in 3000 s, logarithmically',
                'a vented, closed valve at the start',
            ),
        ),
        Experiment(
            'closed-loop',
            'PI control of x, C(s) = 0.2083 (1 + 1/(15 s)), Fig. 13, Sect. 3.4.4',
            0.02,
            set_points,
            (
                'set points of 40, 60 and 30 %, 200 s each',
                'u = K e + I with I += K T_s/T_i e, limited to 0 to 100 %, no wind-up',
                'a vented, closed valve at the start',
            ),
            closed_loop=True,
        ),
        Experiment(
            'signature',
            'Slow sine over the span: the signature of Fig. 8',
            4.0,
            slow,
            (
                'two periods of 40000 s, slow against T_g2',
                'sampled every 4 s',
                'a vented, closed valve at the start',
            ),
        ),
    )
}
"""The experiments by name."""


def experiment(name: str) -> Experiment:
    """Return an experiment.

    Raises
    ------
    ModelError
        If there is none of that name.
    """
    if name not in EXPERIMENTS:
        raise ModelError(f'experiment {name!r}: expected one of {", ".join(EXPERIMENTS)}')
    return EXPERIMENTS[name]
