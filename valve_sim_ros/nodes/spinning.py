# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How every node of the package starts, spins and ends."""

from collections.abc import Callable, Sequence
from functools import wraps
import signal
import sys
import threading
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
from rclpy.task import Future

REFUSALS = (
    ValueError,
    RCLError,  # e.g. a parameter file that is missing or no YAML
    InvalidParameterException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
)
"""What bad input raises while a node is made; all carry a sentence."""


SWITCH_INTERVAL = 5e-5
"""Longest wait of a tick for a thread that makes machine code; Python's own is 5 ms [s]."""


def new_executor() -> EventsExecutor:
    """Return the executor the nodes run on; it costs a third of the single-threaded one.

    Threads of the process take turns more often from now on.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
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


def spin(nodes: Sequence[Node]) -> None:
    """Spin until the context is shut down (SIGINT, SIGTERM)."""
    executor = new_executor()
    for node in nodes:
        executor.add_node(node)
    try:
        # spin() of this executor ignores signals; spin_once returns to Python with each event,
        # which costs a fifth of the throughput
        while rclpy.ok():
            executor.spin_until_future_complete(Future(), 1.0)
    except ExternalShutdownException:
        pass
    finally:
        executor.shutdown()


def run(
    make: Callable[[], Node | list[Node]], args: Sequence[str] | None = None, once: bool = False
) -> int:
    """Make nodes, spin them (not at all if `once`), and end in the order that never aborts.

    Returns
    -------
    int
        Exit code: 0 after SIGINT or SIGTERM, 1 with a sentence on stderr after bad input.
    """
    nodes: list[Node] = []
    told = _hear_signals()
    started = False
    try:
        rclpy.init(args=list(args) if args is not None else None)
        started = True
        made = make() if not told else []
        nodes = made if isinstance(made, list) else [made]
        if not once and not told:
            spin(nodes)
    except ExternalShutdownException:
        pass
    except REFUSALS as error:
        if not started or rclpy.ok():  # else a signal came while the nodes were made
            print(f'refused: {error}', file=sys.stderr)
            return 1
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.try_shutdown()
    return 0


def _hear_signals() -> list[int]:
    """Let signals interrupt nothing: rclpy ends the context on them, and that ends the spinning.

    Returns
    -------
    list of int
        Grows with each signal.
    """
    told: list[int] = []
    if threading.current_thread() is threading.main_thread():
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda number, _: told.append(number))
    return told
