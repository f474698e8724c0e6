# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A controller as somebody else might write it: integral action with a dead band."""

from rclpy.node import Node
from std_msgs.msg import Float64

SAMPLE_TIME = 0.2


class SmallController(Node):
    """Hears x, publishes u; knows nothing of simulation."""

    def __init__(self, setpoint, gain=0.05, dead_band=1.0):
        """Connect; set point and dead band in per cent of span, gain in 1/s."""
        super().__init__('small_controller')
        self.setpoint, self.gain, self.dead_band = setpoint, gain, dead_band
        self.u = 0.0
        self.publisher = self.create_publisher(Float64, 'u', 10)
        self.create_subscription(Float64, 'x', self.hear, 10)

    def hear(self, message):
        """Answer a position with a command."""
        error = self.setpoint - message.data
        if abs(error) > self.dead_band:
            self.u += self.gain * SAMPLE_TIME * error
        self.u = min(max(self.u, 0.0), 100.0)
        self.publisher.publish(Float64(data=self.u))
