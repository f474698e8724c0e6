# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A DDS domain that no other test process on this machine uses."""

import os
import socket

PORT_BASE = 22119
"""The ports ROS's own domain_coordinator uses for the same purpose."""
DOMAINS = 101


def reserve_domain() -> tuple[int, socket.socket]:
    """Return a domain id in 1..101 and the bound socket that reserves it while it is open.

    Raises
    ------
    RuntimeError
        If all are taken.
    """
    for attempt in range(DOMAINS):
        domain = 1 + (os.getpid() + attempt) % DOMAINS
        claim = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            claim.bind(('127.0.0.1', PORT_BASE + domain))
        except OSError:
            claim.close()
        else:
            return domain, claim
    raise RuntimeError(f'all {DOMAINS} ROS domains are taken by other test processes; wait')
