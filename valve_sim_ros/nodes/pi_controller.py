# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Node `pi_controller`: the paper's C(s) around a valve, or around any process from 0 to 100 %."""

from collections.abc import Sequence
import math
import sys
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from std_msgs.msg import Float64

from ..experiments.pi_controller import PiController
from ..model.declarations import Parameter
from ..model.errors import ModelError
from ..model.parameters import SAMPLE_TIME
from .messages import INPUT, LOSSLESS, LOSSLESS_LATCHED, OUTPUT, publisher, subscription
from .parameters import per_cent, refuse_unknown, Settings, Switch
from .spinning import ends_quietly, run
from .start import pi_controller

GAIN = Parameter(
    'gain', 'K_c', '%/%', 0.2083, -1e3, 1e3, 'linear', 'Gain; negative for a reverse action'
)
INTEGRAL_TIME = Parameter('integral_time', 'T_i', 's', 15.0, 1e-3, 1e5, 'log', 'Integral time')
LOCKSTEP = Switch(
    'lockstep', False, 'Send the first command by itself and lose no message: for a lockstep valve'
)
AUTOMATIC = Switch('automatic', True, 'Control; if false, u follows the topic manual')
INITIAL_X = per_cent('initial_x', 'x(0)', 'Position assumed before the first one arrives')
HOLD = Parameter(
    'setpoint_hold', 'T_h', 's', 200.0, 1e-3, 1e6, 'log', 'Time for which each of setpoints holds'
)
FIXED = (SAMPLE_TIME, LOCKSTEP, INITIAL_X, HOLD)
LIVE = (GAIN, INTEGRAL_TIME, AUTOMATIC)


class PiControllerNode(Node):
    """Subscribes x and setpoint, publishes u: one command for each x that arrives.

    So it is paced by what it controls, on the wall, on /clock and in lockstep alike. Without x
    it falls silent, and the plant's watchdog takes over.

    Attributes
    ----------
    setpoint, command : float
        In force now [% of span].
    """

    def __init__(self, **options: Any) -> None:
        """Declare the parameters and connect; `options` go to rclpy's Node."""
        super().__init__('pi_controller', **options)
        refuse_unknown(self, [*(declared.name for declared in (*FIXED, *LIVE)), 'setpoints'])
        self._settings = Settings(self, FIXED, LIVE).values
        self._programme = self._declare_setpoints()
        self._hold = max(1, round(self._settings['setpoint_hold'] / self._settings['sample_time']))
        self._law = PiController(sample_time=self._settings['sample_time'])
        self._tune()
        self.setpoint, self._measured = self._programme[0], self._settings['initial_x']
        self.command, self._manual, self._samples = 0.0, 0.0, 0
        self.add_post_set_parameters_callback(self._retune)
        self._connect(self._settings['lockstep'])

    def _declare_setpoints(self) -> list[float]:
        """Declare and check the programme of set points."""
        words = ParameterDescriptor(
            description='Set points [%], each held for setpoint_hold, the last for ever; a '
            'message on the topic setpoint ends the programme',
            read_only=True,
            dynamic_typing=True,
        )
        given = self.declare_parameter('setpoints', [50.0], words).value
        try:
            return [per_cent('setpoints', 'r', 'set point').checked(one) for one in given]
        except TypeError:
            raise ModelError(
                f'setpoints = {given!r}: expected a list, e.g. [40.0, 60.0]'
            ) from None

    def _connect(self, lockstep: bool) -> None:
        """Make the topics, and in lockstep what sends the first command."""
        out, into = (LOSSLESS, LOSSLESS_LATCHED) if lockstep else (OUTPUT, INPUT)
        self._u = publisher(self, Float64, 'u', out)
        self._shown = publisher(self, Float64, '~/setpoint', OUTPUT)
        self._x = subscription(self, Float64, 'x', self._hear, into)
        subscription(self, Float64, 'setpoint', self._take_setpoint, INPUT)
        subscription(self, Float64, 'manual', self._take_manual, INPUT)
        if lockstep:
            clock = Clock(clock_type=ClockType.STEADY_TIME)
            self._starter = self.create_timer(0.02, self._start, clock=clock)

    @ends_quietly
    def _start(self) -> None:
        """Send the first command as soon as a valve is there to answer it."""
        if self._u.get_subscription_count() and self.count_publishers(self._x.topic_name):
            self._starter.cancel()
            if not self._samples:
                self._answer()

    @ends_quietly
    def _hear(self, message: Float64) -> None:
        """Answer a position with a command."""
        if math.isfinite(message.data):
            self._measured = message.data
            self._answer()

    def _answer(self) -> None:
        """Work out the command, publish it."""
        if self._programme:
            entry = min(self._samples // self._hold, len(self._programme) - 1)
            self.setpoint = self._programme[entry]
        self._samples += 1
        if self._settings['automatic']:
            self.command = self._law.step(self.setpoint, self._measured)
        else:
            self.command = self._manual
            self._law.track(self.command, self.setpoint, self._measured)
        self._u.publish(Float64(data=float(self.command)))
        self._shown.publish(Float64(data=float(self.setpoint)))

    def _take_setpoint(self, message: Float64) -> None:
        """Take over a set point; it ends the programme."""
        if math.isfinite(message.data):
            self._programme = []
            self.setpoint = min(max(message.data, 0.0), 100.0)

    def _take_manual(self, message: Float64) -> None:
        """Take over a command by hand."""
        if math.isfinite(message.data):
            self._manual = min(max(message.data, 0.0), 100.0)

    def _tune(self) -> None:
        """Give the law its gain and integral time."""
        self._law.gain = self._settings['gain']
        self._law.integral_time = self._settings['integral_time']

    def _retune(self, _: Any) -> None:
        """Change the tuning, or take over by hand, without a bump."""
        before = self._law.gain, self._law.integral_time
        self._tune()
        if (self._law.gain, self._law.integral_time) != before:
            self._law.track(self.command, self.setpoint, self._measured)
        if self._settings['automatic']:
            self._manual = self.command


def main(args: Sequence[str] | None = None) -> None:
    """Run the node until SIGINT or SIGTERM; exit code 1 if a parameter is refused."""
    sys.exit(run(PiControllerNode, args))


if __name__ == '__main__':
    pi_controller()
