# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Bags and CSV files in and out, good and bad."""

import numpy as np
import pytest

from valve_sim_ros import read_recording, Recording, RecordingError, simulate, write_recording
from valve_sim_ros.recordings.align import align, Arrivals
from valve_sim_ros.recordings.bags import write_bag
from valve_sim_ros.recordings.recording import Provenance


@pytest.fixture(name='recording')
def _recording():
    u = np.repeat(np.random.default_rng(1).uniform(0.0, 100.0, 20), 25)
    s = simulate(u)
    return Recording(s.t, s.u, s.p1, s.p2, s.x)


@pytest.mark.parametrize('storage', ['mcap', 'sqlite3'])
@pytest.mark.parametrize('way', ['folder', 'file', 'no metadata'])
def test_bag_round_trip(recording, tmp_path, storage, way):
    path = tmp_path / 'bag'
    write_bag(recording, path, storage)
    if way == 'no metadata':
        (path / 'metadata.yaml').unlink()
    if way == 'file':
        path = next(p for p in path.iterdir() if p.suffix in ('.mcap', '.db3'))
    again = read_recording(path)
    for name in ('time', 'u', 'p1', 'p2', 'x'):
        np.testing.assert_array_equal(getattr(again, name), getattr(recording, name), name)
    assert again.provenance.digests


def test_csv_round_trip_is_exact(recording, tmp_path):
    lost = recording.x.copy()
    lost[7] = np.nan
    recording = Recording(recording.time, recording.u, x=lost)
    write_recording(recording, tmp_path / 'r.csv')
    again = read_recording(tmp_path / 'r.csv')
    assert again.signals == ('x',)
    np.testing.assert_array_equal(again.x, recording.x)
    np.testing.assert_array_equal(again.time, recording.time)


def arrivals(recording, stamps, keep=slice(None)):
    nanoseconds = np.round(stamps * 1e9).astype(np.int64) + 10**18
    found = {n: Arrivals(nanoseconds[keep], recording.output(n)[keep]) for n in ('p1', 'p2', 'x')}
    return {'u': Arrivals(nanoseconds - 10**6, recording.u), **found}


def test_jitter_leaves_the_samples_where_they_were(recording):
    jitter = np.random.default_rng(0).normal(0.0, 0.01, recording.time.size)
    found = align(arrivals(recording, recording.time + jitter), Provenance())
    np.testing.assert_array_equal(found.x, recording.x)
    np.testing.assert_allclose(found.time, recording.time, atol=1e-9)
    assert 0.005 < found.quality.jitter < 0.02


def test_lost_samples_are_nan_and_never_interpolated(recording):
    kept = np.sort(np.random.default_rng(0).permutation(recording.time.size)[:-25])
    kept[0], kept[-1] = 0, recording.time.size - 1
    found = align(arrivals(recording, recording.time, kept), Provenance())
    missing = np.setdiff1d(np.arange(len(recording)), kept)
    assert np.isnan(found.x[missing]).all()
    np.testing.assert_array_equal(found.x[kept], recording.x[kept])


def test_a_gap_starts_a_segment(recording):
    kept = np.r_[0:100, 200:500]
    found = align(arrivals(recording, recording.time, kept), Provenance())
    assert [part.stop - part.start for part in found.segments] == [100, 300]
    assert len(found.quality.gaps) == 1


def test_disorder_and_duplicates_are_counted_and_mended(recording):
    order = np.arange(len(recording))
    order[[10, 11]] = 11, 10
    order = np.insert(order, 50, 50)
    found = align(arrivals(recording, recording.time, order), Provenance())
    np.testing.assert_array_equal(found.x, recording.x)
    assert found.quality.signals['x'].duplicates == 1
    assert found.quality.signals['x'].out_of_order == 1


def test_other_names_and_scales(recording, tmp_path):
    write_bag(recording, tmp_path / 'bag')
    found = read_recording(tmp_path / 'bag', {'x': '/p2.data*0.5+1'})
    np.testing.assert_allclose(found.x, 0.5 * recording.p2 + 1.0)


def test_refusals(recording, tmp_path):
    def refused(path, words, topics=None):
        with pytest.raises(RecordingError, match=words):
            read_recording(path, topics)

    refused(tmp_path / 'none', 'no such bag')
    (tmp_path / 'empty').mkdir()
    refused(tmp_path / 'empty', 'empty folder or no bag')
    write_bag(recording, tmp_path / 'bag')
    refused(tmp_path / 'bag', 'no topic /position', {'x': '/position'})
    with pytest.raises(RecordingError, match='never overwritten'):
        write_bag(recording, tmp_path / 'bag')
    file = next((tmp_path / 'bag').glob('*.mcap'))
    (tmp_path / 'cut.mcap').write_bytes(file.read_bytes()[:20])
    refused(tmp_path / 'cut.mcap', 'mcap recover')


def test_a_bag_without_messages_and_one_of_strings(tmp_path):
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import get_typestore, Stores

    store = get_typestore(Stores.ROS2_JAZZY)
    for name, kind, count in (('none', 'Float64', 0), ('text', 'String', 20)):
        full = f'std_msgs/msg/{kind}'
        with Writer(tmp_path / name, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
            for topic in ('/u', '/x'):
                connection = writer.add_connection(topic, full, typestore=store)
                for k in range(count):
                    payload = store.serialize_cdr(store.types[full](str(k)), full)
                    writer.write(connection, k * 10**8, payload)
    with pytest.raises(RecordingError, match='no message'):
        read_recording(tmp_path / 'none')
    with pytest.raises(RecordingError, match='std_msgs/msg/String'):
        read_recording(tmp_path / 'text')


def test_nan_in_a_bag_is_refused(recording, tmp_path):
    values = arrivals(recording, recording.time)
    from valve_sim_ros.recordings.recording import refuse_not_finite

    spoilt = values['x'].values.copy()
    spoilt[3] = np.nan
    with pytest.raises(RecordingError, match='NaN or infinite'):
        refuse_not_finite('x', spoilt, recording.time)


@pytest.mark.parametrize('clock', ['t', 'time', '__time', 'time [s]'])
def test_the_column_of_times_may_be_called_so(tmp_path, clock):
    (tmp_path / 'own.csv').write_text(f'u,x,{clock}\n10,11,100\n20,21,100.5\n')
    found = read_recording(tmp_path / 'own.csv')
    np.testing.assert_array_equal(found.time, [0.0, 0.5])
    assert found.provenance.time_source == f'column {clock.split()[0]}'


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('', 'empty'),
        ('u,x\n0,1\n', "no column 't'"),
        ('t,u,x\n', 'without samples'),
        ('t,x\n0,1\n', "no column 'u'"),
        ('t,u,x\n0,1,2\n1,a,2\n', 'line 3'),
        ('t,u,x\n0,1,2\n1,1\n', 'line 3'),
        ('t,u,x\n0,1,2\n0,1,2\n', 'does not increase'),
        ('t,u,x\n0,1,nan\n1,1,2\n', 'NaN'),
    ],
)
def test_bad_csv(tmp_path, text, words):
    (tmp_path / 'bad.csv').write_text(text)
    with pytest.raises(RecordingError, match=words):
        read_recording(tmp_path / 'bad.csv')
