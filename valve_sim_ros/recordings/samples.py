# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The plant's `~/sample` topic: t, u, p1, p2, x of one sample in one message.

Such a bag needs no alignment: each message says which command the valve used, and when.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from .errors import RecordingError
from .fields import MULTI_ARRAY
from .quality import Array, Gap, MAX_GAP_PERIODS, Quality, resolution, SignalQuality
from .recording import OUTPUTS, Provenance, Recording, refuse_not_finite
from .storage import Connection
from .topics import Topics

SAMPLE = 'sample'
ON_GRID = 0.01
"""Share of the period by which t may be off its grid and still be meant to be on it."""


def sample_topic(
    topics: Topics | None, connections: Mapping[str, Connection], counts: Mapping[str, int]
) -> str:
    """Return the topic that carries whole samples, or '' if topics per signal are to be read."""
    if topics and set(topics) != {SAMPLE}:
        return ''
    wanted = (topics or {}).get(SAMPLE)
    found = [
        topic
        for topic, connection in sorted(connections.items())
        if connection.definition.msgtype == MULTI_ARRAY
        and topic.rsplit('/', 1)[-1] == SAMPLE
        and counts[topic]
        and topic == (wanted or topic)
    ]
    if len(found) > 1:
        valve = found[0].rsplit('/', 1)[0]
        raise RecordingError(
            f'{len(found)} valves were recorded: {", ".join(found)}; say which one you mean with '
            f'--topic sample={valve}/{SAMPLE}'
        )
    return found[0] if found else ''


def from_samples(
    label: str,
    rows: Sequence[Array],
    stamps: Sequence[int],
    topic: str,
    provenance: Provenance,
    notes: Sequence[str] = (),
) -> Recording:
    """Make a recording of whole samples.

    Parameters
    ----------
    label : str
        Names of the numbers, as ``t,u,p1,p2,x``.
    rows : sequence of ndarray
        The numbers of each message.
    stamps : sequence of int
        Receive stamps [ns].
    topic : str
        For messages.
    provenance : Provenance
        Passed on, with the start added.
    notes : sequence of str
        Passed on.

    Raises
    ------
    RecordingError
        If the label or the sizes do not fit, or a number is not finite.
    """
    names = [name.strip() for name in label.split(',')]
    if not {'t', 'u'} < set(names) or any(row.size != len(names) for row in rows):
        raise RecordingError(
            f'topic {topic} has the label {label!r}: expected "t,u,p1,p2,x" and as many numbers '
            'in every message; choose topics by --topic instead'
        )
    columns = dict(zip(names, np.array(rows).T, strict=True))
    for name, values in columns.items():
        refuse_not_finite(name, values, np.arange(values.size, dtype=float))
    fresh = np.diff(columns['t'], prepend=-np.inf) != 0
    columns = {name: values[fresh] for name, values in columns.items()}
    return _assemble(columns, int(fresh.size - fresh.sum()), stamps[0], provenance, notes)


def _assemble(
    columns: Mapping[str, Array],
    duplicates: int,
    start: int,
    provenance: Provenance,
    notes: Sequence[str],
) -> Recording:
    """Put samples on the grid of their own time; where t falls, the plant was started anew."""
    t = columns['t']
    steps = np.diff(t)
    forward = steps[steps > 0]
    period = float(f'{np.median(forward):.9g}') if forward.size else 1.0
    max_gap = (MAX_GAP_PERIODS + 0.5) * period
    whole = np.maximum(np.rint(steps / period), 1.0)
    regular = bool((np.abs(forward / period - np.rint(forward / period)) <= ON_GRID).all())
    breaks = np.flatnonzero((steps <= 0) | (steps > max_gap)) + 1
    rows: list[Array] = []
    times: list[Array] = []
    gaps: list[Gap] = []
    end = -2.0 * max_gap
    for part in np.split(np.arange(t.size), breaks):
        before = int(part[0]) - 1
        pause = steps[before] if before >= 0 and steps[before] > 0 else 2.0 * max_gap
        if times:
            restart = float(min(steps[before], 0.0))
            gaps.append(Gap(end, end + pause, restart))
        inside = whole[part[:-1]].astype(np.int64) if regular else np.ones(part.size - 1, int)
        present = np.concatenate(([0], np.cumsum(inside)))
        row = np.full(present[-1] + 1, -1)
        row[present] = part
        time = np.asarray(np.arange(row.size) * period if regular else t[part] - t[part[0]])
        times.append(end + pause + time)
        rows.append(row)
        end = float(times[-1][-1])
    row, time = np.concatenate(rows), np.concatenate(times)
    lost = row < 0
    held = np.maximum.accumulate(row)
    outputs = {n: np.where(lost, np.nan, columns[n][held]) for n in OUTPUTS if n in columns}
    changed = np.diff(columns['u'][held]) != 0
    doubtful = np.flatnonzero(lost[:-1] & ~lost[1:] & changed) + 1
    figures = {
        name: SignalQuality(
            messages=t.size,
            rate=1.0 / period,
            lost=int(lost.sum()),
            duplicates=duplicates,
            resolution=resolution(columns[name]),
        )
        for name in ('u', *outputs)
    }
    return Recording(
        time=time - time[0],
        u=columns['u'][held],
        **outputs,
        provenance=replace(provenance, start=start),
        quality=Quality(
            samples=time.size,
            period=period,
            fitted_period=period,
            regular=regular,
            gaps=tuple(gaps),
            signals=figures,
            doubtful_commands=tuple(doubtful.tolist()),
            lost_commands=tuple(np.flatnonzero(lost).tolist()),
            notes=tuple(notes),
        ),
        max_gap=max_gap,
    )
