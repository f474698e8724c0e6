# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands that come just when samples are taken."""

import numpy as np
import pytest

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import diagnose
from valve_sim_ros.recordings.recording import Recording

VALVE = {'f_d1': 0.5, 'T_g1': 8.0, 'T_g2': 30.0, 'f_s': 4.0, 'f_d': 2.4}


def recorded(rng, **effects):
    """Return a record with some steps at the sample after that by which they came, and which."""
    u = np.repeat(rng.uniform(10.0, 90.0, 120), rng.integers(6, 16, 120))
    steps = np.flatnonzero(np.diff(u)) + 1
    early = steps[rng.random(steps.size) < 0.3]
    sent = u.copy()
    sent[early - 1] = u[early]
    used = list({name.split('.')[0] for name in effects})
    run = simulate(sent, 0.5, {**VALVE, 'effects': used, **effects})
    p1 = run.p1.copy()
    p1[early - 1] = p1[early - 2]  # taken a little before the command
    noisy = [each + 0.2 * rng.standard_normal(u.size) for each in (p1, run.p2)]
    return Recording(run.t, u, *noisy), sent, steps


@pytest.mark.parametrize(
    'effect', [{}, {'quick_exhaust.factor': 5.0, 'quick_exhaust.threshold': 9.0}]
)
def test_each_step_is_put_in_its_period_behind_a_slow_chamber(effect):
    record, sent, steps = recorded(np.random.default_rng(11), **effect)
    assert np.mean(record.u[steps - 1] != sent[steps - 1]) > 0.2
    found = diagnose([record])
    assert [named.rung.effect for named in found.effects] == [*{n.split('.')[0] for n in effect}]
    assert found.ladders[1].after.mean_square < 1.0  # noise
    (stretch,) = found.bench.stretches
    large = steps[np.abs(np.diff(record.u)[steps - 1]) > 30.0]
    assert np.mean(stretch.u[large - 1] == sent[large - 1]) > 0.95
