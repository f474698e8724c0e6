# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a node says about itself on /diagnostics."""

from collections.abc import Callable, Mapping
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from .spinning import ends_quietly

Report = tuple[list[str], Mapping[str, Any]]
"""What is wrong, in sentences (nothing: all is well), and the figures."""


class Health:
    """Publishes a report every so often, in wall time: it must come even if /clock stands."""

    def __init__(self, node: Node, period: float, report: Callable[[], Report]) -> None:
        """Begin to report every `period` seconds; 0: never."""
        self._node, self._report = node, report
        if period:
            self.context = node.context
            self._publisher = node.create_publisher(DiagnosticArray, '/diagnostics', 10)
            clock = Clock(clock_type=ClockType.STEADY_TIME)
            node.create_timer(period, self._publish, clock=clock)

    @ends_quietly
    def _publish(self) -> None:
        self._publisher.publish(self.message())

    def message(self) -> DiagnosticArray:
        """Return the report as a message."""
        troubles, figures = self._report()
        name = self._node.get_fully_qualified_name()
        status = DiagnosticStatus(
            level=DiagnosticStatus.WARN if troubles else DiagnosticStatus.OK,
            name=f'{name.lstrip("/")}: valve',
            message='; '.join(troubles) or 'all is well',
            hardware_id=name,
            values=[KeyValue(key=key, value=str(value)) for key, value in figures.items()],
        )
        array = DiagnosticArray(status=[status])
        array.header.stamp = self._node.get_clock().now().to_msg()
        return array
