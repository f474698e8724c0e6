# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of a sqlite3 (.db3) file in the order in which they were written."""

from collections.abc import Iterator
from pathlib import Path
import sqlite3

from .messages import Damage, decompressed, Definition, LANGUAGES, Message, Walk


def walk_db3(path: Path, topics: frozenset[str] | None, seen: Walk) -> Iterator[Message]:
    """Yield the messages in file order, then raise Damage if the file is not complete.

    Parameters
    ----------
    path : Path
        A .db3 file.
    topics : frozenset of str, or None
        Only these; None for all.
    seen : Walk
        Filled while walking.
    """
    connection = sqlite3.connect(f'{path.resolve().as_uri()}?immutable=1', uri=True)
    try:
        names: dict[int, str] = {}
        for number, name, msgtype in connection.execute('SELECT id, name, type FROM topics'):
            seen.types[name] = msgtype
            if topics is None or name in topics:
                names[number] = name
        seen.definitions += _definitions(connection)
        rows = connection.execute('SELECT topic_id, timestamp, data FROM messages ORDER BY id')
        for number, received, payload in rows:
            if number in names:
                yield Message(names[number], received, received, decompressed(payload))
    except (sqlite3.Error, TypeError, UnicodeError) as error:
        raise Damage(f'sqlite says: {error}') from error
    finally:
        connection.close()


def _definitions(connection: sqlite3.Connection) -> list[Definition]:
    """Return the type definitions; old files have none."""
    tables = {name for (name,) in connection.execute('SELECT name FROM sqlite_master')}
    if 'message_definitions' not in tables:
        return []
    rows = connection.execute(
        'SELECT topic_type, encoding, encoded_message_definition FROM message_definitions'
    )
    return [Definition(name, LANGUAGES.get(coding, ''), text) for name, coding, text in rows]
