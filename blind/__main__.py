# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m blind``: make blind records and score a diagnosis on them."""

from pathlib import Path

import click
from tqdm import tqdm

from . import sets


@click.group(context_settings={'help_option_names': ['-h', '--help']})
def main() -> None:
    """Blind records of valves with one hidden effect, and the score of a diagnosis."""


@main.command()
@click.option('--set', 'name', type=click.Choice(list(sets.SETS)), default='singles')
@click.option('--split', type=click.Choice(sets.SPLITS), default='tuning')
@click.option('--signals', default='p1,p2,x', help='Measured signals.', show_default=True)
@click.option('--count', type=click.IntRange(1), default=150, show_default=True)
@click.option('--seed', type=click.IntRange(0), default=0, show_default=True)
@click.option('--out', type=click.Path(path_type=Path), required=True)
def generate(name: str, split: str, signals: str, count: int, seed: int, out: Path) -> None:
    """Write records to OUT/records and sealed keys to OUT/keys."""
    measured = tuple(signals.split(','))
    if not set(measured) <= {'p1', 'p2', 'x'}:
        raise click.ClickException(f'--signals {signals}: expected some of p1,p2,x')
    if (out / 'set.json').exists():
        raise click.ClickException(f'{out} holds a set already; choose another --out')
    with tqdm(total=count, desc=f'{name} {split}', disable=None) as bar:
        sets.generate(name, split, measured, count, seed, out, bar.update)


if __name__ == '__main__':
    main(prog_name='python -m blind')
