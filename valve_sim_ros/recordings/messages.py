# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What comes out of a storage file.

rosbags yields messages sorted by their receive stamps. That hides a clock that was set back while
recording, drops the stamps of the sender, and needs a complete file. The walkers in `mcap_file`
and `db3_file` keep the order and both stamps, and stop at damage with a word about it; everything
else (opening, types, decoding, writing) is left to rosbags.
"""

from dataclasses import dataclass, field
import sys
from typing import NamedTuple

if sys.version_info >= (3, 14):
    from compression import zstd
else:
    from backports import zstd

ZSTD_MAGIC = b'\x28\xb5\x2f\xfd'
LANGUAGES = {'ros2msg': 'msg', 'ros2idl': 'idl', 'omgidl': 'idl'}


class Message(NamedTuple):
    """One message: topic, receive stamp [ns], send stamp [ns], CDR payload."""

    topic: str
    received: int
    sent: int
    payload: bytes


@dataclass(frozen=True)
class Definition:
    """The definition of a message type as a bag stores it."""

    msgtype: str
    language: str
    """'msg', 'idl' or '' for none."""
    text: str


@dataclass
class Walk:
    """What a walk through a storage file has met so far.

    Attributes
    ----------
    types : dict of str to str
        Message type by topic.
    definitions : list of Definition
        Type definitions found.
    """

    types: dict[str, str] = field(default_factory=dict)
    definitions: list[Definition] = field(default_factory=list)


class Damage(Exception):  # noqa: N818 - it ends a walk, it is not shown to the user as such
    """The file ends, or makes no sense, from here on; the text says where and why."""


def decompressed(payload: bytes) -> bytes:
    """Return a payload, unpacked if it was compressed message by message.

    A CDR payload never starts with the zstd magic: its first byte is 0.
    """
    return zstd.decompress(payload) if payload[:4] == ZSTD_MAGIC else payload


def decompressed_so_far(data: bytes) -> bytes:
    """Return what a zstd stream that was cut off still holds."""
    unpacker = zstd.ZstdDecompressor()
    try:
        return unpacker.decompress(data)
    except zstd.ZstdError:
        return b''
