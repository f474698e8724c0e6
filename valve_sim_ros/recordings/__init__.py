# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Recordings of a valve: ROS 2 bags and CSV files in, one `Recording` out, and back."""

from collections.abc import Sequence
import os
from pathlib import Path

from .bags import read_bag, write_bag
from .csv_file import read_csv, write_csv
from .errors import RecordingError
from .recording import Recording
from .topics import Topics

__all__ = ['Recording', 'RecordingError', 'read_commands', 'read_recording', 'write_recording']


def read_recording(
    path: str | os.PathLike[str],
    topics: Topics | None = None,
    sample_time: float | None = None,
    message_folders: Sequence[str | os.PathLike[str]] = (),
    time_source: str = 'received',
) -> Recording:
    """Read a bag (folder, .mcap or .db3 file, compressed or not) or a CSV file.

    Parameters
    ----------
    path : path-like
        What to read.
    topics : mapping of str to str, optional
        Topic or CSV column by signal, as ``{'x': '/valve_7/position'}``.
    sample_time : float, optional
        Sampling period of the valve [s], for bags that hold only some of its samples.
    message_folders : sequence of path-like
        Folders with ``PACKAGE/msg/NAME.msg`` files, for old bags that do not define their types.
    time_source : {'received', 'sent', 'header'}
        Which stamps are the time of a message: when the recorder received it, when its publisher
        sent it (mcap only), or the stamp in its header.

    Raises
    ------
    RecordingError
        If it cannot be read, with what to do about it.
    """
    path = Path(path)
    if not path.exists():
        raise RecordingError(f'{path}: no such bag or CSV file; check the path')
    if path.suffix.lower() == '.csv':
        return read_csv(path, topics)
    return read_bag(
        path,
        topics,
        sample_time=sample_time,
        message_folders=message_folders,
        time_source=time_source,
    )


def read_commands(path: str | os.PathLike[str], topics: Topics | None = None) -> Recording:
    """Read a bag or CSV file as `read_recording` does, but u alone is enough."""
    path = Path(path)
    if path.suffix.lower() == '.csv' or not path.exists():
        return read_recording(path, topics)
    return read_bag(path, topics, require_outputs=False)


def write_recording(recording: Recording, path: str | os.PathLike[str]) -> None:
    """Write a CSV file if `path` ends in .csv, else a bag (mcap; sqlite3 if it ends in .db3)."""
    path = Path(path)
    if path.suffix.lower() == '.csv':
        write_csv(recording, path)
    elif path.suffix.lower() == '.db3':
        write_bag(recording, path.with_suffix(''), storage='sqlite3')
    else:
        write_bag(recording, path)
