# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Golden numbers and limits of the physical friction models."""

import math

import numpy as np
import pytest

from valve_sim_ros import ModelError, simulate, Valve, ValveSpec
from valve_sim_ros.model import kernels
from valve_sim_ros.model.rivals import lugre, rival, RIVALS, seven_parameter

PHYSICAL = [name for name, model in RIVALS.items() if not model.data_driven]
STEP = np.repeat([0.0, 50.0], [45, 280])


def drive(name, signal, values=None, **options):
    return rival(name).drive(signal, values, **options)


def stairs(n=600, seed=3):
    u = np.repeat(np.random.default_rng(seed).uniform(0.0, 100.0, n // 40), 40)
    u[:40] = 0.0
    return u


def test_there_are_eleven():
    assert len(RIVALS) == 11
    assert len(PHYSICAL) == 4
    for model in RIVALS.values():
        assert model.confirmed or model.reconstructed
        assert set(model.held) < set(model.defaults)
        levels = model.from_friction(9.0, 5.0)
        assert set(levels) <= set(model.free)
        start = model.start(30.0, 40.0, 50.0, model.theta(model.defaults))
        assert start[:3].tolist() == [30.0, 40.0, 50.0]


def test_an_unknown_model_is_refused():
    with pytest.raises(ModelError, match='kano'):
        rival('cano')


def test_classical_is_the_base_valve_without_a_dead_zone():
    u = stairs()
    base = simulate(u, parameters={'delta': 0.0})
    np.testing.assert_allclose(drive('classical', u, channel='u'), base.x, atol=1e-9)


def test_classical_lags_a_ramp_by_friction_and_damping():
    p = np.concatenate([np.arange(0.0, 60.0, 0.01), np.arange(60.0, 0.0, -0.01)])
    x = drive('classical', p, sample_time=0.01)
    # a pressure that is held over each sample leads its ramp by half a sample, 0.005 %
    assert x[4000] - p[4000] == pytest.approx(-5.3482 + 0.005, abs=2e-4)
    assert x[9000] - p[9000] == pytest.approx(5.3482 - 0.005, abs=2e-4)


def test_karnopp_of_table_1_jumps_twice():
    p2 = simulate(STEP).p2
    x = drive('karnopp', STEP, {'f_d1': 1.7647}, channel='u')
    moves = np.flatnonzero(np.diff(x) > 1.0) + 1
    # breaks at 18.637 s and 28.117 s, so the samples at 18.8 s and 28.2 s show it
    assert (0.2 * moves).tolist() == pytest.approx([18.8, 28.2])
    assert x[moves] == pytest.approx([10.666, 21.312], abs=2e-3)
    assert x[-1] == x[moves[-1]]
    measured = drive('karnopp', p2)  # held between samples, as a recording is
    assert (np.diff(measured) > 1.0).sum() == 2


def test_karnopp_with_the_corrected_coefficient_is_smooth():
    corrected = rival('karnopp').preset('corrected')
    zeta = corrected['a_2'] / (2.0 * math.sqrt(corrected['a_1']))
    assert zeta == pytest.approx(1.147, abs=1e-3)
    x = drive('karnopp', STEP, corrected, channel='u')
    once = np.flatnonzero(np.diff(x) > 1e-9)
    assert 4.0 < x[once[0] + 1] < 6.0
    assert (np.diff(once) == 1).all()


def test_karnopp_of_table_1_as_printed():
    values = rival('karnopp').preset('table_1')
    expected = {'f_s': 32.0210, 'f_d': 26.6779, 'a_1': 38602.94, 'a_2': 1.169118}
    assert {name: values[name] for name in expected} == pytest.approx(expected, rel=1e-5)
    assert values['delta'] == pytest.approx(0.0984, abs=1e-4)
    with pytest.raises(ModelError, match='table_1'):
        rival('karnopp').preset('table_2')


@pytest.mark.parametrize('name', ['classical', 'karnopp'])
def test_a_vanishing_stribeck_speed_changes_little(name):
    u = stairs()
    values = {'f_s': 8.7978, 'f_d': 5.2602, 'a_1': 2000.0, 'a_2': 176.0}
    plain = drive(name, u, values, channel='u')
    fast = drive(name, u, {**values, 'v_s': 1e-6}, channel='u')
    assert np.abs(fast - plain).max() < 0.5
    assert np.abs(fast - plain).mean() < 0.01


def constants(**values):
    """Return theta of LuGre with the constants of its paper in % of span where k = m = 1."""
    paper = {'f_s': 1.5, 'f_d': 1.0, 'a_1': 1.0, 'a_2': 0.4, 'v_s': 1e-3}
    paper |= {'sigma_0': 1e5, 'sigma_1': math.sqrt(1e5), **values}
    model = rival('lugre')
    return model.theta({**model.defaults, **paper})


@pytest.mark.parametrize(
    ('speed', 'force'), [(1e-3, 1.184340), (5e-3, 1.002000), (0.1, 1.04), (-1e-3, -1.184340)]
)
def test_steady_force_of_lugre(speed, force):
    step = kernels.interpreted(lugre.bristle_step, {})
    theta = constants(a_1=1e-12, a_2=0.4e-12)  # so heavy that the speed stays
    x = z = 0.0
    for _ in range(20000):
        x, v, z = step(1e-4, 0.0, x, speed, z, theta)
    assert v == pytest.approx(speed, rel=1e-6)
    assert 1e5 * z + 0.4 * v == pytest.approx(force, rel=1e-5)


def test_lugre_yields_a_little_before_it_slips_and_shows_a_loop():
    values = dict(zip([p.name for p in rival('lugre').parameters], constants(), strict=True))
    force = np.concatenate([np.linspace(0, 1.425, 500), np.linspace(1.425, 0, 500)])
    x = drive('lugre', force, values, sample_time=0.02)
    # slowly, z' = x' (1 - z/z_s) with z_s = f_s/sigma_0: x = -z_s ln(1 - z/z_s)
    assert x[499] == pytest.approx(-1.5e-5 * math.log(1.0 - 0.95), rel=0.02)
    assert x[-1] > 1e-5
    rising, falling = x[:500], x[500:][::-1]
    assert (falling[50:450] > rising[50:450]).all()


def test_lugre_sticks_and_slips_when_pulled():
    """M = 1, k = 2, pulled at 0.1 per second: a_1 = 2, friction over k."""
    values = {
        'f_s': 0.75, 'f_d': 0.5, 'a_1': 2.0, 'a_2': 0.4, 'v_s': 1e-3,
        'sigma_0': 0.5e5, 'sigma_1': 0.5 * math.sqrt(1e5),
    }  # fmt: skip
    x = drive('lugre', 0.1 * 0.05 * np.arange(1000), values, sample_time=0.05)
    resting = np.diff(x) < 1e-5
    assert np.count_nonzero(resting[:-1] & ~resting[1:]) >= 3  # slips, one after the other
    assert resting.mean() > 0.3


def test_bristles_never_carry_more_than_static_friction():
    model = rival('lugre')
    theta = model.theta(model.defaults)
    state = model.start(0.0, 0.0, 0.0, theta)
    for p in np.random.default_rng(0).uniform(0.0, 100.0, 300):
        model.make('p2').step(p, 0.2, state, theta, math.inf, (), ())
        assert abs(state[lugre.Z]) <= model.defaults['f_s'] / model.defaults['sigma_0'] * (
            1 + 1e-9
        )


def test_stiff_bristles_tend_to_the_classical_model():
    u = np.repeat([0.0, 60.0, 20.0, 80.0, 40.0], 150)
    classical = drive('classical', u, channel='u')
    creep = []
    for stiffness in (1e2, 1e4, 1e6):
        values = {'sigma_0': stiffness, 'sigma_1': math.sqrt(stiffness / 2e3), 'v_s': 1e-3}
        x = drive('lugre', u, values, channel='u')
        assert np.abs(x - classical).mean() < 0.05
        assert x[149::150] == pytest.approx(classical[149::150], abs=0.06)
        creep.append(x[155])  # before the breakaway
    assert creep[0] > creep[1] > creep[2]
    assert creep[2] < 1e-3


def test_seven_parameters_tend_to_the_classical_model():
    u = stairs()
    classical = drive('classical', u, channel='u')
    limit = {'gamma': 0.0, 'tau_L': 0.0, 'v_s': 1e-5, 'k_t': 1e6}
    x = drive('seven_parameter', u, limit, channel='u')
    assert np.abs(x - classical).mean() < 0.02
    assert np.abs(x - classical).max() < 0.5


def test_a_slow_stem_of_seven_parameters_carries_nearly_all_static_friction():
    p = np.arange(0.0, 60.0, 0.02)
    x = drive('seven_parameter', p, {'v_s': 100.0, 'tau_L': 0.0}, sample_time=0.02)
    assert p[-1] - x[-1] == pytest.approx(8.7978 + 0.088 - 0.01, abs=2e-3)


def test_static_friction_of_seven_parameters_rises_with_the_dwell_time():
    excess = kernels.interpreted(seven_parameter.static_excess, {})
    model = rival('seven_parameter')
    theta = model.theta({**model.defaults, 'gamma': 10.0})
    full = 8.7978 - 5.2602
    assert excess(0.0, 1.0, theta) == 1.0
    assert excess(10.0, 1.0, theta) == pytest.approx((1.0 + full) / 2)
    assert excess(seven_parameter.LONG_AGO, 1.0, theta) == pytest.approx(full)


def test_the_lag_of_friction_delays_its_fall():
    """With the lag the friction stays high at first, so the slip is behind."""
    p = np.full(40, 20.0)
    quick, late = (
        drive('seven_parameter', p, {'tau_L': lag, 'v_s': 1.0}, sample_time=0.005)
        for lag in (0.0, 0.02)
    )
    assert (late[2:8] < quick[2:8]).all()


@pytest.mark.parametrize('name', PHYSICAL)
def test_a_stuck_stem_stays(name):
    x = drive(name, [4.0] * 300, channel='u')
    assert np.abs(x).max() < 0.01


@pytest.mark.parametrize('name', list(RIVALS))
def test_interpreted_and_compiled_steps_agree(name):
    model = rival(name)
    u = stairs(120)
    theta = model.theta(model.defaults)
    step = model.make().interpreted
    state = model.start(u[0], u[0], 0.0, theta).tolist()
    x = [
        step(v, 0.2 if k else 0.0, state, theta, math.inf, (), ())
        for k, v in enumerate(u.tolist())
    ]
    np.testing.assert_allclose(x, drive(name, u, channel='u'), atol=1e-9)


@pytest.mark.parametrize('name', list(RIVALS))
def test_any_rival_is_a_plant(name):
    u = stairs(200)
    result = simulate(u, parameters={'model': name})
    np.testing.assert_array_equal(result.x, drive(name, u, channel='u'))
    valve = Valve(ValveSpec(model=name))
    steps = np.array([valve.step(v, 0.2) for v in u]).T
    np.testing.assert_allclose(steps, [result.p1, result.p2, result.x], atol=1e-9)
    if RIVALS[name].data_driven:
        np.testing.assert_array_equal(result.p2, u)
    else:
        np.testing.assert_allclose(result.p2, simulate(u).p2, atol=1e-9)


def test_levels_in_the_wrong_order_are_refused():
    for name in ('he', 'chen', 'classical', 'karnopp', 'lugre', 'seven_parameter'):
        with pytest.raises(ModelError, match='exceeds'):
            ValveSpec({'f_s': 3.0, 'f_d': 4.0}, model=name)
