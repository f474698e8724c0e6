# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The controller node with the plant: the same numbers as the law and the valve without ROS."""

import math

from conftest import overrides
import numpy as np
import pytest
from rclpy.node import Node
from std_msgs.msg import Float64

from valve_sim_ros import ModelError, ValveSpec
from valve_sim_ros.experiments.perform import closed_loop
from valve_sim_ros.nodes.messages import LOSSLESS, LOSSLESS_LATCHED
from valve_sim_ros.nodes.pi_controller import PiControllerNode

pytestmark = pytest.mark.ros


def controller(**parameters):
    return PiControllerNode(parameter_overrides=overrides(**parameters))


def test_closed_loop_over_dds_equals_the_loop_without_ros(lockstep_valve):
    valve = lockstep_valve(sample_time=0.2)
    node = controller(
        lockstep=True, sample_time=0.2, setpoints=[40.0, 60.0, 30.0], setpoint_hold=100.0
    )
    result = valve.drive(node, samples=1500, first_command=math.nan)
    loop = closed_loop(np.repeat([40.0, 60.0, 30.0], 500), 0.2, ValveSpec())
    assert result.u.tolist() == loop.u.tolist()
    assert result.x.tolist() == loop.x.tolist()
    assert loop.x.max() > 25.0  # it did move


def test_closed_loop_on_the_wall(bench):
    plant = bench.plant(sample_time=0.02, T_g1=0.2, T_g2=0.4, f_s=1.0, f_d=0.5)
    bench.add(controller(sample_time=0.02, gain=1.0, integral_time=0.5, setpoints=[50.0]))
    peer = bench.peer(plant)
    bench.until(lambda: peer.heard['x'] and abs(peer.heard['x'][-1] - 50.0) < 5.0)


def test_set_point_by_topic_manual_and_back_without_a_bump(bench):
    node = bench.add(controller(lockstep=True, sample_time=0.2, setpoints=[50]))
    heard, peer = [], bench.add(Node('peer'))
    peer.create_subscription(Float64, 'u', lambda m: heard.append(m.data), LOSSLESS)
    topics = {
        name: peer.create_publisher(Float64, name, LOSSLESS_LATCHED)
        for name in ('x', 'setpoint', 'manual')
    }
    bench.until(lambda: all(p.get_subscription_count() for p in topics.values()))
    bench.until(lambda: heard)  # the first command comes by itself

    def answer(x):
        count = len(heard)
        topics['x'].publish(Float64(data=x))
        bench.until(lambda: len(heard) == count + 1)
        return heard[-1]

    before = [answer(20.0) for _ in range(3)][-1]
    node.set_parameters(overrides(automatic=False))
    assert answer(20.0) == before  # by hand begins where control ended
    topics['manual'].publish(Float64(data=66.0))
    bench.until(lambda: node._manual == 66.0)
    assert answer(20.0) == 66.0
    node.set_parameters(overrides(automatic=True))
    assert answer(20.0) == pytest.approx(66.0)
    node.set_parameters(overrides(gain=2.0))
    assert answer(20.0) == pytest.approx(66.0, abs=1.0)
    topics['setpoint'].publish(Float64(data=20.0))
    bench.until(lambda: node.setpoint == 20.0)
    assert answer(20.0) < 66.0
    topics['x'].publish(Float64(data=math.nan))
    assert math.isfinite(answer(20.0))


@pytest.mark.parametrize('wrong', [{'gains': 1.0}, {'setpoints': [500.0]}, {'setpoints': 5.0}])
def test_wrong_parameters_are_refused(bench, wrong):
    with pytest.raises(ModelError):
        controller(**wrong)
