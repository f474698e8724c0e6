# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long fits of rivals take: He and Kano on 10,000 samples (aim 1 s), all on 3,000 (20 s)."""

from functools import partial
import time

import numpy as np

from valve_sim_ros import identify, Recording, simulate
from valve_sim_ros.identification.compare import compare
from valve_sim_ros.model.rivals import RIVALS


def stairs(samples, hold, **parameters):
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(5.0, 95.0, samples // hold), hold)
    s = simulate(u, parameters=parameters)
    return Recording(s.t, s.u, x=s.x + 0.1 * rng.standard_normal(u.size))


def timed(work):
    start, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - start, time.process_time() - processor


def main():
    own = {name: stairs(10_000, 25, model=name) for name in ('he', 'kano')}
    other = stairs(10_000, 50, T_g1=3.0, T_g2=8.0)
    for name in ('he', 'kano'):
        for what, data in (('its own data', own[name]), ('the base valve', other)):
            fit = partial(identify, data, model=name, hold_out=False)
            timed(fit)
            wall, processor = timed(fit)
            print(f'{name} on 10,000 samples of {what}: {wall:.2f} s ({processor:.2f} s of CPU)')
    data = stairs(3_000, 50, T_g1=3.0, T_g2=8.0)
    timed(lambda: compare([data], hold_out=False))
    wall, processor = timed(lambda: compare([data]))
    words = f'base and {len(RIVALS)} rivals on 3,000 samples'
    print(f'{words}, with hold-out: {wall:.1f} s ({processor:.1f} s of CPU)')


if __name__ == '__main__':
    main()
