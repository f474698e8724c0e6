# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Samples per second of the compiled pipeline, and seconds for a 3,000-sample identification."""

import time

import numpy as np

from valve_sim_ros import identify, Recording, simulate


def main():
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(0.0, 100.0, 40_000), 50)
    simulate(u)
    seconds = min(timed(lambda: simulate(u)) for _ in range(5))
    print(f'pipeline: {u.size / seconds / 1e6:.1f} million samples/s on one core')
    s = simulate(u[:3000])
    noisy = {n: getattr(s, n) + 0.1 * rng.standard_normal(3000) for n in ('p1', 'p2', 'x')}
    data = Recording(s.t, s.u, **noisy)
    identify(data)
    print(f'identification of 3,000 samples: {timed(lambda: identify(data)):.2f} s')


def timed(work):
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


if __name__ == '__main__':
    main()
