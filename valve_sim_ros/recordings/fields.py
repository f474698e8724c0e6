# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Numbers out of messages, by the type definitions the bag carries itself."""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
import re
from typing import Any

import numpy as np
from rosbags.typesys import get_types_from_idl, get_types_from_msg, get_typestore, Stores

from .errors import RecordingError
from .quality import Array
from .storage import Column, Definition

FLOAT64 = 'std_msgs/msg/Float64'
MULTI_ARRAY = 'std_msgs/msg/Float64MultiArray'
BUILT_IN = get_typestore(Stores.ROS2_JAZZY)
STEP = re.compile(r'([A-Za-z_]\w*)((?:\[\d+\])*)')
PLAIN = np.dtype(
    {
        'names': ['order', 'little', 'big'],
        'formats': ['u1', '<f8', '>f8'],
        'offsets': [1, 4, 4],
        'itemsize': 12,
    }
)
"""A serialised Float64, read in either byte order."""
IDL_SEPARATOR = '=' * 80 + '\nIDL: '


class Decoder:
    """Decodes the messages of one bag."""

    def __init__(self, definitions: Iterable[Definition], folders: Sequence[Path] = ()) -> None:
        """Learn the types.

        Parameters
        ----------
        definitions : iterable of Definition
            What the bag carries; they win over the built-in ones.
        folders : sequence of Path
            Folders with ``PACKAGE/msg/NAME.msg`` files, for old bags without definitions.
        """
        self._store = get_typestore(Stores.ROS2_JAZZY)
        types: dict[str, Any] = {}
        self._unreadable: dict[str, str] = {}
        for folder in folders:
            if not folder.is_dir():
                raise RecordingError(f'{folder}: no such folder with .msg files; check the path')
            for path in sorted(folder.rglob('*.msg')):
                name = f'{_package(path)}/msg/{path.stem}'
                definition = Definition(name, 'msg', path.read_text(encoding='utf-8'))
                self._learn(definition, types)
        for definition in definitions:
            self._learn(definition, types)
        for name in types:
            if name in self._store.fielddefs and types[name][1] != self._store.fielddefs[name][1]:
                del self._store.fielddefs[name], self._store.types[name]
        self._store.register({n: t for n, t in types.items() if n not in self._store.fielddefs})

    def _learn(self, definition: Definition, types: dict[str, Any]) -> None:
        """Add what a definition defines; one that cannot be read matters only if it is used."""
        try:
            types.update(_types(definition))
        except Exception as error:  # the parser raises what it likes
            self._unreadable[definition.msgtype] = str(error)

    def values(
        self, column: Column, msgtype: str, paths: Sequence[str], topic: str
    ) -> list[Array]:
        """Return the numbers at some paths of every message, each shape (n,).

        Raises
        ------
        RecordingError
            If the type is unknown, has no such field, the field is no number, or a message is
            damaged.
        """
        if msgtype == FLOAT64 and set(paths) == {'data'} and self._is_plain(FLOAT64):
            fast = float64_values(column)
            if fast is not None:
                return [fast] * len(paths)
        readers = [self._reader(msgtype, path, topic) for path in paths]
        numbers = [np.empty(len(column)) for _ in paths]
        for k, payload in enumerate(column.messages()):
            message = self._message(payload, msgtype, topic, k)
            for path, read, values in zip(paths, readers, numbers, strict=True):
                values[k] = as_number(read(message), f'{topic}.{path}', msgtype)
        return numbers

    def rows(self, column: Column, topic: str) -> tuple[str, list[Array]]:
        """Return the label and the rows of std_msgs/msg/Float64MultiArray messages."""
        label, rows = '', []
        for k, payload in enumerate(column.messages()):
            message = self._message(payload, MULTI_ARRAY, topic, k)
            label = label or (message.layout.dim[0].label if message.layout.dim else '')
            rows.append(np.asarray(message.data, dtype=np.float64))
        return label, rows

    def _is_plain(self, msgtype: str) -> bool:
        """Tell whether the bag means by a type what everyone means by it."""
        return bool(self._store.fielddefs[msgtype][1] == BUILT_IN.fielddefs[msgtype][1])

    def _message(self, payload: bytes, msgtype: str, topic: str, k: int) -> Any:
        try:
            return self._store.deserialize_cdr(payload, msgtype)
        except Exception as error:  # a damaged payload raises anything
            raise RecordingError(
                f'message {k} of {topic} is damaged or is no {msgtype} ({error}): record again, '
                'or leave the topic out'
            ) from error

    def _reader(self, msgtype: str, path: str, topic: str) -> Callable[[Any], Any]:
        """Return a function that follows `path` in a message, after checking it by type."""
        if msgtype in self._unreadable:
            raise RecordingError(
                f'topic {topic} has type {msgtype}, whose definition cannot be read: '
                f'{self._unreadable[msgtype]}'
            )
        if msgtype not in self._store.fielddefs:
            raise RecordingError(
                f'topic {topic} has type {msgtype}, which the bag does not define: give '
                'the folder of its .msg files (message_folders, --msg-dir), or record as mcap'
            )
        fields = self.numeric_fields(msgtype)
        if re.sub(r'\[\d+\]', '[]', path) not in [re.sub(r'\[\d*\]', '[]', f) for f in fields]:
            shown = ', '.join(fields[:12]) + (', …' if len(fields) > 12 else '')
            raise RecordingError(
                f'topic {topic} has type {msgtype}, which has no number {path!r}; '
                + (
                    f'its numbers are {shown}: write {topic}.{fields[0]}'
                    if fields
                    else 'it holds none'
                )
            )
        steps: list[str | int] = []
        for step in path.split('.'):
            match = STEP.fullmatch(step)
            assert match is not None
            steps.append(match[1])
            steps += [int(index) for index in re.findall(r'\d+', match[2])]

        def read(message: Any) -> Any:
            for step in steps:
                try:
                    message = getattr(message, step) if isinstance(step, str) else message[step]
                except IndexError:
                    raise RecordingError(
                        f'{topic}.{path}: a message has only {len(message)} elements there'
                    ) from None
            return message

        return read

    def numeric_fields(self, msgtype: str, depth: int = 6) -> list[str]:
        """Return the paths of all numbers in a type, ``[]`` standing for any index."""
        paths: list[str] = []
        for name, description in self._store.fielddefs[msgtype][1]:
            paths += [f'{name}{rest}' for rest in self._leaves(description, depth)]
        return paths

    def _leaves(self, description: Any, depth: int) -> list[str]:
        kind, detail = int(description[0]), description[1]
        if kind == 1:  # a base type
            return [''] if detail[0] not in ('string', 'wstring', 'octet') else []
        if kind == 2:  # a message
            known = depth > 0 and detail in self._store.fielddefs
            return [f'.{path}' for path in self.numeric_fields(detail, depth - 1)] if known else []
        return [f'[]{rest}' for rest in self._leaves(detail[0], depth)]


def float64_values(column: Column) -> Array | None:
    """Return the numbers of std_msgs/msg/Float64 messages, or None if they are not all plain.

    A payload is four bytes of CDR header, the second of them odd for little-endian, and the
    double.
    """
    if not len(column):
        return np.empty(0)
    if set(column.sizes) != {12}:
        return None
    table = np.frombuffer(column.packed, dtype=PLAIN)
    if (table['order'] == 1).all():
        return table['little'].astype(np.float64)
    little = table['order'] % 2 == 1
    return np.where(little, table['little'], table['big']).astype(np.float64)


def as_number(value: Any, where: str, msgtype: str) -> float:
    """Return a field as a float, or refuse what is no number."""
    if isinstance(value, (bool, int, float, np.number, np.bool_)):
        return float(value)
    raise RecordingError(f'{where} of {msgtype} is a {type(value).__name__}: expected a number')


def _types(definition: Definition) -> dict[str, Any]:
    """Parse one definition, with the types it uses."""
    if definition.language == 'msg':
        return dict(get_types_from_msg(definition.text, definition.msgtype))
    if definition.language != 'idl':
        return {}
    if not definition.text.startswith(IDL_SEPARATOR):
        return dict(get_types_from_idl(definition.text))
    types: dict[str, Any] = {}
    for part in definition.text.split(IDL_SEPARATOR)[1:]:
        types.update(get_types_from_idl(part.split('\n', 1)[1]))
    return types


def _package(path: Path) -> str:
    """Return the package of a .msg file."""
    return path.parent.parent.name if path.parent.name == 'msg' else path.parent.name
