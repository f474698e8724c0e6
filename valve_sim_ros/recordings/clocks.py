# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which of a message's stamps is its time, and how the others differ from it."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from .errors import RecordingError
from .fields import Decoder
from .quality import milliseconds
from .storage import Column

Stamps = npt.NDArray[np.int64]
TIME_SOURCES = ('received', 'sent', 'header')
HEADER = ('header.stamp.sec', 'header.stamp.nanosec')
LARGE_OFFSET, LARGE_DRIFT = 0.1, 1e-3
"""Clocks that differ by more [s], or drift by more [s/s], are worth a sentence."""


def stamps(column: Column, source: str, decoder: Decoder, msgtype: str, topic: str) -> Stamps:
    """Return the stamps of a topic's messages [ns], shape (n,).

    Parameters
    ----------
    column : Column
        The messages.
    source : {'received', 'sent', 'header'}
        When the recorder received a message, when its publisher sent it (mcap only), or the stamp
        in its header.
    decoder : Decoder
        Of the bag.
    msgtype, topic : str
        For the header, and for messages.

    Raises
    ------
    RecordingError
        If the bag does not hold such stamps.
    """
    if source == 'received':
        return np.array(column.packed_stamps, dtype=np.int64)
    if source == 'sent':
        if not _has_sent(column):
            raise RecordingError(
                f'topic {topic} has no send stamps (mcap files of ROS 2 Jazzy and newer do): use '
                'the receive stamps, --time received'
            )
        return np.array(column.packed_sent, dtype=np.int64)
    if source == 'header':
        seconds, rest = decoder.values(column, msgtype, HEADER, topic)
        return np.asarray(seconds, dtype=np.int64) * 10**9 + np.asarray(rest, dtype=np.int64)
    raise RecordingError(f'time source {source!r}: expected {", ".join(TIME_SOURCES)}')


def differences(columns: Mapping[str, Column]) -> list[str]:
    """Return a sentence per topic whose send and receive stamps lie far apart."""
    sentences = []
    for topic, column in columns.items():
        if len(column) < 2 or not _has_sent(column):
            continue
        received = np.array(column.packed_stamps, dtype=np.int64)
        late = 1e-9 * (received - np.array(column.packed_sent, dtype=np.int64))
        half = late.size // 2
        span = 0.5e-9 * float(received[-1] - received[0])
        middle, change = float(np.median(late)), np.median(late[half:]) - np.median(late[:half])
        drift = float(change) / span if span > 0.0 else 0.0
        if abs(middle) > LARGE_OFFSET or abs(drift) > LARGE_DRIFT:
            sentences.append(
                f'{topic} was received {milliseconds(middle)} after it was sent, says the bag, '
                f'drifting by {1e6 * drift:.2g} us/s: two clocks, or a slow network; --time sent '
                'takes the other stamps'
            )
    return sentences


def _has_sent(column: Column) -> bool:
    """Tell whether send stamps are there and are no zeros."""
    return len(column.packed_sent) == len(column) > 0 and any(column.packed_sent[:10])
