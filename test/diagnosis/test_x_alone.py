# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""With x alone, all stages are sought at once: lags found without an effect are far off."""

from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import base_valve, odds
from valve_sim_ros.diagnosis.adequacy import leftover
from valve_sim_ros.diagnosis.alike import alike
from valve_sim_ros.diagnosis.base_valve import find_base, standing_still, starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.fitting import Fitter
from valve_sim_ros.diagnosis.race import race
from valve_sim_ros.diagnosis.rung import judged
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.recordings.recording import Recording

(ALL,) = groups(('x',))
VALVE = {'f_d1': 0.5, 'T_g1': 2.8, 'T_g2': 10.0, 'f_s': 10.0, 'f_d': 4.5}


def measured(samples=50, **effects):
    """Return a fitter beside x alone, noise 0.2 %, of a valve with effects."""
    levels = np.random.default_rng(8).uniform(10.0, 90.0, 24)
    u = np.concatenate([np.full(20, 40.0), np.repeat(levels, samples)])
    used = list({name.split('.')[0] for name in effects if '.' in name})
    s = simulate(u, parameters={**VALVE, 'effects': used, **effects})
    x = s.x + 0.2 * np.random.default_rng(2).standard_normal(u.size)
    return Fitter(Bench([Recording(s.t, u, x=x)]))


def ramp(start, end):
    return np.linspace(start, end, 60)


def candidates(*effects):
    return [each for each in ALL.candidates() if each.effect in effects]


def test_the_speed_at_which_a_stem_stops_shows_once_its_other_values_are_refined():
    """A fit without it puts lags and friction far off, from where one with it does not return."""
    fitter = measured(samples=100, delta=0.0984)
    true = {**VALVE, 'f_d/f_s': VALVE['f_d'] / VALVE['f_s']}
    start = starting_valve(fitter.bench)
    start = replace(start, values={**start.values, **true})
    problem = fitter.problem(ALL, start)
    valve = fitter.refined(start, problem)
    assert leftover(fitter.residuals(valve, 'x')).excess > 5.0
    found = standing_still(fitter, valve, problem)
    assert leftover(fitter.residuals(found, 'x')).excess <= odds.SPOTLESS
    assert found.values['delta'] == pytest.approx(0.0984, rel=0.25)


@pytest.mark.parametrize(('beyond', 'longer'), [(4.0, False), (np.inf, True)])
def test_a_base_valve_that_is_far_off_is_not_searched_for_before_effects_are_tried(
    beyond, longer, monkeypatch
):
    class Longer(Exception):
        pass

    def noted(*_):
        raise Longer

    monkeypatch.setattr(base_valve, '_along_the_valley', noted)
    monkeypatch.setattr(odds, 'NO_BASE_ALONE', beyond)
    fitter = measured(**{'spring_nonlinearity.hardening': 0.8})
    start = starting_valve(fitter.bench)
    with pytest.raises(Longer) if longer else nullcontext():
        find_base(fitter, ALL, start, ())


@pytest.mark.slow
def test_base_valves_are_found_at_the_end_of_a_narrow_valley():
    """A stem that creeps imitates one that slips: lags and friction change together in between.

    The noise decides whether a search begins in it: 12 of draws 3 to 18 do, and come to its end.
    """
    rng = np.random.default_rng(3)
    ends = np.concatenate([[40.0], rng.uniform(10.0, 90.0, 12)])
    u = np.concatenate([np.full(20, 40.0), *map(ramp, ends[:-1], ends[1:])])
    valve = {'f_d1': 0.74, 'T_g1': 5.0, 'T_g2': 5.0, 'f_s': 4.57, 'f_d': 2.87}
    s = simulate(u, 0.5, {**valve, 'a_1': 1530.0, 'a_2': 50.0})

    def found(seed):
        noise = 0.2 * np.random.default_rng(seed).standard_normal(u.size)
        fitter = Fitter(Bench([Recording(s.t, u, x=s.x + noise)]))
        best = find_base(fitter, ALL, starting_valve(fitter.bench), ())
        near = [best.values[name] for name in ('T_g1', 'f_s')]
        # 2.0 for each sample where the stem creeps, 0.5 or more on the way to the end
        return best.cost < 0.5 * u.size and near == pytest.approx([5.0, 4.57], rel=0.1)

    assert sum(found(seed) for seed in range(3, 7)) >= 2


@pytest.mark.slow
def test_a_rate_that_is_limited_one_way_is_found():
    fitter = measured(**{'rate_limit.emptying_rate': 1.2, 'rate_limit.pressure_rate': 1000.0})
    base = find_base(fitter, ALL, starting_valve(fitter.bench), ())
    found = race(fitter, ALL, base, candidates('rate_limit', 'quick_exhaust'))
    best = found[0]
    assert best.values['rate_limit.emptying_rate'] == pytest.approx(1.2, rel=0.05)
    # a law that limits both ways contains it, and may fit the noise a little better
    rung = judged(fitter, ALL, base, leftover(fitter.residuals(base, 'x')), found)
    assert rung.valve.candidates[-1].names == ('emptying_rate',)
    assert rung.valve.values['rate_limit.emptying_rate'] == pytest.approx(1.2, rel=0.05)


def test_the_span_of_a_converter_is_found_where_that_of_a_sensor_is():
    """All is linear but for friction: only its size differs, and no x shows that."""
    fitter = measured(**{'sensor_calibration.zero': 1.0, 'sensor_calibration.span': 0.85})
    (one,), (other,) = candidates('ip_calibration'), candidates('sensor_calibration')
    true = {**starting_valve(fitter.bench).values, **VALVE, 'f_d/f_s': 0.45}
    true |= {f'sensor_calibration.{name}': v for name, v in (('zero', 1.0), ('span', 0.85))}
    start = replace(starting_valve(fitter.bench), values={**true, **one.neutral})

    def runner(candidate):
        there = replace(start, effects=(candidate.effect,), candidates=(candidate,))
        return fitter.fit(there, fitter.problem(ALL, there))

    sensor = runner(other)
    stuck = replace(start, effects=(one.effect,), candidates=(one,), cost=1e9)
    found = next(each for each in alike(fitter, ALL, [sensor, stuck]) if each is not sensor)
    assert found.cost == pytest.approx(sensor.cost, rel=0.05)
    assert found.values['ip_calibration.span'] == pytest.approx(0.85, abs=0.02)
