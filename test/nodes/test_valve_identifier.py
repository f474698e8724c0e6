# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The identifier node on the real middleware: latched result, service, refusals, exit codes."""

import json
import os
from pathlib import Path
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import Float64, Float64MultiArray, String
from std_srvs.srv import Trigger

from valve_sim_ros import identify, simulate
from valve_sim_ros.model.parameter_file import read_parameters
from valve_sim_ros.nodes.valve_identifier import LATCHED, ValveIdentifier
from valve_sim_ros.recordings.bags import write_bag
from valve_sim_ros.recordings.recording import Recording

pytestmark = pytest.mark.ros
NAMES = 'f_d1,T_g1,T_g2,f_s,f_d,a_1,a_2'
CONFIG = Path(__file__).parents[2] / 'config' / 'valve_identifier.yaml'


@pytest.fixture(scope='module')
def bag(tmp_path_factory):
    levels = np.random.default_rng(1).uniform(10.0, 90.0, 40)
    run = simulate(np.repeat(levels, 15))
    path = tmp_path_factory.mktemp('bags') / 'rich'
    write_bag(Recording(run.t, run.u, run.p1, run.p2, run.x), path)
    return path


@pytest.fixture
def context():
    rclpy.init()
    yield
    rclpy.try_shutdown()


@pytest.fixture
def spun(context):
    """Return a function that makes the identifier, a client node and what spins both."""
    executor, nodes = SingleThreadedExecutor(), []

    def make(**parameters):
        given = [Parameter(name, value=value) for name, value in parameters.items()]
        nodes.append(ValveIdentifier(parameter_overrides=given))
        nodes.append(Node('late'))
        for node in nodes:
            executor.add_node(node)
        return nodes[1], executor

    yield make
    executor.shutdown()
    for node in nodes:
        node.destroy_node()


def spin_until(executor, done, limit=30.0):
    end = time.monotonic() + limit
    while not done():
        assert time.monotonic() < end, 'nothing came in time'
        executor.spin_once(timeout_sec=0.1)


def call(client_node, executor):
    client = client_node.create_client(Trigger, '/valve_identifier/identify')
    spin_until(executor, client.service_is_ready)
    answer = client.call_async(Trigger.Request())
    spin_until(executor, answer.done, 90.0)
    return answer.result()


def command(*words):
    return [sys.executable, '-m', 'valve_sim_ros.nodes.valve_identifier', *map(str, words)]


def test_late_subscriber_gets_what_identify_returns(spun, bag, tmp_path):
    late, executor = spun(bags=[str(bag)], output_directory=str(tmp_path), hold_out=False)
    got = {}
    for name, kind in (('parameters', Float64MultiArray), ('eta', Float64), ('result', String)):
        topic = f'/valve_identifier/{name}'
        late.create_subscription(kind, topic, lambda m, n=name: got.update({n: m}), LATCHED)
    spin_until(executor, lambda: len(got) == 3)
    expected = identify(bag, hold_out=False)
    assert got['parameters'].layout.dim[0].label == NAMES
    assert list(got['parameters'].data) == [expected.spec.values[n] for n in NAMES.split(',')]
    assert got['eta'].data == expected.eta
    assert json.loads(got['result'].data) == expected.as_json()
    assert dict(read_parameters(tmp_path / 'fitted.yaml').values) == dict(expected.spec.values)
    assert expected.eta > 99.99


def test_service_identifies_on_demand(spun, bag):
    late, executor = spun(bags=[str(bag)], hold_out=False, identify_at_start=False)
    answer = call(late, executor)
    assert answer.success, answer.message
    assert answer.message.startswith('eta = ')


@pytest.mark.parametrize(
    ('parameters', 'reason'),
    [
        ({}, 'no bag'),
        ({'bags': ['no_such_bag']}, 'no such bag'),
        ({'bags': ['a'], 'topics': ['position']}, 'expected SIGNAL=TOPIC'),
    ],
)
def test_service_refuses_with_the_reason(spun, parameters, reason):
    late, executor = spun(identify_at_start=False, **parameters)
    answer = call(late, executor)
    assert not answer.success
    assert reason in answer.message


@pytest.mark.parametrize(
    ('words', 'reason'),
    [
        (('no_such_bag', '--once'), 'no such bag'),
        (('--once',), 'no bag'),
        (('--twice',), 'unknown option'),
        (('no_such_bag', '--ros-args', '-p', 'seed:=-1'), 'refused'),
    ],
)
def test_bad_command_line_ends_with_one_sentence(words, reason):
    ended = subprocess.run(command(*words), capture_output=True, text=True, timeout=60)
    assert ended.returncode == 1
    assert reason in ended.stderr
    assert 'Traceback' not in ended.stderr


def test_once_writes_and_ends(bag, tmp_path):
    words = (bag, '--once', '--ros-args', '--params-file', CONFIG)
    words += ('-p', f'output_directory:={tmp_path}', '-p', 'hold_out:=false')
    ended = subprocess.run(command(*words), capture_output=True, text=True, timeout=120)
    assert ended.returncode == 0, ended.stderr
    assert read_parameters(tmp_path / 'fitted.yaml').values['f_s'] > 0.0


@pytest.mark.parametrize('sent', [signal.SIGINT, signal.SIGTERM])
def test_waiting_node_ends_cleanly(context, sent):
    watcher = Node('watcher')
    process = subprocess.Popen(command(), stderr=subprocess.PIPE, text=True, env=dict(os.environ))
    try:
        client = watcher.create_client(Trigger, '/valve_identifier/identify')
        assert client.wait_for_service(timeout_sec=30.0)
        time.sleep(0.3)  # the service is seen a moment before the node spins
        process.send_signal(sent)
        _, errors = process.communicate(timeout=15)
    finally:
        process.kill()
        watcher.destroy_node()
    assert process.returncode == 0, errors
    assert 'Traceback' not in errors
