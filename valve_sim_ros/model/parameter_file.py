# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Valve parameters as a ROS parameter file, which `valve_plant --params-file` loads as it is."""

from collections.abc import Iterable, Mapping
import os
from pathlib import Path
from typing import Any

import yaml

from .errors import ModelError
from .files import write_text
from .parameters import BRANCH, SAMPLE_TIME
from .spec import BASE_MODEL, EFFECTS, MODEL, ValveSpec

NODE_ONLY = frozenset(
    {
        SAMPLE_TIME.name,
        *('use_sim_time', 'start_type_description_service', 'qos_overrides'),
        *('initial_command', 'initial_p1', 'initial_p2', 'initial_x'),
        *('pacing', 'speed_factor', 'publish_sample', 'diagnostics_period'),
        *('command_timeout', 'fail_action', 'fail_position', 'fail_value'),
    }
)
"""Parameters of the node that say nothing about the valve."""


def read_parameters(path: str | os.PathLike[str]) -> ValveSpec:
    """Read the valve from a ROS parameter file.

    Parameters
    ----------
    path : path-like
        YAML file of the form ``/**: ros__parameters: {f_s: 4.0}``; one node only.

    Raises
    ------
    ModelError
        If it cannot be read, has another form, or holds unknown or ill-typed parameters.
    """
    path = Path(path)
    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8'))
    except OSError as error:
        raise ModelError(f'{path}: cannot be read ({error.strerror})') from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise ModelError(f'{path}: not a YAML file ({" ".join(str(error).split())})') from None
    nodes = content if isinstance(content, dict) else {}
    found = [node['ros__parameters'] for node in nodes.values() if _is_node(node)]
    if len(found) != 1:
        raise ModelError(
            f'{path}: expected one node with ros__parameters, found {len(found)}; '
            'the file starts with "/**:" and "  ros__parameters:"'
        )
    try:
        return ValveSpec().changed(
            {name: value for name, value in _flat(found[0]).items() if name not in NODE_ONLY}
        )
    except ModelError as error:
        raise ModelError(f'{path}: {error}') from None


def write_parameters(
    path: str | os.PathLike[str], spec: ValveSpec, comments: Iterable[str] = ()
) -> None:
    """Write the valve as a ROS parameter file, aside first and then renamed into place.

    Parameters
    ----------
    path : path-like
        Target; an existing file is replaced.
    spec : ValveSpec
        The valve.
    comments : iterable of str
        Lines for the head of the file.
    """
    path = Path(path)
    parameters: dict[str, Any] = {}
    if spec.model != BASE_MODEL:
        parameters[MODEL.name] = spec.model
    if spec.effects:
        parameters[EFFECTS] = list(spec.effects)
    parameters |= spec.values
    if spec.model == BASE_MODEL:
        parameters[BRANCH.name] = spec.branch
    content = {'/**': {'ros__parameters': parameters}}
    head = ''.join(f'# {line}\n' for comment in comments for line in comment.splitlines())
    write_text(path, head + yaml.safe_dump(content, sort_keys=False))


def _is_node(node: Any) -> bool:
    """Tell whether a top-level entry carries parameters."""
    return isinstance(node, dict) and isinstance(node.get('ros__parameters'), dict)


def _flat(parameters: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    """Return nested parameters (``air_leak: {leak_rate: 0.01}``) under their full names."""
    flat: dict[str, Any] = {}
    for name, value in parameters.items():
        if isinstance(value, dict):
            flat |= _flat(value, f'{prefix}{name}.')
        else:
            flat[f'{prefix}{name}'] = value
    return flat
