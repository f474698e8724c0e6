# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The signal player sends what the file says, in time, and ends."""

from contextlib import suppress
import time

from conftest import overrides
import pytest
import rclpy
from rclpy.executors import ExternalShutdownException
from std_msgs.msg import Float64

from valve_sim_ros import RecordingError
from valve_sim_ros.nodes.signal_player import SignalPlayer

pytestmark = pytest.mark.ros


def player(path):
    return SignalPlayer(parameter_overrides=overrides(file=str(path)))


def test_it_plays_the_file_once_somebody_listens_and_ends(bench, tmp_path):
    levels = [10.0, 20.0, 35.5, 0.0, 100.0, 50.0]
    rows = '\n'.join(f'{0.05 * k},{u}' for k, u in enumerate(levels))
    (tmp_path / 'signal.csv').write_text(f't,u\n{rows}\n')
    bench.add(player(tmp_path / 'signal.csv'))
    listener = bench.add(rclpy.create_node('listener'))
    heard = []
    listener.create_subscription(Float64, 'u', lambda message: heard.append(message.data), 100)
    end = time.monotonic() + 20.0
    with suppress(ExternalShutdownException):
        while rclpy.ok() and time.monotonic() < end:
            bench.executor.spin_once(timeout_sec=0.05)
    assert not rclpy.ok()
    # a busy machine may skip commands, it never invents or reorders them
    assert heard == [u for u in levels if u in heard]
    assert heard[-1] == levels[-1]
    assert len(heard) >= 2


@pytest.mark.parametrize(
    ('text', 'words'),
    [(None, 'no file to play'), ('', 'no such'), ('t,x\n0,1\n', "no column 'u'")],
)
def test_what_cannot_be_played_is_refused_with_a_sentence(bench, tmp_path, text, words):
    path = tmp_path / 'signal.csv'
    if text:
        path.write_text(text)
    with pytest.raises(RecordingError, match=words):
        player('' if text is None else path)
