# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`valve_sim identify`: recordings in, fitted parameters out."""

from pathlib import Path
import sys
from typing import Any

import click

from ..identification.choices import SIGNALS, WAYS
from .options import INTERRUPTED, progress_bar, read, reading_options


@click.command('identify')
@click.argument('data', nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option('--out', required=True, type=click.Path(path_type=Path), help='Folder for results.')
@reading_options
@click.option(
    '--signal',
    'signals',
    multiple=True,
    type=click.Choice(SIGNALS),
    help='Output to fit; repeatable; all that are measured by default.',
)
@click.option(
    '--model', default='base', show_default=True, help='Valve model: base or a rival, as kano.'
)
@click.option('--seed', default=0, show_default=True, help='Seed of the global search.')
@click.option(
    '--hold-out',
    type=click.Choice(WAYS),
    default='auto',
    show_default=True,
    help='Also fit without the outer thirds of the time, or without each bag; auto: by bag if '
    'there are several.',
)
@click.option('--profiles', is_flag=True, help='Also the profile likelihood of each parameter.')
@click.option('--plot/--no-plot', default=True, help='Draw OUT/fit.png and OUT/report.html.')
def identify_command(
    data: tuple[Path, ...],
    out: Path,
    signals: tuple[str, ...],
    model: str,
    seed: int,
    hold_out: str,
    profiles: bool,
    plot: bool,
    **reading: Any,
) -> None:
    """Fit the valve to DATA (bags or CSV files); write fitted.yaml, identify.json, report.html.

    Ctrl-C ends the search and keeps the best so far, marked as partial (exit code 130).
    """
    from ..identification.identify import identify

    recordings = [read(path, **reading) for path in data]
    with progress_bar() as progress:
        result = identify(
            recordings,
            seed=seed,
            signals=signals or None,
            model=model,
            hold_out=hold_out,
            profiles=profiles,
            progress=progress,
            interruptible=True,
        )
    for recording in result.recordings:
        for line in recording.quality.lines():
            click.echo(line)
    for line in result.lines():
        click.echo(line)
    result.write(out)
    written = ['fitted.yaml', 'identify.json']
    if plot:
        from ..report.identification import write_report
        from ..report.plots import draw_fit

        draw_fit(result, out / 'fit.png')
        write_report(result, out / 'report.html')
        written += ['fit.png', 'report.html']
    click.echo('written: ' + ', '.join(str(out / name) for name in written))
    if result.partial:
        sys.exit(INTERRUPTED)
