# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where each state of the simulated valve stands in the state array."""

P2, X, V, XM = 0, 1, 2, 3
GAP, LAG, LOOP, SMOOTH = 4, 5, 6, 7
REST, BRISTLE, WARM, CREEP = 8, 9, 10, 11
LINK, SENSED, HYSTERESIS, HYSTERESIS_INPUT = 12, 13, 14, 15
PLAY = 16
PLAYS = 10
EXHAUST = PLAY + PLAYS
SIZE = EXHAUST + 1
