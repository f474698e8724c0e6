# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`valve_sim experiment`: the paper's experiments on a simulated valve."""

from pathlib import Path

import click

from ..experiments.inputs import EXPERIMENTS


@click.command('experiment')
@click.argument('name', type=click.Choice(tuple(EXPERIMENTS)))
@click.option(
    '--out', required=True, type=click.Path(path_type=Path), help='Bag folder to make, or .csv.'
)
@click.option('--params', type=click.Path(path_type=Path), help='ROS parameter file of the valve.')
@click.option('--noise', default=0.0, show_default=True, help='Noise added to p1, p2 and x [%].')
@click.option('--seed', default=0, show_default=True, help='Seed of the noise.')
def experiment_command(name: str, out: Path, params: Path | None, noise: float, seed: int) -> None:
    """Perform an experiment of the paper and record it; the node signal_player plays its u."""
    from ..experiments.perform import perform
    from ..model.parameter_file import read_parameters
    from ..recordings import Recording, write_recording

    if noise < 0.0:
        raise click.UsageError(f'--noise {noise:g}: expected 0 or more')
    chosen = EXPERIMENTS[name]
    s = perform(chosen, read_parameters(params) if params else None, noise, seed)
    write_recording(Recording(s.t, s.u, s.p1, s.p2, s.x), out)
    click.echo(chosen.title)
    for assumption in chosen.assumptions:
        click.echo(f'assumed: {assumption}')
    click.echo(f'written: {out} ({s.t.size} samples at {chosen.sample_time:g} s)')
