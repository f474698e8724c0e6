# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`valve_sim identify`: recordings in, fitted parameters out."""

from pathlib import Path

import click

from .options import progress_bar, topic_option, topics_by_signal


@click.command('identify')
@click.argument('data', nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option('--out', required=True, type=click.Path(path_type=Path), help='Folder for results.')
@topic_option
@click.option('--seed', default=0, show_default=True, help='Seed of the global search.')
@click.option('--hold-out/--no-hold-out', default=True, help='Also fit without the outer thirds.')
@click.option('--plot/--no-plot', default=True, help='Draw OUT/fit.png.')
def identify_command(
    data: tuple[Path, ...],
    out: Path,
    topics: tuple[str, ...],
    seed: int,
    hold_out: bool,
    plot: bool,
) -> None:
    """Fit the valve to DATA (bags or CSV files); write OUT/fitted.yaml and OUT/identify.json."""
    from ..identification.identify import identify

    with progress_bar() as progress:
        result = identify(
            data,
            topics=topics_by_signal(topics),
            seed=seed,
            hold_out=hold_out,
            progress=progress,
        )
    for recording in result.recordings:
        for line in recording.quality.lines():
            click.echo(line)
    for line in result.lines():
        click.echo(line)
    result.write(out)
    if plot:
        from ..report.plots import draw_fit

        draw_fit(result, out / 'fit.png')
    click.echo(f'written: {out / "fitted.yaml"}, {out / "identify.json"}')
