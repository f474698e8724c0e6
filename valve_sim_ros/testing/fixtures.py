# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The pytest fixture."""

from collections.abc import Callable, Iterator
import os
from pathlib import Path
from typing import Any

import pytest
import rclpy

from .isolation import reserve_domain
from .lockstep_valve import LockstepValve


@pytest.fixture
def lockstep_valve(tmp_path: Path) -> Iterator[Callable[..., LockstepValve]]:
    """Return what makes a `LockstepValve`; all of them are taken down after the test.

    ROS is started in a domain of its own on the loopback device, unless the test did so itself
    or set ROS_DOMAIN_ID.
    """
    claim = None
    started = not rclpy.ok()
    if started:
        os.environ.setdefault('ROS_LOG_DIR', str(tmp_path))
        os.environ.setdefault('ROS_AUTOMATIC_DISCOVERY_RANGE', 'LOCALHOST')
        domain = None
        if 'ROS_DOMAIN_ID' not in os.environ:
            domain, claim = reserve_domain()
        rclpy.init(domain_id=domain)
    made: list[LockstepValve] = []

    def make(*arguments: Any, **options: Any) -> LockstepValve:
        made.append(LockstepValve(*arguments, **options))
        return made[-1]

    yield make
    for valve in made:
        valve.close()
    if started:
        rclpy.try_shutdown()
    if claim:
        claim.close()
