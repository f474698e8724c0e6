# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`python -m valve_sim_ros.cli`."""

from . import main

main(prog_name='valve_sim')
