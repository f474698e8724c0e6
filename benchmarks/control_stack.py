# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a control stack may count on: rates, latency, CPU, memory and lockstep throughput.

Short by default; ``--seconds 600 --steps 1000000`` gives the figures of doc/control_stack.md.
Plants run in processes of their own; this process listens, and looks at /proc.
"""

from multiprocessing import Process, Queue
import os
from pathlib import Path
import subprocess
import sys
import time

import click
import numpy as np
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_msgs.msg import Float64, Float64MultiArray

from valve_sim_ros.nodes.messages import LOSSLESS
from valve_sim_ros.nodes.spinning import new_executor
from valve_sim_ros.nodes.valve_plant import ValvePlant

MOST_BARE = 20.0
"""Longest look at what the machine itself holds back [s]."""
WARM_UP = 5.0
"""Seconds for machine code and discovery before anything is counted."""


class Timed(ValvePlant):
    """A plant that notes when a tick was due, when it came, and when its sample was out."""

    def __init__(self, **options):
        super().__init__(**options)
        self.late, self.taken, self.begun = [], [], []

    def step(self):
        """Take a sample, note the times."""
        begin = time.monotonic()
        sample = super().step()
        end = time.monotonic()
        period = self.sample_time
        grid = self.pacing._origin * 1e-9
        self.late.append((begin - grid) % period)
        self.taken.append(end - begin)
        self.begun.append(begin)
        return sample


def overrides(**values):
    return [Parameter(name, value=value) for name, value in values.items()]


def cpu_seconds():
    return time.process_time()


def resident():
    """Return the resident memory of this process [MB]."""
    return int(Path('/proc/self/statm').read_text().split()[1]) * os.sysconf('SC_PAGESIZE') / 1e6


def stolen():
    """Return for how long the host kept this machine's cores to itself so far [core seconds]."""
    ticks = int(Path('/proc/stat').read_text().split(maxsplit=9)[8])
    return ticks / os.sysconf('SC_CLK_TCK')


def spin_for(executor, seconds):
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        executor.spin_until_future_complete(Future(), end - time.monotonic())


def paced(count, rate, seconds, results):
    """Run so many valves at a rate in this process; put what was measured in the queue."""
    rclpy.init()
    executor = new_executor()
    plants = [
        Timed(
            namespace=f'valve_{k}',
            parameter_overrides=overrides(sample_time=1.0 / rate, diagnostics_period=1.0),
        )
        for k in range(count)
    ]
    for plant in plants:
        executor.add_node(plant)
    spin_for(executor, WARM_UP + count * 0.05)
    for plant in plants:
        for times in (plant.late, plant.taken, plant.begun):
            times.clear()
    missed, tardy = zip(*((p.missed_periods, p.pacing.late_samples) for p in plants), strict=True)
    cpu, begin = cpu_seconds(), time.monotonic()
    steal = stolen()
    spin_for(executor, seconds)
    wall = time.monotonic() - begin
    late, taken = (np.concatenate([getattr(p, n) for p in plants]) for n in ('late', 'taken'))
    results.put(
        {
            'rate': late.size / wall / count,
            'missed': sum(p.missed_periods - m for p, m in zip(plants, missed, strict=True)),
            'tardy': sum(p.pacing.late_samples - k for p, k in zip(plants, tardy, strict=True)),
            'periods': wall * rate * count,
            'cpu': (cpu_seconds() - cpu) / wall / count,
            'stolen': (stolen() - steal) / wall / os.cpu_count(),
            'pause': max(np.diff(p.begun).max() for p in plants),
            'late': np.percentile(late, [50, 99, 100]) * 1e6,
            'taken': np.percentile(taken, [50, 99, 100]) * 1e6,
        }
    )
    executor.shutdown()
    for plant in plants:
        plant.destroy_node()
    rclpy.try_shutdown()


class Driver(Node):
    """Sends the next command when a sample has come."""

    def __init__(self):
        super().__init__('driver')
        self.u = self.create_publisher(Float64, 'u', LOSSLESS)
        self.count, self.limit = 0, 0
        topic = 'valve_plant/sample'
        self.create_subscription(Float64MultiArray, topic, self.hear, LOSSLESS)
        self.message = Float64(data=50.0)

    def hear(self, _):
        """Go on, or say that the run is over."""
        self.count += 1
        if self.count < self.limit:
            self.send()
        else:
            self.over.set_result(True)

    def send(self):
        """Send the next command."""
        self.message.data = 30.0 + 0.001 * (self.count % 40_000)
        self.u.publish(self.message)


def bare(rate, seconds, results):
    """Count the periods that a loop loses which does nothing but look at the clock."""
    begin = before = time.monotonic()
    lost = 0
    while before < begin + seconds:
        now = time.monotonic()
        lost += max(0, int((now - begin) * rate) - int((before - begin) * rate) - 1)
        before = now
    results.put(100.0 * lost / (rate * seconds))


def lockstep(own_process, steps, results):
    """Drive a lockstep valve, here or in a process of its own, for so many steps."""
    given = {'pacing': 'lockstep', 'publish_sample': True, 'diagnostics_period': 0.0}
    rclpy.init()
    executor, nodes, other = new_executor(), [Driver()], None
    driver = nodes[0]
    if own_process:
        words = [word for k, v in given.items() for word in ('-p', f'{k}:={str(v).lower()}')]
        program = 'from valve_sim_ros.nodes.start import valve_plant; valve_plant()'
        environment = dict(os.environ)
        environment.pop('_ROS_WHEELS_BOOTSTRAP_COMPLETE', None)
        command = [sys.executable, '-c', program, '--ros-args', *words]
        other = subprocess.Popen(command, env=environment)
    else:
        nodes.append(ValvePlant(parameter_overrides=overrides(**given)))
    for node in nodes:
        executor.add_node(node)
    while not (driver.u.get_subscription_count() and driver.count_publishers('x')):
        executor.spin_once(timeout_sec=0.1)
    run_until(executor, driver, min(steps, 2000))
    memory, parts = [resident()], 10
    begin, cpu = time.monotonic(), cpu_seconds()
    for _ in range(parts):
        run_until(executor, driver, steps // parts)
        memory.append(resident())
    cpu = cpu_seconds() - cpu
    rate = steps / (time.monotonic() - begin)
    results.put({'rate': rate, 'cpu': cpu / steps, 'memory': memory})
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()
    if other:
        other.terminate()
        other.wait(10.0)


def run_until(executor, driver, steps):
    driver.limit, driver.over = driver.count + steps, Future()
    driver.send()
    executor.spin_until_future_complete(driver.over, 1e6)


def measure(function, *arguments):
    """Return what a function puts in its queue, run in a fresh process."""
    os.environ.pop('_ROS_WHEELS_BOOTSTRAP_COMPLETE', None)
    results = Queue()
    process = Process(target=function, args=(*arguments, results))
    process.start()
    found = results.get()
    process.join()
    return found


def say_paced(count, rate, found):
    missed, tardy = (100.0 * found[name] / found['periods'] for name in ('missed', 'tardy'))
    print(
        f'{count:4d} valve(s) at {rate:g} Hz: {found["rate"]:.1f} samples/s each, '
        f'{found["missed"]} of {found["periods"]:.0f} periods missed ({missed:.3f} %), '
        f'{found["tardy"]} samples after their period ({tardy:.3f} %), '
        f'{100.0 * found["cpu"]:.2f} % of a core per valve'
    )
    print(
        f'      longest time between two samples: {1e3 * found["pause"]:.1f} ms; '
        f'the host kept {100.0 * found["stolen"]:.1f} % of the cores to itself'
    )
    for name, words in (
        ('late', 'tick after its due time, within the period'),
        ('taken', 'tick to last publish'),
    ):
        p50, p99, worst = found[name]
        print(f'      {words}: p50 {p50:.0f}, p99 {p99:.0f}, worst {worst:.0f} us')


@click.command()
@click.option('--seconds', default=10.0, show_default=True, help='Length of each paced run.')
@click.option('--steps', default=30_000, show_default=True, help='Lockstep steps; 0: none.')
@click.option(
    '--paced',
    'cases',
    multiple=True,
    metavar='VALVES@HZ',
    default=('1@2000', '1@200', '10@200', '100@5'),
    show_default=True,
    help='A paced run; repeatable.',
)
def main(seconds, steps, cases):
    """Measure and print all figures."""
    load = os.getloadavg()[0]
    print(f'{os.cpu_count()} cores, load of the machine before the start: {load:.1f}')
    for case in cases:
        count, rate = map(float, case.split('@'))
        say_paced(int(count), rate, measure(paced, int(count), rate, seconds))
        held = measure(bare, rate, min(seconds, MOST_BARE))
        print(
            f'      a loop that only looks at the clock slept through {held:.3f} % of the periods'
        )
    ways = ((False, 'one process'), (True, 'two processes'))
    for own_process, words in ways if steps else ():
        found = measure(lockstep, own_process, steps)
        memory = found['memory']
        print(f'lockstep in {words}: {found["rate"]:.0f} steps/s over {steps} steps')
        print(f'      {1e6 * found["cpu"]:.0f} us of CPU per step in the driving process')
        print(f'      memory {memory[1]:.1f} MB after a tenth, {memory[-1]:.1f} MB at the end')


if __name__ == '__main__':
    main()
