# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Node `valve_plant`: a simulated valve behind the topics u, p1, p2 and x."""

from collections.abc import Sequence
import math
import sys
from typing import Any

from rclpy._rclpy_pybind11 import RCLError  # rclpy exports it nowhere else
from rclpy.node import Node
from std_msgs.msg import Float64

from ..model.simulation import Valve
from ..model.spec import ValveSpec
from .parameters import INITIAL_COMMAND, ValveParameters
from .spinning import run

QUEUE = 10
REPORT_PERIOD = 10.0
"""Seconds between two reports of the same trouble."""


class ValvePlant(Node):
    """Subscribes u, steps the valve every sample_time, publishes p1, p2 and x.

    All topics are std_msgs/Float64 in per cent of span. The command holds until the next one. A
    sample always advances the valve by the nominal sample time; periods the timer missed are
    counted and reported, they do not change the physics.

    Attributes
    ----------
    refused_commands, clamped_commands, missed_periods : int
        Counts since the start.
    """

    def __init__(self, **options: Any) -> None:
        """Declare the parameters and connect; `options` go to rclpy's Node."""
        super().__init__('valve_plant', **options)
        self._valve_parameters = ValveParameters(self, self._apply)
        self.sample_time = self._valve_parameters.fixed['sample_time']
        self.command = self._valve_parameters.fixed[INITIAL_COMMAND.name]
        self.refused_commands = self.clamped_commands = self.missed_periods = 0
        self._last_tick: int | None = None
        self._valve = Valve(self._valve_parameters.spec)
        self._outputs = [self.create_publisher(Float64, name, QUEUE) for name in ('p1', 'p2', 'x')]
        self.create_subscription(Float64, 'u', self._receive, QUEUE)
        self.create_timer(self.sample_time, self._tick)

    def step(self) -> tuple[float, float, float]:
        """Take one sample and publish it; return p1, p2, x [% of span]."""
        sample = self._valve.step(self.command, self.sample_time)
        for publisher, value in zip(self._outputs, sample, strict=True):
            publisher.publish(Float64(data=value))
        return sample

    def _apply(self, spec: ValveSpec) -> None:
        # callbacks and ticks take turns on one thread, so this falls between two samples
        self._valve.spec = spec

    def _receive(self, message: Float64) -> None:
        """Take over a command, unless it is no number; clamp it to the span."""
        if not math.isfinite(message.data):
            self.refused_commands += 1
            self.get_logger().warning(
                f'command {message.data} refused ({self.refused_commands} so far): expected a '
                f'number from 0 to 100 %; the last good one, {self.command:g} %, holds',
                throttle_duration_sec=REPORT_PERIOD,
            )
            return
        self.command = min(max(message.data, 0.0), 100.0)
        if self.command != message.data:
            self.clamped_commands += 1
            self.get_logger().warning(
                f'command {message.data:g} % clamped to {self.command:g} %: the span is 0 to '
                '100 %; further ones are clamped without a word',
                once=True,
            )

    def _tick(self) -> None:
        """Step, and count the periods that the timer missed before."""
        now = self.get_clock().now().nanoseconds
        if self._last_tick is not None:
            late = round((now - self._last_tick) * 1e-9 / self.sample_time) - 1
            if late > 0:
                self.missed_periods += late
                self.get_logger().warning(
                    f'{self.missed_periods} periods of {self.sample_time:g} s missed so far: this '
                    'machine is too slow or too busy; the valve itself is not affected',
                    throttle_duration_sec=REPORT_PERIOD,
                )
        self._last_tick = now
        try:
            self.step()
        except RCLError:
            if self.context.ok():  # otherwise a signal came between two publications
                raise


def main(args: Sequence[str] | None = None) -> None:
    """Run the node until SIGINT or SIGTERM; exit code 1 if a parameter is refused."""
    sys.exit(run(ValvePlant, args))


if __name__ == '__main__':
    main()
