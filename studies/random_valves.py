# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Does the search find the optimum of valves it has never seen? `make starts` prints the count.

Each valve is drawn at random, moved by random stairs and measured with noise; in turn x, p2 and
x, or all outputs are given to the search, which knows nothing of the truth. The optimum is known
from a polish that starts at the truth. It counts as reached if the weighted squares are not above
it by more than `WITHIN` of them.
"""

import argparse
import time

import numpy as np
from tqdm import tqdm

from valve_sim_ros import Recording, simulate
from valve_sim_ros.identification.problem import Problem
from valve_sim_ros.identification.search import polish, search
from valve_sim_ros.model.pipeline import Array

WITHIN = 1e-3
GIVEN = (('x',), ('p2', 'x'), ('p1', 'p2', 'x'))


def draw(rng: np.random.Generator) -> dict[str, float]:
    """Return the parameters of a valve such as one may meet."""

    def log_uniform(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    f_s = log_uniform(0.5, 15.0)
    return {
        'f_d1': float(rng.uniform(0.0, 6.0)),
        'T_g1': log_uniform(0.3, 30.0),
        'T_g2': log_uniform(0.3, 100.0),
        'f_s': f_s,
        'f_d': f_s * float(rng.uniform(0.1, 1.0)),
        'a_1': 2000.0,
        'a_2': 2000.0 / log_uniform(0.3, 20.0),
    }


def stairs(rng: np.random.Generator, samples: int) -> Array:
    """Return random levels, each held for 10 to 100 samples."""
    holds = rng.integers(10, 100, samples // 10)
    return np.repeat(rng.uniform(5.0, 95.0, holds.size), holds)[:samples]


def reaches(number: int, samples: int) -> tuple[bool, float, str]:
    """Return whether valve `number` is found, the seconds it took and a line about it."""
    rng = np.random.default_rng(number)
    truth = draw(rng)
    clean = simulate(stairs(rng, samples), parameters=truth)
    noise = rng.uniform(0.05, 0.5)
    given = GIVEN[number % len(GIVEN)]
    measured = {n: getattr(clean, n) + noise * rng.standard_normal(clean.t.size) for n in given}
    problem = Problem([Recording(clean.t, clean.u, **measured)])
    best = polish(problem, problem.point(truth)).cost
    begun = time.process_time()
    found = search(problem, seed=number)
    seconds = time.process_time() - begun
    excess = found.cost / best - 1.0
    line = f'valve {number} ({", ".join(given)}): {100 * excess:+.4f} % in {seconds:.2f} s'
    return excess <= WITHIN, seconds, line


def main() -> None:
    """Count the valves whose optimum is reached."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--valves', type=int, default=100)
    parser.add_argument('--samples', type=int, default=3000)
    parser.add_argument('--first', type=int, default=0, help='number of the first valve')
    arguments = parser.parse_args()
    reached, times = 0, []
    for number in tqdm(range(arguments.first, arguments.first + arguments.valves), disable=None):
        success, seconds, line = reaches(number, arguments.samples)
        reached += success
        times.append(seconds)
        if not success:
            tqdm.write(line)
    print(
        f'optimum reached: {reached} of {arguments.valves} valves, {arguments.samples} samples '
        f'each; search: median {np.median(times):.2f} s, longest {max(times):.2f} s of processor'
    )


if __name__ == '__main__':
    main()
