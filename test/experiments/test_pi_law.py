# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The PI law: its step response, its limits and its handover."""

from hypothesis import given
from hypothesis import strategies as st
import pytest

from valve_sim_ros import ModelError
from valve_sim_ros.experiments.pi_controller import PiController

LEVEL = st.floats(0.0, 100.0)


def test_constant_error_gives_the_step_response_of_c():
    controller = PiController()
    u = [controller.step(10.0, 0.0) for _ in range(750)]
    assert u[0] == pytest.approx(2.083 * (1 + 0.02 / 15.0))
    assert u[-1] == pytest.approx(2 * 2.083)  # after one integral time


def test_the_integral_does_not_wind_up():
    controller = PiController(gain=2.0)
    for _ in range(5000):
        assert controller.step(100.0, 0.0) == 100.0
    assert controller.step(50.0, 60.0) < 100.0
    assert controller.integral <= 100.0


@given(LEVEL, LEVEL, LEVEL)
def test_taking_over_makes_no_bump(command, setpoint, measurement):
    controller = PiController()
    controller.track(command, setpoint, measurement)
    assert controller.step(setpoint, measurement) == pytest.approx(command, abs=1e-9)


@given(st.lists(st.tuples(LEVEL, LEVEL), max_size=50), st.floats(-5.0, 5.0))
def test_the_command_stays_within_its_limits(samples, gain):
    controller = PiController(gain=gain, low=10.0, high=90.0)
    assert all(10.0 <= controller.step(*sample) <= 90.0 for sample in samples)


@pytest.mark.parametrize(
    'settings', [{'integral_time': 0.0}, {'gain': float('nan')}, {'low': 60.0, 'high': 40.0}]
)
def test_impossible_settings_are_refused(settings):
    with pytest.raises(ModelError):
        PiController(**settings)
