# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the storage files of a bag have in common, whichever plugin wrote them."""

from array import array
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
import sys
from typing import Protocol

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd  # comes with rosbags

__all__ = ['Column', 'Connection', 'Definition', 'StorageFile', 'unpacked', 'zstd']

BLOCK = 1 << 16
"""Messages kept as objects before they are packed."""
ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'
CDR = 'cdr'


@dataclass(frozen=True)
class Definition:
    """The definition of a message type as a bag stores it; language is 'msg', 'idl' or ''."""

    msgtype: str
    language: str = ''
    text: str = ''


LANGUAGES = {'ros2msg': 'msg', 'ros2idl': 'idl', 'omgidl': 'idl'}


@dataclass(frozen=True)
class Connection:
    """A topic as one storage file knows it."""

    topic: str
    definition: Definition
    encoding: str = CDR


@dataclass
class Column:
    """The messages of one topic in the order in which they were stored.

    Payloads are packed into one buffer block by block: a million small objects would take ten
    times the memory of what they hold. `sent` stays empty where the storage has no such stamps.
    """

    stamps: list[int] = field(default_factory=list)
    sent: list[int] = field(default_factory=list)
    payloads: list[bytes] = field(default_factory=list)
    packed_stamps: 'array[int]' = field(default_factory=lambda: array('q'))
    packed_sent: 'array[int]' = field(default_factory=lambda: array('q'))
    packed: bytearray = field(default_factory=bytearray)
    sizes: 'array[int]' = field(default_factory=lambda: array('L'))

    def pack(self) -> None:
        """Pack what has come since the last call; undo compression of single messages."""
        if self.payloads and self.payloads[0][:4] == ZSTD_MAGIC:  # all of a file are, or none
            self.payloads = [zstd.decompress(payload) for payload in self.payloads]
        self.packed_stamps.extend(self.stamps)
        self.packed_sent.extend(self.sent)
        self.packed += b''.join(self.payloads)
        self.sizes.extend(map(len, self.payloads))
        self.stamps.clear()
        self.sent.clear()
        self.payloads.clear()

    def truncate(self, count: int) -> None:
        """Keep only the first messages, packed ones."""
        self.stamps.clear()
        self.payloads.clear()
        del self.packed[sum(self.sizes[:count]) :]
        del self.packed_stamps[count:], self.sizes[count:]

    def messages(self) -> Iterator[bytes]:
        """Yield the packed payloads one by one."""
        start = 0
        for size in self.sizes:
            yield bytes(self.packed[start : start + size])
            start += size

    def __len__(self) -> int:
        """Return the number of packed messages."""
        return len(self.sizes)


class StorageFile(Protocol):
    """One storage file, open for reading.

    Attributes
    ----------
    damage : list of str
        What is lost, in sentences; complete only after `read`.
    """

    damage: list[str]

    @property
    def connections(self) -> Mapping[int, Connection]:
        """By the id used in the file."""

    @property
    def counts(self) -> Mapping[int, int]:
        """Messages by the same id; for sqlite3 only whether there are any, 1 or 0."""

    def read(self, columns: Mapping[int, Column]) -> None:
        """Append the messages of some connections to their columns, in stored order."""


def unpacked(path: Path, folder: Path) -> tuple[Path, list[str]]:
    """Return `path` itself, or its content in `folder` if it is compressed as a whole.

    A compressed file that is cut off is unpacked as far as it goes.

    Returns
    -------
    path : Path
        A plain storage file.
    damage : list of str
        A sentence if something is missing.
    """
    if path.suffix != '.zstd':
        return path, []
    plain = folder / path.stem
    try:
        with zstd.open(path, 'rb') as source, plain.open('wb') as target:
            while block := source.read1(1 << 20):
                target.write(block)
    except (EOFError, zstd.ZstdError) as error:
        return plain, [
            f'{path.name} is cut off or damaged ({error}): its end is lost; "zstd -dc {path.name} '
            f'> {path.stem}" unpacks the rest'
        ]
    return plain, []
