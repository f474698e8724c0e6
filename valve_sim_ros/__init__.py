# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A pneumatic control valve for ROS 2: plant simulation and identification from recordings.

``simulate``, ``identify``, ``Recording`` and ``read_recording`` are all a notebook needs; they are
loaded when first used, so that a node does not wait for what it never calls.
"""

from importlib import import_module
from typing import Any

__version__ = '0.1.0'

_PUBLIC = {
    'simulate': 'model.simulation',
    'Simulation': 'model.simulation',
    'InitialState': 'model.simulation',
    'Valve': 'model.simulation',
    'ValveSpec': 'model.spec',
    'ModelError': 'model.errors',
    'read_parameters': 'model.parameter_file',
    'write_parameters': 'model.parameter_file',
    'Recording': 'recordings',
    'read_recording': 'recordings',
    'write_recording': 'recordings',
    'RecordingError': 'recordings',
    'diagnose': 'diagnosis',
    'Diagnosis': 'diagnosis',
    'DiagnosisError': 'diagnosis',
    'identify': 'identification.identify',
    'Identification': 'identification.result',
    'IdentificationError': 'identification.errors',
}

__all__ = ['__version__', *_PUBLIC]


def __getattr__(name: str) -> Any:
    """Load a public name from its module."""
    if name not in _PUBLIC:
        raise AttributeError(f'module {__name__} has no attribute {name}')
    return getattr(import_module(f'{__name__}.{_PUBLIC[name]}'), name)


def __dir__() -> list[str]:
    """List the public names."""
    return __all__
