# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Node `signal_player`: the commands of a CSV file on the topic u, once, in time."""

from collections.abc import Sequence
import sys
from typing import Any

import numpy as np
from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node
from std_msgs.msg import Float64

from ..recordings import read_commands, RecordingError
from .messages import OUTPUT, publisher
from .parameters import refuse_unknown
from .spinning import ends_quietly, run
from .start import signal_player

SHORTEST_PERIOD = 0.001
"""Nothing is sent more often [s]."""


class SignalPlayer(Node):
    """Publishes u [% of span] as a CSV file (columns t, u) says, then ends.

    It starts once somebody listens, keeps to the node's clock, and where a tick comes late sends
    the command that is due then: the signal is never stretched.
    """

    def __init__(self, **options: Any) -> None:
        """Read the file and connect; `options` go to rclpy's Node.

        Raises
        ------
        RecordingError
            If there is no file, or it cannot be read.
        """
        super().__init__('signal_player', **options)
        refuse_unknown(self, ['file'])
        words = ParameterDescriptor(description='CSV file (t,u) or bag to play', read_only=True)
        path = self.declare_parameter('file', '', words).value
        if not path:
            raise RecordingError(
                'no file to play: give one with --ros-args -p file:=signal.csv; "valve_sim doctor '
                '--signal signal.csv" writes one'
            )
        commands = read_commands(path)
        self._times = np.round(commands.time * 1e9).astype(np.int64)
        self._u = commands.u
        self._next, self._start = 0, -1
        self._publisher = publisher(self, Float64, 'u', OUTPUT)
        step = float(np.median(np.diff(commands.time))) if len(commands) > 1 else 1.0
        self.create_timer(max(step, SHORTEST_PERIOD), self._tick)
        self.get_logger().info(
            f'{path}: {len(commands)} commands in {commands.time[-1]:.6g} s; waiting for a valve'
        )

    @ends_quietly
    def _tick(self) -> None:
        """Send the command that is due; end behind the last one."""
        now = self.get_clock().now().nanoseconds
        if self._start < 0:
            if not self._publisher.get_subscription_count():
                return
            self._start = now
            self.get_logger().info('playing')
        due = int(np.searchsorted(self._times, now - self._start, side='right'))
        if self._next >= self._times.size:
            self.get_logger().info('played')
            self.context.try_shutdown()
        elif due > self._next:
            self._publisher.publish(Float64(data=float(self._u[due - 1])))
            self._next = due


def main(args: Sequence[str] | None = None) -> None:
    """Run the node to the end of the signal; exit code 1 if the file is refused."""
    sys.exit(run(SignalPlayer, args))


if __name__ == '__main__':
    signal_player()
