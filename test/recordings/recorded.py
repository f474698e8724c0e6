# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a recorder gets to see of a valve: receive stamps that lag, jitter and are lost.

The truth is known: the valve computes its samples on a timer with the newest command it has.
"""

from dataclasses import dataclass

import numpy as np

from valve_sim_ros import simulate
from valve_sim_ros.recordings.arrivals import Arrivals

EPOCH = 1_760_000_000 * 10**9


@dataclass(frozen=True)
class Truth:
    """What the valve did, sample by sample: t [s], u, p1, p2, x [% of span]."""

    t: np.ndarray
    u: np.ndarray
    p1: np.ndarray
    p2: np.ndarray
    x: np.ndarray


def commands(rng, count, hold, phase=None):
    """Return times [s] and levels [%] of commands; `phase` fixes their place in a sample."""
    times = np.cumsum(rng.uniform(0.6, 1.4, count) * hold)
    if phase is not None:
        times = np.round(times / 0.2) * 0.2 + phase * 0.2
    return times, rng.uniform(5.0, 95.0, count)


def recorded(
    rng,
    times,
    levels,
    *,
    sample_time=0.2,
    parameters=None,
    noise=0.1,
    lag=0.0,
    jitter=0.0,
    command_lag=0.0,
    loss=0.0,
    dead_samples=0,
    signals=('p1', 'p2', 'x'),
    initial=50.0,
):
    """Simulate a valve and return its `Truth` and the `Arrivals` by signal.

    Parameters
    ----------
    rng : numpy.random.Generator
    times, levels : arrays, shape (m,)
        Commands [s], [%]; `initial` [%] is sent one sample before the first tick.
    lag, command_lag : float or callable
        Delay of the stamps of outputs and commands [s]; a callable gets the number of messages.
    jitter : float
        Standard deviation of all stamps [s].
    loss : float
        Share of the output messages that are lost.
    dead_samples : int
        Dead time of the valve in samples.
    """
    ticks = sample_time * np.arange(int((times[-1] + times[0]) / sample_time))
    times, levels = np.append(-0.5 * sample_time, times), np.append(initial, levels)
    used = np.searchsorted(times, ticks + 1e-9, side='right') - 1
    u = levels[used]
    delayed = np.concatenate([np.full(dead_samples, u[0]), u[: u.size - dead_samples]])
    s = simulate(delayed, sample_time, parameters)
    outputs = {n: getattr(s, n) + noise * rng.standard_normal(u.size) for n in ('p1', 'p2', 'x')}
    stamped = {'u': Arrivals(_stamps(rng, times, command_lag, jitter), levels)}
    late = _stamps(rng, ticks, lag, jitter)
    for name in signals:
        kept = rng.random(u.size) >= loss
        kept[[0, -1]] = True
        # the three outputs of a sample leave the valve one right after the other
        behind = np.int64(20_000 * ('p1', 'p2', 'x').index(name))
        stamped[name] = Arrivals(late[kept] + behind, outputs[name][kept])
    return Truth(ticks, u, **outputs), stamped


def _stamps(rng, times, lag, jitter):
    delay = lag(times.size) if callable(lag) else lag
    stamps = times + delay + jitter * rng.standard_normal(times.size)
    return np.maximum.accumulate(np.round(stamps * 1e9).astype(np.int64)) + EPOCH


def faults(truth, found):
    """Return how many samples of `found` hold another command or other outputs than the truth.

    Samples are matched by the values of the outputs themselves.
    """
    wrong_u = wrong_y = 0
    names = found.signals
    keys = {float(v): k for name in names for k, v in enumerate(getattr(truth, name))}
    previous = None
    for i in range(len(found)):
        ks = {keys[float(v)] for v in (found.output(n)[i] for n in names) if v == v}
        if len(ks) > 1:
            wrong_y += 1
        if ks:
            k = ks.pop()
            wrong_u += truth.u[k] != found.u[i]
            if previous is not None and abs(
                (found.time[i] - previous[1]) - (truth.t[k] - truth.t[previous[0]])
            ) > 0.5 * (truth.t[1] - truth.t[0]):
                wrong_y += 1
            previous = k, found.time[i]
    return wrong_u, wrong_y
