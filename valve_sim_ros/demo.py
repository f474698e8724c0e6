# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The whole way in a minute: plant over DDS, bag, identification, picture.

`valve_plant` and a command source run as nodes on the real middleware. The plant's sample time is
shortened so that minutes of valve time pass in seconds; the valve is scaled with it.
"""

import argparse
from pathlib import Path
import shutil
import sys
from typing import Any

import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64
from tqdm import tqdm

from .identification.identify import identify
from .model.pipeline import Array
from .model.simulation import Valve
from .nodes.spinning import new_executor
from .nodes.valve_plant import ValvePlant
from .recordings.align import align, Arrivals
from .recordings.bags import read_bag, write_bag
from .recordings.recording import Provenance, Recording
from .report.plots import draw_fit

SAMPLE_TIME = 0.01
SAMPLES = 2000
HOLD = 50
"""Samples for which the command source keeps each level."""
TRUTH = {'f_d1': 1.7647, 'T_g1': 0.442, 'T_g2': 1.5, 'f_s': 8.7978, 'f_d': 5.2602}
"""The paper's valve with shorter lags, so that twenty seconds hold enough filling and emptying."""
NOISE = 0.1
"""Standard deviation of the sensors [% of span]."""


class Recorder(Node):
    """Sends the commands and takes down what comes back, each message with its receive stamp."""

    def __init__(self, commands: Array) -> None:
        """Connect to the plant's topics."""
        super().__init__('demo_recorder')
        self._commands = iter(commands.tolist())
        self._publisher = self.create_publisher(Float64, 'u', 10)
        self.heard: dict[str, list[tuple[int, float]]] = {n: [] for n in ('u', 'p1', 'p2', 'x')}
        for name, messages in self.heard.items():
            self.create_subscription(
                Float64,
                name,
                lambda message, messages=messages: messages.append((self._now(), message.data)),
                1000,
            )
        self.create_timer(HOLD * SAMPLE_TIME, self._command)

    def _command(self) -> None:
        command = next(self._commands, None)
        if command is not None and self._publisher.get_subscription_count() > 1:
            self._publisher.publish(Float64(data=command))

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)


def record(folder: Path) -> Path:
    """Run plant and command source until enough samples are there; return the bag's path."""
    levels = np.random.default_rng(7).uniform(5.0, 95.0, SAMPLES // HOLD + 20)
    Valve(background=False)  # machine code first: compiling would disturb the recording
    rclpy.init()
    executor = new_executor()
    values = {'sample_time': SAMPLE_TIME, **TRUTH}
    plant = ValvePlant(
        parameter_overrides=[Parameter(name, value=value) for name, value in values.items()]
    )
    recorder = Recorder(levels)
    for node in (plant, recorder):
        executor.add_node(node)
    with tqdm(total=SAMPLES, desc='recording', unit=' samples', disable=None) as bar:
        while len(recorder.heard['x']) < SAMPLES:
            executor.spin_once(timeout_sec=0.5)
            bar.update(len(recorder.heard['x']) - bar.n)
    executor.shutdown()
    for node in (plant, recorder):
        node.destroy_node()
    rclpy.try_shutdown()
    arrivals = {
        name: Arrivals(
            np.array([stamp for stamp, _ in messages], dtype=np.int64),
            np.array([value for _, value in messages]),
        )
        for name, messages in recorder.heard.items()
    }
    clean = align(arrivals, Provenance(time_source='received'))
    noise = np.random.default_rng(0)
    noisy: dict[str, Any] = {
        n: clean.output(n) + NOISE * noise.standard_normal(len(clean)) for n in clean.signals
    }
    bag = folder / 'bag'
    write_bag(Recording(clean.time, clean.u, **noisy, provenance=clean.provenance), bag)
    return bag


def main() -> int:
    """Run the demo; return 0 if the fitted valve matches."""
    parser = argparse.ArgumentParser(prog='valve_sim_ros.demo', description=__doc__)
    parser.add_argument('--out', type=Path, default=Path('demo_output'), help='folder to fill')
    folder = parser.parse_args().out
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    print('1. valve_plant and a command source talk over DDS')
    bag = record(folder)
    print(f'2. recorded {bag}; sensors with {NOISE} % noise')
    recording = read_bag(bag)
    for line in recording.quality.lines():
        print(f'   {line}')
    print('3. identifying from the bag')
    with tqdm(total=100, desc='identifying', unit=' %', disable=None) as bar:
        result = identify(recording, progress=lambda share, text: bar.update(100 * share - bar.n))
    print(f'   {"parameter":<9} {"true":>9} {"fitted":>9}')
    worst = 0.0
    for name, true in TRUTH.items():
        fitted = result.spec.values[name]
        worst = max(worst, abs(fitted / true - 1.0))
        print(f'   {name:<9} {true:9.4f} {fitted:9.4f}  ({100 * (fitted / true - 1):+.2f} %)')
    for line in result.lines()[-6:]:
        print(f'   {line}')
    result.write(folder)
    draw_fit(result, folder / 'fit.png')
    print(f'4. written: {folder}/fitted.yaml, identify.json, fit.png')
    return 0 if worst < 0.05 and result.eta > 99.0 else 1


if __name__ == '__main__':
    sys.exit(main())
