# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Blind records of pneumatic control valves with hidden effects, and the score of a diagnosis.

Deliberately shares no code with the package it tests: its own integrator (small fixed steps of
physical time), its own way of writing each effect, its own sampling, stamps and noise.
"""
