# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ROS 2 nodes: thin skins around the model and the identification."""
