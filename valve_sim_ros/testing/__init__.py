# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""For the tests of other packages: a lockstep valve in the test's own process, over real DDS.

In a test module, or with ``from valve_sim_ros.testing import lockstep_valve`` in a conftest.py::

    pytest_plugins = 'valve_sim_ros.testing.fixtures'

    def test_my_controller(lockstep_valve):
        valve = lockstep_valve({'f_s': 9.0}, sample_time=0.1)
        run = valve.drive(MyController(), samples=500)
        assert abs(run.x[-1] - 50.0) < 1.0
"""

from .fixtures import lockstep_valve
from .isolation import reserve_domain
from .lockstep_valve import LockstepValve, Sample

__all__ = ['LockstepValve', 'Sample', 'lockstep_valve', 'reserve_domain']
