# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The plant node on the real middleware."""

import math
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64

from valve_sim_ros import identify, Recording, simulate, Valve
from valve_sim_ros.nodes.spinning import new_executor
from valve_sim_ros.nodes.valve_plant import ValvePlant

pytestmark = pytest.mark.ros


class Peer(Node):
    """Sends commands and keeps what the plant publishes."""

    def __init__(self):
        super().__init__('peer')
        self.u = self.create_publisher(Float64, 'u', 10)
        self.heard = {name: [] for name in ('p1', 'p2', 'x')}
        for name, values in self.heard.items():
            self.create_subscription(
                Float64, name, lambda m, values=values: values.append(m.data), 1000
            )


@pytest.fixture(name='ros')
def _ros():
    rclpy.init()
    nodes, executor = [], new_executor()

    def add(node):
        nodes.append(node)
        executor.add_node(node)
        return node

    def until(condition, limit=20.0):
        end = time.monotonic() + limit
        while not condition():
            assert time.monotonic() < end, 'timed out'
            executor.spin_once(timeout_sec=0.05)

    yield add, until
    executor.shutdown()
    for node in nodes:
        node.destroy_node()
    rclpy.try_shutdown()


def overrides(**values):
    return [Parameter(name, value=value) for name, value in values.items()]


def connected(plant, peer):
    return lambda: (
        peer.u.get_subscription_count()
        and all(plant.count_subscribers(name) for name in ('p1', 'p2', 'x'))
    )


def test_topics_equal_the_offline_pipeline(ros):
    add, until = ros
    plant = add(ValvePlant(parameter_overrides=overrides(sample_time=60.0)))  # stepped by hand
    peer = add(Peer())
    until(connected(plant, peer))
    u = np.repeat(np.random.default_rng(2).uniform(0.0, 100.0, 25), 8)
    for k, command in enumerate(u):
        if command != plant.command:
            peer.u.publish(Float64(data=float(command)))
            until(lambda command=command: plant.command == command)
        plant.step()
        until(lambda k=k: all(len(values) == k + 1 for values in peer.heard.values()))
    expected = simulate(u, sample_time=60.0)
    for name, values in peer.heard.items():
        np.testing.assert_allclose(values, getattr(expected, name), rtol=0, atol=1e-9)


def test_plant_to_recording_to_plant(ros):
    add, until = ros
    Valve(background=False)
    truth = {'f_d1': 2.0, 'T_g1': 0.5, 'T_g2': 1.0, 'f_s': 6.0, 'f_d': 3.0}
    plant = add(ValvePlant(parameter_overrides=overrides(sample_time=0.02, **truth)))
    peer = add(Peer())
    until(connected(plant, peer))
    for values in peer.heard.values():
        values.clear()
    levels, used = np.random.default_rng(4).uniform(5.0, 95.0, 12).tolist(), []
    step = plant.step
    plant.step = lambda: (used.append(plant.command), step())
    for level in levels:
        peer.u.publish(Float64(data=level))
        goal = len(used) + 40
        until(lambda goal=goal: len(used) >= goal)
    count = len(used)
    until(lambda: all(len(values) >= count for values in peer.heard.values()))
    heard = {
        name: np.array(values[-count:] if len(values) == count else values[:count])
        for name, values in peer.heard.items()
    }
    result = identify(Recording(np.arange(count) * 0.02, used, **heard), hold_out=False)
    for name, true in truth.items():
        assert result.spec.values[name] == pytest.approx(true, rel=0.02), name
    results = plant.set_parameters_atomically(
        overrides(**{name: result.spec.values[name] for name in truth})
    )
    assert results.successful
    assert plant._valve.spec.values['f_s'] == result.spec.values['f_s']


def test_parameters_are_checked_before_they_are_used(ros):
    add, _ = ros
    plant = add(ValvePlant())
    for name, value in (
        ('f_s', math.nan), ('f_s', math.inf), ('f_s', 'wide'), ('f_s', 1.0), ('T_g1', -3.0),
        ('branch', 'euler'), ('sample_time', 1.0), ('f_s', True),
    ):  # fmt: skip
        before = plant.get_parameter(name).value
        (result,) = plant.set_parameters(overrides(**{name: value}))
        assert not result.successful, (name, value)
        assert result.reason
        assert plant.get_parameter(name).value == before
    (result,) = plant.set_parameters(overrides(f_s=12))  # an integer for a float
    assert result.successful
    assert plant._valve.spec.values['f_s'] == 12.0
    assert plant.set_parameters_atomically(overrides(f_s=2.0, f_d=1.0)).successful
    assert plant._valve.spec.values['f_d'] == 1.0


def test_bad_commands_are_refused_or_clamped(ros):
    add, until = ros
    plant, peer = add(ValvePlant()), add(Peer())
    until(connected(plant, peer))
    peer.u.publish(Float64(data=40.0))
    until(lambda: plant.command == 40.0)
    for bad in (math.nan, math.inf, -math.inf):
        peer.u.publish(Float64(data=bad))
    until(lambda: plant.refused_commands == 3)
    assert plant.command == 40.0
    peer.u.publish(Float64(data=140.0))
    until(lambda: plant.clamped_commands == 1)
    assert plant.command == 100.0


def run_plant(*arguments):
    return subprocess.Popen(
        [sys.executable, '-m', 'valve_sim_ros.nodes.valve_plant', *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={k: v for k, v in os.environ.items() if k != '_ROS_WHEELS_BOOTSTRAP_COMPLETE'},
    )


@pytest.mark.parametrize('number', [signal.SIGINT, signal.SIGTERM])
def test_ends_silently_under_a_namespace_with_a_file(ros, tmp_path, number):
    add, until = ros
    peer = add(Node('peer', namespace='/plant_7'))
    heard = []
    peer.create_subscription(Float64, 'p1', lambda m: heard.append(m.data), 10)
    file = tmp_path / 'valve.yaml'
    file.write_text(
        '/**:\n  ros__parameters:\n    f_d1: 5\n    initial_command: 50.0\n'
        '    sample_time: 1.0\n'  # so long that a busy machine misses no period, and warns of none
    )
    process = run_plant('--ros-args', '-r', '__ns:=/plant_7', '--params-file', str(file))
    try:
        until(lambda: heard)
        assert heard[-1] == 45.0
        process.send_signal(number)
        out, err = process.communicate(timeout=20)
    finally:
        process.kill()
    assert (process.returncode, out, err) == (0, '', '')


@pytest.mark.parametrize(
    ('setting', 'words'),
    [('f_s:=wide', 'f_s'), ('fs:=3.0', 'did you mean f_s'), ('f_d:=50.0', 'exceeds')],
)
def test_a_bad_start_ends_with_a_sentence(setting, words):
    process = run_plant('--ros-args', '-p', setting)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 1
    assert words in err
    assert 'Traceback' not in err
