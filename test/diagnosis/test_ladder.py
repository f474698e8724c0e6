# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The rules by which effects are kept, exchanged and called unknown."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import diagnose, heats, odds, reconsidering
from valve_sim_ros.diagnosis import ladder as climbing_up
from valve_sim_ros.diagnosis.adequacy import Leftover, leftover
from valve_sim_ros.diagnosis.base_valve import find_base, starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.climbing import _final, _let_go, _quickly
from valve_sim_ros.diagnosis.coarse import COARSE
from valve_sim_ros.diagnosis.fitting import by_cost, Fitter
from valve_sim_ros.diagnosis.ladder import climb
from valve_sim_ros.diagnosis.odds import blurred, explained, imitates, strong, suspicious
from valve_sim_ros.diagnosis.outcome import concluded, excused, Ladder
from valve_sim_ros.diagnosis.race import race
from valve_sim_ros.diagnosis.reconsidering import reconsidered
from valve_sim_ros.diagnosis.rung import judged, Rung
from valve_sim_ros.diagnosis.single_slips import slip_by_slip
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.diagnosis.stretch import CAUGHT
from valve_sim_ros.recordings.recording import Recording

STEM = groups(('p1', 'p2', 'x'))[-1]


STAGES = {'f_d1': 0.5, 'T_g1': 2.0, 'T_g2': 5.0}
VALVE = {**STAGES, 'f_s': 4.0, 'f_d': 2.4}


def left(excess):
    return Leftover(1.0 + excess, 1.0 + excess, 1.0, 5000, 1.0)


def ladder_of(outcome, before, after, *names):
    valve = starting_valve(Bench([measured()]))
    rungs = [Rung(n, 'p2-x', {n: 1e3}, before, after, 1.0, 0.9, (), valve) for n in names]
    return Ladder(STEM, outcome, valve, valve, before, after, tuple(rungs))


def measured(hold=50, **effects):
    levels = np.random.default_rng(5).uniform(10.0, 90.0, 30)
    u = np.concatenate([np.zeros(20), np.repeat(levels, hold)])
    used = list({name.split('.')[0] for name in effects if '.' in name})
    return noisy(u, 0.2, np.random.default_rng(1), **{**VALVE, 'effects': used, **effects})


def noisy(u, noise, rng, **parameters):
    """Return a record of a valve, its stages as usual but for the parameters."""
    s = simulate(u, parameters={**STAGES, **parameters})
    each = (signal + noise * rng.standard_normal(u.size) for signal in (s.p1, s.p2, s.x))
    return Recording(s.t, u, *each)


def fitted(record):
    """Return a fitter, and the base valve fitted to the stem alone."""
    fitter = Fitter(Bench([record]))
    start = starting_valve(fitter.bench)
    start = replace(start, values={**start.values, **STAGES})
    return fitter, fitter.fit(start, fitter.problem(STEM, start))


def beside(base, candidate, cost):
    """Return a valve with an effect that does nothing yet."""
    values = {**base.values, **candidate.neutral}
    return replace(base, values=values, cost=cost, candidates=(candidate,))


@pytest.mark.parametrize(
    ('names', 'before', 'after', 'outcome'),
    [
        (('travel_stops',), 50.0, 2.0, 'missing_effect'),
        (('travel_stops', 'vibration'), 50.0, 2.0, 'unknown_effect'),
        (('travel_stops', 'vibration'), 50.0, 1.0, 'missing_effect'),
        (('travel_stops',), 50.0, 5.0, 'unknown_effect'),
        # where much is left, nearly all must be explained
        (('travel_stops',), 2000.0, 10.0, 'missing_effect'),
        (('travel_stops',), 2000.0, 40.0, 'unknown_effect'),
        # where next to nothing is left, less is enough; any line straightens most of a large gap
        (('travel_stops',), 0.9, 0.2, 'missing_effect'),
        (('travel_stops',), 10.0, 0.2, 'missing_effect'),
        (('sensor_calibration',), 0.9, 0.2, 'missing_effect'),
        (('sensor_calibration',), 10.0, 0.2, 'unknown_effect'),
        (('sensor_calibration',), 10.0, 0.1, 'missing_effect'),
    ],
)
def test_two_effects_must_explain_more_than_one(names, before, after, outcome):
    assert concluded(ladder_of('adequate', left(before), left(after), *names)).outcome == outcome


@pytest.mark.parametrize(('width', 'outcome'), [(8.0, 'missing_effect'), (30.0, 'unknown_effect')])
def test_an_effect_as_large_as_it_can_be_stands_for_another(width, outcome):
    ladder = ladder_of('adequate', left(2.0), left(0.05), 'hysteresis')
    added = next(c for c in groups(('p1',))[0].candidates() if 'command_width' in c.names)
    values = {**ladder.valve.values, **added.neutral, 'hysteresis.command_width': width}
    valve = replace(ladder.valve, candidates=(added,), values=values)
    assert concluded(replace(ladder, valve=valve)).outcome == outcome


@pytest.mark.parametrize('far', [9, 10])
def test_many_far_errors_are_chance_in_slips_only(far):
    little = left(0.1)._replace(far=far)
    assert concluded(ladder_of('adequate', little, little)).outcome == 'adequate'
    of_p1 = replace(ladder_of('adequate', little, little), group=groups(('p1', 'p2', 'x'))[0])
    assert (concluded(of_p1).outcome == 'unknown_effect') == (far >= 10)


@pytest.mark.slow
def test_a_dead_time_that_is_no_candidate_is_unknown_where_p1_shows_it():
    """It is off at one sample per step only, where jitter forgives most."""
    record = measured(hold=170, **{'ip_dead_time.dead_time': 0.35})
    found = diagnose(record, without=['ip_dead_time'])
    assert found.verdict == 'unknown_effect'


def test_what_is_named_in_p1_must_explain_more():
    """A calibration in a slow loop passed for a supply limit; a loop may amplify noise."""
    names = ['positioner_loop']
    assert explained('x', left(100.0), left(1.5), names)
    assert not explained('p1', left(100.0), left(1.5), names)
    assert explained('p1', left(1000.0), left(1.5), names)
    # unless that comes of the noise of x, which the loop sees
    assert explained('p1', left(100.0), left(1.5), names, blurred=1.0)


def test_a_loop_makes_noise_of_x_that_of_p1():
    valve = replace(starting_valve(Bench([measured()])), effects=('positioner_loop',))
    noise = {'p1': 0.2, 'x': 0.3}

    def excess(gain):
        there = replace(valve, values={**valve.values, 'positioner_loop.gain': gain})
        return blurred(there, noise)

    assert excess(1.0) == pytest.approx((0.7 * 1.5) ** 2)
    assert excess(3.0) == pytest.approx(9.0 * excess(1.0))
    assert blurred(replace(valve, effects=()), noise) == 0.0


@pytest.mark.parametrize(
    ('effect', 'odd'),
    [
        ('linkage_backlash', {'f_d/f_s': 0.95}),
        ('stribeck_friction', {'f_d/f_s': 0.95}),
        ('sensor_lag', {'a_1/a_2': 2.1}),
    ],
)
def test_a_base_valve_that_is_rare_passes_for_an_effect(effect, odd):
    valve = starting_valve(Bench([measured()]))
    assert not imitates(valve, effect)
    there = replace(valve, values={**valve.values, **odd})
    assert imitates(there, effect)
    assert not imitates(there, 'dwell_friction')


@pytest.mark.parametrize(('height', 'large'), [(3.7, True), (3.5, False)])
def test_a_bump_of_friction_far_higher_than_usual_stands_for_a_stop(height, large):
    valve = starting_valve(Bench([measured()]))
    bump = next(c for c in STEM.candidates() if 'height' in c.names)
    values = {**valve.values, **bump.neutral, f'{bump.effect}.height': height}
    there = replace(valve, values=values, candidates=(bump,))
    ladder = ladder_of('adequate', left(60.0), left(0.1), bump.effect)
    rungs = tuple(replace(rung, valve=there) for rung in ladder.rungs)
    found = concluded(replace(ladder, valve=there, rungs=rungs))
    assert found.outcome == ('unknown_effect' if large else 'missing_effect')
    told = f'the least bad, {bump.effect}, would be far larger than usual'
    assert found.nearest == (told if large else '')


@pytest.mark.parametrize('signal', ['p1', 'p2', 'x'])
def test_nearly_the_noise_once_more_is_unknown(signal):
    assert odds.adequate(signal, left(0.75))
    assert not odds.adequate(signal, left(0.87))


def test_a_coarse_sensor_may_leave_steps_that_come_at_another_moment():
    assert explained('x', left(3.04), left(0.28), [COARSE])
    assert not explained('x', left(3.04), left(0.28), ['linkage_backlash'])
    assert not explained('x', left(3.04), left(0.28), [COARSE, 'linkage_backlash'])
    assert _final(ladder_of('missing_effect', left(3.04), left(0.28), COARSE))
    assert not _final(ladder_of('missing_effect', left(3.04), left(0.28), 'linkage_backlash'))


def test_jitter_may_leave_more_of_p2():
    assert explained('p2', left(4.4), left(0.4), ['quick_exhaust'])
    assert not explained('x', left(4.4), left(0.4), ['quick_exhaust'])


@pytest.mark.parametrize(
    ('excess', 'gained', 'closed', 'named', 'enough'),
    [
        (0.14, 335.0, 1.0, False, True),
        (0.14, 335.0, 0.63, False, False),
        (0.14, 30.0, 1.0, False, False),
        (0.5, 30.0, 0.5, False, True),
        (0.5, 30.0, 1.0, True, False),
        (0.5, 335.0, 0.63, True, True),
    ],
)
def test_a_little_excess_of_p2_is_named_if_one_effect_closes_it(
    excess, gained, closed, named, enough
):
    found = strong('p2', left(excess), gained, closed, first=True, named=named)
    assert found == enough


def test_x_alone_must_leave_more_before_a_name_is_sought():
    (alone,), stem = groups(('x',)), STEM
    assert suspicious(left(0.05), stem, False)
    assert not suspicious(left(0.05), alone, False)
    assert suspicious(left(0.2), alone, False)


@pytest.mark.slow
def test_what_a_led_stem_hides_is_judged_with_a_free_one():
    vibration = {'vibration.amplitude': 1.5, 'vibration.frequency': 0.2, 'vibration.phase': 0.3}
    fitter, base = fitted(measured(**vibration))
    (candidate,) = (each for each in STEM.candidates() if each.effect == 'vibration')
    valve = replace(
        base,
        values={**base.values, **VALVE, **vibration, 'f_d/f_s': 0.6},
        effects=('vibration',),
        candidates=(candidate,),
    )
    before = leftover(fitter.residuals(base, 'x'))
    ladder = Ladder(STEM, 'unknown_effect', base, base, before, before)
    guess = Rung('vibration', 'p2-x', {'vibration': 1e3}, before, before, 0.75, 0.9, (), valve)
    found = _let_go(fitter, ladder, guess)
    assert found.outcome == 'missing_effect'
    assert found.rungs[0].closed > 0.95
    assert _let_go(fitter, ladder, replace(guess, closed=0.5)) is None
    still = replace(valve, values={**valve.values, 'vibration.frequency': 0.05})
    assert _let_go(fitter, ladder, replace(guess, valve=still)) is None


def test_p2_shows_the_part_of_a_dead_time_that_p1_does_not():
    found = diagnose([measured(**{'ip_dead_time.dead_time': 0.35})])
    assert [named.rung.effect for named in found.effects] == ['ip_dead_time']
    assert found.augmented.values['ip_dead_time.dead_time'] == pytest.approx(0.35, abs=0.02)
    low, high = found.effects[0].intervals['ip_dead_time.dead_time']
    assert (low, high) == pytest.approx((0.15, 0.55), abs=0.02)


@pytest.mark.parametrize(('named', 'found'), [(False, ['sensor_lag']), (True, [])])
def test_little_excess_behind_a_named_effect_is_no_reason_for_another(named, found):
    fitter, base = fitted(measured(**{'sensor_lag.time_constant': 0.4}))
    lag = [each for each in STEM.candidates() if each.effect == 'sensor_lag']
    ladder = climb(
        fitter, STEM, base, lag, refit=False, named=named, progress=lambda share: None, stops=()
    )
    assert [rung.effect for rung in ladder.rungs] == found


def test_stops_that_rests_show_are_not_laid_to_slips_that_hang_on_noise(monkeypatch):
    levels = np.random.default_rng(5).uniform(20.0, 63.0, 60)
    levels[4::16] = 81.0  # not enough to push a stem that was caught at the stop
    u = np.concatenate([np.full(20, levels[0]), np.repeat(levels, 50)])
    stem = {'f_s': 11.7, 'f_d': 4.7, 'effects': ['travel_stops'], 'travel_stops.upper': 71.4}
    s = simulate(u, parameters={**STAGES, **stem})
    rng = np.random.default_rng(1)
    noisy = [each + 0.2 * rng.standard_normal(u.size) for each in (s.p1, s.p2, s.x)]
    fitter, base = fitted(Recording(s.t, u, *noisy))
    monkeypatch.setattr(climbing_up, 'on_time', lambda *_: left(0.05))
    stops = [each for each in STEM.candidates() if each.names == ('upper',)]
    ladder = climb(fitter, STEM, base, stops, refit=True, progress=lambda share: None, stops=())
    assert [rung.effect for rung in ladder.rungs] == ['travel_stops']
    assert ladder.valve.values['travel_stops.upper'] == pytest.approx(71.4, abs=0.1)


def test_what_an_effect_named_before_explains_is_not_unknown():
    unknown = ladder_of('unknown_effect', left(1.0), left(1.0))
    assert excused(unknown, left(20.0), 0.1).outcome == 'adequate'
    assert excused(unknown, left(2.0), 0.1).outcome == 'unknown_effect'
    # where the signals before are not explained themselves, what is no more than that says nothing
    assert excused(unknown, left(20.0), 0.5).outcome == 'unknown_effect'
    assert excused(unknown, left(20.0), 0.5, sure=True).outcome == 'adequate'
    assert excused(unknown, left(2.0), 0.5, sure=True).outcome == 'unknown_effect'
    assert excused(unknown, left(2.0), 1.5).outcome == 'adequate'


def test_a_first_effect_that_the_second_makes_needless_is_dropped():
    parameters = {'sensor_calibration.zero': -3.5, 'sensor_calibration.span': 0.94}
    fitter, base = fitted(measured(**parameters))
    chosen = {c.effect: c for c in STEM.candidates() if c.names != ('hardening',)}
    wrong, right = chosen['spring_nonlinearity'], chosen['sensor_calibration']

    def with_effect(valve, candidate):
        before = leftover(fitter.residuals(valve, 'x'))
        (found, *_) = race(fitter, STEM, valve, [candidate])
        return judged(fitter, STEM, valve, before, [found])

    first = with_effect(base, wrong)
    second = with_effect(first.valve, right)
    rungs = reconsidered(fitter, STEM, base, [first, second])
    assert [rung.effect for rung in rungs] == ['sensor_calibration']
    assert rungs[0].after.excess < 0.05


@pytest.mark.slow
def test_a_first_effect_keeps_its_name_though_its_search_anew_ends_worse(monkeypatch):
    effects = {'spring_preload.pressure': 8.0, 'sensor_drift.rate': 40.0}
    fitter, base = fitted(measured(**effects))
    chosen = {c.effect: c for c in STEM.candidates() if c.names != ('pressure', 'seat')}
    added = chosen['spring_preload'], chosen['sensor_drift']
    both = base
    for each in reversed(added):
        both, *_ = race(fitter, STEM, both, [each])
    both = replace(both, candidates=added)

    def rung(effect, valve):
        after = leftover(fitter.residuals(valve, 'x'))
        before = leftover(fitter.residuals(base, 'x'))
        gains = {'spring_preload': 2e4, 'sensor_calibration': 1.9e4}
        return Rung(effect, 'p2-x', gains, before, after, 0.9, 0.9, (), valve)

    def badly(*how, **more):
        worse = {'spring_preload': 2.0}
        found = race(*how, **more)
        found = [replace(e, cost=worse.get(e.candidates[-1].effect, 1.0) * e.cost) for e in found]
        return sorted(found, key=by_cost)

    monkeypatch.setattr(reconsidering, 'race', badly)
    first = replace(both, candidates=added[:1])
    rungs = [rung('spring_preload', first), rung('sensor_drift', both)]
    found = reconsidered(fitter, STEM, base, rungs)
    assert [each.effect for each in found] == ['spring_preload', 'sensor_drift']
    assert found[-1].valve.cost == both.cost


@pytest.mark.slow
@pytest.mark.parametrize('seed', [0, 1])
def test_a_bump_is_found_beside_another_effect_though_next_to_none_costs_least_at_first(seed):
    rng = np.random.default_rng(seed)
    time = np.arange(2400) * 0.2
    u = np.interp(time, np.linspace(0.0, 480.0, 12), rng.uniform(25.0, 70.0, 12))
    u[:50] = u[0]
    bump = {'height': 0.4, 'centre': 46.0, 'width': 10.0}
    bump = {f'position_dependent_friction.{name}': value for name, value in bump.items()}
    names = ['friction_drift', 'position_dependent_friction']
    stem = {'f_s': 6.0, 'f_d': 2.7, 'effects': names, 'friction_drift.rate': 2.0, **bump}
    fitter, valve = fitted(noisy(u, 0.2, rng, **stem))
    valve = find_base(fitter, STEM, valve, ())
    fitter.drive = (CAUGHT,)
    valve = replace(valve, cost=fitter.score(valve, 'x', fitter.drive))
    candidates = {(c.effect, len(c.names)): c for c in STEM.candidates()}
    for key in zip(names, (1, 3), strict=True):
        valve, *_ = race(fitter, STEM, valve, [candidates[key]])
    assert leftover(fitter.residuals(valve, 'x')).excess < 0.05
    assert valve.values['position_dependent_friction.centre'] == pytest.approx(46.0, abs=1.0)
    assert valve.values['friction_drift.rate'] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize(
    ('name', 'value', 'taken'),
    [('travel_stops.upper', 62.0, True), ('sensor_drift.rate', 5.0, False)],
)
def test_what_a_caught_stem_shows_is_taken_if_it_explains_a_free_one(name, value, taken):
    fitter, base = fitted(measured(**{'travel_stops.upper': 60.0}))
    effect, parameter = name.split('.')
    (added,) = [c for c in STEM.candidates() if c.effect == effect and c.names == (parameter,)]
    values = {**base.values, **added.neutral, name: value}
    named = replace(base, effects=(effect,), candidates=(added,), values=values)
    before = leftover(fitter.residuals(base, 'x'))
    unknown = Ladder(STEM, 'adequate', base, base, before, before, raced=(named,))
    rung = Rung(effect, 'p2-x', {effect: 1e3}, before, left(0.0), 1.0, 0.9, (), named)
    caught = replace(unknown, valve=named, after=left(0.0), rungs=(rung,))
    climbs = []

    def climbing(valve, candidates, *, hastily=False, **how):
        climbs.append((fitter.drive, hastily, how))
        return caught if CAUGHT in fitter.drive else unknown

    found = _quickly(fitter, base, (added,), climbing, climbing, ())
    hasty = [((), True, {}), ((CAUGHT,), True, {'most': 1})]
    if taken:
        assert climbs == hasty
        assert found.rungs == (rung,)
        assert found.valve.values[name] == pytest.approx(60.0, abs=0.3)
        assert found.after == leftover(fitter.residuals(found.valve, 'x'))
    else:
        further = {'refit': False, 'raced': (named,)}
        assert climbs == [*hasty, ((CAUGHT,), True, {**further, 'most': 2}), ((), False, further)]
        assert found is unknown


@pytest.mark.slow
def test_a_train_of_slips_is_put_together_from_single_slips():
    rng = np.random.default_rng(0)
    time = np.arange(1500) * 0.2
    u = np.interp(time, np.arange(0.0, 301.0, 50.0), rng.uniform(10.0, 90.0, 7))
    u[:50] = u[0]
    stem = {'f_s': 9.5, 'f_d': 6.6, 'a_1': 2340.0, 'a_2': 218.0}
    effect = {'effects': ['stribeck_friction'], 'stribeck_friction.velocity': 3.7}
    fitter, base = fitted(noisy(u, 0.2, rng, **stem, **effect))
    some = [c for c in STEM.candidates() if c.effect == 'stribeck_friction']
    best = race(fitter, STEM, base, some)[0]
    before, after = (leftover(fitter.residuals(each, 'x')).excess for each in (base, best))
    assert after < 0.05 * before
    assert best.values['f_s'] == pytest.approx(9.5, rel=0.01)
    assert best.values['stribeck_friction.velocity'] == pytest.approx(3.7, rel=0.2)


@pytest.mark.slow
def test_a_friction_that_falls_with_speed_is_found_behind_a_stem_of_another_kind():
    """A base valve that creeps or swings imitates it, and lies far from the true stem."""
    rng = np.random.default_rng(1)
    u = np.interp(np.arange(1500) * 0.2, np.linspace(0.0, 300.0, 15), rng.uniform(10.0, 90.0, 15))
    u[:50] = u[0]
    stem = {'f_s': 6.76, 'f_d': 4.43, 'a_1': 1451.0, 'a_2': 145.4}
    effect = {'effects': ['stribeck_friction'], 'stribeck_friction.velocity': 7.5}
    fitter, base = fitted(noisy(u, 0.15, rng, **stem, **effect))
    base = find_base(fitter, STEM, base, ())
    assert base.values['a_1/a_2'] > 30.0
    plain, _ = [c for c in STEM.candidates() if c.effect == 'stribeck_friction']
    start = {**base.values, **plain.neutral, 'stribeck_friction.velocity': 4.0}
    there = replace(base, effects=(plain.effect,), candidates=(plain,), values=start)
    problem = fitter.problem(STEM, there)
    found = min(slip_by_slip(fitter, there, [start], problem, held=6.8), key=by_cost)
    before, after = (leftover(fitter.residuals(each, 'x')) for each in (base, found))
    assert before.closed_by(after) > 0.97
    assert found.values['a_1/a_2'] == pytest.approx(10.0, rel=0.2)
    assert found.values['stribeck_friction.velocity'] == pytest.approx(7.5, rel=0.1)


@pytest.mark.parametrize(('left', 'widened'), [(0.001, False), (0.3, True)])
def test_a_law_with_one_more_parameter_is_tried_where_the_plain_one_leaves_something(
    left, widened, monkeypatch
):
    fitter, base = fitted(measured(**{'friction_drift.rate': 3.0}))

    def screened(fitter, candidate, *rest):
        return beside(base, candidate, left * base.cost)

    monkeypatch.setattr(heats, 'screened', screened)
    for how in ('evolve', 'fit', 'refined'):
        monkeypatch.setattr(Fitter, how, lambda self, valve, *rest: valve)
    noise = np.random.default_rng(0).standard_normal(2000)

    def residuals(self, valve, *rest):
        factor = 1.0 if left < 0.1 and valve.candidates else np.repeat([1.0, 4.0], 1000)
        return noise * factor

    monkeypatch.setattr(Fitter, 'residuals', residuals)
    laws = [c for c in STEM.candidates() if c.effect == 'stribeck_friction']
    found = race(fitter, STEM, base, laws)
    assert {each.candidates[-1] for each in found} == {*laws[: 1 + widened]}


def test_a_laborious_effect_does_not_run_where_another_explains_the_signal(monkeypatch):
    fitter, base = fitted(measured(**{'travel_stops.upper': 60.0}))
    screened = heats.screened
    tried = []

    def noted(fitter, candidate, *more):
        tried.append(candidate.effect)
        return screened(fitter, candidate, *more)

    monkeypatch.setattr(heats, 'screened', noted)
    some = [c for c in STEM.candidates() if c.effect in ('travel_stops', 'stribeck_friction')]
    found = race(fitter, STEM, base, some)
    assert found == sorted(found, key=by_cost)
    assert set(tried) == {'travel_stops'}


@pytest.mark.parametrize(('closes', 'waits'), [(0.99, True), (0.5, False)])
def test_what_rests_show_waits_where_another_effect_closes_most(closes, waits, monkeypatch):
    fitter, base = fitted(measured(**{'travel_stops.upper': 60.0}))
    done = []

    def screened(fitter, candidate, *rest):
        done.append(candidate.effect)
        return beside(base, candidate, (1.0 - closes) * base.cost)

    def evolve(self, valve, *rest):
        done.append('heat')
        return valve

    monkeypatch.setattr(heats, 'screened', screened)
    monkeypatch.setattr(Fitter, 'evolve', evolve)
    for how in ('fit', 'refined'):
        monkeypatch.setattr(Fitter, how, lambda self, valve, *rest: valve)
    found = fitter.residuals(base, 'x')

    def residuals(self, valve, *rest):
        return found * (1.0 - closes) ** 0.5 if valve.candidates else found

    monkeypatch.setattr(Fitter, 'residuals', residuals)
    names = ('travel_stops', 'fluid_force')
    race(fitter, STEM, base, [each for each in STEM.candidates() if each.effect in names])
    assert {*names} <= {*done}
    assert (done.index('heat') < done.index('travel_stops')) == waits


@pytest.mark.parametrize(('beyond', 'longer'), [(10.0, False), (np.inf, True)])
def test_no_longer_search_for_a_base_valve_follows_one_that_leaves_far_too_much(
    beyond, longer, monkeypatch
):
    monkeypatch.setattr(odds, 'NO_BASE', beyond)
    fitter, base = fitted(measured(hold=150, **{'sensor_drift.rate': 20.0}))
    refined = []

    def noted(self, valve, problem):
        refined.append(valve)
        return valve

    monkeypatch.setattr(Fitter, 'refined', noted)
    found = find_base(fitter, STEM, base, fitter.drive)
    assert leftover(fitter.residuals(found, 'x')).excess > 10.0
    assert bool(refined) == longer


def test_where_there_is_no_gap_what_a_base_valve_imitates_is_tried(monkeypatch):
    fitter, base = fitted(measured())
    tried = []

    def screened(fitter, candidate, *rest):
        tried.append(candidate.effect)
        return beside(base, candidate, base.cost)

    monkeypatch.setattr(heats, 'screened', screened)
    monkeypatch.setattr(Fitter, 'residuals', lambda *_: np.random.default_rng(0).normal(size=2000))
    for how in ('evolve', 'fit', 'refined'):
        monkeypatch.setattr(Fitter, how, lambda self, valve, *rest: valve)
    some = [c for c in STEM.candidates() if c.effect in ('spring_rate', 'linkage_backlash')]
    race(fitter, STEM, base, some)
    assert tried == ['spring_rate', 'linkage_backlash']


@pytest.mark.slow
def test_an_effect_found_in_p1_is_not_fitted_anew_to_p2():
    """A leak looks like a converter's span to p2, which must not undo what p1 shows."""
    both = {'ip_calibration.span': 0.97, 'air_leak.leak_rate': 0.36}
    record = measured(**both, T_g1=1.0, T_g2=1.2)
    found = diagnose(record)
    assert [each.rung.effect for each in found.effects] == ['ip_calibration', 'air_leak']
    assert found.augmented.values['ip_calibration.span'] == pytest.approx(0.97, abs=0.01)


def test_steps_of_x_are_named_by_its_values_alone(monkeypatch):
    """Noise of a third of a step comes out as whole steps, whether the model rounds x or not."""
    record = measured()
    colour = lfilter([1.0], [1.0, -0.8], np.random.default_rng(3).standard_normal(record.x.size))
    step = 0.66
    coarse = step * np.round((simulate(record.u, parameters=VALVE).x + 0.12 * colour) / step)
    raced = []

    def noted(fitter, group, *rest, **how):
        raced.append(group.signal)
        return race(fitter, group, *rest, **how)

    monkeypatch.setattr('valve_sim_ros.diagnosis.ladder.race', noted)
    found = diagnose(Recording(record.time, record.u, record.p1, record.p2, coarse))
    assert [each.rung.effect for each in found.effects] == [COARSE]
    assert found.augmented.values[f'{COARSE}.step'] == pytest.approx(step, rel=1e-3)
    assert 'x' not in raced


@pytest.mark.slow
@pytest.mark.parametrize('lag', [0.4, 0.0])
def test_a_lag_that_a_slower_stem_hides_in_coloured_noise_is_named(lag):
    rng = np.random.default_rng(4)
    u = np.repeat(rng.uniform(10.0, 90.0, 60), rng.integers(60, 200, 60))
    s = simulate(u, 0.1, {**VALVE, 'effects': ['sensor_lag'], 'sensor_lag.time_constant': lag})
    noise = lfilter([1.0], [1.0, -0.5], rng.standard_normal((3, u.size)))
    noise *= 0.2 / noise.std()
    found = diagnose([Recording(s.t, u, s.p1 + noise[0], s.p2 + noise[1], s.x + noise[2])])
    assert found.ladders[-1].before.excess < 0.02
    named = {name: value for each in found.effects for name, value in each.values.items()}
    assert named == ({'sensor_lag.time_constant': pytest.approx(lag, rel=0.1)} if lag else {})


@pytest.mark.slow
@pytest.mark.parametrize('noise', [0.0, 0.05])
def test_a_clean_record_in_steps_of_a_tenth_is_adequate(noise):
    rng = np.random.default_rng(7)
    u = np.repeat(rng.uniform(10.0, 90.0, 60), 50)
    s = simulate(u, parameters=VALVE)
    coarse = [
        0.1 * np.rint((each + noise * rng.standard_normal(u.size)) / 0.1)
        for each in (s.p1, s.p2, s.x)
    ]
    found = diagnose([Recording(s.t, u, *coarse)])
    assert found.verdict == 'adequate'
    assert all(ladder.before.excess < 0.2 for ladder in found.ladders)


@pytest.mark.parametrize(('drop', 'sought'), [(0.95, True), (0.6, False)])
def test_where_nothing_is_left_stribeck_friction_is_sought_beside_a_rare_base_valve(
    drop, sought, monkeypatch
):
    fitter, base = fitted(measured())
    tried = []

    def screened(fitter, candidate, *rest):
        tried.append(candidate.effect)
        return beside(base, candidate, 1.0)

    monkeypatch.setattr(heats, 'screened', screened)
    monkeypatch.setattr(Fitter, 'evolve', lambda self, valve, *rest: valve)
    monkeypatch.setattr(Fitter, 'fit', lambda self, valve, *rest: valve)
    rare = replace(base, values={**base.values, 'f_d/f_s': drop})
    noise = np.tile([0.9, -0.9], 2500)
    monkeypatch.setattr(Fitter, 'residuals', lambda self, valve, *rest: noise)
    names = {'sensor_lag', 'stribeck_friction'}
    race(fitter, STEM, rare, [each for each in STEM.candidates() if each.effect in names])
    assert ('stribeck_friction' in tried) == sought
    assert 'sensor_lag' in tried
