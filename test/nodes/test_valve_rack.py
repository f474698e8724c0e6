# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Several valves in one process: each in its namespace, each with its own command and values."""

import pytest
import rclpy

from valve_sim_ros import ModelError, simulate
from valve_sim_ros.nodes.valve_rack import names, plants

pytestmark = pytest.mark.ros

FILE = """
/**:
  ros__parameters:
    pacing: lockstep
    sample_time: 1.0
    f_d1: 3.0
/unit_a/fv_2/valve_plant:
  ros__parameters:
    f_d1: 9.0
"""


def test_each_valve_answers_its_own_command(bench, tmp_path):
    file = tmp_path / 'rack.yaml'
    file.write_text(FILE)
    rclpy.try_shutdown()
    rclpy.init(args=['--ros-args', '--params-file', str(file)])
    bench.renew()
    made = [bench.add(plant) for plant in plants(['fv_1', 'unit_a/fv_2'])]
    peers = [bench.peer(plant) for plant in made]
    commands = ([50.0, 10.0, 60.0], [20.0, 90.0, 15.0])
    for k in range(3):
        for peer, own in zip(peers, commands, strict=True):
            peer.send(own[k])
    bench.until(lambda: all(len(heard) == 3 for peer in peers for heard in peer.heard.values()))
    for peer, own, f_d1 in zip(peers, commands, (3.0, 9.0), strict=True):
        expected = simulate(own, sample_time=1.0, parameters={'f_d1': f_d1})
        for name, heard in peer.heard.items():
            assert heard == getattr(expected, name).tolist()


def test_a_number_makes_that_many_names():
    assert names(['3']) == ['valve_1', 'valve_2', 'valve_3']


@pytest.mark.parametrize('words', [[], ['0'], ['a', 'a'], ['a b'], ['2', 'a'], ['a/']])
def test_wrong_names_are_refused(words):
    with pytest.raises(ModelError, match='expected valve_rack'):
        names(words)
