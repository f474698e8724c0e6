# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reading a bag against rosbags merely iterating its messages, and the memory it takes."""

from pathlib import Path
import resource
import struct
import subprocess
import sys
import tempfile
import time

import numpy as np
from rosbags.rosbag2 import Reader, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from valve_sim_ros import read_recording, simulate

FLOAT64 = 'std_msgs/msg/Float64'
FEW, MANY = 100_000, 1_000_000


def main():
    with tempfile.TemporaryDirectory() as folder:
        for storage in StoragePlugin:
            path = Path(folder) / f'few_{storage.name.lower()}'
            write(path, FEW, storage)
            ours, theirs = [], []
            for _ in range(5):
                theirs.append(processor_time(lambda path=path: iterate(path)))
                ours.append(processor_time(lambda path=path: read_recording(path)))
            print(
                f'{storage.name.lower()}, {FEW} samples of u, p1, p2, x: read in {min(ours):.2f} '
                f's, {min(ours) / min(theirs):.2f} x what rosbags needs to iterate'
            )
        for count in (MANY // 4, MANY // 2, MANY):
            path = Path(folder) / f'many_{count}'
            write(path, count, StoragePlugin.MCAP)
            command = [sys.executable, __file__, str(path)]
            peak = subprocess.run(command, capture_output=True, text=True, check=True).stdout
            print(f'{count} samples: {int(peak) / 1e6:.0f} MB at most, the interpreter included')


def write(path, count, storage):
    """Write a bag as the plant does; u comes every 50 samples."""
    rng = np.random.default_rng(0)
    s = simulate(np.repeat(rng.uniform(0.0, 100.0, count // 50), 50))
    columns = {n: getattr(s, n) + 0.1 * rng.standard_normal(s.t.size) for n in ('p1', 'p2', 'x')}
    store = get_typestore(Stores.ROS2_JAZZY)
    with Writer(path, version=9, storage_plugin=storage) as writer:
        topics = {
            name: writer.add_connection(f'/{name}', FLOAT64, typestore=store)
            for name in ('u', *columns)
        }
        pack = struct.Struct('<Id').pack
        for k, t in enumerate(np.round(s.t * 1e9).astype(np.int64).tolist()):
            if k % 50 == 0:
                writer.write(topics['u'], t, pack(256, s.u[k]))
            for name, values in columns.items():
                writer.write(topics[name], t + 20_000, pack(256, values[k]))


def iterate(path):
    with Reader(path) as reader:
        for _ in reader.messages():
            pass


def processor_time(work):
    start = time.process_time()
    work()
    return time.process_time() - start


if __name__ == '__main__':
    if len(sys.argv) > 1:
        assert len(read_recording(sys.argv[1])) >= MANY // 4
        print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024)
    else:
        main()
