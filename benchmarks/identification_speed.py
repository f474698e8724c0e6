# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How long an identification takes, with and without hold-out, after a warm-up."""

from pathlib import Path
import resource
import time

import click
import numpy as np

from valve_sim_ros import identify, Recording, simulate

SAMPLES = 3000
LONG = (100_000, 300_000, 1_000_000)
NOISE = 0.1
TRUTH = {'f_d1': 2.5, 'T_g1': 5.0, 'T_g2': 20.0, 'f_s': 7.0, 'f_d': 3.0}
GIVEN = (('p1', 'p2', 'x'), ('p2', 'x'), ('x',))


def record(given: tuple[str, ...], seed: int, samples: int = SAMPLES) -> Recording:
    """Return random stairs of a known valve with noise on what is measured."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(5.0, 95.0, samples // 50), 50)
    clean = simulate(u, parameters=TRUTH)
    noisy = {n: getattr(clean, n) + NOISE * rng.standard_normal(u.size) for n in given}
    return Recording(clean.t, clean.u, **noisy)


def seconds(data: Recording | Path, hold_out: bool) -> tuple[float, float]:
    """Return wall-clock and processor time of one identification."""
    wall, processor = time.perf_counter(), time.process_time()
    identify(data, hold_out=hold_out)
    return time.perf_counter() - wall, time.process_time() - processor


def peak() -> float:
    """Return the most memory this process has had [MB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


@click.command()
@click.option('--long', is_flag=True, help='Show the memory of fits of long records instead.')
@click.argument('paths', nargs=-1, type=click.Path(exists=True, path_type=Path))
def main(long: bool, paths: tuple[Path, ...]) -> None:
    """Print times and memory; PATHS of recordings may be given to time them too."""
    identify(record(GIVEN[0], 0), hold_out=False)
    if long:
        for samples in LONG:
            data = record(GIVEN[0], 0, samples)
            before = peak()
            wall, _ = seconds(data, False)
            print(f'{samples} samples: {wall:.0f} s, peak memory {before:.0f} -> {peak():.0f} MB')
        return
    for given in GIVEN:
        for hold_out in (False, True):
            walls, processors = zip(
                *(seconds(record(given, seed), hold_out) for seed in range(1, 6)), strict=True
            )
            print(
                f'{SAMPLES} samples of {", ".join(given)}, {"with" if hold_out else "without"} '
                f'hold-out: median {np.median(walls):.2f} s, longest {max(walls):.2f} s '
                f'({np.median(processors):.2f} s of processor)'
            )
    for path in paths:
        wall, processor = seconds(path, True)
        print(f'{path}, with hold-out: {wall:.2f} s ({processor:.2f} s of processor)')
    print(f'peak memory {peak():.0f} MB')


if __name__ == '__main__':
    main()
