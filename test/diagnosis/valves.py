# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Valves whose parts are tested, and what is recorded of them."""

import numpy as np

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.unknowns import complete
from valve_sim_ros.recordings.recording import Recording

VALUES = {
    'f_d1': 0.5,
    'T_g1': 2.0,
    'T_g2': 5.0,
    'f_s': 4.0,
    'f_d/f_s': 0.6,
    'a_1/a_2': 10.0,
    'damping': 1.8,
    'phase': 0.0,
}


CREEPING = ((20, 20.0), (600, 70.0), (600, 30.0), (600, 62.0), (600, 25.0))
"""Commands and for how many samples: so long that p2 of a slow valve creeps."""


def commands(n=1500):
    rng = np.random.default_rng(5)
    return np.concatenate([np.zeros(20), np.repeat(rng.uniform(10.0, 90.0, n // 50), 50)])


def recording(noise=0.0, **effects):
    u = commands()
    values = {name: v for name, v in complete(VALUES).items() if '/' not in name}
    values = {n: v for n, v in values.items() if n not in ('phase', 'damping')}
    s = simulate(
        u, parameters={**values, 'effects': list({e.split('.')[0] for e in effects}), **effects}
    )
    rng = np.random.default_rng(1)
    noisy = {
        name: getattr(s, name) + noise * rng.standard_normal(u.size) for name in ('p1', 'p2', 'x')
    }
    return Recording(s.t, u, **noisy)


def slow_valve(levels, noise, **lags):
    """Return the values of a valve that lags, its record without noise, and one of it with."""
    u = np.concatenate([np.full(n, value) for n, value in levels])
    slow = {**VALUES, **lags, **{f'{name}_0': u[0] for name in ('p1', 'p2', 'x')}}
    time = 0.2 * np.arange(u.size)
    (truth,) = Bench([Recording(time, u, p1=u)]).run(complete(slow))
    noisy = truth[2] + noise * np.random.default_rng(4).standard_normal(u.size)
    return slow, *(Recording(time, u, truth[0], truth[1], x) for x in (truth[2], noisy))
