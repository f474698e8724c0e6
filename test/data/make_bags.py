# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Make the small ugly bags of this folder again: ``python test/data/make_bags.py [FOLDER]``.

One valve is recorded over and over, each time with one thing wrong that happens to real
recordings. What the valve truly did is in ``truth.csv``.
"""

from collections.abc import Callable
from pathlib import Path
import shutil
import sys
import tempfile

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import get_types_from_msg, get_typestore, Stores

sys.path.insert(0, str(Path(__file__).parents[1] / 'recordings'))

from recorded import commands, recorded, Truth

from valve_sim_ros import Recording, write_recording
from valve_sim_ros.recordings.arrivals import Arrivals

FLOAT64 = 'std_msgs/msg/Float64'
SAMPLE = 'std_msgs/msg/Float64MultiArray'
STATE = 'plant_msgs/msg/ValveState'
DEFINITION = """
std_msgs/Header header
float32[4] current
plant_msgs/Pressure[] pressure
"""
PRESSURE = 'float64 bar\nbool valid\n'
SECOND = 10**9
SHORT = 80
Messages = list[tuple[str, int, bytes]]
"""Topic, receive stamp [ns], payload, in stored order."""

STORE = get_typestore(Stores.ROS2_JAZZY)
STORE.register(
    {
        **get_types_from_msg(PRESSURE, 'plant_msgs/msg/Pressure'),
        **get_types_from_msg(DEFINITION, STATE),
    }
)
TYPES = STORE.types


def recording(**recorder: object) -> tuple[Truth, dict[str, Arrivals]]:
    """Record the valve with some recorder; the valve and its noise are always the same."""
    times, levels = commands(np.random.default_rng(4), 11, 3.5)
    options = {'signals': ('p1', 'x'), 'initial': 40.0, **recorder}
    truth, arrivals = recorded(np.random.default_rng(5), times, levels, **options)
    return (
        Truth(truth.t, *(_rounded(getattr(truth, name)) for name in ('u', 'p1', 'p2', 'x'))),
        {name: Arrivals(each.stamps, _rounded(each.values)) for name, each in arrivals.items()},
    )


def float64(arrivals: dict[str, Arrivals]) -> Messages:
    """Return the messages of plain topics in the order of their stamps."""
    messages = [
        (f'/{name}', int(stamp), _payload(FLOAT64, data=float(value)))
        for name, each in arrivals.items()
        for stamp, value in zip(each.stamps, each.values, strict=True)
    ]
    return sorted(messages, key=lambda message: message[1])


def bag(
    path: Path,
    messages: Messages,
    storage: str = 'mcap',
    mode: CompressionMode = CompressionMode.STORAGE,
    types: dict[str, str] | None = None,
) -> Path:
    """Write a bag as rosbag2 does; return its storage file."""
    writer = Writer(path, version=9, storage_plugin=StoragePlugin[storage.upper()])
    writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        connections = {
            topic: writer.add_connection(topic, (types or {}).get(topic, FLOAT64), typestore=STORE)
            for topic in sorted({topic for topic, _, _ in messages})
        }
        for topic, stamp, payload in messages:
            writer.write(connections[topic], stamp, payload)
    return next(file for file in path.iterdir() if file.name != 'metadata.yaml')


def single(path: Path, messages: Messages, types: dict[str, str] | None = None) -> None:
    """Write one compressed .mcap file without metadata.yaml."""
    with tempfile.TemporaryDirectory() as folder:
        file = bag(Path(folder) / path.stem, messages, mode=CompressionMode.FILE, types=types)
        shutil.copyfile(file, path.with_suffix('.mcap.zstd'))


def storages(folder: Path) -> None:
    """Write the clean recording in every storage."""
    messages = float64(recording()[1])[:SHORT]
    for storage in ('mcap', 'sqlite3'):
        for mode in (CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE):
            bag(folder / f'{storage}_{mode.name.lower()}', messages, storage, mode)
    bag(folder / 'mcap_chunks', messages)


def split(folder: Path) -> None:
    """Write a bag in two files whose stamps overlap, one of which is listed but missing."""
    messages = float64(recording()[1])
    first, second = messages[:200] + messages[206:212], messages[200:206] + messages[212:]
    for name, kept in (('split', True), ('split_missing_file', False)):
        file = bag(folder / name, first)
        file = file.rename(file.with_name('part_0.mcap'))
        if kept:
            single(file.with_name('part_1'), second)
        text = file.with_name('metadata.yaml').read_text()
        text = text.replace(f'{name}.mcap', 'part_0.mcap')
        listed = '  relative_file_paths:\n  - part_0.mcap\n'
        assert listed in text
        text = text.replace(listed, listed + '  - part_1.mcap.zstd\n')
        file.with_name('metadata.yaml').write_text(text)


def damaged(folder: Path) -> None:
    """Write bags that a crash, a full disc or a careless copy left behind."""
    messages = float64(recording()[1])[:SHORT]
    for name, storage, mode, share in (
        ('cut_mcap', 'mcap', CompressionMode.NONE, 0.6),
        ('cut_mcap_chunk', 'mcap', CompressionMode.STORAGE, 0.5),
        ('cut_sqlite3', 'sqlite3', CompressionMode.NONE, 0.95),
        ('cut_zstd_file', 'mcap', CompressionMode.FILE, 0.7),
    ):
        file = bag(folder / name, messages, storage, mode)
        (folder / name / 'metadata.yaml').unlink()
        content = file.read_bytes()
        file.write_bytes(content[: int(share * len(content))])
    file = bag(folder / 'damaged_metadata', messages)
    file.with_name('metadata.yaml').write_text('rosbag2_bagfile_information:\n  version: [9\n')


def stamps(folder: Path) -> None:
    """Write single files whose stamps are not what they should be."""
    _, clean = recording()
    messages = float64(clean)
    disorder = list(messages)
    for k in (40, 90, 333):
        disorder[k], disorder[k + 5] = disorder[k + 5], disorder[k]
    for k in (70, 200):
        disorder.insert(k + 9, disorder[k])
    single(folder / 'disorder', disorder)
    single(folder / 'zero_stamps', [(t, 0, p) for t, _, p in messages[:3]] + messages)
    half = next(k for k in range(len(messages) // 2, len(messages)) if messages[k][0] == '/p1')
    for name, jump in (('clock_set_back', -30 * SECOND), ('clock_set_forward', 3600 * SECOND)):
        single(folder / name, messages[:half] + [(t, s + jump, p) for t, s, p in messages[half:]])
    for name, recorder in {
        'jitter': {'jitter': 0.02},
        'bursts': {'lag': _bursts},
        'loss': {'loss': 0.05, 'jitter': 0.02},
        'lag': {'lag': 0.12},
        'dead_time': {'dead_samples': 2},
    }.items():
        single(folder / name, float64(recording(**recorder)[1]))
    single(folder / 'gap', [m for m in messages if not 20.0 < _age(m, messages) < 27.0])
    slow = {'u': clean['u'], 'p1': clean['p1'].part(slice(None, None, 5)), 'x': clean['x']}
    single(folder / 'rates', float64(slow))


def own_message() -> Messages:
    """Return messages of a type that only the bag defines: mA and bar instead of per cent."""
    truth, clean = recording()
    messages = [m for m in float64(clean) if m[0] == '/u']
    for k, stamp in enumerate(clean['x'].stamps):
        current = np.array([0.0, 0.0, 4.0 + 0.16 * truth.x[k], 0.0], dtype=np.float32)
        header = TYPES['std_msgs/msg/Header'](
            TYPES['builtin_interfaces/msg/Time'](*map(int, divmod(stamp, SECOND))), 'valve'
        )
        pressure = [TYPES['plant_msgs/msg/Pressure'](0.2 + 0.008 * truth.p1[k], True)]
        payload = _payload(STATE, header=header, current=current, pressure=pressure)
        messages.append(('/valve/state', int(stamp), payload))
    return sorted(messages, key=lambda message: message[1])


def own_message_sqlite3(path: Path) -> Path:
    """Write them as .db3; return the file."""
    types = {'/valve/state': STATE}
    return bag(path, own_message(), 'sqlite3', CompressionMode.NONE, types)


def other_messages(folder: Path) -> None:
    """Write recordings whose numbers are not in plain Float64 topics."""
    single(folder / 'own_message', own_message(), {'/valve/state': STATE})
    truth, clean = recording()
    layout = TYPES['std_msgs/msg/MultiArrayLayout'](
        [TYPES['std_msgs/msg/MultiArrayDimension']('t,u,p1,x', 4, 4)], 0
    )
    rows = np.stack([truth.t, truth.u, truth.p1, truth.x], axis=1)
    rng = np.random.default_rng(6)
    late = clean['x'].stamps + np.int64(0.05 * SECOND * rng.random(len(rows)))
    samples = [
        ('/valve/sample', int(stamp), _payload(SAMPLE, layout=layout, data=row))
        for k, (stamp, row) in enumerate(zip(late, rows, strict=True))
        if k % 20 != 7
    ]
    single(folder / 'sample', samples, {'/valve/sample': SAMPLE})


def _rounded(values: np.ndarray) -> np.ndarray:
    """Round to 20 binary digits behind the point: still unique, but small when compressed."""
    return np.round(values * 2**20) / 2**20


def _bursts(count: int) -> np.ndarray:
    """Return delays [s] with which every fourth sample brings the three before it along."""
    index = np.arange(count)
    return 0.2 * (np.minimum(index // 4 * 4 + 3, count - 1) - index)


def _age(message: tuple[str, int, bytes], messages: Messages) -> float:
    return (message[1] - messages[0][1]) / SECOND


def _payload(kind: str, **fields: object) -> bytes:
    return bytes(STORE.serialize_cdr(TYPES[kind](**fields), kind))


MAKERS: tuple[Callable[[Path], None], ...] = (storages, split, damaged, stamps, other_messages)


def write_all(folder: Path) -> None:
    """Write everything anew."""
    for old in folder.iterdir():
        if old.is_dir():
            shutil.rmtree(old)
        elif old.name.endswith('.mcap.zstd'):
            old.unlink()
    truth, _ = recording()
    write_recording(Recording(truth.t, truth.u, p1=truth.p1, x=truth.x), folder / 'truth.csv')
    for make in MAKERS:
        make(folder)


if __name__ == '__main__':
    write_all(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
