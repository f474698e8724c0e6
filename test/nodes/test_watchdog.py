# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A command that grows old, diagnostics, QoS, namespaces, live changes."""

import math

from conftest import overrides
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import pytest
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, Float64MultiArray

from valve_sim_ros.model.parameter_file import NODE_ONLY
from valve_sim_ros.nodes.messages import LOSSLESS
from valve_sim_ros.nodes.parameters import FIXED, LIVE, OF_ROS
from valve_sim_ros.nodes.watchdog import Watchdog

pytestmark = pytest.mark.ros


@pytest.mark.parametrize(
    ('settings', 'expected'),
    [
        ({'fail_action': 'hold'}, 60.0),
        ({'fail_action': 'vent', 'fail_position': 'closed'}, 0.0),
        ({'fail_action': 'vent', 'fail_position': 'open'}, 100.0),
        ({'fail_action': 'value', 'fail_value': 35.0}, 35.0),
    ],
)
def test_fail_action_at_the_timeout_and_recovery(settings, expected):
    said = []
    given = {'command_timeout': 2.0, 'fail_position': 'closed', 'fail_value': 0.0, **settings}
    watchdog = Watchdog(given, lambda stale, text: said.append(stale))
    watchdog.feed(10.0)
    assert watchdog.command(60.0, 12.0) == 60.0
    assert watchdog.command(60.0, 12.2) == expected
    assert watchdog.command(60.0, 13.0) == expected
    assert said == [True]
    watchdog.feed(14.0)
    assert watchdog.command(61.0, 14.0) == 61.0
    assert said == [True, False]
    given['command_timeout'] = 0.0  # off
    assert watchdog.command(61.0, 1e6) == 61.0


def test_publisher_killed_and_restarted(bench):
    plant = bench.plant(
        sample_time=0.01, command_timeout=0.3, fail_action='value', fail_value=10.0,
        publish_sample=True,
    )  # fmt: skip
    applied = []
    listener = bench.add(Node('listener'))
    listener.create_subscription(
        Float64MultiArray, 'valve_plant/sample', lambda m: applied.append(m.data[1]), LOSSLESS
    )
    bench.until(lambda: applied)
    for level in (70.0, 40.0):
        source = Node('source')
        publisher = source.create_publisher(Float64, 'u', LOSSLESS)
        bench.until(publisher.get_subscription_count)
        publisher.publish(Float64(data=level))
        bench.until(lambda level=level: applied[-1] == level)
        assert not plant.watchdog.stale
        source.destroy_node()
        bench.until(lambda: applied[-1] == 10.0)
        assert plant.watchdog.stale


def test_no_number_is_no_command(lockstep_valve):
    valve = lockstep_valve(sample_time=1.0, command_timeout=3.0, fail_action='vent')
    used = [valve.step(u).u for u in (50.0, math.nan, math.nan, math.nan, math.nan, 50.0)]
    assert used == [50.0, 50.0, 50.0, 50.0, 0.0, 50.0]
    assert valve.plant.refused_commands == 4


def test_ten_thousand_bad_commands(lockstep_valve):
    valve = lockstep_valve(sample_time=0.1)
    valve.step(50.0)
    for k in range(10_000):
        valve.step((math.nan, math.inf, -math.inf, 1e308, -1e308)[k % 5])
    assert valve.plant.samples == 10_001
    assert valve.plant.refused_commands == 6000
    assert valve.plant.clamped_commands == 4000
    assert all(math.isfinite(value) for sample in valve.samples for value in sample)
    assert all(-1.0 <= sample.x <= 101.0 for sample in valve.samples)


def test_diagnostics_say_what_is_wrong(bench):
    plant = bench.plant(
        namespace='/area_3', sample_time=0.05, diagnostics_period=0.1, command_timeout=0.5
    )
    peer = bench.peer(plant)
    reports = []
    peer.create_subscription(
        DiagnosticArray, '/diagnostics', lambda m: reports.append(m.status[0]), 10
    )
    peer.send(50.0)
    bench.until(lambda: plant.command == 50.0)
    bench.until(lambda: reports and 'no command' in reports[-1].message)
    assert reports[-1].level == DiagnosticStatus.WARN
    assert reports[-1].hardware_id == '/area_3/valve_plant'
    assert {'pacing', 'missed periods', 'command age [s]'} <= {v.key for v in reports[-1].values}
    peer.send(500.0)
    bench.until(lambda: plant.clamped_commands)
    bench.until(lambda: any('1 commands clamped' in report.message for report in reports))


@pytest.mark.parametrize('offered', list(ReliabilityPolicy)[1:3])
@pytest.mark.parametrize('wanted', list(ReliabilityPolicy)[1:3])
def test_every_reliability_connects(bench, offered, wanted):
    plant = bench.plant(sample_time=0.02)
    node = bench.add(Node('peer'))
    heard = []
    u = node.create_publisher(Float64, 'u', QoSProfile(depth=1, reliability=offered))
    node.create_subscription(Float64, 'x', heard.append, QoSProfile(depth=1, reliability=wanted))
    bench.until(u.get_subscription_count)

    def arrived():
        u.publish(Float64(data=42.0))
        return plant.command == 42.0 and heard

    bench.until(arrived)


def test_qos_can_be_overridden(bench):
    plant = bench.plant(
        **{
            'qos_overrides./u.subscription.reliability': 'reliable',
            'qos_overrides./x.publisher.reliability': 'best_effort',
        }
    )
    (subscription,) = plant.get_subscriptions_info_by_topic('/u')
    assert subscription.qos_profile.reliability == ReliabilityPolicy.RELIABLE
    (publisher,) = plant.get_publishers_info_by_topic('/x')
    assert publisher.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT


def test_two_namespaces_in_one_process(bench):
    plants = [bench.plant(namespace=f'/valve_{k}', pacing='lockstep') for k in (1, 2)]
    peers = [bench.peer(plant) for plant in plants]
    for peer, u in zip(peers, (30.0, 80.0), strict=True):
        peer.send(u)
    bench.until(lambda: all(peer.heard['p1'] for peer in peers))
    assert [plant.command for plant in plants] == [30.0, 80.0]
    assert [plant.samples for plant in plants] == [1, 1]
    assert peers[0].heard['p1'] != peers[1].heard['p1']


def test_live_changes_apply_together_or_not_at_all(bench):
    plant = bench.plant()
    result = plant.set_parameters_atomically(overrides(f_s=4.0, f_d=3.0, command_timeout=5))
    assert result.successful, result.reason
    assert (plant.spec.values['f_s'], plant.spec.values['f_d']) == (4.0, 3.0)
    result = plant.set_parameters_atomically(overrides(f_s=2.0, fail_value=500.0))
    assert not result.successful
    assert plant.spec.values['f_s'] == 4.0
    for name, value in (('fail_action', 'explode'), ('pacing', 'lockstep'), ('f_d', 5.0)):
        (result,) = plant.set_parameters(overrides(**{name: value}))
        assert not result.successful, name


def test_parameter_files_may_hold_the_nodes_parameters():
    names = {declared.name for declared in (*FIXED, *LIVE)}
    assert names | set(OF_ROS) == NODE_ONLY
