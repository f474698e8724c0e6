# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a recording to parameters, their fitness, and what the data cannot tell."""
