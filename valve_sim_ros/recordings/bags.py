# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ROS 2 bags: read from their storage files, types by rosbags; written by rosbags."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
import hashlib
import os
from pathlib import Path
import shutil

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from .align import align, Arrivals
from .bag_files import Bag, opened, storage_files
from .clocks import differences, stamps
from .errors import RecordingError
from .fields import Decoder, FLOAT64
from .recording import Provenance, Recording, refuse_not_finite
from .samples import from_samples, sample_topic
from .storage import CDR, Column, Connection
from .topics import select, Topics, TopicSelection

STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
FEWEST_MESSAGES = 10


def read_bag(
    path: str | os.PathLike[str],
    topics: Topics | None = None,
    require_outputs: bool = True,
    sample_time: float | None = None,
    message_folders: Sequence[str | os.PathLike[str]] = (),
    time_source: str = 'received',
) -> Recording:
    """Read the signals of one valve from a bag and put them on one time axis.

    Parameters
    ----------
    path : path-like
        Bag folder (with or without metadata.yaml), or a single storage file, compressed or not.
    topics : mapping of str to str or TopicSelection, optional
        Topic by signal; by default the plant's self-consistent ``~/sample`` if it was recorded,
        else the topics whose names end in u, p1, p2, x.
    require_outputs : bool
        Whether a bag that holds nothing but commands is refused.
    sample_time : float, optional
        Sampling period of the valve [s], where the outputs were recorded less often.
    message_folders : sequence of path-like
        Folders with .msg files, for bags that do not define their types.
    time_source : {'received', 'sent', 'header'}
        Which stamps are the time of a message.

    Raises
    ------
    RecordingError
        If the bag is missing or empty, nothing can be recovered from it, a topic is missing or
        carries no numbers, or a value is not finite.

    Notes
    -----
    What is there is read; what is lost is said in the recording's quality, with the command that
    repairs the bag.
    """
    path = Path(path)
    files = storage_files(path)
    with opened(path) as bag:
        try:
            decoder = Decoder(
                (c.definition for c in bag.connections.values() if c.definition.language),
                [Path(folder) for folder in message_folders],
            )
            return _read(
                path, files, bag, decoder, topics, require_outputs, sample_time, time_source
            )
        except RecordingError as error:
            raise RecordingError(f'{path}: {error}') from None


def _read(
    path: Path,
    files: list[Path],
    bag: Bag,
    decoder: Decoder,
    topics: Topics | None,
    require_outputs: bool,
    sample_time: float | None,
    time_source: str,
) -> Recording:
    """Read an open bag."""
    counts, connections = bag.counts, bag.connections
    if not counts.total():
        raise RecordingError(
            '; '.join(
                [
                    f'the bag holds no message (topics: {", ".join(connections) or "none"}); '
                    'record it again while the valve and its command source run',
                    *bag.notes,
                    *(sentence for file in bag.files for sentence in file.damage),
                ]
            )
        )
    provenance = Provenance(
        paths=(str(path),),
        digests={str(file): digest(file) for file in files},
        time_source=time_source,
        storage='mcap' if '.mcap' in files[0].name else 'sqlite3',
        reader='valve_sim_ros',
    )
    sampled = sample_topic(topics, connections, counts)
    if sampled:
        columns, notes = bag.read({sampled})
        rows = decoder.rows(columns[sampled], sampled)
        provenance = replace(
            provenance, topics={'t, u, p1, p2, x': sampled}, time_source='field t'
        )
        return from_samples(*rows, columns[sampled].packed_stamps, sampled, provenance, notes)
    selections = select(topics, counts, require_outputs)
    columns, notes = bag.read({chosen.topic for chosen in selections.values()})
    arrivals = _arrivals(selections, columns, connections, decoder, time_source)
    notes += differences(columns)
    commands_only = not require_outputs and len(selections) == 1
    messages = max(
        (each.stamps.size for name, each in arrivals.items() if name != 'u' or commands_only),
        default=0,
    )
    if messages < FEWEST_MESSAGES:
        raise RecordingError(
            '; '.join([f'only {messages} messages per output: record at least 10 samples', *notes])
        )
    provenance = replace(
        provenance, topics={name: chosen.text() for name, chosen in selections.items()}
    )
    return align(arrivals, provenance, notes, sample_time)


def _arrivals(
    selections: Mapping[str, TopicSelection],
    columns: Mapping[str, Column],
    connections: Mapping[str, Connection],
    decoder: Decoder,
    time_source: str,
) -> dict[str, Arrivals]:
    """Decode each topic once and return stamps and values by signal."""
    arrivals = {}
    for topic, column in columns.items():
        names = [name for name, chosen in selections.items() if chosen.topic == topic]
        connection = connections[topic]
        if connection.encoding != CDR:
            raise RecordingError(
                f'topic {topic} is encoded as {connection.encoding!r}, not as ROS 2 messages '
                f'({CDR}): convert the recording first'
            )
        kind = connection.definition.msgtype
        times = stamps(column, time_source, decoder, kind, topic)
        fields = [selections[name].field for name in names]
        decoded = decoder.values(column, kind, fields, topic)
        for name, raw in zip(names, decoded, strict=True):
            values = selections[name].scale * raw + selections[name].offset
            refuse_not_finite(name, values, 1e-9 * np.asarray(times - times[:1], dtype=np.float64))
            arrivals[name] = Arrivals(times, values)
    return {name: arrivals[name] for name in selections if arrivals[name].stamps.size}


def write_bag(recording: Recording, path: str | os.PathLike[str], storage: str = 'mcap') -> None:
    """Write u and the measured outputs as std_msgs/msg/Float64 topics /u, /p1, /p2, /x.

    Parameters
    ----------
    recording : Recording
        Lost samples are left out.
    path : path-like
        Folder to make; it must not exist.
    storage : {'mcap', 'sqlite3'}
        Storage plugin.

    Raises
    ------
    RecordingError
        If the folder exists or the storage is unknown.
    """
    path = Path(path)
    if path.exists():
        raise RecordingError(f'{path} exists: bags are never overwritten; choose another name')
    if storage not in STORAGES:
        raise RecordingError(f'storage {storage!r}: expected {" or ".join(STORAGES)}')
    store = get_typestore(Stores.ROS2_JAZZY)
    start = recording.provenance.start or 0
    ticks = start + np.round(recording.time * 1e9).astype(np.int64)
    aside = path.with_name(f'.{path.name}.part') / path.name
    shutil.rmtree(aside.parent, ignore_errors=True)
    aside.parent.mkdir(parents=True)
    message = store.types[FLOAT64]
    with Writer(aside, version=9, storage_plugin=STORAGES[storage]) as writer:
        connections = {
            name: writer.add_connection(f'/{name}', FLOAT64, typestore=store)
            for name in ('u', *recording.signals)
        }
        columns = {name: getattr(recording, name) for name in connections}
        for k, stamp in enumerate(ticks.tolist()):
            for name, values in columns.items():
                if values[k] == values[k]:
                    payload = store.serialize_cdr(message(float(values[k])), FLOAT64)
                    writer.write(connections[name], stamp, payload)
    os.replace(aside, path)
    aside.parent.rmdir()


def digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    digest = hashlib.sha256()
    with path.open('rb') as file:
        for block in iter(lambda: file.read(1 << 20), b''):
            digest.update(block)
    return digest.hexdigest()
