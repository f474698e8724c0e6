# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which files make a bag, and what metadata.yaml says about them."""

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, ExitStack
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
import re
from tempfile import TemporaryDirectory
from typing import Any

import yaml

from .errors import RecordingError
from .mcap_file import McapFile
from .sqlite_file import settled, SqliteFile
from .storage import Column, Connection, StorageFile, unpacked

METADATA = 'metadata.yaml'
KINDS = {'.mcap', '.db3'}


@dataclass(frozen=True)
class Bag:
    """An open bag: its storage files in order, and what is wrong with it so far."""

    files: tuple[StorageFile, ...]
    notes: tuple[str, ...]
    expected: Mapping[str, int]
    """Messages by topic according to metadata.yaml; empty if it is not there."""

    @property
    def counts(self) -> Counter[str]:
        """Messages by topic."""
        counts: Counter[str] = Counter()
        for file in self.files:
            for key, connection in file.connections.items():
                counts[connection.topic] += file.counts.get(key, 0)
        return counts

    @property
    def connections(self) -> dict[str, Connection]:
        """Connections by topic; the first file that knows a topic decides."""
        found: dict[str, Connection] = {}
        for file in self.files:
            for key, connection in file.connections.items():
                if file.counts.get(key) or connection.topic not in found:
                    found.setdefault(connection.topic, connection)
        return found

    def read(self, topics: set[str]) -> tuple[dict[str, Column], list[str]]:
        """Return the messages of some topics, and what is lost in sentences."""
        columns = {topic: Column() for topic in topics}
        known = self.connections
        notes = list(self.notes)
        for file in self.files:
            file.read(
                {
                    key: columns[connection.topic]
                    for key, connection in file.connections.items()
                    if connection.topic in columns
                    and connection.definition.msgtype == known[connection.topic].definition.msgtype
                }
            )
            notes += file.damage
        for topic, column in columns.items():
            missing = self.expected.get(topic, 0) - len(column)
            if missing > 0:
                notes.append(
                    f'{METADATA} counts {self.expected[topic]} messages of {topic}, '
                    f'{len(column)} are there: {missing} are lost'
                )
        return columns, notes


def storage_files(path: Path) -> list[Path]:
    """Return the storage files of a bag in order, or say why there are none."""
    if not path.exists():
        raise RecordingError(f'{path}: no such bag; check the path')
    if path.is_file():
        if not _is_storage(path):
            raise RecordingError(f'{path}: expected a bag folder, an .mcap, a .db3 or a .csv file')
        return [path]
    files = sorted(filter(_is_storage, path.iterdir()), key=_natural)
    if not files:
        raise RecordingError(
            f'{path}: an empty folder or no bag: expected .mcap or .db3 files and {METADATA}'
        )
    return files


@contextmanager
def opened(path: Path) -> Iterator[Bag]:
    """Open a bag: a folder, with or without metadata.yaml, or one storage file.

    Raises
    ------
    RecordingError
        If there is none, or not one of its files can be opened.
    """
    files = storage_files(path)
    information, notes = ({}, []) if path.is_file() else _metadata(path)
    expected, more = _expected(information, files)
    notes += more
    ready: list[StorageFile] = []
    refused = []
    with TemporaryDirectory(prefix='valve_sim_ros_') as folder, ExitStack() as stack:
        for file in files:
            damage: list[str] = []
            try:
                plain, damage = unpacked(file, Path(folder))
                if plain.suffix == '.mcap':
                    ready.append(McapFile(plain))
                else:
                    database = SqliteFile(settled(plain, Path(folder)))
                    stack.callback(database.close)
                    ready.append(database)
            except (RecordingError, OSError) as error:
                refused.append('; '.join([*damage, str(error)]))
            else:
                notes += damage
        if not ready:
            raise RecordingError(f'{path}: {"; ".join([*refused, *notes])}')
        yield Bag(tuple(ready), (*notes, *refused), expected)


def _metadata(folder: Path) -> tuple[dict[str, Any], list[str]]:
    """Return what metadata.yaml holds, and what is wrong with it."""
    path = folder / METADATA
    cure = (
        f'the storage files were read without it; "ros2 bag reindex {folder.name}" writes it anew'
    )
    if not path.exists():
        return {}, [f'{METADATA} is missing: {cure}']
    try:
        information = yaml.safe_load(path.read_text(encoding='utf-8'))
        information = information['rosbag2_bagfile_information']
        if not isinstance(information, dict):
            raise TypeError('no mapping')
    except (OSError, yaml.YAMLError, ValueError, KeyError, TypeError):
        return {}, [f'{METADATA} cannot be read: {cure}']
    return information, []


def _expected(information: dict[str, Any], files: list[Path]) -> tuple[dict[str, int], list[str]]:
    """Return the messages by topic that should be there, and which files are not."""
    try:
        listed = [PurePosixPath(each).name for each in information.get('relative_file_paths', ())]
        counts = {
            each['topic_metadata']['name']: int(each['message_count'])
            for each in information.get('topics_with_message_count', ())
        }
    except (KeyError, TypeError, ValueError):
        return {}, [f'{METADATA} is damaged: message counts cannot be checked']
    present = {file.name for file in files}
    return counts, [
        f'{METADATA} lists {name}, which is missing: its messages are lost'
        for name in listed
        if name not in present and f'{name}.zstd' not in present
    ]


def _is_storage(path: Path) -> bool:
    """Tell a storage file, compressed or not, by its name."""
    plain = path.stem if path.suffix == '.zstd' else path.name
    return PurePosixPath(plain).suffix in KINDS


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sort bag_10 behind bag_9."""
    return [
        (int(part or 0), '') if part.isdigit() else (0, part)
        for part in re.split(r'(\d+)', path.name)
    ]
