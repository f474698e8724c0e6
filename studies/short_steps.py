# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Is a sample as good as many short ones? `make steps` prints it for every effect.

Valves with random parameters and one effect each follow a slow sine and random stairs, once in
samples of 0.2 s and once in steps of 0.5 ms. Printed: how many samples of x are more than 0.3 %
apart, and the root mean square of the difference of p2.
"""

import numpy as np
from tqdm import tqdm

from valve_sim_ros import InitialState, simulate, ValveSpec
from valve_sim_ros.diagnosis.stages import starts_of
from valve_sim_ros.model.declarations import Effect
from valve_sim_ros.model.effects import CATALOGUE

SAMPLE, SHORT = 0.2, 5e-4
APART = 0.3
VALVES = 8


def draw(effect: Effect, rng: np.random.Generator) -> ValveSpec:
    """Return a valve with the effect, whose freed parameters are values a search starts from."""
    f_s, ratio, damping = rng.uniform((3.0, 9.0, 0.7), (10.0, 25.0, 1.8))
    a_1 = (2.0 * damping * ratio) ** 2
    values = {
        'f_d1': 0.5,
        'T_g1': rng.uniform(1.0, 6.0),
        'T_g2': rng.uniform(1.0, 6.0),
        'f_s': f_s,
        'f_d': f_s * rng.uniform(0.3, 0.8),
        'a_1': a_1,
        'a_2': a_1 / ratio,
    }
    variants = effect.variants or (tuple(p.name for p in effect.parameters),)
    freed = variants[rng.integers(len(variants))]
    own = {
        f'{effect.id}.{p.name}': float(rng.choice(starts_of(p))) if p.name in freed else p.neutral
        for p in effect.parameters
    }
    return ValveSpec().changed({**values, 'effects': [effect.id], **own})


def commands(rng: np.random.Generator) -> np.ndarray:
    """Return a slow sine of three minutes and stairs of two."""
    time = SAMPLE * np.arange(900)
    slow = rng.uniform(15.0, 30.0) * np.sin(2.0 * np.pi * time / rng.uniform(60.0, 150.0))
    return np.concatenate([50.0 + slow, np.repeat(rng.uniform(20.0, 80.0, 30), 20)])


def apart(effect: Effect, rng: np.random.Generator) -> tuple[float, float]:
    """Return the share of samples of x that differ, and the difference of p2 [% of span]."""
    spec, u = draw(effect, rng), commands(rng)
    start, times = InitialState(*[u[0]] * 3), round(SAMPLE / SHORT)
    one = simulate(u, parameters=spec, initial=start, sample_time=SAMPLE)
    many = simulate(np.repeat(u, times), parameters=spec, initial=start, sample_time=SHORT)
    x, p2 = one.x - many.x[::times], one.p2 - many.p2[::times]
    return float(np.mean(np.abs(x) > APART)), float(np.sqrt(np.mean(p2**2)))


def main() -> None:
    """Print a row for each effect, the worst first."""
    rows = []
    for effect in tqdm(CATALOGUE.values(), unit='effect'):
        rng = np.random.default_rng(1)
        rows.append((*np.mean([apart(effect, rng) for _ in range(VALVES)], axis=0), effect.id))
    print(f'samples of x more than {APART} % apart, rms of p2 [%], effect')
    for share, rms, name in sorted(rows, reverse=True):
        print(f'{100.0 * share:6.1f} %  {rms:6.3f}  {name}')


if __name__ == '__main__':
    main()
