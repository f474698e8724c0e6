# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pneumatic control valve for ROS 2: plant simulation and identification from recordings."""

__version__ = '0.1.0'
