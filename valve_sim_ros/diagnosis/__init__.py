# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Find where model and measurement disagree, name the missing effect, add it, show the gap."""

from .diagnose import diagnose, PATIENCE
from .errors import DiagnosisError
from .result import Diagnosis

__all__ = ['PATIENCE', 'Diagnosis', 'DiagnosisError', 'diagnose']
