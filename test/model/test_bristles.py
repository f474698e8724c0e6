# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A stem on bristles against a solver that knows nothing of it."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from valve_sim_ros.model.bristles import Bent, Bristles, rates, slopes, through
from valve_sim_ros.model.stem import Friction

FRICTION = Friction(5.0, 6.0, 3.0, 4.0, 1.0)
LUGRE = Bristles(900.0, 40.0, 5.0, 0.15, 0.3, 0.0, FRICTION)
ELASTOPLASTIC = Bristles(900.0, 40.0, 5.0, 0.15, 0.3, 0.6, FRICTION)
laws = pytest.mark.parametrize('law', [LUGRE, ELASTOPLASTIC], ids=['lugre', 'elastoplastic'])


@laws
@pytest.mark.parametrize('target', [58.0, 54.0, 30.0])
def test_a_stem_moves_as_a_stiff_solver_says(law, target):
    excess, rate, period = 50.0 - target, 0.5, 0.2
    there = np.arange(1, 51) * period
    wanted = solve_ivp(
        lambda t, y: (y[1], *rates(target + excess * math.exp(-rate * t), Bent(*y), law)),
        (0.0, there[-1]),
        (50.0, 0.0, 0.0),
        'Radau',
        there,
        rtol=1e-8,
        atol=1e-9,
        max_step=0.05,
    ).y[0]
    bent, memory, found = Bent(50.0, 0.0, 0.0), np.full(2, np.nan), []
    for _ in there:
        bent = through(bent, target, excess, rate, period, law, memory)
        excess *= math.exp(-rate * period)
        found.append(bent.x)
    assert np.ptp(wanted) > 0.5
    assert np.allclose(found, wanted, atol=2e-3)


@laws
@pytest.mark.parametrize('v', [-0.4, 0.05, 0.5, 3.0])
@pytest.mark.parametrize('z', [-0.9, -0.3, 0.5, 0.7])
def test_derivatives_are_those_of_the_rates(law, v, z):
    def differences(**step):
        bent = Bent(50.0, v, z)
        (before, after) = (
            rates(55.0, bent._replace(**{k: getattr(bent, k) + s for k in step}), law)
            for s in (-1e-6, 1e-6)
        )
        return (np.array(after) - before) / 2e-6

    found = slopes(Bent(50.0, v, z), law)
    assert np.allclose([found.a_v, found.z_v], differences(v=1), rtol=1e-4, atol=1e-3)
    assert np.allclose([found.a_z, found.z_z], differences(z=1), rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize('elastic', [0.0, 0.95])
@pytest.mark.parametrize('drop_speed', [0.005, 0.1, 20.0])
@pytest.mark.parametrize('stem', [(2000.0, 150.0), (2000.0, 1.0), (100.0, 150.0), (1.0, 20.0)])
def test_a_stem_that_next_to_nothing_holds_does_not_run_away(stem, drop_speed, elastic):
    free = Bristles(
        *stem, 200.0, 0.4 / stem[0] ** 0.5, drop_speed, elastic, Friction(5, 5, 0, 0, 1)
    )
    rng = np.random.default_rng(3)
    bent, memory, p2, period = Bent(50.0, 0.0, 0.0), np.full(2, np.nan), 50.0, 0.2
    for target in np.repeat(rng.uniform(20.0, 80.0, 12), 30):
        excess = p2 - target
        bent = through(bent, target, excess, 0.3, period, free, memory)
        p2 = target + excess * math.exp(-0.3 * period)
        assert abs(bent.x - 50.0) < 80.0
