# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`valve_sim doctor`: what recordings can tell and what to record next."""

from pathlib import Path
from typing import Any

import click

from .options import read, reading_options


@click.command('doctor')
@click.argument('data', nargs=-1, type=click.Path(path_type=Path))
@reading_options
@click.option(
    '--signal', type=click.Path(path_type=Path), help='Write the recommended commands to this CSV.'
)
@click.option(
    '--range',
    'limits',
    nargs=2,
    default=(10.0, 90.0),
    show_default=True,
    metavar='LOW HIGH',
    help='What the plant may be commanded to [%].',
)
def doctor_command(
    data: tuple[Path, ...],
    signal: Path | None,
    limits: tuple[float, float],
    **reading: Any,
) -> None:
    """Say what DATA (bags or CSV files) can tell about the valve, before anything is fitted.

    Without DATA, --signal writes the commands with which to begin.
    """
    from ..recordings import write_recording
    from ..recordings.advice import recommended, wanted
    from ..recordings.doctor import examine, PARAMETERS, together

    if not data and signal is None:
        raise click.UsageError('give a bag or CSV file, or --signal FILE')
    examinations = []
    for path in data:
        recording = read(path, **reading)
        examinations.append(examine(recording))
        click.echo(f'{path} (time: {recording.provenance.time_source}):')
        for line in examinations[-1].lines():
            click.echo(f'  {line}')
    best = together(examinations) if examinations else ()
    if len(examinations) > 1:
        click.echo('together:')
        for verdict in best:
            click.echo(f'  {verdict.parameter}: {verdict.visibility}')
    if signal is not None:
        commands = recommended(
            examinations[-1] if examinations else None,
            missing=wanted(best) if best else PARAMETERS,
            low=limits[0],
            high=limits[1],
        )
        write_recording(commands, signal)
        click.echo(
            f'written: {signal} ({commands.time[-1]:.0f} s of commands); play it with "ros2 run '
            f'valve_sim_ros signal_player --ros-args -p file:={signal}"'
        )
