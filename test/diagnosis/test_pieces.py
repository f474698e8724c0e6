# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The other parts of the diagnosis, each held against what is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from valves import recording, VALUES

from valve_sim_ros.diagnosis import odds
from valve_sim_ros.diagnosis.adequacy import Leftover, leftover
from valve_sim_ros.diagnosis.base_valve import starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.conditions import places
from valve_sim_ros.diagnosis.decision import TestSignal
from valve_sim_ros.diagnosis.descent import cost_of, descend, walk
from valve_sim_ros.diagnosis.evolution import evolve
from valve_sim_ros.diagnosis.fitting import Fitter, Valve
from valve_sim_ros.diagnosis.proof import closed
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.diagnosis.stretch import CAUGHT, HELD
from valve_sim_ros.diagnosis.unknowns import complete
from valve_sim_ros.model.effects import CATALOGUE
from valve_sim_ros.recordings.recording import Recording


def seen(noise):
    """Return noise as a multiple of what differences show of it."""
    return noise / np.sqrt(np.mean(np.diff(noise, 2) ** 2) / 6.0)


@pytest.mark.parametrize('colour', [0.0, 0.5, 0.75, 0.86, 0.9])
def test_noise_of_any_colour_leaves_no_excess(colour):
    rng = np.random.default_rng(2)
    noise = lfilter([np.sqrt(1 - colour**2)], [1, -colour], rng.standard_normal(5000))
    assert leftover(noise).excess < 0.25
    left = leftover(seen(noise))
    assert left.excess < 0.25
    assert left.noise == (colour > 0.0)


@pytest.mark.parametrize('seed', range(4))
@pytest.mark.parametrize('share', [0.2, 0.5, 0.8])
@pytest.mark.parametrize('colour', [0.75, 0.86, 0.92])
def test_white_noise_beside_coloured_noise_leaves_no_excess(colour, share, seed):
    rng = np.random.default_rng(seed)
    lasting = lfilter([np.sqrt(1 - colour**2)], [1, -colour], rng.standard_normal(4500))
    noise = np.sqrt(1 - share) * lasting + np.sqrt(share) * rng.standard_normal(4500)
    assert leftover(seen(noise)).excess < 0.25


@pytest.mark.parametrize('share', [0.3, 0.6, 0.9, 0.97])
@pytest.mark.parametrize('kind', ['wander', 'decays', 'swing'])
def test_misfit_in_white_noise_is_no_coloured_noise(kind, share):
    rng = np.random.default_rng(4)
    if kind == 'wander':
        misfit = lfilter([1], [1, -0.97], rng.standard_normal(4500))
    elif kind == 'decays':  # after steps
        misfit = lfilter([1], [1, -0.95], (np.arange(4500) % 90 == 0) * rng.standard_normal(4500))
    else:
        misfit = np.sin(0.3 * np.arange(4500))
    misfit *= np.sqrt(share / (1.0 - share)) / misfit.std()
    assert not leftover(seen(misfit + rng.standard_normal(4500))).noise


def test_a_misfit_in_a_tenth_of_the_time_is_an_excess():
    rng = np.random.default_rng(2)
    misfit = np.where(np.arange(5000) % 1000 < 100, 4.0, 0.0)
    left = leftover(rng.standard_normal(5000) + misfit)
    assert left.excess == pytest.approx(1.6, abs=0.4)


def test_a_model_that_swings_everywhere_does_not_pass_for_noise():
    swings = 30.0 * np.random.default_rng(5).standard_normal(4000)
    assert leftover(swings).excess > 1.0


def test_an_effect_is_as_large_as_its_largest_parameter_is_for_one():
    group = groups(('p1', 'p2', 'x'))[0]
    (candidate,) = [c for c in group.candidates() if c.effect == 'ip_calibration']

    def fitted(zero, span):
        values = {**candidate.neutral, 'ip_calibration.zero': zero, 'ip_calibration.span': span}
        return Valve(values, candidates=(candidate,))

    assert odds.size(fitted(0.05, 1.0005)) < odds.NEGLIGIBLE
    assert odds.surprise(fitted(0.05, 1.0005)) == 1
    assert odds.surprise(fitted(-1.0, 1.0)) == 0  # a zero error alone is nothing odd
    assert odds.surprise(fitted(9.0, 1.0)) == 1


def test_a_lag_of_next_to_nothing_is_another_run_of_the_base_valve():
    (lag,) = [c for c in groups(('p1', 'p2', 'x'))[2].candidates() if c.effect == 'sensor_lag']

    def fitted(time):
        return Valve({'sensor_lag.time_constant': time}, candidates=(lag,))

    assert odds.size(fitted(0.0)) < odds.size(fitted(0.01)) < odds.NEGLIGIBLE
    assert odds.size(fitted(0.03)) > odds.NEGLIGIBLE


def test_of_two_effects_that_fit_alike_the_one_in_its_usual_stage_is_named():
    each = {c.effect: c for c in groups(('p1', 'p2', 'x'))[2].candidates() if len(c.names) == 1}
    sizes = {'hysteresis.stem_width': 1.7, 'linkage_backlash.width': 1.9}
    runners = [
        Valve({**each[name].neutral, **sizes}, candidates=(each[name],))
        for name in ('hysteresis', 'linkage_backlash')
    ]
    gains = {'hysteresis': 621.3, 'linkage_backlash': 621.0}
    assert odds.choice(runners, gains) is runners[1]
    assert odds.choice(runners, {**gains, 'hysteresis': 700.0}) is runners[0]


def test_one_far_larger_than_usual_stands_for_one_next_to_it():
    each = {c.effect: c for c in groups(('p1', 'p2', 'x'))[2].candidates()}
    spans = {'sensor_calibration.zero': 0.0, 'sensor_calibration.span': 0.7}
    runners = [
        Valve({**each[name].neutral, **spans, 'spring_rate.factor': 1.3}, candidates=(each[name],))
        for name in ('sensor_calibration', 'spring_rate')
    ]
    gains = {'sensor_calibration': 770e3, 'spring_rate': 764e3}
    assert odds.choice(runners, gains) is runners[1]
    assert odds.choice(runners, {**gains, 'spring_rate': 700e3}) is runners[0]
    runners[0].values['sensor_calibration.span'] = 0.9
    assert odds.choice(runners, gains) is runners[0]


def test_errors_of_any_size_can_be_compared():
    rng = np.random.default_rng(2)
    noise, misfit = rng.standard_normal(5000), np.linspace(-400.0, 400.0, 5000)
    far, near = leftover(noise + misfit), leftover(noise + 0.1 * misfit)
    assert far.closed_by(near) > 0.85
    assert near.closed_by(far) == 0.0


def test_a_further_effect_must_close_part_of_the_whole_gap():
    base, far, near, clean = (Leftover(1.0 + e, 1.0 + e, 1.0, 5000, 1.0) for e in (50, 10, 1, 0))
    names = ['air_leak', 'quick_exhaust']
    assert odds.needed(base, far, 1.0, clean, names)
    assert odds.needed(base, far, 0.3, near, names)  # much is left, and both explain it
    assert not odds.needed(base, near, 0.3, clean, names)  # enough is explained without it
    assert not odds.needed(base, near, 0.9, Leftover(1.5, 1.5, 1.0, 5000, 1.0), names)
    # little of a huge gap, and yet far more than noise
    quiet = Leftover(1.2, 1.2, 1.0, 5000, 1.0)
    assert odds.needed(Leftover(701.0, 701.0, 1.0, 5000, 1.0), far, 0.98, quiet, names)
    assert not odds.needed(base, near, 0.8, quiet, names)
    small, noise = (Leftover(1.0 + e, 1.0 + e, 1.0, 5000, 1.0) for e in (0.4, 0.05))
    # little of the whole, but nothing more is left; not if the first law may just not be right
    assert odds.needed(base, small, 0.9, noise, names)
    assert not odds.needed(base, small, 0.9, noise, ['ip_nonlinearity', 'ip_calibration'])
    assert odds.needed(base, far, 0.9, noise, ['ip_nonlinearity', 'ip_calibration'])
    # a share of a huge gap is far more than noise all the same
    huge, twins = Leftover(701.0, 701.0, 1.0, 5000, 1.0), ['fluid_force', 'spring_nonlinearity']
    assert odds.needed(huge, far, 0.99, noise, twins)
    assert not odds.needed(huge, far, 0.9, near, twins)
    assert not odds.needed(huge, near, 0.9, noise, twins)


def test_the_place_of_a_misfit_is_found():
    record = recording(noise=0.2)
    bench = Bench([record])
    results = bench.run(complete({**VALUES, 'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 0.0}))
    filling = results[0][0] > results[0][1] + 0.5
    rng = np.random.default_rng(3)
    residual = rng.standard_normal(filling.size) + 5.0 * filling
    found = places(bench, 'p1-p2', 'p2', residual, results)
    assert found[0].condition == 'while p2 fills'
    assert found[0].share_of_gap > 0.9
    assert all(a <= b for a, b in found[0].spans)


def test_groups_follow_the_measured_signals():
    assert [(g.signal, g.stages) for g in groups(('p1', 'x'))] == [
        ('p1', ('u-p1',)),
        ('x', ('p1-p2', 'p2-x')),
    ]


def test_every_effect_is_a_candidate_somewhere():
    named = {c.effect for group in groups(('p1', 'p2', 'x')) for c in group.candidates()}
    assert named == set(CATALOGUE)
    assert {c.effect for c in groups(('x',))[0].candidates()} == set(CATALOGUE)
    assert 'air_leak' not in {c.effect for c in groups(('x',))[0].candidates(['air_leak'])}


def test_searches_find_the_bottom_of_a_crooked_valley():
    def residuals(point):
        return np.array([point[0] - 3.0, 2.0 * (point[1] - point[0] ** 2 / 3.0)])

    def cost(point, bound=np.inf):
        return cost_of(residuals(point))

    slope = descend(residuals, np.zeros(2), 40)
    np.testing.assert_allclose(walk(cost, slope).point, [3.0, 3.0], atol=0.2)
    rng = np.random.default_rng(0)
    np.testing.assert_allclose(
        evolve(cost, np.zeros(2), 2.0, rng, 60, 10).point, [3.0, 3.0], atol=0.05
    )


def test_the_gap_closed():
    assert closed(2.0, 1.0, 1.0) == 1.0
    assert closed(2.0, 2.0, 1.0) == 0.0
    assert closed(np.sqrt(5.0), np.sqrt(2.0), 1.0) == pytest.approx(0.75)
    assert closed(1.0, 1.0, 1.0) is None


def test_the_deciding_commands_reach_both_stops_and_rest():
    signal = TestSignal.of(recording())
    assert signal.u.min() == 0.0
    assert signal.u.max() == 100.0
    assert np.all(np.diff(signal.time) > 0.0)
    assert signal.csv().splitlines()[0] == 't,u'


def test_a_run_that_blows_up_never_fits():
    bench = Bench([recording(noise=0.2)])
    fitter = Fitter(bench)
    valve = replace(starting_valve(bench), values={**starting_valve(bench).values, 'p2_0': np.nan})
    assert fitter.score(valve, 'p2') == np.inf
    assert cost_of(fitter.residuals(valve, 'p2')) > 1e6


def test_a_recording_may_begin_with_lost_samples():
    record = recording(noise=0.2)
    lost = {name: record.output(name).copy() for name in record.signals}
    for values in lost.values():
        values[:5] = np.nan
    bench = Bench([Recording(record.time, record.u, **lost)])
    assert all(np.isfinite(value) for value in bench.stretches[0].first.values())


def test_one_of_several_recordings_may_have_lost_x():
    record = recording(noise=0.1)
    lost = Recording(record.time, record.u, record.p1, record.p2, np.full(record.u.size, np.nan))
    bench = Bench([record, lost])
    right = complete(VALUES)
    for drive in ((), (CAUGHT,), (HELD,)):
        assert np.isfinite(bench.score(right, (), 'p1', drive))
    assert bench.score(right, (), 'x') == pytest.approx(Bench([record]).score(right, (), 'x'))


@pytest.mark.parametrize('effect', CATALOGUE)
def test_a_fit_may_reach_the_valve_without_the_effect(effect):
    bench = Bench([recording()])
    values = complete({**VALUES, 'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 0.0})
    neutral = {f'{effect}.{p.name}': p.neutral for p in CATALOGUE[effect].parameters}
    (plain,) = bench.run(values)
    (with_it,) = bench.run({**values, **neutral}, (effect,))
    assert np.quantile(np.abs(with_it[2] - plain[2]), 0.99) < 0.02
