# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where the rivals' kernels find their numbers."""

P1, P2, X, V, DIRECTION, ARMED = range(6)
"""State: p1, p2, x [% of span] in every model; v [%/s], slip direction and arming in some."""

F_D1, T_G1, T_G2, F_S, F_D, A_1, A_2 = range(7)
"""Parameters of the physical models: the base valve's seven, then the model's own."""

OWN = 7
"""First parameter that a physical model adds to the seven."""
