# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How many times as long as that of the base valve a run with each effect takes, in one run."""

import time

import numpy as np

from valve_sim_ros import simulate
from valve_sim_ros.model.effects import CATALOGUE

SAMPLES, PERIOD, REPEATS = 4500, 0.2, 15
VALVE = {'T_g1': 3.0, 'T_g2': 8.0, 'f_s': 5.0, 'f_d': 3.0}


def main():
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(10.0, 90.0, SAMPLES // 75), 75)
    each = {name: in_turn(u, VALVE, {**VALVE, 'effects': [name]}) for name in CATALOGUE}
    base = min(plain for plain, _ in each.values())
    print(f'base valve: {1e3 * base:.2f} ms for {SAMPLES} samples at {1.0 / PERIOD:g} Hz')
    ratios = {name: affected / plain for name, (plain, affected) in each.items()}
    for name, ratio in sorted(ratios.items(), key=lambda pair: -pair[1]):
        print(f'{name:28s} {ratio:6.1f} times')


def in_turn(u, *valves):
    """Return the shortest of some runs of each valve [s], in turn: a shared machine is noisy.

    The first ones, which may compile, are left out.
    """
    rounds = [[seconds(u, valve) for valve in valves] for _ in range(REPEATS)]
    return np.min(rounds[1:], axis=0)


def seconds(u, parameters):
    """Return how long one run takes."""
    start = time.perf_counter()
    simulate(u, PERIOD, parameters)
    return time.perf_counter() - start


if __name__ == '__main__':
    main()
