# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The small ugly bags of test/data: one valve, recorded with one thing wrong at a time."""

import functools
import importlib.util
from pathlib import Path
import shutil
import sqlite3
import struct

import numpy as np
import pytest
from recorded import faults, Truth

from valve_sim_ros import read_recording, RecordingError
from valve_sim_ros.recordings.bag_files import storage_files
from valve_sim_ros.recordings.mcap_file import CHUNK, HEAD, MAGIC, MESSAGE
from valve_sim_ros.recordings.storage import zstd

DATA = Path(__file__).parents[1] / 'data'
LAST = 233
"""Index of the last sample of the whole recordings."""


@pytest.fixture(name='truth', scope='module')
def _truth():
    true = read_recording(DATA / 'truth.csv')
    return Truth(true.time, true.u, true.p1, None, true.x)


def outcome(path):
    """Return the recording, or None, and the sentence with which it was refused."""
    try:
        return read_recording(path), ''
    except RecordingError as error:
        return None, str(error)


@functools.cache
def make_bags():
    """Return the script as a module."""
    source = importlib.util.spec_from_file_location('make_bags', DATA / 'make_bags.py')
    module = importlib.util.module_from_spec(source)
    source.loader.exec_module(module)
    return module


def notes(found):
    return '; '.join(found.quality.lines())


@pytest.mark.parametrize(
    ('name', 'storage', 'messages'),
    [
        (f'{storage}_{compression}', storage, 39)
        for storage in ('mcap', 'sqlite3')
        for compression in ('none', 'file', 'message')
    ]
    + [('mcap_chunks', 'mcap', 39), ('split', 'mcap', LAST + 1), ('damaged_metadata', 'mcap', 39)],
)
def test_every_storage_gives_the_same_samples(truth, name, storage, messages):
    found = read_recording(DATA / name)
    assert found.provenance.storage == storage
    assert len(found) == messages
    assert faults(truth, found) == (0, 0)
    np.testing.assert_array_equal(found.x, truth.x[:messages])
    np.testing.assert_allclose(found.time, truth.t[:messages], atol=1e-9)


@pytest.mark.parametrize('name', ['mcap_none', 'sqlite3_none', 'mcap_file', 'sqlite3_file'])
def test_the_folder_the_file_and_the_folder_without_metadata_are_one(tmp_path, name):
    whole = read_recording(DATA / name)
    (file,) = storage_files(DATA / name)
    alone = read_recording(file)
    shutil.copyfile(file, tmp_path / file.name)
    bare = read_recording(tmp_path)
    for other in (alone, bare):
        np.testing.assert_array_equal(other.x, whole.x)
    assert 'reindex' in notes(bare)
    assert 'reindex' not in notes(whole)


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('cut_mcap', 'mcap recover cut_mcap.mcap -o recovered.mcap'),
        ('cut_mcap_chunk', 'mcap recover'),
        ('cut_sqlite3', 'sqlite3 cut_sqlite3.db3 .recover | sqlite3 recovered.db3'),
        ('damaged_metadata', 'metadata.yaml cannot be read'),
        ('split_missing_file', 'lists part_1.mcap.zstd, which is missing'),
    ],
)
def test_what_is_left_of_a_damaged_bag_is_read_and_the_cure_is_named(truth, name, words):
    found = read_recording(DATA / name)
    assert len(found) >= 30
    assert faults(truth, found)[1] == 0
    assert words in notes(found)


def test_a_compressed_file_cut_within_its_first_block_is_refused_with_the_cure():
    with pytest.raises(RecordingError, match=r'zstd -dc .* unpacks the rest'):
        read_recording(DATA / 'cut_zstd_file')


@pytest.mark.parametrize('name', ['mcap_none', 'sqlite3_none', 'mcap_chunks', 'cut_mcap'])
@pytest.mark.parametrize('cut', [0, 1, 20, 300, 5000, -1, -300])
def test_a_file_cut_anywhere_is_read_or_refused_with_a_sentence(truth, tmp_path, name, cut):
    (file,) = storage_files(DATA / name)
    (tmp_path / file.name).write_bytes(file.read_bytes()[:cut])
    found, sentence = outcome(tmp_path / file.name)
    assert file.name in sentence if found is None else faults(truth, found) == (0, 0)


@pytest.mark.filterwarnings('error')
@pytest.mark.parametrize('name', ['mcap_none', 'sqlite3_none', 'mcap_file', 'mcap_chunks'])
def test_a_file_with_flipped_bytes_is_read_or_refused_with_a_sentence(tmp_path, name):
    (file,) = storage_files(DATA / name)
    content = file.read_bytes()
    rng = np.random.default_rng(0)
    for _ in range(40):
        spoilt = bytearray(content)
        for place in rng.integers(0, len(content), 3):
            spoilt[place] ^= int(rng.integers(1, 256))
        (tmp_path / file.name).write_bytes(bytes(spoilt))
        found, sentence = outcome(tmp_path / file.name)
        assert found or file.name in sentence


def test_what_the_recorder_had_not_merged_when_it_died_is_read(tmp_path):
    source = sqlite3.connect(DATA / 'sqlite3_none' / 'sqlite3_none.db3')
    path = tmp_path / 'live.db3'
    live = sqlite3.connect(path)
    source.backup(live)
    live.execute('PRAGMA journal_mode=WAL')
    live.execute('DELETE FROM messages WHERE id > 60')
    live.commit()
    (tmp_path / 'dead').mkdir()
    for each in tmp_path.glob('live.db3*'):
        shutil.copyfile(each, tmp_path / 'dead' / each.name)
    before = {each.name: each.read_bytes() for each in (tmp_path / 'dead').iterdir()}
    found = read_recording(tmp_path / 'dead' / 'live.db3')
    assert len(found) < 39
    assert {each.name: each.read_bytes() for each in (tmp_path / 'dead').iterdir()} == before
    live.close()
    source.close()


@pytest.mark.parametrize(
    ('name', 'words'),
    [
        ('disorder', 'out of order, sorted'),
        ('zero_stamps', 'without a stamp, dropped'),
        ('bursts', 'arrived in bursts'),
        ('jitter', 'jitter'),
        ('loss', '% lost'),
        ('lag', 'offset of the outputs against u'),
        ('rates', '1 per second'),
        ('sample', '5.1 % lost'),
    ],
)
def test_ugly_stamps_leave_every_sample_and_command_in_place(truth, name, words):
    found = read_recording(DATA / f'{name}.mcap.zstd')
    assert faults(truth, found) == (0, 0)
    assert found.time[-1] == pytest.approx(truth.t[-1], abs=1e-6)
    assert words in notes(found)


def test_the_lag_of_stamps_is_estimated_and_a_dead_time_is_not_taken_for_it(truth):
    lag = read_recording(DATA / 'lag.mcap.zstd').quality
    low, high = lag.command_offset_range
    assert low <= 0.12 <= high
    assert lag.dead_samples == 0
    dead = read_recording(DATA / 'dead_time.mcap.zstd')
    low, high = dead.quality.command_offset_range
    assert low <= 0.0 <= high
    assert dead.quality.dead_samples == 2
    np.testing.assert_array_equal(dead.u, truth.u)


@pytest.mark.parametrize(
    ('name', 'jump', 'pause'),
    [('clock_set_back', -30.0, None), ('clock_set_forward', 0.0, 3600.2)],
)
def test_a_step_of_the_clock_parts_the_recording(truth, name, jump, pause):
    found = read_recording(DATA / f'{name}.mcap.zstd')
    (gap,) = found.quality.gaps
    assert len(found.segments) == 2
    assert gap.clock_jump == pytest.approx(jump, abs=0.4)
    assert pause is None or gap.stop - gap.start == pytest.approx(pause, abs=1e-6)
    np.testing.assert_array_equal(found.x[np.isfinite(found.x)], truth.x)
    assert faults(truth, found)[0] == 0


def test_a_gap_starts_a_segment_and_is_not_filled(truth):
    found = read_recording(DATA / 'gap.mcap.zstd')
    (gap,) = found.quality.gaps
    assert (gap.start, gap.stop) == pytest.approx((19.8, 27.0), abs=0.21)
    assert len(found.segments) == 2
    assert faults(truth, found)[1] == 0
    kept = (truth.t < gap.start + 0.1) | (truth.t > gap.stop - 0.1)
    np.testing.assert_array_equal(found.x, truth.x[kept])


def test_numbers_out_of_a_message_that_only_the_bag_defines(truth):
    path = DATA / 'own_message.mcap.zstd'
    topics = {
        'p1': '/valve/state/pressure[0].bar*125-25',
        'x': '/valve/state/current[2]*6.25-25',
    }
    found = read_recording(path, topics)
    np.testing.assert_allclose(found.p1, truth.p1, atol=1e-9)
    np.testing.assert_allclose(found.x, truth.x, atol=1e-4)  # it was a float32
    np.testing.assert_array_equal(found.u, truth.u)
    for wrong, words in (
        ('/valve/state/current[9]', 'only 4 elements'),
        ('/valve/state/flow', r'no number .*current\[\]'),
        ('/valve/state/header.frame_id', 'no number'),
        ('/valve/position', 'no topic /valve/position.*did you mean|no topic'),
    ):
        with pytest.raises(RecordingError, match=words):
            read_recording(path, {'x': wrong})


def test_the_bags_are_small_and_all_of_them_are_made_by_the_script(tmp_path):
    kept = {p.relative_to(DATA) for p in DATA.rglob('*') if p.is_file()}
    kept = {p for p in kept if p.suffix not in ('.py', '.pyc')}
    assert sum((DATA / p).stat().st_size for p in kept) < 300_000
    make_bags().write_all(tmp_path)
    made = {p.relative_to(tmp_path) for p in tmp_path.rglob('*') if p.is_file()}
    assert made == kept


def test_an_old_bag_without_definitions_takes_them_from_a_folder(truth, tmp_path):
    path = make_bags().own_message_sqlite3(tmp_path / 'old')
    database = sqlite3.connect(path)
    database.execute('DELETE FROM message_definitions')
    database.commit()
    database.close()
    topics = {'x': '/valve/state/current[2]*6.25-25'}
    with pytest.raises(RecordingError, match='--msg-dir'):
        read_recording(path, topics)
    folder = tmp_path / 'plant_msgs' / 'msg'
    folder.mkdir(parents=True)
    (folder / 'ValveState.msg').write_text(make_bags().DEFINITION)
    (folder / 'Pressure.msg').write_text(make_bags().PRESSURE)
    (folder / 'Other.msg').write_text('not a message at all ((\n')
    found = read_recording(path, topics, message_folders=[tmp_path / 'plant_msgs'])
    np.testing.assert_allclose(found.x, truth.x, atol=1e-4)
    with pytest.raises(RecordingError, match='no such folder'):
        read_recording(path, topics, message_folders=[tmp_path / 'nowhere'])


def test_send_and_receive_stamps_are_compared_and_either_can_be_the_time(truth, tmp_path):
    path = tmp_path / 'sent.mcap'
    content = bytearray(zstd.decompress((DATA / 'jitter.mcap.zstd').read_bytes()))
    sent_earlier(content, int(1.7e9))
    path.write_bytes(bytes(content))
    received = read_recording(path)
    assert received.provenance.time_source == 'received'
    assert 'received 1.7 s after it was sent' in notes(received)
    sent = read_recording(path, time_source='sent')
    assert sent.provenance.time_source == 'sent'
    assert received.provenance.start - sent.provenance.start == pytest.approx(1.7e9, abs=1e8)
    np.testing.assert_array_equal(sent.x, received.x)
    with pytest.raises(RecordingError, match='no send stamps'):
        read_recording(DATA / 'sqlite3_none', time_source='sent')
    with pytest.raises(RecordingError, match=r'header\.stamp\.sec'):
        read_recording(path, time_source='header')
    with pytest.raises(RecordingError, match='expected received, sent, header'):
        read_recording(path, time_source='clock')


def sent_earlier(content, nanoseconds):
    """Change the send stamps of all messages in an uncompressed mcap file."""
    position = len(MAGIC)
    while position < len(content) - len(MAGIC):
        kind, size = HEAD.unpack_from(content, position)
        body = position + HEAD.size
        if kind == CHUNK:
            content[body + 24 : body + 28] = bytes(4)  # no checksum
            position = body + 32 + struct.unpack_from('<I', content, body + 28)[0] + 8
            continue
        if kind == MESSAGE:
            (sent,) = struct.unpack_from('<Q', content, body + 14)
            struct.pack_into('<Q', content, body + 14, sent - nanoseconds)
        position = body + size


def test_the_stamp_in_a_header_can_be_the_time(truth):
    topics = {
        'u': '/valve/state/current[1]',
        'p1': '/valve/state/pressure[0].bar*125-25',
        'x': '/valve/state/current[2]*6.25-25',
    }
    found = read_recording(DATA / 'own_message.mcap.zstd', topics, time_source='header')
    np.testing.assert_allclose(found.x, truth.x, atol=1e-4)
