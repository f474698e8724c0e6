# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""MCAP files, whole or cut off, in the order in which they were written.

Readers that follow the index need its end, and sort by stamp: both hide what happened to a
recording. This one goes through the records as they lie in the file (https://mcap.dev/spec) and
keeps everything that is complete, also inside an unfinished chunk.
"""

from collections import Counter
from collections.abc import Iterator, Mapping
import os
from pathlib import Path
import struct
from typing import BinaryIO
from zlib import crc32

from lz4.frame import LZ4FrameDecompressor  # comes with rosbags

from .errors import RecordingError
from .storage import BLOCK, Column, Connection, Definition, LANGUAGES, zstd

MAGIC = b'\x89MCAP0\r\n'
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, STATISTICS, SUMMARY_OFFSET = 2, 3, 4, 5, 6, 11, 14
HEAD = struct.Struct('<BQ')
MESSAGE_HEAD = struct.Struct('<HIqq')
CHUNK_HEAD = struct.Struct('<QQQI')
FOOTER_BYTES = HEAD.size + 20 + len(MAGIC)


class McapFile:
    """An MCAP file; see `StorageFile`."""

    def __init__(self, path: Path) -> None:
        """Learn the topics, from the summary or, if there is none, from the records.

        Raises
        ------
        RecordingError
            If the file is no MCAP.
        """
        self.path = path
        self.connections: dict[int, Connection] = {}
        self.counts: Mapping[int, int] = {}
        self.damage: list[str] = []
        self._schemas: dict[int, Definition] = {}
        with path.open('rb') as file:
            if file.read(len(MAGIC)) != MAGIC:
                raise RecordingError(f'{path.name} is empty or no MCAP file: record again')
            if not self._read_summary(file):
                self._count()

    def read(self, columns: Mapping[int, Column]) -> None:
        """Append the messages of some connections to their columns, in stored order."""
        self._scan(columns, None)

    def _scan(self, columns: Mapping[int, Column], tally: Counter[int] | None) -> None:
        """Go through all records: fill the columns, count what has none."""
        self.damage = []
        loose: list[bytes] = []
        with self.path.open('rb') as file:
            file.seek(len(MAGIC))
            for kind, body, whole in self._records(file):
                if kind == CHUNK:
                    self._take(self._content(body, whole), columns, tally)
                elif kind == MESSAGE and whole:
                    loose += (HEAD.pack(kind, len(body)), body)
                if kind == CHUNK or len(loose) >= BLOCK:
                    self._take(b''.join(loose), columns, tally)
                    loose.clear()
        self._take(b''.join(loose), columns, tally)

    def _records(self, file: BinaryIO) -> Iterator[tuple[int, bytes, bool]]:
        """Yield kind, content and completeness of the records up to the footer or the cut."""
        end = os.fstat(file.fileno()).st_size
        while len(head := file.read(HEAD.size)) == HEAD.size:
            kind, size = HEAD.unpack(head)
            if kind == FOOTER:
                return
            start = file.tell() - HEAD.size
            body = file.read(min(size, end - file.tell()))
            if len(body) < size:
                self._cut(start)
                yield kind, body, False
                return
            if kind in (SCHEMA, CHANNEL):
                self._learn(kind, body)
            yield kind, body, True
        self._cut(file.tell())

    def _cut(self, position: int) -> None:
        """Take down that the file ends early."""
        self.damage.append(
            f'{self.path.name} is cut off or damaged behind byte {position}: the messages there '
            f'that are whole were read, the others are lost; "mcap recover {self.path.name} -o '
            'recovered.mcap" makes a whole file of the rest'
        )

    def _content(self, chunk: bytes, whole: bool) -> bytes:
        """Return the records inside a chunk, as far as they can be had."""
        if len(chunk) < CHUNK_HEAD.size + 12:
            return b''
        start, stop, size, checksum = CHUNK_HEAD.unpack_from(chunk)
        compression, position = _text(chunk, CHUNK_HEAD.size)
        packed = chunk[position + 8 :]
        try:
            if compression == '':
                content = packed
            elif compression == 'zstd':
                content = zstd.ZstdDecompressor().decompress(packed)
            elif compression == 'lz4':
                content = LZ4FrameDecompressor().decompress(packed)
            else:
                raise RuntimeError(f'unknown compression {compression!r}')
            if whole and checksum and (len(content) != size or crc32(content) != checksum):
                raise RuntimeError('wrong checksum')
        except (RuntimeError, zstd.ZstdError) as error:
            self.damage.append(
                f'a part of {self.path.name} is damaged ({error}): its messages from '
                f'{start * 1e-9:.3f} s to {stop * 1e-9:.3f} s are lost'
            )
            return b''
        return bytes(content)

    def _take(
        self, data: bytes, columns: Mapping[int, Column], tally: Counter[int] | None
    ) -> None:
        """Append the messages among some records to their columns, or count them."""
        sinks = {
            channel: (column.stamps.append, column.sent.append, column.payloads.append)
            for channel, column in columns.items()
        }
        head, message = HEAD.unpack_from, MESSAGE_HEAD.unpack_from
        position, end = 0, len(data)
        while position + HEAD.size <= end:
            kind, size = head(data, position)
            following = position + HEAD.size + size
            if following > end:
                break
            if kind == MESSAGE:
                channel, _, stamp, sent = message(data, position + HEAD.size)
                if channel in sinks:
                    add_stamp, add_sent, add_payload = sinks[channel]
                    add_stamp(stamp)
                    add_sent(sent)
                    add_payload(data[position + HEAD.size + MESSAGE_HEAD.size : following])
                elif tally is not None:
                    tally[channel] += 1
            elif kind in (SCHEMA, CHANNEL):
                self._learn(kind, data[position + HEAD.size : following])
            position = following
        for column in columns.values():
            column.pack()

    def _learn(self, kind: int, body: bytes) -> None:
        """Take in a schema or a channel."""
        try:
            (key,) = struct.unpack_from('<H', body)
            if kind == SCHEMA:
                name, position = _text(body, 2)
                encoding, position = _text(body, position)
                text, _ = _text(body, position)
                self._schemas[key] = Definition(name, LANGUAGES.get(encoding, ''), text)
            else:
                (schema,) = struct.unpack_from('<H', body, 2)
                topic, position = _text(body, 4)
                encoding, _ = _text(body, position)
                definition = self._schemas.get(schema, Definition('no type'))
                self.connections[key] = Connection(topic, definition, encoding)
        except (struct.error, UnicodeDecodeError):
            self.damage.append(f'{self.path.name}: the description of a topic is damaged')

    def _read_summary(self, file: BinaryIO) -> bool:
        """Take schemas, channels and counts from the summary; False if it is not there."""
        size = file.seek(0, 2)
        if size < len(MAGIC) + FOOTER_BYTES:
            return False
        file.seek(-FOOTER_BYTES, 2)
        footer = file.read()
        kind, _ = HEAD.unpack_from(footer)
        (start,) = struct.unpack_from('<Q', footer, HEAD.size)
        if not footer.endswith(MAGIC) or kind != FOOTER or not 0 < start < size:
            return False
        file.seek(start)
        for kind, body, whole in self._records(file):
            if kind == STATISTICS and whole:
                table = body[46:]
                self.counts = dict(struct.iter_unpack('<HQ', table[: len(table) // 10 * 10]))
        known = {channel for channel, count in self.counts.items() if count}
        return bool(self._schemas) and known <= set(self.connections) and not self.damage

    def _count(self) -> None:
        """Go through the whole file to learn what it holds."""
        self.connections.clear()
        tally: Counter[int] = Counter()
        self._scan({}, tally)
        self.counts = tally


def _text(data: bytes, position: int) -> tuple[str, int]:
    """Return the string at `position`, and where it ends."""
    (size,) = struct.unpack_from('<I', data, position)
    start = position + 4
    return data[start : start + size].decode(), start + size
