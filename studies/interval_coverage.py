# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Do the 95 % intervals hold the truth 95 times in 100? `make coverage` prints how often.

Each run draws a valve, moves it by random stairs and measures it with noise that remembers (an
autoregressive process of its own for each signal); the search starts blind. All intervals of the
parameters that the data are said to identify count, and those of a_1/a_2.
"""

import argparse
from collections import defaultdict

import numpy as np
from scipy.signal import lfilter
from tqdm import tqdm

from valve_sim_ros import identify, Recording, simulate
from valve_sim_ros.model.pipeline import Array

NAMES = ('f_d1', 'T_g1', 'T_g2', 'f_s', 'f_d', 'a_1/a_2')
GIVEN = (('x',), ('p2', 'x'), ('p1', 'p2', 'x'))
MOST_MEMORY = 0.9


def draw(rng: np.random.Generator) -> dict[str, float]:
    """Return the parameters of a valve that stairs can show."""
    f_s = float(rng.uniform(3.0, 10.0))
    a_1 = float(np.exp(rng.uniform(np.log(1000.0), np.log(10000.0))))
    return {
        'f_d1': float(rng.uniform(0.5, 4.0)),
        'T_g1': float(rng.uniform(1.0, 8.0)),
        'T_g2': float(rng.uniform(2.0, 20.0)),
        'f_s': f_s,
        'f_d': f_s * float(rng.uniform(0.3, 0.9)),
        'a_1': a_1,
        'a_2': a_1 / float(rng.uniform(4.0, 15.0)),
    }


def coloured(rng: np.random.Generator, size: int, spread: float) -> Array:
    """Return noise of a given standard deviation whose neighbours resemble each other."""
    memory = float(rng.uniform(0.0, MOST_MEMORY))
    white = rng.standard_normal(size + 200) * spread * np.sqrt(1.0 - memory**2)
    return np.asarray(lfilter([1.0], [1.0, -memory], white)[200:])


def one(number: int, samples: int) -> dict[str, bool]:
    """Return for each identified parameter whether its interval holds the truth."""
    rng = np.random.default_rng(number)
    truth = draw(rng)
    levels = rng.uniform(5.0, 95.0, samples // 40)
    clean = simulate(np.repeat(levels, 40), parameters=truth)
    spread = float(rng.uniform(0.05, 0.3))
    measured = {
        name: getattr(clean, name) + coloured(rng, clean.t.size, spread)
        for name in GIVEN[number % len(GIVEN)]
    }
    found = identify(Recording(clean.t, clean.u, **measured), seed=number, hold_out=False)
    truth['a_1/a_2'] = truth['a_1'] / truth['a_2']
    return {
        name: found.estimates[name].lower <= truth[name] <= found.estimates[name].upper
        for name in NAMES
        if found.estimates[name].identified or name == 'a_1/a_2'
    }


def main() -> None:
    """Count the intervals that hold the truth."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--runs', type=int, default=200)
    parser.add_argument('--samples', type=int, default=2000)
    arguments = parser.parse_args()
    held = defaultdict(list)
    for number in tqdm(range(arguments.runs), disable=None):
        for name, inside in one(number, arguments.samples).items():
            held[name].append(inside)
    for name in NAMES:
        print(f'{name:<8} {100 * np.mean(held[name]):5.1f} % of {len(held[name])} intervals')
    whole = np.concatenate([held[name] for name in NAMES])
    print(
        f'all      {100 * np.mean(whole):5.1f} % of {whole.size} intervals, {arguments.runs} runs'
    )


if __name__ == '__main__':
    main()
