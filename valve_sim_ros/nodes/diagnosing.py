# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The service `~/diagnose` and its latched topic `~/diagnosis`, for every node that has data."""

from collections.abc import Callable, Mapping
import json
from pathlib import Path
from typing import Any

from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import String

from .long_service import Job, LongService
from .messages import LATCHED

Material = tuple[Any, Mapping[str, Any]]
"""First argument of `diagnosis.diagnose`, and keyword arguments."""


class DiagnoseService:
    """Answers `~/diagnose` with the diagnosis as text; its JSON goes to `~/diagnosis`."""

    def __init__(
        self, node: Node, material: Callable[[], Material], folder: Callable[[], str]
    ) -> None:
        """Offer it.

        Parameters
        ----------
        node : Node
            Node that offers it.
        material : callable
            Returns what to diagnose as it is now, or raises a ValueError.
        folder : callable
            Returns where the diagnosis shall be written; '' writes nothing.
        """
        self._node, self._material, self._folder = node, material, folder
        self._diagnosis = node.create_publisher(String, '~/diagnosis', LATCHED)
        self._service = LongService(node, '~/diagnose', self._prepare)

    def _prepare(self) -> Job:
        """Take along the data of this moment."""
        data, options = self._material()
        folder = self._folder()
        return lambda: self._diagnose(data, options, folder)

    def _diagnose(self, data: Any, options: Mapping[str, Any], folder: str) -> str:
        """Diagnose, publish, write; return the text."""
        from ..diagnosis import diagnose, PATIENCE  # heavy, and few ever ask
        from ..report.diagnosis import write_report

        found = diagnose(data, progress=self._progress, patience=PATIENCE, **options)
        if folder:
            found.write(folder)
            write_report(found, Path(folder) / 'report.html')
        text = json.dumps(found.as_json(), allow_nan=False)
        self._diagnosis.publish(String(data=text))
        return '\n'.join(found.lines())

    def _progress(self, share: float, text: str) -> None:
        """Say how far it is; give it up once the node is told to end."""
        if not self._node.context.ok():
            raise ExternalShutdownException
        log = self._node.get_logger()
        log.info(f'{100.0 * share:.0f} % {text}', throttle_duration_sec=1.0)
