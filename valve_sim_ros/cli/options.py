# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options that several verbs share."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TYPE_CHECKING

import click
from tqdm import tqdm

if TYPE_CHECKING:
    from ..recordings import Recording

INTERRUPTED = 130
"""Exit code of what Ctrl-C has ended."""

topic_option: Callable[[Any], Any] = click.option(
    '--topic',
    'topics',
    multiple=True,
    metavar='SIGNAL=TOPIC',
    help='Topic (or CSV column) of a signal, e.g. x=/valve_7/position; repeatable.',
)

_READING = (
    click.option(
        '--sample-time',
        type=click.FloatRange(min=0.0, min_open=True),
        help='Sampling period of the valve [s], if it was recorded less often than it samples.',
    ),
    click.option(
        '--msg-dir',
        'message_folders',
        multiple=True,
        type=click.Path(path_type=Path),
        help='Folder with .msg files, for bags that do not define their types; repeatable.',
    ),
    click.option(
        '--time',
        'time_source',
        type=click.Choice(['received', 'sent', 'header']),
        default='received',
        show_default=True,
        help='Which stamps of a bag are the time of a message.',
    ),
    topic_option,
)


def reading_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of `read` to a verb."""
    for option in _READING:
        command = option(command)
    return command


def read(path: Path, topics: Sequence[str], **reading: Any) -> 'Recording':
    """Read a bag or CSV file as the options say."""
    from ..recordings import read_recording

    return read_recording(path, topics_by_signal(topics), **reading)


def topics_by_signal(topics: Sequence[str]) -> dict[str, str]:
    """Return `--topic` options as a mapping, or a ClickException."""
    pairs = [topic.partition('=') for topic in topics]
    for signal, equals, topic in pairs:
        if not (signal and equals and topic):
            raise click.ClickException(
                f'--topic {signal}{equals}{topic}: expected SIGNAL=TOPIC, e.g. x=/valve_7/position'
            )
    return {signal: topic for signal, _, topic in pairs}


@contextmanager
def progress_bar() -> Iterator[Callable[[float, str], None]]:
    """Show a bar with the time left on a terminal, nothing elsewhere."""
    with tqdm(
        total=1.0,
        disable=None,
        leave=False,
        bar_format='{desc} {percentage:3.0f} %|{bar}| {remaining}',
    ) as bar:

        def report(share: float, text: str) -> None:
            bar.set_description_str(text)
            bar.update(max(share - bar.n, 0.0))

        yield report
