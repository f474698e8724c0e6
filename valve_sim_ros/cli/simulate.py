# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`valve_sim simulate`: commands of a recording through a valve."""

from pathlib import Path

import click

from .options import topic_option, topics_by_signal


@click.command('simulate')
@click.option('--params', type=click.Path(path_type=Path), help='ROS parameter file of the valve.')
@click.option(
    '--input', 'source', required=True, type=click.Path(path_type=Path), help='Bag or CSV with u.'
)
@click.option(
    '--out', required=True, type=click.Path(path_type=Path), help='Bag folder to make, or .csv.'
)
@topic_option
def simulate_command(
    params: Path | None, source: Path, out: Path, topics: tuple[str, ...]
) -> None:
    """Run the commands of a recording through the valve; write t, u, p1, p2, x."""
    from ..model.parameter_file import read_parameters
    from ..model.simulation import simulate
    from ..model.spec import ValveSpec
    from ..recordings import read_commands, Recording, write_recording

    spec = read_parameters(params) if params else ValveSpec()
    commands = read_commands(source, topics_by_signal(topics))
    result = simulate(commands.u, parameters=spec, time=commands.time)
    write_recording(
        Recording(
            result.t, result.u, result.p1, result.p2, result.x, provenance=commands.provenance
        ),
        out,
    )
    click.echo(f'written: {out} ({result.t.size} samples)')
