# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The declarations as a commented parameter file and as the README's table."""

from collections.abc import Iterable

from .declarations import Parameter
from .parameters import BASE, BRANCH, SAMPLE_TIME

HEAD = "# Parameters of valve_plant with their defaults, the paper's valve, eq. (12).\n/**:\n"


def sample_file(others: Iterable[Parameter] = (SAMPLE_TIME,)) -> str:
    """Return config/valve_plant.yaml."""
    lines = [f'{HEAD}  ros__parameters:']
    for parameter in (*others, *BASE):
        lines.append(
            f'    # {parameter.description} [{parameter.unit}], '
            f'{parameter.lower:g} to {parameter.upper:g}'
        )
        lines.append(f'    {parameter.name}: {parameter.default!r}')
    lines.append(f'    # {BRANCH.description}; one of {", ".join(BRANCH.choices)}')
    lines.append(f'    {BRANCH.name}: {BRANCH.default}')
    return '\n'.join(lines).replace('1e-05', '1.0e-05') + '\n'


def parameter_table() -> str:
    """Return the README's table of parameters, in Markdown."""
    rows = ['| parameter | unit | default | range | live | meaning |', '|---|---|---|---|---|---|']
    for parameter in (*BASE, SAMPLE_TIME):
        live = 'no' if parameter is SAMPLE_TIME else 'yes'
        rows.append(
            f'| `{parameter.name}` | {parameter.unit} | {parameter.default:g} | '
            f'{parameter.lower:g} to {parameter.upper:g} | {live} | {parameter.description} |'
        )
    rows.append(
        f'| `{BRANCH.name}` | – | {BRANCH.default} | {", ".join(BRANCH.choices)} | yes | '
        f'{BRANCH.description} |'
    )
    return '\n'.join(rows)
