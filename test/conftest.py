# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""
Isolation of the tests, before anything imports rclpy.

Each test process (each xdist worker too) gets a DDS domain of its own on the loopback device, so
tests can run side by side and next to a live robot. Processes that a test starts inherit it.
"""

import atexit
import os
import shutil
import socket
import tempfile

from hypothesis import HealthCheck, settings

# The ports ROS's own domain_coordinator uses for the same purpose.
_PORT_BASE = 22119
_DOMAINS = 101

# Settings of the caller that would lead out of the isolation.
_FOREIGN = (
    'ROS_LOCALHOST_ONLY',
    'ROS_STATIC_PEERS',
    'ROS_DISCOVERY_SERVER',
    'ROS_NAMESPACE',
    'FASTRTPS_DEFAULT_PROFILES_FILE',
    'FASTDDS_DEFAULT_PROFILES_FILE',
)


def _reserve_domain():
    """Return a domain id in 1..101 and the bound socket that reserves it while it is open."""
    for attempt in range(_DOMAINS):
        domain = 1 + (os.getpid() + attempt) % _DOMAINS
        claim = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            claim.bind(('127.0.0.1', _PORT_BASE + domain))
        except OSError:
            claim.close()
        else:
            return domain, claim
    raise RuntimeError(f'all {_DOMAINS} ROS domains are taken by other test processes; wait')


_domain, _claim = _reserve_domain()
_logs = tempfile.mkdtemp(prefix='valve_sim_ros_log_')
atexit.register(shutil.rmtree, _logs, ignore_errors=True)
atexit.register(_claim.close)

for _name in _FOREIGN:
    os.environ.pop(_name, None)
os.environ.update(
    ROS_AUTOMATIC_DISCOVERY_RANGE='LOCALHOST',
    ROS_DOMAIN_ID=str(_domain),
    ROS_LOG_DIR=_logs,
    ROS_PYTHON_CHECK_FIELDS='1',
)

# `steady` tries the same examples every time; `--hypothesis-profile explore` looks for new ones.
_COMMON = {'deadline': None, 'suppress_health_check': [HealthCheck.too_slow]}
settings.register_profile('steady', max_examples=50, derandomize=True, **_COMMON)
settings.register_profile('explore', max_examples=500, print_blob=True, **_COMMON)
settings.load_profile('steady')
