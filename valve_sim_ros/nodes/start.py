# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The commands: whatever the moment of a SIGINT or SIGTERM, they end silently with code 0.

A command loads its node only once a signal during the loading would end it quietly, and it ends
without taking the interpreter down.
"""

from contextlib import suppress
from importlib import import_module
import os
import signal
import sys
from typing import Any, NoReturn


def _run(node: str) -> NoReturn:
    """Run the node's `main` and end the process with its exit code."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, _leave_while_loading)
    try:
        import_module(f'valve_sim_ros.nodes.{node}').main()
        code = 0
    except SystemExit as end:
        code = int(end.code or 0)
    _leave(code)


def _leave(code: int) -> NoReturn:
    """End the process after its node and ROS have been shut down.

    The interpreter is not taken down: while it is, it ends every thread that asks for its lock,
    from within. Threads that do are at work in C++ then, the one that loads machine code and those
    of ROS, and C++ answers with std::terminate: exit code -6 where 0 was due.
    """
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError):  # the reader may have gone
            stream.flush()
    os._exit(code)


def _leave_while_loading(*_: Any) -> None:
    """End before there is anything to shut down; `run` has handlers of its own later."""
    os._exit(0)


def valve_plant() -> None:
    """Run one simulated valve."""
    _run('valve_plant')


def valve_rack() -> None:
    """Run several simulated valves in one process."""
    _run('valve_rack')


def pi_controller() -> None:
    """Run the PI controller."""
    _run('pi_controller')


def valve_twin() -> None:
    """Run the live twin of a valve."""
    _run('valve_twin')


def valve_identifier() -> None:
    """Run the identifier."""
    _run('valve_identifier')


def signal_player() -> None:
    """Play the commands of a file."""
    _run('signal_player')
