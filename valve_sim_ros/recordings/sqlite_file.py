# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""SQLite storage files, whole or cut off, in the order in which they were written."""

from collections import Counter
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
import shutil
import sqlite3
import struct
from typing import Any
from urllib.parse import quote

from .errors import RecordingError
from .storage import BLOCK, Column, Connection, Definition, LANGUAGES

MAGIC = b'SQLite format 3\0'
FARTHEST_HOP = 1 << 40


class SqliteFile:
    """A .db3 file of any rosbag2 schema version; see `StorageFile`."""

    def __init__(self, path: Path) -> None:
        """Learn the topics.

        Raises
        ------
        RecordingError
            If the file is no bag, or so damaged that its topics cannot be read.
        """
        self.path = path
        self.damage: list[str] = []
        self._database = sqlite3.connect(f'file:{quote(str(path))}?mode=ro&immutable=1', uri=True)
        # a file that is shorter than its head says is otherwise refused as a whole
        self._database.execute('PRAGMA writable_schema=ON')
        try:
            self.connections = self._topics()
        except sqlite3.Error as error:
            self.close()
            raise RecordingError(
                f'{path.name} is empty, damaged or no bag ({error}); try "sqlite3 {path.name} '
                '.recover | sqlite3 recovered.db3", or record again'
            ) from None
        self.counts = self._counts()

    def close(self) -> None:
        """Let go of the file."""
        self._database.close()

    def read(self, columns: Mapping[int, Column]) -> None:
        """Append the messages of some connections to their columns, in stored order."""
        self.damage = self._cut()
        before = {key: len(column) for key, column in columns.items()}
        try:
            for key, column in columns.items():
                self._read_topic(key, column)
        except sqlite3.DatabaseError:
            for key, column in columns.items():
                column.truncate(before[key])
            self._read_what_is_left(columns)

    def _read_topic(self, key: int, column: Column) -> None:
        """Append the messages of one topic; a scan for each is faster than sorting one scan."""
        query = 'SELECT timestamp, data FROM messages WHERE topic_id = ? ORDER BY id'
        rows = self._database.execute(query, (key,))
        stamps, payloads = column.stamps, column.payloads
        while True:
            for stamp, payload in islice(rows, BLOCK):
                stamps.append(stamp)
                payloads.append(payload)
            if not stamps:
                return
            column.pack()

    def _read_what_is_left(self, columns: Mapping[int, Column]) -> None:
        """Append the messages of a damaged file that can still be had."""
        wanted = ','.join(str(int(key)) for key in columns) or 'NULL'
        query = (
            'SELECT topic_id, timestamp, data, id FROM messages '
            f'WHERE id > ? AND topic_id IN ({wanted}) ORDER BY id'
        )
        for block in self._blocks(query):
            for key, stamp, payload, _ in block:
                columns[key].stamps.append(stamp)
                columns[key].payloads.append(payload)
            for column in columns.values():
                column.pack()

    def _blocks(self, query: str) -> Iterator[list[Any]]:
        """Yield rows in blocks; hop over pages that are damaged."""
        last, hop = -1, 0
        while hop < FARTHEST_HOP:
            try:
                rows = self._database.execute(query, (last + hop,))
                rows.arraysize = 1
                while block := rows.fetchmany(BLOCK if not self.damage else 1):
                    last, hop = block[-1][-1], 0
                    yield block
                return
            except sqlite3.DatabaseError as error:
                if not self.damage:  # now row by row, up to the very place
                    self.damage.append(
                        f'{self.path.name} is damaged ({error}): some of its messages are lost; '
                        f'"sqlite3 {self.path.name} .recover | sqlite3 recovered.db3" saves the '
                        'rest'
                    )
                else:
                    hop = 2 * hop or 1

    def _cut(self) -> list[str]:
        """Return a sentence if the file is shorter than it says itself."""
        page, pages, size = _pages(self.path)
        if size >= page * pages:
            return []
        return [
            f'{self.path.name} is cut off: it holds {size} of {page * pages} bytes, the last '
            f'messages are lost; "sqlite3 {self.path.name} .recover | sqlite3 recovered.db3" '
            'makes a whole file of the rest'
        ]

    def _topics(self) -> dict[int, Connection]:
        """Return the topics by id."""
        definitions = {}
        tables = {name for (name,) in self._rows('SELECT name FROM sqlite_master')}
        if not {'topics', 'messages'} <= tables:
            raise sqlite3.DatabaseError('it has no tables "topics" and "messages"')
        if 'message_definitions' in tables:
            definitions = {
                name: Definition(name, LANGUAGES.get(encoding, ''), text)
                for name, encoding, text in self._rows(
                    'SELECT topic_type, encoding, encoded_message_definition '
                    'FROM message_definitions'
                )
            }
        return {
            key: Connection(topic, definitions.get(kind, Definition(kind)), encoding)
            for key, topic, kind, encoding in self._rows(
                'SELECT id, name, type, serialization_format FROM topics'
            )
        }

    def _counts(self) -> Mapping[int, int]:
        """Tell which topics have messages: counting them all would take as long as reading."""
        try:
            query = 'SELECT EXISTS(SELECT 1 FROM messages WHERE topic_id = ?)'
            return {
                key: int(self._database.execute(query, (key,)).fetchone()[0])
                for key in self.connections
            }
        except sqlite3.DatabaseError:
            self.damage = self._cut()
            query = 'SELECT topic_id, id FROM messages WHERE id > ? ORDER BY id'
            return Counter(key for block in self._blocks(query) for key, _ in block if key)

    def _rows(self, query: str) -> list[Any]:
        return self._database.execute(query).fetchall()


def settled(path: Path, folder: Path) -> Path:
    """Return `path`, or a copy in `folder` that SQLite can open without touching the original.

    A copy is needed if the recorder died before it merged its write-ahead log or journal, and if
    the file ends inside a page, where half a number would be taken for a whole one.
    """
    beside = [path.with_name(path.name + ending) for ending in ('-wal', '-journal')]
    unfinished = [each for each in beside if each.exists() and each.stat().st_size]
    page, pages, size = _pages(path)
    if not unfinished and (not pages or size % page == 0):
        return path
    copy = folder / path.name
    for each in (path, *unfinished):
        shutil.copyfile(each, folder / each.name)
    with copy.open('r+b') as file:
        file.truncate(size // page * page)
    if unfinished:
        with sqlite3.connect(copy) as database:
            database.execute('SELECT count(*) FROM sqlite_master').fetchall()
            database.execute('PRAGMA journal_mode=DELETE')
        database.close()
    return copy


def _pages(path: Path) -> tuple[int, int, int]:
    """Return page size [bytes], pages that should be there, and the file's size [bytes]."""
    with path.open('rb') as file:
        head = file.read(32)
        size = file.seek(0, 2)
    if len(head) < 32 or not head.startswith(MAGIC):
        return 1, 0, size
    (page,), (pages,) = struct.unpack_from('>H', head, 16), struct.unpack_from('>I', head, 28)
    return 65536 if page == 1 else page, pages, size
