# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The error of this layer."""


class RecordingError(ValueError):
    """A recording cannot be read or written.

    The message says what, where, what was expected and what to do next.
    """
