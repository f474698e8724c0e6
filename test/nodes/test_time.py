# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Which clock drives the valve: wall, /clock, its own /clock, or each command."""

import subprocess
import sys
import time

from conftest import overrides
import numpy as np
import pytest
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.time import Time
from rosgraph_msgs.msg import Clock
from std_srvs.srv import SetBool, Trigger

from valve_sim_ros import ModelError, simulate
from valve_sim_ros.nodes.pacing import Wall
from valve_sim_ros.nodes.valve_plant import ValvePlant

pytestmark = pytest.mark.ros


class Simulator:
    """Publishes /clock and waits until the plant has seen it."""

    def __init__(self, bench, plant):
        self._bench, self._plant = bench, plant
        node = bench.add(Node('simulator'))
        self._clock = node.create_publisher(Clock, '/clock', QoSProfile(depth=10))
        bench.until(self._clock.get_subscription_count)

    def show(self, seconds):
        stamp = Time(nanoseconds=round(seconds * 1e9))
        self._clock.publish(Clock(clock=stamp.to_msg()))
        self._bench.until(lambda: self._plant.get_clock().now().nanoseconds == stamp.nanoseconds)


def test_follows_clock_ten_times_faster_than_the_wall(bench):
    plant = bench.plant(use_sim_time=True, sample_time=0.05)
    clock = Simulator(bench, plant)
    assert plant.samples == 0
    begin = time.monotonic()
    for k in range(201):  # 20 s
        clock.show(100.0 + 0.1 * k)
        if plant.samples == 1:
            begin = time.monotonic()
    assert plant.samples == 401
    assert plant.missed_periods == 0
    assert time.monotonic() - begin < 20.0


def test_waits_for_the_clock(bench):
    plant = bench.plant(use_sim_time=True, sample_time=0.001)
    peer = bench.peer(plant)
    peer.send(30.0)
    bench.until(lambda: plant.command == 30.0)
    assert plant.samples == 0
    Simulator(bench, plant).show(5.0)
    assert plant.samples == 1


def test_backward_jump_restarts_and_forward_gap_is_not_integrated(bench):
    plant = bench.plant(use_sim_time=True, sample_time=0.2, initial_command=50.0)
    peer = bench.peer(plant)
    clock = Simulator(bench, plant)
    for k in range(11):
        clock.show(10.0 + 0.2 * k)
    bench.until(lambda: len(peer.heard['x']) == 11)
    clock.show(4000.0)  # far ahead: one more sample, not twenty thousand
    assert plant.samples == 12
    clock.show(4000.2)
    assert plant.samples == 13
    for k in range(11):  # back, as a bag played in a loop
        clock.show(10.0 + 0.2 * k)
    assert plant.samples == 11
    bench.until(lambda: len(peer.heard['p2']) == 24)
    expected = simulate(np.full(13, 50.0)).p2.tolist()
    assert peer.heard['p2'] == expected + expected[:11]


def test_own_clock_runs_at_the_speed_asked_for(bench):
    plant = bench.plant(pacing='own_clock', speed_factor=20.0, sample_time=0.1)
    follower = bench.add(Node('follower', parameter_overrides=overrides(use_sim_time=True)))
    bench.until(lambda: follower.get_clock().now().nanoseconds > 0)
    begin, seen = time.monotonic(), follower.get_clock().now().nanoseconds
    bench.until(lambda: time.monotonic() > begin + 2.0)
    sim = (follower.get_clock().now().nanoseconds - seen) * 1e-9
    wall = time.monotonic() - begin
    # what the machine could not do is counted, so the sum is known on any machine
    assert sim + 0.1 * plant.missed_periods == pytest.approx(20.0 * wall, abs=5.0)
    assert sim <= 20.0 * wall + 5.0


@pytest.mark.parametrize(
    ('parameters', 'words'),
    [
        ({'pacing': 'own_clock', 'speed_factor': 0.0}, 'speed_factor'),
        ({'pacing': 'own_clock', 'speed_factor': -1.0}, 'speed_factor'),
        ({'pacing': 'own_clock', 'use_sim_time': True}, 'two clocks'),
        ({'pacing': 'wall', 'use_sim_time': True}, 'two clocks'),
        ({'pacing': 'sim_time'}, 'two clocks'),
        ({'speed_factor': 2.0}, 'only own_clock'),
        ({'pacing': 'fast'}, 'expected one of'),
    ],
)
def test_contradictions_are_refused(bench, parameters, words):
    with pytest.raises(Exception, match=words) as refusal:
        ValvePlant(parameter_overrides=overrides(**parameters))
    assert isinstance(refusal.value, ModelError) or 'InvalidParameter' in refusal.typename


def test_the_clock_cannot_be_swapped_while_it_runs(bench):
    plant = bench.plant()
    (result,) = plant.set_parameters(overrides(use_sim_time=True))
    assert not result.successful


def commands(count=2000):
    return np.random.default_rng(3).uniform(-5.0, 105.0, count).tolist()


def test_lockstep_takes_one_sample_per_command(lockstep_valve):
    valve = lockstep_valve({'f_s': 9.0}, sample_time=0.1)
    for u in commands(200):
        valve.step(u)
    u = np.clip(commands(200), 0.0, 100.0)
    expected = simulate(u, sample_time=0.1, parameters={'f_s': 9.0})
    assert valve.plant.samples == len(valve.samples) == 200
    assert [sample.u for sample in valve.samples] == u.tolist()
    np.testing.assert_allclose([s.x for s in valve.samples], expected.x, rtol=0, atol=1e-12)
    np.testing.assert_allclose([s.t for s in valve.samples], expected.t, rtol=0, atol=1e-12)


def test_lockstep_is_equal_to_the_byte_under_load(lockstep_valve):
    def run():
        valve = lockstep_valve(sample_time=0.05)
        for u in commands():
            valve.step(u)
        return np.array(valve.samples).tobytes()

    quiet = run()
    load = [subprocess.Popen([sys.executable, '-c', 'while True: pass']) for _ in range(3)]
    try:
        loaded = run()
    finally:
        for process in load:
            process.kill()
            process.wait()
    assert quiet == loaded


def test_burst_of_commands_in_lockstep_loses_none(bench):
    plant = bench.plant(pacing='lockstep')
    peer = bench.peer(plant)
    for u in commands(500):
        peer.send(u)
    bench.until(lambda: len(peer.heard['x']) == 500)
    assert plant.samples == 500


def test_pause_step_reset(bench):
    plant = bench.plant(initial_command=80.0, initial_x=20.0, initial_p2=22.0, sample_time=0.02)
    peer = bench.peer(plant)
    answer = bench.call(Trigger, '/valve_plant/step')
    assert not answer.success
    assert 'pause' in answer.message
    bench.until(lambda: plant.samples > 5)
    assert bench.call(SetBool, '/valve_plant/pause', data=True).success
    held = plant.samples
    for _ in range(3):
        assert bench.call(Trigger, '/valve_plant/step').success
    assert plant.samples == held + 3
    assert bench.call(Trigger, '/valve_plant/reset').success
    for values in peer.heard.values():
        values.clear()
    plant.set_parameters(overrides(initial_x=70.0))  # for the next reset
    assert bench.call(Trigger, '/valve_plant/step').success
    bench.until(lambda: peer.heard['x'])
    assert peer.heard['p1'] == pytest.approx([80.0 - 1.7647])
    assert peer.heard['x'] == pytest.approx([20.0])
    assert bench.call(Trigger, '/valve_plant/reset').success
    assert bench.call(Trigger, '/valve_plant/step').success
    bench.until(lambda: len(peer.heard['x']) == 2)
    assert peer.heard['x'][1] == pytest.approx(70.0)
    assert bench.call(SetBool, '/valve_plant/pause', data=False).success
    bench.until(lambda: plant.samples > 10)


@pytest.mark.parametrize(
    ('period', 'ticks', 'late', 'missed'),
    [
        # the period in which each tick runs; at 5 Hz two are made up for: 10, 11 never come
        (0.2, [5, 6, 8, 8, 9, 13, 14], 2, 2),
        # at 2 kHz 400 are, 40 of them before anybody else gets a turn: 9 to 108 never come
        (0.0005, [5, 6, 8, *[508] * 10, 509], 1 + 399, 100),
    ],
)
def test_short_lateness_is_caught_up_and_long_one_counted(
    bench, monkeypatch, period, ticks, late, missed
):
    taken = []
    wall = Wall(bench.add(Node('ticks')), period, lambda: taken.append(1))
    monkeypatch.setattr(wall._node, 'create_timer', lambda *given, **named: None)
    wall.start(lambda back: None)
    periods = iter(ticks)
    monkeypatch.setattr(wall, '_index', lambda: next(periods))
    for _ in ticks:
        wall._tick()
    assert len(taken) + missed == ticks[-1] - ticks[0] + 1
    assert (wall.late_samples, wall.missed_periods) == (late, missed)
