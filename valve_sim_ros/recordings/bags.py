# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""ROS 2 bags (mcap and sqlite3) through rosbags."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
import hashlib
import os
from pathlib import Path
import shutil

import numpy as np
from rosbags.rosbag2 import Reader, ReaderError, StoragePlugin, Writer
from rosbags.typesys import get_typestore, Stores

from .align import align, Arrivals
from .errors import RecordingError
from .fields import Decoder, Definition, FLOAT64
from .recording import Provenance, Recording, refuse_not_finite
from .topics import select, Topics

STORAGES = {'mcap': StoragePlugin.MCAP, 'sqlite3': StoragePlugin.SQLITE3}
FEWEST_MESSAGES = 10


def read_bag(
    path: str | os.PathLike[str], topics: Topics | None = None, require_outputs: bool = True
) -> Recording:
    """Read the signals of one valve from a bag and put them on one time axis.

    Parameters
    ----------
    path : path-like
        Bag folder (with or without metadata.yaml), or a single .mcap or .db3 file.
    topics : mapping of str to str or TopicSelection, optional
        Topic by signal; by default the topics whose names end in u, p1, p2, x.
    require_outputs : bool
        Whether a bag that holds nothing but commands is refused.

    Raises
    ------
    RecordingError
        If the bag is missing, damaged or empty, a topic is missing or carries no numbers, or a
        value is not finite.
    """
    path = Path(path)
    files = storage_files(path)
    opened = [path] if path.is_file() or (path / 'metadata.yaml').exists() else files
    stamps: dict[str, list[int]] = {}
    payloads: dict[str, list[bytes]] = {}
    types: dict[str, str] = {}
    definitions: dict[str, Definition] = {}
    with _explained(path):
        for part in opened:
            with Reader(part) as reader:
                counts: Counter[str] = Counter()
                for connection in reader.connections:
                    counts[connection.topic] += connection.msgcount
                    types[connection.topic] = connection.msgtype
                    definitions[connection.msgtype] = Definition(
                        connection.msgtype,
                        {1: 'msg', 2: 'idl'}.get(int(connection.msgdef.format.value), ''),
                        connection.msgdef.data,
                    )
                if not sum(counts.values()):
                    continue
                chosen_topics = {s.topic for s in select(topics, counts, False).values()}
                wanted = [c for c in reader.connections if c.topic in chosen_topics]
                for connection, stamp, payload in reader.messages(wanted):
                    stamps.setdefault(connection.topic, []).append(stamp)
                    payloads.setdefault(connection.topic, []).append(bytes(payload))
    if not stamps:
        raise RecordingError(
            f'{path}: the bag holds no message (topics: {", ".join(types) or "none"}); record it '
            'again while the valve and its command source run'
        )
    try:
        available = {topic: len(stamps.get(topic, ())) for topic in types}
        selections = select(topics, available, require_outputs)
        decoder = Decoder(d for d in definitions.values() if d.language)
        arrivals = {}
        for name, chosen in selections.items():
            raw = decoder.values(
                payloads[chosen.topic], types[chosen.topic], chosen.field, chosen.topic
            )
            values = chosen.scale * raw + chosen.offset
            received = np.array(stamps[chosen.topic], dtype=np.int64)
            refuse_not_finite(name, values, (received - received[0]) * 1e-9)
            arrivals[name] = Arrivals(received, values)
        messages = max(
            a.stamps.size for name, a in arrivals.items() if name != 'u' or len(arrivals) == 1
        )
        if messages < FEWEST_MESSAGES:
            raise RecordingError(
                f'only {messages} messages per output; record at least 10 samples'
            )
        return align(
            arrivals,
            Provenance(
                paths=(str(path),),
                digests={str(file): _digest(file) for file in files},
                topics={name: chosen.text() for name, chosen in selections.items()},
                time_source='received',
                storage='mcap' if files[0].suffix == '.mcap' else 'sqlite3',
                reader='rosbags',
            ),
        )
    except RecordingError as error:
        raise RecordingError(f'{path}: {error}') from None


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


def storage_files(path: Path) -> list[Path]:
    """Return the storage files of a bag, or say why there are none."""
    if not path.exists():
        raise RecordingError(f'{path}: no such bag; check the path')
    if path.is_file():
        if path.suffix not in ('.mcap', '.db3'):
            raise RecordingError(
                f'{path}: expected a bag folder, an .mcap, a .db3 or a .csv file'
                + ('; give the folder of a compressed bag' if path.suffix == '.zstd' else '')
            )
        return [path]
    files = sorted(file for file in path.iterdir() if set(file.suffixes) & {'.mcap', '.db3'})
    if not files:
        raise RecordingError(
            f'{path}: an empty folder or no bag: expected .mcap or .db3 files and metadata.yaml'
        )
    return files


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Turn what rosbags raises on damage into a sentence with the cure."""
    try:
        yield
    except RecordingError as error:
        raise RecordingError(f'{path}: {error}') from None
    except (ReaderError, OSError, ValueError, KeyError, AssertionError) as error:
        raise RecordingError(
            f'{path}: damaged or cut off ({error}); repair it first: '
            '"mcap recover IN.mcap -o OUT.mcap" for mcap, "sqlite3 IN.db3 .recover" for sqlite3, '
            '"ros2 bag reindex FOLDER" if metadata.yaml is damaged'
        ) from None


def _digest(path: Path) -> str:
    """Return the SHA-256 of a file."""
    digest = hashlib.sha256()
    with path.open('rb') as file:
        for block in iter(lambda: file.read(1 << 20), b''):
            digest.update(block)
    return digest.hexdigest()


__all__: Sequence[str] = ['read_bag', 'storage_files', 'write_bag']
