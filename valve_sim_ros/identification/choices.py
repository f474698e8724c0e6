# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What callers choose from, apart from all that takes time to import."""

SIGNALS = ('p1', 'p2', 'x')
"""The outputs that can be fitted."""
WAYS = ('auto', 'time', 'bags', 'none')
"""How data are held out; see `holdout.parts_of`."""
