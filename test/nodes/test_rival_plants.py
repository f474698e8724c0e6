# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every rival model behind the plant's topics is the model offline."""

import numpy as np
import pytest

from valve_sim_ros import simulate
from valve_sim_ros.model.rivals import RIVALS

pytestmark = pytest.mark.ros

COMMANDS = [40.0] * 10 + [70.0] * 40 + np.linspace(70.0, 20.0, 50).tolist()


@pytest.mark.parametrize('name', RIVALS)
def test_a_rival_over_topics_equals_the_rival_offline(lockstep_valve, name):
    valve = lockstep_valve({'model': name})
    heard = [valve.step(u).x for u in COMMANDS]
    expected = simulate(COMMANDS, parameters={'model': name}).x
    assert np.ptp(expected) > 5.0
    np.testing.assert_allclose(heard, expected, rtol=0.0, atol=1e-9)
