# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`valve_sim diagnose`: recordings in, the missing effect out."""

from pathlib import Path
import sys
import time

import click

from .options import INTERRUPTED, progress_bar, topic_option, topics_by_signal


@click.command('diagnose')
@click.argument('data', nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option('--out', required=True, type=click.Path(path_type=Path), help='Folder for results.')
@click.option(
    '--params',
    type=click.Path(path_type=Path),
    help='ROS parameter file of what is known of the valve: the search starts there.',
)
@topic_option
@click.option('--seed', default=0, show_default=True, help='Seed of the searches.')
@click.option(
    '--without',
    multiple=True,
    metavar='EFFECT',
    help='Effect to leave out of the catalogue; repeatable.',
)
@click.option(
    '--patience',
    type=click.FloatRange(0.0),
    default=300.0,  # PATIENCE of the diagnosis, which takes seconds to import
    show_default=True,
    help='Seconds after which no further search begins; what was found so far is the result.',
)
def diagnose_command(
    data: tuple[Path, ...],
    out: Path,
    params: Path | None,
    topics: tuple[str, ...],
    seed: int,
    without: tuple[str, ...],
    patience: float,
) -> None:
    """Find where the model is wrong on DATA (bags or CSV files) and name the missing effect.

    Writes base.yaml, augmented.yaml, diagnosis.json, report.html and, unless the model is
    adequate, decide_by.csv: commands that tell apart what these data do not. Exit code 0 for
    every verdict. Ctrl-C ends the search and keeps what was found so far, marked as partial (exit
    code 130).
    """
    from ..diagnosis import diagnose
    from ..model.parameter_file import read_parameters
    from ..report.diagnosis import write_report

    spec = read_parameters(params) if params else None
    began = time.monotonic()
    with progress_bar() as progress:
        result = diagnose(
            data,
            topics=topics_by_signal(topics),
            seed=seed,
            spec=spec,
            progress=progress,
            without=without,
            interruptible=True,
            patience=patience,
        )
    for recording in result.recordings:
        for line in recording.quality.lines():
            click.echo(line)
    for line in result.lines():
        click.echo(line)
    written = [*result.write(out), out / 'report.html']
    write_report(result, written[-1])
    click.echo('written: ' + ', '.join(map(str, written)))
    if result.partial and time.monotonic() < began + patience:
        sys.exit(INTERRUPTED)
