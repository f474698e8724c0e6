# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one error type of the identification."""


class IdentificationError(ValueError):
    """The data cannot be identified from, with the reason and what to do about it."""
