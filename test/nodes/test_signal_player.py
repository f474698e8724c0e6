# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The signal player sends what the file says, in time, and ends."""

import time

import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64

from valve_sim_ros import RecordingError
from valve_sim_ros.nodes.signal_player import SignalPlayer

pytestmark = pytest.mark.ros


@pytest.fixture(name='context')
def _context():
    context = rclpy.Context()
    rclpy.init(context=context)
    yield context
    context.try_shutdown()


def player(context, path):
    given = [Parameter('file', value=str(path))]
    return SignalPlayer(context=context, parameter_overrides=given)


def test_it_plays_the_file_once_somebody_listens_and_ends(context, tmp_path):
    levels = [10.0, 20.0, 35.5, 0.0, 100.0, 50.0]
    rows = '\n'.join(f'{0.05 * k},{u}' for k, u in enumerate(levels))
    (tmp_path / 'signal.csv').write_text(f't,u\n{rows}\n')
    node = player(context, tmp_path / 'signal.csv')
    listener = Node('listener', context=context)
    heard = []
    listener.create_subscription(Float64, 'u', lambda message: heard.append(message.data), 100)
    executor = SingleThreadedExecutor(context=context)
    for each in (node, listener):
        executor.add_node(each)
    end = time.monotonic() + 20.0
    while context.ok() and time.monotonic() < end:
        executor.spin_once(timeout_sec=0.05)
    assert not context.ok()
    executor.shutdown()
    # a busy machine may skip commands, it never invents or reorders them
    assert heard == [u for u in levels if u in heard]
    assert heard[-1] == levels[-1]
    assert len(heard) >= 2
    for each in (node, listener):
        each.destroy_node()


@pytest.mark.parametrize(
    ('text', 'words'),
    [(None, 'no file to play'), ('', 'no such'), ('t,x\n0,1\n', "no column 'u'")],
)
def test_what_cannot_be_played_is_refused_with_a_sentence(context, tmp_path, text, words):
    path = tmp_path / 'signal.csv'
    if text:
        path.write_text(text)
    with pytest.raises(RecordingError, match=words):
        player(context, '' if text is None else path)
