# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Command `valve_rack`: several valves in one process, each in a namespace of its own."""

from collections.abc import Sequence
import re
import sys

from rclpy.node import Node
from rclpy.utilities import remove_ros_args

from ..model.errors import ModelError
from .spinning import run
from .start import valve_rack
from .valve_plant import ValvePlant

USAGE = 'valve_rack NAME... | NUMBER [--ros-args ...]'


def names(words: Sequence[str]) -> list[str]:
    """Return the namespaces: those given, or valve_1 to valve_NUMBER.

    Raises
    ------
    ModelError
        If there is none, one is no name, or one comes twice.
    """
    if len(words) == 1 and words[0].isdigit():
        words = [f'valve_{k + 1}' for k in range(int(words[0]))]
    wrong = [word for word in words if not re.fullmatch(r'[A-Za-z]\w*(/[A-Za-z]\w*)*', word)]
    if not words or wrong or len(set(words)) < len(words):
        raise ModelError(
            f'valves {" ".join(words) or "missing"}: expected {USAGE}, names of letters, digits '
            'and _, none twice'
        )
    return list(words)


def plants(words: Sequence[str]) -> list[Node]:
    """Return the valves, or raise a ModelError if a name or a parameter is refused."""
    made: list[Node] = []
    try:
        for name in names(words):
            made.append(ValvePlant(namespace=name))
    except BaseException:
        for plant in made:
            plant.destroy_node()
        raise
    return made


def main(args: Sequence[str] | None = None) -> None:
    """Run the valves until SIGINT or SIGTERM; exit code 1 if a parameter is refused.

    Parameters given for all nodes (``/**``) reach every valve, those given for
    ``/valve_2/valve_plant`` reach one.
    """
    command = list(sys.argv) if args is None else ['valve_rack', *args]
    words = remove_ros_args(command)[1:]
    sys.exit(run(lambda: plants(words), args))


if __name__ == '__main__':
    valve_rack()
