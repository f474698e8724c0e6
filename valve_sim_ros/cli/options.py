# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Options that several verbs share."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import click
from tqdm import tqdm

topic_option: Callable[[Any], Any] = click.option(
    '--topic',
    'topics',
    multiple=True,
    metavar='SIGNAL=TOPIC',
    help='Topic (or CSV column) of a signal, e.g. x=/valve_7/position; repeatable.',
)


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
