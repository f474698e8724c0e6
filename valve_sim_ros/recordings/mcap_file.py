# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of an mcap file in the order in which they were written, damaged or not.

Format: https://mcap.dev/spec. Every record is an opcode, a length of eight bytes and a body.
"""

from collections.abc import Iterator
from pathlib import Path
import struct
from zlib import crc32

from lz4.frame import decompress as lz4_decompress  # type: ignore[import-untyped]

from .messages import Damage, decompressed, decompressed_so_far, Definition, LANGUAGES
from .messages import Message, Walk

MAGIC = b'\x89MCAP0\r\n'
SCHEMA, CHANNEL, MESSAGE, CHUNK, DATA_END = 0x03, 0x04, 0x05, 0x06, 0x0F
RECORD = struct.Struct('<BQ')
MESSAGE_HEAD = struct.Struct('<HIQQ')
CHUNK_HEAD = struct.Struct('<QQQI')
LARGEST_RECORD = 2**32


def walk_mcap(path: Path, topics: frozenset[str] | None, seen: Walk) -> Iterator[Message]:
    """Yield the messages in file order, then raise Damage if the file is not complete.

    Parameters
    ----------
    path : Path
        An .mcap file.
    topics : frozenset of str, or None
        Only these; None for all.
    seen : Walk
        Filled while walking.
    """
    walker = _Walker(topics, seen)
    with path.open('rb') as file:
        if file.read(8) != MAGIC:
            raise Damage('it does not start as an mcap file')
        while True:
            position = file.tell()
            head = file.read(9)
            if len(head) < 9:
                raise Damage(f'it ends at byte {position + len(head)} without a closing record')
            opcode, size = RECORD.unpack(head)
            if opcode == DATA_END:
                return
            if size > LARGEST_RECORD:
                raise Damage(f'the record at byte {position} claims {size} bytes')
            body = file.read(size)
            cut = len(body) < size
            if opcode == CHUNK:
                yield from walker.records(_chunk(body, position, cut))
            elif not cut:
                yield from walker.records(head + body)
            if cut:
                raise Damage(f'it ends at byte {file.tell()}, inside a record')


class _Walker:
    """The state of a walk: the channels known so far."""

    def __init__(self, topics: frozenset[str] | None, seen: Walk) -> None:
        self._topics = topics
        self._seen = seen
        self._schemas: dict[int, Definition] = {}
        self._channels: dict[int, str] = {}
        """Topics of the channels asked for."""

    def records(self, data: bytes) -> Iterator[Message]:
        """Yield the messages among the complete records in `data`."""
        position, end = 0, len(data)
        channels, record, head = self._channels, RECORD.unpack_from, MESSAGE_HEAD.unpack_from
        while position + 9 <= end:
            opcode, size = record(data, position)
            position += 9
            stop = position + size
            if stop > end:
                return
            if opcode == MESSAGE:
                number, _, received, sent = head(data, position)
                if number in channels:
                    payload = data[position + 22 : stop]
                    yield Message(channels[number], received, sent, decompressed(payload))
            elif opcode == SCHEMA:
                self._schema(data[position:stop])
            elif opcode == CHANNEL:
                self._channel(data[position:stop])
            position = stop

    def _schema(self, body: bytes) -> None:
        name, at = _string(body, 2)
        encoding, at = _string(body, at)
        text, _ = _string(body, at)
        definition = Definition(name, LANGUAGES.get(encoding, ''), text)
        self._schemas[int.from_bytes(body[:2], 'little')] = definition
        if definition not in self._seen.definitions:
            self._seen.definitions.append(definition)

    def _channel(self, body: bytes) -> None:
        number, schema = struct.unpack_from('<HH', body)
        topic, _ = _string(body, 4)
        self._seen.types[topic] = self._schemas[schema].msgtype if schema in self._schemas else ''
        if self._topics is None or topic in self._topics:
            self._channels[number] = topic


def _chunk(body: bytes, position: int, cut: bool) -> bytes:
    """Return the records of a chunk; of one that is cut off, those that are there."""
    try:
        _, _, size, checksum = CHUNK_HEAD.unpack_from(body)
        compression, at = _string(body, 28)
        (length,) = struct.unpack_from('<Q', body, at)
        packed = body[at + 8 : at + 8 + length]
        if cut:
            if compression == 'zstd':
                return decompressed_so_far(packed)
            return packed if compression == '' else b''
        data = packed
        if compression == 'zstd':
            data = decompressed(packed)
        elif compression == 'lz4':
            data = bytes(lz4_decompress(packed))
        elif compression:
            raise Damage(f'the chunk at byte {position} is packed in an unknown way, {compression!r}')
    except struct.error as error:
        if cut:
            return b''
        raise Damage(f'the chunk at byte {position} makes no sense ({error})') from error
    except Exception as error:  # the decompressors raise what they like
        if isinstance(error, Damage):
            raise
        raise Damage(f'the chunk at byte {position} cannot be unpacked ({error})') from error
    if len(data) != size or (checksum and crc32(data) != checksum):
        raise Damage(f'the chunk at byte {position} fails its checksum')
    return data


def _string(data: bytes, at: int) -> tuple[str, int]:
    """Return a string of a record and the place behind it."""
    (length,) = struct.unpack_from('<I', data, at)
    return data[at + 4 : at + 4 + length].decode('utf-8', 'replace'), at + 4 + length
