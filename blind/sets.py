# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The sets of blind records; record k of a set depends on set, half, seed and k alone."""

from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
import zlib

import numpy as np

from . import records
from .effects import EFFECTS
from .physics import Physics
from .plant import simulate, STEP
from .seal import digest, write_json
from .unknown import UNKNOWN

SPLITS = ('tuning', 'test')
Rng = np.random.Generator


ALIASES: tuple[set[str], ...] = (
    # one of the two undoes the other, or a single effect does exactly the same
    {'sensor_calibration', 'spring_preload'},
    {'sensor_calibration', 'spring_rate'},
    {'spring_preload', 'spring_rate'},
    # both place the lower stop
    {'spring_preload', 'travel_stops'},
)


def _singles(index: int, block: Rng, rng: Rng) -> tuple[str, ...]:
    names = list(EFFECTS)
    return (names[block.permutation(len(names))[index % len(names)]],)


def _unknown(index: int, block: Rng, rng: Rng) -> tuple[str, ...]:
    names = list(UNKNOWN)
    return (names[block.permutation(len(names))[index % len(names)]],)


def _pairs(index: int, block: Rng, rng: Rng) -> tuple[str, ...]:
    while True:
        pair = tuple(str(name) for name in rng.choice(list(EFFECTS), 2, replace=False))
        if set(pair) not in ALIASES:
            return pair


def _clean(index: int, block: Rng, rng: Rng) -> tuple[str, ...]:
    return ()


SETS: dict[str, tuple[Callable[[int, Rng, Rng], tuple[str, ...]], int, float]] = {
    # how the effects are chosen, length of a block with each of them once, share of nuisances
    'singles': (_singles, len(EFFECTS), 0.3),
    'left_out': (_singles, len(EFFECTS), 0.3),
    'clean': (_clean, 1, 0.6),
    'unknown': (_unknown, len(UNKNOWN), 0.3),
    'pairs': (_pairs, 1, 0.3),
}
WORKERS = 2
CLEAN_STEPS = (5e-3, 2e-3, 1e-3, 5e-4)


def generate_one(
    name: str, split: str, signals: tuple[str, ...], seed: int, folder: Path, index: int
) -> str:
    """Write record `index` of a set; return its name."""
    choose, block, nuisances = SETS[name]
    root = [zlib.crc32(' '.join((name, split, *signals)).encode()), seed]
    for attempt in range(20):
        rng = np.random.default_rng([*root, 1, index, attempt])
        effects = choose(index, np.random.default_rng([*root, 0, index // block]), rng)
        try:
            steps = (STEP,) if effects else CLEAN_STEPS
            blind = records.draw(rng, effects, signals, nuisances, steps)
        except ValueError:
            if name == 'pairs':
                continue
            raise
        break
    record = f'{index + 1:04d}'
    records.write(blind, rng, record, signals, folder)
    return record


def generate(
    name: str,
    split: str,
    signals: tuple[str, ...],
    count: int,
    seed: int,
    folder: Path,
    progress: Callable[[int], object] = lambda done: None,
) -> None:
    """Write a set of blind records.

    Parameters
    ----------
    name, split : str
        Which set, which half.
    signals : tuple of str
        Measured signals.
    count, seed : int
        Number of records, and the seed of them all.
    folder : Path
        Where records/ and keys/ go.
    progress : callable
        Called with 1 after each record.
    """
    folder.mkdir(parents=True, exist_ok=True)
    simulate(np.zeros(2), np.arange(2.0), np.arange(2.0), Physics())  # compile before the fork
    work = partial(generate_one, name, split, signals, seed, folder)
    with ProcessPoolExecutor(WORKERS, mp_context=get_context('fork')) as pool:
        for _ in pool.map(work, range(count)):
            progress(1)
    about = {'set': name, 'split': split, 'signals': signals, 'count': count, 'seed': seed}
    write_json(folder / 'set.json', {**about, 'seal': digest(folder / 'keys')})
