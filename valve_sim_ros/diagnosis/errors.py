# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The one error of this layer."""


class DiagnosisError(ValueError):
    """The diagnosis could not be made; the text says why and what to do."""
