# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""``python -m blind``: make blind records, diagnose them, score the verdicts."""

from collections.abc import Callable
import os
from pathlib import Path
import sys

import click
from tqdm import tqdm

from . import results, runner, sets, study
from .table import as_markdown, as_text, one_by_one

FOLDER = click.Path(path_type=Path)


def bar(title: str, total: int) -> Callable[[int], object]:
    """Return the update of a new progress bar."""
    return tqdm(total=total, desc=title, disable=None).update


@click.group(context_settings={'help_option_names': ['-h', '--help']})
def main() -> None:
    """Blind records of valves with hidden effects, and the score of a diagnosis on them."""


@main.command()
@click.option('--set', 'name', type=click.Choice(list(sets.SETS)), default='singles')
@click.option('--split', type=click.Choice(sets.SPLITS), default='tuning')
@click.option('--signals', default='p1,p2,x', help='Measured signals.', show_default=True)
@click.option('--count', type=click.IntRange(1), default=150, show_default=True)
@click.option('--seed', type=click.IntRange(0), default=0, show_default=True)
@click.option('--out', type=FOLDER, required=True)
def generate(name: str, split: str, signals: str, count: int, seed: int, out: Path) -> None:
    """Write records to OUT/records and sealed keys to OUT/keys."""
    measured = tuple(signals.split(','))
    if not set(measured) <= {'p1', 'p2', 'x'}:
        raise click.ClickException(f'--signals {signals}: expected some of p1,p2,x')
    if (out / 'set.json').exists():
        raise click.ClickException(f'{out} holds a set already; choose another --out')
    sets.generate(name, split, measured, count, seed, out, bar(f'{name} {split}', count))


@main.command()
@click.argument('folder', type=FOLDER)
@click.option('--out', type=FOLDER, help='Folder of the verdicts.  [default: FOLDER/verdicts]')
@click.option('--seed', type=int, default=0, show_default=True)
@click.option('--limit', type=click.IntRange(1), help='Only the first so many records.')
def run(folder: Path, out: Path | None, seed: int, limit: int | None) -> None:
    """Diagnose the records of a set; those with a verdict are not done again."""
    out = out or folder / 'verdicts'
    records = len(os.listdir(folder / 'records'))
    progress = bar(f'{folder.name} verdicts', min(records, limit or records))
    failed = runner.run(folder, out, seed=seed, limit=limit, progress=progress)
    if failed:
        raise click.ClickException(f'{failed} records failed: see the error.txt below {out}')


@main.command()
@click.argument('folder', type=FOLDER)
@click.argument('verdicts', type=FOLDER, required=False)
@click.option('--records', is_flag=True, help='Also a line for each record.')
def score(folder: Path, verdicts: Path | None, records: bool) -> None:
    """Open the keys of a set and score the verdicts."""
    try:
        scored = study.scored(folder, verdicts or folder / 'verdicts')
    except ValueError as error:
        raise click.ClickException(str(error)) from None
    click.echo(as_text(scored))
    if records:
        click.echo(one_by_one(scored))


@main.command('study')
@click.option('--split', type=click.Choice(sets.SPLITS), default='test', show_default=True)
@click.option('--share', type=click.FloatRange(0.0, 1.0), default=1.0, show_default=True)
@click.option('--seed', type=click.IntRange(0), default=0, show_default=True)
@click.option('--out', type=FOLDER, default=Path('build/blind'), show_default=True)
@click.option('--doc', type=FOLDER, help='Markdown file for the table.')
@click.option('--keep', type=FOLDER, help='JSON lines of outcomes; those are not made again.')
@click.option('--of', 'said_by', help='Only score what this version said before.')
def whole_study(
    split: str,
    share: float,
    seed: int,
    out: Path,
    doc: Path | None,
    keep: Path | None,
    said_by: str | None,
) -> None:
    """Generate, diagnose and score all sets; SHARE of their records."""
    version = said_by or results.version(Path(__file__).parents[1])
    share = 0.0 if said_by else share
    found = study.study(split, share, seed, out, bar, version, keep)
    if not found:
        advice = 'expected one that --keep names' if said_by else 'give a larger --share'
        raise click.ClickException(f'no outcomes of version {version}, seed {seed}: {advice}')
    for each in found:
        click.echo(as_text(each) + '\n')
    if doc:
        command = ' '.join(('python -m blind', *sys.argv[1:]))
        aside = doc.with_name(f'.{doc.name}.part')
        aside.write_text(as_markdown(found, split, version, command), encoding='utf-8')
        os.replace(aside, doc)


if __name__ == '__main__':
    main(prog_name='python -m blind')
