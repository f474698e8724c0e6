# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Blind records of pneumatic control valves with hidden effects, and the score of a diagnosis.

The generator shares no code with the package it tests: its own integrator (small fixed steps of
physical time), its own way of writing each effect, its own sampling, stamps and noise. Only the
runner and the score of the gap closed import the package.

    python -m blind generate --set singles --split tuning --signals p2,x --count 30 --out SET
    python -m blind run SET
    python -m blind score SET --records

``make blind`` does all of it for all sets of the test half; thresholds are set on the tuning half.
The sets: singles (one effect), clean (none), left_out (one effect that the diagnosis must do
without), unknown (an effect that no catalogue lists) and pairs.
"""
