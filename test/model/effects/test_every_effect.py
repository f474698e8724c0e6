# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One battery for every effect of the catalogue; a new file is tested the moment it exists."""

from itertools import product

import numpy as np
import pytest

from valve_sim_ros import (
    InitialState,
    ModelError,
    read_parameters,
    simulate,
    Valve,
    ValveSpec,
    write_parameters,
)
from valve_sim_ros.model.effects import CATALOGUE
from valve_sim_ros.model.effects.nonlinear_flow import flow
from valve_sim_ros.model.kernels import SLOTS
from valve_sim_ros.model.state import State

PUBLIC = """
ip_dead_time ip_lag ip_calibration ip_nonlinearity supply_limit positioner_loop tubing_dead_time
air_leak chamber_volume nonlinear_flow quick_exhaust rate_limit hysteresis friction_asymmetry
position_dependent_friction stribeck_friction presliding dwell_friction friction_drift
spring_preload spring_rate spring_nonlinearity travel_stops fluid_force vibration linkage_backlash
sensor_lag sensor_calibration sensor_quantisation sensor_drift
"""
PUBLIC_IDS = set(PUBLIC.split())
FAST = {'T_g1': 1.0, 'T_g2': 3.0}
every_effect = pytest.mark.parametrize('effect', CATALOGUE.values(), ids=list(CATALOGUE))


def commands(n=400):
    rng = np.random.default_rng(7)
    return np.repeat(rng.uniform(0.0, 100.0, n // 25), 25)


def with_effect(effect, **values):
    named = {f'{effect.id}.{name}': value for name, value in values.items()}
    return ValveSpec().changed({**FAST, 'effects': [effect.id], **named})


def test_the_catalogue_is_the_public_one():
    assert set(CATALOGUE) == PUBLIC_IDS
    assert all(effect.id == name for name, effect in CATALOGUE.items())


@every_effect
def test_declaration_is_complete(effect):
    assert set(effect.slots) <= set(SLOTS)
    assert effect.explanation
    assert effect.symptom
    assert effect.confirm
    names = {parameter.name for parameter in effect.parameters}
    assert {name for variant in effect.variants for name in variant} <= names
    assert set(effect.twins) <= PUBLIC_IDS - {effect.id}


@every_effect
def test_neutral_equals_absent_to_the_bit(effect):
    u = commands()
    neutral = with_effect(effect, **{p.name: p.neutral for p in effect.parameters})
    assert neutral.active == ()
    # beside another effect, so that the machine code with effects runs
    other = 'sensor_drift' if effect.id != 'sensor_drift' else 'air_leak'
    both, alone = (
        simulate(u, parameters=neutral.changed({'effects': [*names, other]}))
        for names in ([effect.id], [])
    )
    for name in ('p1', 'p2', 'x'):
        assert getattr(both, name).tobytes() == getattr(alone, name).tobytes()


@every_effect
def test_usual_size_is_seen(effect):
    u = commands()
    base, changed = simulate(u, parameters=FAST), simulate(u, parameters=with_effect(effect))
    difference = [np.abs(getattr(base, n) - getattr(changed, n)).max() for n in ('p1', 'p2', 'x')]
    assert max(difference) > 0.1


@every_effect
def test_finite_at_every_corner_of_the_bounds(effect):
    u = commands(200)
    for corner in product(*((p.lower, p.default, p.upper) for p in effect.parameters)):
        names = [parameter.name for parameter in effect.parameters]
        spec = with_effect(effect, **dict(zip(names, corner, strict=True)))
        s = simulate(u, parameters=spec)
        assert np.isfinite([s.p1, s.p2, s.x]).all(), corner


@every_effect
def test_interpreted_steps_agree_with_machine_code(effect):
    u, spec = commands(150), with_effect(effect)
    s, valve = simulate(u, parameters=spec), Valve(spec, background=False)
    valve._compiled = None  # stay with plain Python
    steps = np.array([valve.step(value, 0.2) for value in u]).T
    np.testing.assert_allclose(steps, [s.p1, s.p2, s.x], rtol=0, atol=1e-9)


@every_effect
def test_record_and_single_steps_are_equal_to_the_bit(effect):
    u, spec = commands(150), with_effect(effect)
    s, valve = simulate(u, parameters=spec), Valve(spec, background=False)
    steps = np.array([valve.step(value, 0.2) for value in u]).T
    np.testing.assert_array_equal(steps, [s.p1, s.p2, s.x])


@every_effect
def test_yaml_and_back_is_the_identity(effect, tmp_path):
    spec = with_effect(effect)
    write_parameters(tmp_path / 'valve.yaml', spec)
    assert read_parameters(tmp_path / 'valve.yaml') == spec


@pytest.mark.parametrize(
    ('changes', 'words'),
    [
        ({'effects': ['air_leek']}, 'did you mean air_leak'),
        ({'effects': 'air_leak'}, 'expected a list'),
        ({'air_leak.leak_rate': 0.01}, r'add effects: \[air_leak\]'),
        ({'effects': ['air_leak'], 'air_leak.leak_rate': -1.0}, 'between'),
        ({'effects': ['air_leak'], 'air_leak.rate': 1.0}, 'did you mean air_leak.leak_rate'),
    ],
)
def test_bad_effects_are_refused_with_a_sentence(changes, words):
    with pytest.raises(ModelError, match=words):
        ValveSpec().changed(changes)


def test_a_leak_settles_below_the_inlet():
    spec = ValveSpec().changed({'effects': ['air_leak'], 'air_leak.leak_rate': 0.02, 'T_g1': 5.0})
    s = simulate([80.0] * 3000, parameters=spec)
    assert s.p2[-1] == pytest.approx(s.p1[-1] / (1.0 + 0.02 * 5.0), abs=1e-6)


def test_a_dead_time_shifts_everything_by_whole_samples():
    u = np.concatenate([np.zeros(10), commands()])  # at rest first, or the start shifts nothing
    base = simulate(u)
    spec = {'effects': ['ip_dead_time'], 'ip_dead_time.dead_time': 0.6}
    late = simulate(u, parameters=spec)
    np.testing.assert_array_equal(late.p1[3:], base.p1[:-3])
    np.testing.assert_allclose(late.x[3:], base.x[:-3], rtol=0, atol=1e-9)


def test_a_dead_time_of_part_of_a_sample_lies_between():
    u = commands()
    early, half, late = (
        simulate(
            u, parameters={'effects': [name], f'{name}.dead_time': value, 'f_d1': 0.0, **FAST}
        ).p2
        for name, value in (
            ('tubing_dead_time', 0.4),
            ('tubing_dead_time', 0.5),
            ('tubing_dead_time', 0.6),
        )
    )
    assert np.abs(half - 0.5 * (early + late)).max() < 0.1 * np.abs(early - late).max()


def test_chamber_dips_at_a_slip():
    spec = {
        'effects': ['chamber_volume'],
        'chamber_volume.ratio': 2.0,
        'chamber_volume.displacement': 1.0,
        'T_g1': 30.0,
        'f_s': 20.0,
        'f_d': 5.0,
    }
    s = simulate([100.0] * 400, parameters=spec)
    slip = int(np.argmax(np.diff(s.x)))
    assert s.p2[slip + 1] < s.p2[slip] - 1.0


@pytest.mark.parametrize(
    'effect', [('chamber_volume', 'displacement', 1.0), ('tubing_dead_time', 'dead_time', 2.0)]
)
def test_an_effect_switched_on_again_remembers_nothing(effect):
    name, parameter, value = effect
    without = ValveSpec().changed({**FAST, 'effects': ['sensor_calibration']})
    both = without.changed({'effects': ['sensor_calibration', name], f'{name}.{parameter}': value})
    valve = Valve(both, background=False)
    for spec, u in ((both, 0.0), (without, 90.0)):
        valve.spec = spec
        for _ in range(300):
            at_rest = valve.step(u, 0.2)
    valve.spec = both
    for _ in range(20):
        assert valve.step(90.0, 0.2) == pytest.approx(at_rest, abs=0.01)


@pytest.mark.parametrize(('shape', 'moves'), [(0.0, False), (1.0, True)])
def test_friction_grows_with_the_rest_as_told(shape, moves):
    # after 20 s at rest f_s is 4 (1 + 20/(20 + 20)) = 6.0, or 4 (1 + 1 - exp(-1)) = 6.5
    spec = {
        'f_d1': 0.0,
        'T_g1': 0.02,
        'f_s': 4.0,
        'f_d': 2.0,
        'effects': ['dwell_friction'],
        'dwell_friction.growth': 1.0,
        'dwell_friction.time_constant': 20.0,
        'dwell_friction.shape': shape,
    }
    s = simulate(np.repeat([0.0, 6.3], (100, 20)), parameters=spec)
    assert (s.x[-1] > 1.0) == moves


def test_stem_stays_inside_the_stops():
    spec = {'effects': ['travel_stops'], 'travel_stops.lower': 10.0, 'travel_stops.upper': 70.0}
    s = simulate(commands(), parameters=spec, initial=InitialState(50.0, 50.0, 50.0))
    assert s.x.min() >= 10.0
    assert s.x.max() == 70.0


def test_a_stop_that_yields_gives_way_as_its_compliance_tells():
    spec = {'effects': ['travel_stops'], 'travel_stops.upper': 60.0, 'f_s': 2.0, 'f_d': 1.0}
    u = np.repeat([50.0, 90.0], 300)
    # kinetic friction holds 1 % of what p2 presses it beyond the stop
    for compliance in (0.0, 0.05):
        s = simulate(u, parameters={**spec, 'travel_stops.compliance': compliance})
        beyond = compliance / (1.0 + compliance) * (s.p2[-1] - 60.0)
        assert s.x[-1] == pytest.approx(60.0 + beyond, abs=0.15)
        assert s.x[-1] > 60.0 or not compliance


def share_apart(effects):
    """Return how often samples differ from many short ones, by signal."""
    time = 0.2 * np.arange(750)
    slow = 50.0 + 30.0 * np.sin(2.0 * np.pi * time / 60.0)
    u = np.concatenate([slow, commands(400)])
    spec = ValveSpec().changed({**FAST, 'effects': effects})
    start = InitialState(*[u[0]] * 3)
    one = simulate(u, parameters=spec, initial=start)
    many = simulate(np.repeat(u, 400), parameters=spec, initial=start, sample_time=5e-4)
    apart = {n: np.abs(getattr(one, n) - getattr(many, n)[::400]) for n in ('p1', 'p2', 'x')}
    return {n: np.mean(apart[n] > most) for n, most in (('p1', 0.05), ('p2', 0.05), ('x', 0.2))}


@every_effect
def test_a_sample_is_as_good_as_many_short_ones(effect):
    assert max(share_apart([effect.id]).values()) < 0.02


@pytest.mark.parametrize('other', ['presliding', 'stribeck_friction', 'friction_asymmetry'])
def test_so_it_is_where_the_moving_stem_acts_on_the_chamber(other):
    assert max(share_apart(['chamber_volume', other]).values()) < 0.02


@pytest.mark.parametrize('command', [-100.0, -60.0, 0.0])
@pytest.mark.parametrize('p2', [-80.0, -60.0])
def test_an_orifice_knows_no_less_than_a_vacuum(p2, command):
    orifice = {'exponent': 1.0, 'critical_ratio': 0.3, 'absolute_pressure': 60.0}
    values = {f'nonlinear_flow.{name}': value for name, value in orifice.items()}
    spec = ValveSpec().changed({'effects': ['nonlinear_flow'], **values})
    s = simulate(np.full(50, command), parameters=spec, initial=InitialState(command, p2, 0.0))
    assert np.isfinite(s.p2).all()
    towards = np.sign(command - p2) * np.diff(s.p2)
    assert (towards >= -1e-4).all()


def test_an_orifice_lets_a_run_that_blew_up_go_on():
    start = State(*[0.0] * len(State._fields))._replace(p2=np.inf)
    assert flow((0.0, 0.1), start, (1.0, 0.3, 60.0), (), 0.2) == (0.0, 0.1)
