# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's experiments as inputs and loops that anyone can run."""
