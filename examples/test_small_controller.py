# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How to test a controller against a valve: over DDS, in lockstep, in milliseconds.

No launch file, no sleep, no tolerance for a slow machine: a run gives the same numbers everywhere.
"""

import numpy as np
import pytest
from small_controller import SAMPLE_TIME, SmallController

pytest_plugins = 'valve_sim_ros.testing.fixtures'

MINUTE = round(60 / SAMPLE_TIME)


def test_reaches_the_set_point(lockstep_valve):
    valve = lockstep_valve(sample_time=SAMPLE_TIME)
    run = valve.drive(SmallController(setpoint=50.0), samples=15 * MINUTE)
    assert np.abs(run.x[-3 * MINUTE :] - 50.0).max() < 12.0
    assert np.ptp(run.u[-MINUTE:]) < 10.0


def test_sticky_valve_moves_in_jumps(lockstep_valve):
    sticky = {'f_s': 20.0, 'f_d': 5.0}
    run = lockstep_valve(sticky, SAMPLE_TIME).drive(SmallController(50.0), samples=15 * MINUTE)
    assert np.abs(np.diff(run.x)).max() > 5.0


def test_leaking_actuator_needs_more_command(lockstep_valve):
    commands = []
    for leak in ({}, {'effects': ['air_leak'], 'air_leak.leak_rate': 0.02}):
        valve = lockstep_valve(leak, SAMPLE_TIME, initial_x=40.0, initial_p1=40.0, initial_p2=40.0)
        run = valve.drive(SmallController(50.0), samples=10 * MINUTE)
        valve.close()
        commands.append(run.u[-1])
    assert commands[1] > commands[0] + 3.0


def test_two_runs_are_equal_to_the_last_bit(lockstep_valve):
    runs = []
    for _ in range(2):
        valve = lockstep_valve(sample_time=SAMPLE_TIME)
        runs.append(valve.drive(SmallController(40.0), samples=2 * MINUTE))
        valve.close()
    assert runs[0].x.tobytes() == runs[1].x.tobytes()


@pytest.mark.parametrize('u', [-20.0, 250.0])
def test_single_steps(lockstep_valve, u):
    sample = lockstep_valve().step(u)
    assert sample.u == min(max(u, 0.0), 100.0)
