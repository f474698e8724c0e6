# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a recorder makes of a valve's signals: sampling, stamps, noise, resolution, loss."""

from dataclasses import dataclass, field
import os
from pathlib import Path
import shutil

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores
from scipy.signal import lfilter

from .plant import Trace

Rng = np.random.Generator
START = 1_700_000_000_000_000_000
"""Stamp of time 0 of every bag [ns]."""


@dataclass(frozen=True)
class Recorder:
    """How one record is taken.

    Attributes
    ----------
    period : float
        Sampling period [s].
    phase : float
        How long after the command each sample is taken [share of the period].
    sampling_jitter, stamp_jitter : float
        Standard deviation of the true sampling times and of their stamps [share of the period].
    noise : dict
        Standard deviation of each signal's noise [%].
    colour : float
        Correlation of the noise from one sample to the next.
    resolution : dict
        Steps in which each signal is stored [%]; 0 for none.
    outliers : int
        Single wild values.
    loss : float
        Share of lost values, commands as well.
    commands : int
        How many are sent in a period while they go on; a step is one.
    as_sent : bool
        Whether the column u holds the commands as they were sent, one for each row, instead of
        the last one that had arrived when the row's signals were sampled.
    bag : bool
        Whether it is written as a bag instead of a CSV file.
    """

    period: float = 0.2
    phase: float = 0.0
    sampling_jitter: float = 0.0
    stamp_jitter: float = 0.0
    noise: dict[str, float] = field(default_factory=dict)
    colour: float = 0.0
    resolution: dict[str, float] = field(default_factory=dict)
    outliers: int = 0
    loss: float = 0.0
    commands: int = 1
    as_sent: bool = False
    bag: bool = False


def draw_recorder(rng: Rng, share: float) -> Recorder:
    """Return a random recorder that has each nuisance with this probability."""

    def sometimes(low: float, high: float) -> float:
        value, there = rng.uniform(low, high), rng.random() < share
        return float(value) if there else 0.0

    signals = ('p1', 'p2', 'x')
    bag = rng.random() < 0.15
    commands = 10 if rng.random() < share and not bag else 1
    return Recorder(
        period=float(rng.choice((0.2, 0.1, 0.5), p=(0.8, 0.1, 0.1))),
        phase=sometimes(0.02, 0.98),
        sampling_jitter=0.0 if bag else sometimes(0.005, 0.05),
        stamp_jitter=sometimes(0.002, 0.04),
        noise={name: float(rng.uniform(0.15, 0.3)) for name in signals},
        colour=sometimes(0.2, 0.75),
        resolution={name: float(rng.choice((0.01, 0.024, 0.1))) for name in signals}
        if rng.random() < share
        else dict.fromkeys(signals, 0.0),
        outliers=int(rng.integers(1, 5)) if rng.random() < 0.5 * share else 0,
        loss=0.02 if rng.random() < share else 0.0,
        commands=commands,
        as_sent=bool(rng.random() < 0.5) and commands == 1,
        bag=bag,
    )


def sample_times(recorder: Recorder, count: int, rng: Rng) -> np.ndarray:
    """Return the true times at which the samples are taken, from the first command on [s]."""
    jitter = recorder.sampling_jitter * np.clip(rng.standard_normal(count), -3, 3)
    times = np.maximum((np.arange(count) + recorder.phase + jitter) * recorder.period, 0.0)
    return np.maximum.accumulate(times)


def coloured(rng: Rng, count: int, colour: float) -> np.ndarray:
    """Return noise of unit variance, if there is any colour most of it AR(1), the rest white."""
    white = rng.standard_normal(count)
    if colour == 0.0:
        return white
    red = lfilter([np.sqrt(1 - colour**2)], [1, -colour], rng.standard_normal(count + 100))[100:]
    return np.sqrt(0.3) * white + np.sqrt(0.7) * red


def measured(trace: Trace, recorder: Recorder, signals: tuple[str, ...], rng: Rng) -> dict:
    """Return the measured signals with noise, steps, outliers and losses (NaN)."""
    found = {}
    for name in signals:
        values = getattr(trace, name)
        values = values + recorder.noise[name] * coloured(rng, values.size, recorder.colour)
        if recorder.outliers:
            wild = rng.integers(0, values.size, recorder.outliers)
            values[wild] += rng.choice((-1, 1), wild.size) * rng.uniform(4, 20, wild.size)
        step = recorder.resolution[name]
        if step:
            values = step * np.rint(values / step)
        values[rng.random(values.size) < recorder.loss] = np.nan
        found[name] = values
    return found


def write_csv(path: Path, time: np.ndarray, columns: dict[str, np.ndarray]) -> None:
    """Write t and the signals; a lost value is an empty cell."""
    aside = path.with_name(f'.{path.name}.part')
    table = np.column_stack((time, *columns.values()))
    lines = [','.join(('t', *columns))]
    lines += [
        ','.join((f'{t:.4f}', *('' if value != value else f'{value:.6g}' for value in row)))
        for t, *row in table.tolist()
    ]
    aside.write_text('\n'.join(lines) + '\n', encoding='utf-8')
    os.replace(aside, path)


def write_bag(
    path: Path,
    command_times: np.ndarray,
    commands: np.ndarray,
    stamps: np.ndarray,
    signals: dict[str, np.ndarray],
) -> None:
    """Write an mcap bag of std_msgs/msg/Float64; lost values are messages that never came."""
    store = get_typestore(Stores.ROS2_JAZZY)
    kind = 'std_msgs/msg/Float64'
    encode = store.types[kind]
    messages = []
    series = {'u': (command_times, commands)}
    series |= {name: (stamps, values) for name, values in signals.items()}
    for name, (times, values) in series.items():
        for time, value in zip(times.tolist(), values.tolist(), strict=True):
            if value == value:
                messages.append((START + round(time * 1e9), name, value))
    messages.sort(key=lambda each: each[0])
    aside = path.with_name(f'.{path.name}.part')
    for folder in (aside, path):  # of a smaller set, or of one that was interrupted
        shutil.rmtree(folder, ignore_errors=True)
    with Writer(aside, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {
            name: writer.add_connection(f'/{name}', kind, typestore=store) for name in series
        }
        for stamp, name, value in messages:
            payload = store.serialize_cdr(encode(data=value), kind)
            writer.write(connections[name], stamp, payload)
    os.replace(aside, path)
