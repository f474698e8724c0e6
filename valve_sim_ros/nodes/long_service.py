# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A service whose work takes minutes: the node goes on meanwhile, the answer comes at the end."""

from collections.abc import Callable
import threading
from typing import Any

from rclpy._rclpy_pybind11 import InvalidHandle, RCLError  # rclpy exports RCLError nowhere else
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_srvs.srv import Trigger

Job = Callable[[], str]
"""The work; returns the message of the answer, or raises a ValueError with the reason."""


class LongService:
    """A std_srvs/Trigger service that works in a thread, one request at a time."""

    def __init__(self, node: Node, name: str, prepare: Callable[[], Job]) -> None:
        """Offer it.

        Parameters
        ----------
        node : Node
            Node that offers it.
        name : str
            Name of the service.
        prepare : callable
            Called between two callbacks of the node: takes along what the job needs, returns the
            job, or raises a ValueError with the reason why it cannot begin.
        """
        self._node, self._name, self._prepare = node, name, prepare
        self._thread: threading.Thread | None = None
        self._begun: tuple[Trigger.Response, Job] | None = None
        service = node.create_service(Trigger, name, self._begin)
        # an executor sends what the callback returns at once; this service sends it later
        self._send = service.send_response
        service.send_response = self._send_later

    @property
    def busy(self) -> bool:
        """Whether a job is being done."""
        return self._thread is not None and self._thread.is_alive()

    def _begin(self, _: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Begin, or refuse."""
        try:
            if self.busy:
                raise ValueError(f'{self._name} is at work already: wait for its answer')
            self._begun = response, self._prepare()
        except ValueError as error:
            self._node.get_logger().error(str(error))
            response.success, response.message = False, str(error)
        return response

    def _send_later(self, response: Trigger.Response, header: Any) -> None:
        """Send a refusal now, any other answer when the job is done."""
        begun, self._begun = self._begun, None
        if begun is None or begun[0] is not response:
            self._send(response, header)
            return
        self._thread = threading.Thread(
            target=self._work, args=(*begun, header), name=self._name, daemon=True
        )
        self._thread.start()

    def _work(self, response: Trigger.Response, job: Job, header: Any) -> None:
        """Do the job and answer."""
        try:
            response.message, response.success = job(), True
        except ExternalShutdownException:
            return
        except Exception as error:  # a thread has nobody above it: the caller must hear of it
            known = isinstance(error, ValueError)
            response.message = str(error) if known else f'{type(error).__name__}: {error}'
            if self._node.context.ok():
                self._node.get_logger().error(response.message)
        try:
            self._send(response, header)
        except (RCLError, InvalidHandle):
            if self._node.context.ok():
                raise
