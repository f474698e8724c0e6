# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How every node of the package starts, spins and ends."""

from collections.abc import Callable, Sequence
from functools import wraps
import sys
from typing import Any

import rclpy
from rclpy._rclpy_pybind11 import RCLError  # rclpy exports it nowhere else
from rclpy.exceptions import (
    InvalidParameterException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
)
from rclpy.executors import ExternalShutdownException
from rclpy.experimental import EventsExecutor
from rclpy.node import Node

REFUSALS = (
    ValueError,
    RCLError,  # e.g. a parameter file that is missing or no YAML
    InvalidParameterException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
)
"""What bad input raises while a node is made; all carry a sentence."""


def new_executor() -> EventsExecutor:
    """Return the executor the nodes run on; it costs a third of the single-threaded one."""
    return EventsExecutor()


def ends_quietly(callback: Callable[..., Any]) -> Callable[..., Any]:
    """Wrap a node's callback: a signal may end ROS between two publications of it."""

    @wraps(callback)
    def wrapped(node: Node, *arguments: Any) -> Any:
        try:
            return callback(node, *arguments)
        except RCLError:
            if node.context.ok():
                raise
            return None

    return wrapped


def spin(node: Node) -> None:
    """Spin until the context is shut down (SIGINT, SIGTERM)."""
    executor = new_executor()
    executor.add_node(node)
    try:
        # spin() of this executor ignores signals, a bounded spin_once does not
        while rclpy.ok():
            executor.spin_once(timeout_sec=0.2)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        executor.shutdown()


def run(make: Callable[[], Node], args: Sequence[str] | None = None, once: bool = False) -> int:
    """Make a node, spin it (not at all if `once`), and end in the order that never aborts.

    Returns
    -------
    int
        Exit code: 0 after SIGINT or SIGTERM, 1 with a sentence on stderr after bad input.
    """
    node = None
    try:
        rclpy.init(args=list(args) if args is not None else None)
        node = make()
        if not once:
            spin(node)
    except REFUSALS as error:
        print(f'refused: {error}', file=sys.stderr)
        return 1
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        _end(node)
    return 0


def _end(node: Node | None) -> None:
    """Take the node down; a second SIGINT meanwhile changes nothing."""
    try:
        if node is not None:
            node.destroy_node()
        rclpy.try_shutdown()
    except KeyboardInterrupt:
        rclpy.try_shutdown()
