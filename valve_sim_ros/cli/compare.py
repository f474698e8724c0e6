# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`valve_sim compare`: the base valve and all its rivals on the same recordings."""

from pathlib import Path
from typing import Literal

import click

from .options import progress_bar, topic_option, topics_by_signal


@click.command('compare')
@click.argument('data', nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option('--out', required=True, type=click.Path(path_type=Path), help='Folder for results.')
@topic_option
@click.option('--seed', default=0, show_default=True, help='Seed of the global search.')
@click.option(
    '--input',
    'channel',
    type=click.Choice(('u', 'p2')),
    default='u',
    show_default=True,
    help='What drives the rivals: the command, or the measured p2 in the place of the force.',
)
@click.option(
    '--model',
    'models',
    multiple=True,
    help='Rival to compare with the base valve; repeatable; all eleven by default.',
)
@click.option('--plot/--no-plot', default=True, help='Draw the pictures and OUT/compare.html.')
def compare_command(
    data: tuple[Path, ...],
    out: Path,
    topics: tuple[str, ...],
    seed: int,
    channel: Literal['u', 'p2'],
    models: tuple[str, ...],
    plot: bool,
) -> None:
    """Fit the base valve and its eleven rivals to DATA; write OUT/compare.json, .txt, .html."""
    from ..identification.compare import compare
    from ..model.rivals import rival, RIVALS
    from ..recordings import read_recording

    chosen = tuple(rival(name).name for name in models) or tuple(RIVALS)
    names = topics_by_signal(topics)
    recordings = [read_recording(path, names) for path in data]
    with progress_bar() as progress:
        result = compare(recordings, models=chosen, seed=seed, channel=channel, progress=progress)
    for line in result.lines():
        click.echo(line)
    result.write(out)
    written = ['compare.json', 'compare.txt']
    if plot:
        from ..report.compare import write_comparison

        written += write_comparison(result, out)
    click.echo('written: ' + ', '.join(str(out / name) for name in written))
