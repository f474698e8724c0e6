# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one error type of the model layer."""


class ModelError(ValueError):
    """A parameter, option or input that the valve model refuses, with what to do about it."""
