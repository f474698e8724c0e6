# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The bench and what it reads from a record, held against what is known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter
from valves import commands, CREEPING, recording, slow_valve, VALUES

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import odds
from valve_sim_ros.diagnosis.adequacy import leftover
from valve_sim_ros.diagnosis.base_valve import find_base, starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.descent import cost_of
from valve_sim_ros.diagnosis.fitting import Fitter, Valve
from valve_sim_ros.diagnosis.interleaving import interleaved
from valve_sim_ros.diagnosis.intervals import intervals
from valve_sim_ros.diagnosis.loosening import loosened
from valve_sim_ros.diagnosis.readings import straightened
from valve_sim_ros.diagnosis.seen import calibration_seen, friction_seen, mixed_arrivals
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.diagnosis.stretch import CAUGHT, HELD, MODELLED, ON_TIME, RESTS
from valve_sim_ros.diagnosis.unknowns import complete
from valve_sim_ros.diagnosis.workers import cheapest
from valve_sim_ros.model.effects import CATALOGUE
from valve_sim_ros.model.scoring import forgive
from valve_sim_ros.recordings.recording import Recording


def test_the_bench_runs_the_same_valve_as_simulate():
    record = recording()
    bench = Bench([record])
    (result,) = bench.run(complete({**VALUES, 'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 0.0}))
    for row, name in enumerate(('p1', 'p2', 'x')):
        np.testing.assert_allclose(result[row], record.output(name), rtol=0, atol=1e-9)


def test_commands_are_put_in_order_between_samples():
    time, sent = np.array([0.0, 1.0, 2.1, 3.0]), np.array([5.0, 6.0, 6.0, 7.0])
    now, dt, u, rows = interleaved(time, sent, np.full(4, 0.25))
    np.testing.assert_allclose(now, [0.0, 0.75, 1.0, 2.1, 2.775, 3.0])
    np.testing.assert_allclose(dt, [0.0, 0.75, 0.25, 1.1, 0.675, 0.225])
    assert u.tolist() == [5.0, 6.0, 6.0, 6.0, 7.0, 7.0]
    assert rows.tolist() == [0, 2, 3, 5]
    # late by half of the period that follows, the last one as long as that before it
    now, _, u, _ = interleaved(time, sent, np.full(4, -0.5))
    np.testing.assert_allclose(now, [0.0, 1.0, 1.55, 2.1, 3.0, 3.45])
    assert u.tolist() == [5.0, 5.0, 6.0, 6.0, 6.0, 7.0]
    # none overtakes another, and one that is on time needs no row of its own
    now, _, u, _ = interleaved(time[:3], np.array([5.0, 6.0, 7.0]), np.array([0.0, -0.9, 0.5]))
    np.testing.assert_allclose(now, [0.0, 1.0, 1.99, 1.99, 2.1])
    assert u[[0, 1, 4]].tolist() == [5.0, 5.0, 7.0]
    _, _, u, rows = interleaved(time, sent, np.zeros(4))
    assert u.tolist() == sent.tolist()
    assert rows.tolist() == [0, 1, 2, 3]


def test_a_phase_moves_commands_between_samples():
    bench = Bench([recording()])
    on_time, half, whole = (
        bench.run(complete({**VALUES, 'phase': phase, 'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 0.0}))[0][1]
        for phase in (0.0, 0.5, 0.999)
    )
    np.testing.assert_allclose(whole[:-1], on_time[1:], rtol=0, atol=0.1)
    assert np.abs(half - 0.5 * (on_time + whole)).max() < 0.2 * np.abs(whole - on_time).max()


def test_score_is_the_robust_square_of_the_residual_and_stops_at_its_bound():
    bench = Bench([recording(noise=0.2)])
    values = complete({**VALUES, 'f_s': 5.0})
    residual = np.nan_to_num(bench.residual(bench.run(values), 'x'))
    whole = bench.score(values, (), 'x')
    assert whole == pytest.approx(cost_of(residual), rel=1e-9)
    assert 0.1 * whole < bench.score(values, (), 'x', bound=0.1 * whole) < whole


def test_where_pressure_creeps_the_moment_of_a_slip_is_forgiven():
    slow, _, record = slow_valve(CREEPING, 0.2, T_g1=20.0, T_g2=25.0, f_s=7.0)
    bench = Bench([record])
    own, little, much = (
        bench.residual(bench.run(complete({**slow, 'f_s': f_s})), 'x') for f_s in (7.0, 7.05, 7.5)
    )
    assert np.nanmax(np.abs(own)) < 6.0
    assert np.nanmax(np.abs(little)) < 6.0
    assert np.nanmax(np.abs(much)) > 10.0


@pytest.mark.parametrize(('slip', 'part'), [(10.0, 0.0), (0.5, -0.2)])
def test_no_slip_takes_noise_away(slip, part):
    outputs = np.zeros((4, 100_000))
    target = np.random.default_rng(6).standard_normal(outputs.shape[1])
    outputs[2, 0], outputs[2, -1] = -slip, slip  # x may be anywhere between
    target[[0, -1]] = np.nan
    relief = forgive(outputs, 0, target.size, target, np.ones_like(target))
    assert relief < (part + 0.01) * target.size
    assert relief == pytest.approx(cost_of(target[1:-1]) - cost_of((target - outputs[3])[1:-1]))


def test_what_no_slip_explains_is_not_forgiven():
    slow, _, record = slow_valve(CREEPING, 0.2, T_g1=20.0, T_g2=25.0, f_s=7.0)
    bench = Bench([replace(record, x=record.x + 0.1 * (record.x - 45.0))])
    (own,) = bench.run(complete(slow))
    (stretch,) = bench.stretches
    missed = (stretch.counts['x'] - own[2]) / stretch.noise['x']
    beyond = np.abs(missed) > 2.0
    assert beyond.sum() > 1000
    # before a slip and behind it x is where the stem never is
    np.testing.assert_allclose(bench.residual([own], 'x')[beyond], missed[beyond])


def test_a_stem_that_is_let_go_at_a_constant_pressure_is_forgiven_nothing():
    x = np.concatenate([np.full(100, 20.0), np.full(900, 40.0)])
    x += 0.2 * np.random.default_rng(4).standard_normal(x.size)
    p2 = np.full(x.size, 60.0)
    bench = Bench([Recording(0.2 * np.arange(x.size), p2, p2, p2, x)])
    free = complete({**VALUES, 'f_s': 0.01, 'p1_0': 60.0, 'p2_0': 60.0, 'x_0': 20.0})
    residual = bench.residual(bench.run(free, (), ('p1', 'p2')), 'x')
    assert np.nanmedian(np.abs(residual[200:])) > 50.0


def test_a_stem_that_one_slip_could_let_go_at_any_time_is_not_forgiven_all():
    time = 0.2 * np.arange(3000)
    x = np.where(time % 60.0 < 30.0, 36.0, 38.0)
    x += 0.2 * np.random.default_rng(4).standard_normal(x.size)
    bench = Bench([Recording(time, np.full(x.size, 5.0), x=x)])
    brink = {'f_s': 34.0, 'f_d': 30.0, 'T_g1': 20.0, 'T_g2': 20.0}
    at_once, late = (
        bench.run(complete({**VALUES, **brink, 'p1_0': 5.2, 'p2_0': 5.2, 'x_0': 39.0 + above}))
        for above in (0.19, 0.01)
    )
    assert np.all(at_once[0][3] == at_once[0][2])
    assert np.ptp(late[0][2]) > 3.0
    assert np.all(late[0][3] == late[0][2])  # p2 is where it slips for 90 % of the record


@pytest.mark.parametrize('drive', [(), ('p1', 'p2')])
def test_a_stem_that_is_nearly_free_is_forgiven_nothing(drive):
    bench = Bench([recording(0.1)])
    free = {**VALUES, 'T_g1': 0.02, 'T_g2': 0.02, 'f_s': 0.01}
    free |= {'p1_0': 0.5, 'p2_0': 0.5, 'x_0': 0.5}
    results = bench.run(complete(free), (), drive)
    assert np.mean(results[0][3] != results[0][2]) < 0.02
    assert np.mean(np.abs(bench.residual(results, 'x')) > 5.0) > 0.3


def test_a_slip_that_hangs_on_what_noise_leaves_open_of_p2_comes():
    levels = ((20, 20.0), (300, 70.0), (300, 30.0), (300, 62.0), (300, 25.0))
    barely = ((300, 66.0), (300, 53.78), (300, 66.0), (300, 30.0))
    slow, _, record = slow_valve((*levels, *barely), 0.2, f_s=7.0, T_g1=4.0, T_g2=4.0)
    rng = np.random.default_rng(1)
    noisy = {n: record.output(n) + 0.2 * rng.standard_normal(len(record)) for n in ('p1', 'p2')}
    fitter = Fitter(Bench([replace(record, **noisy)]))
    first, second, stem = groups(('p1', 'p2', 'x'))
    missed = Valve({**slow, 'f_d1': 0.52})  # the true dead band is 0.5
    assert leftover(fitter.residuals(missed, 'x')).excess > 5.0
    found = loosened(fitter, stem, missed)
    assert leftover(fitter.residuals(found, 'x')).excess < odds.SPOTLESS
    assert found.cost < 0.1 * fitter.score(missed, 'x')
    for group in (first, second):
        spans = intervals(fitter, group, missed, 1.0)
        for name in ('f_d1', 'T_g1', 'T_g2'):
            low, high = spans.get(name, (-np.inf, np.inf))
            middle, width = 0.5 * (low + high), high - low
            assert name not in spans or abs(found.values[name] - middle) < width


@pytest.mark.parametrize('offset', [0.0, 0.685, 0.3])
def test_a_coarse_sensor_shows_its_steps(offset):
    record = recording(noise=0.2)

    def seen(x):
        return Bench([Recording(record.time, record.u, x=x)]).grids_of_x

    coarse = 1.37 * np.round((record.x - offset) / 1.37) + offset
    for noise in (0.0, 0.1, 0.3):
        late = coarse + noise * np.random.default_rng(2).standard_normal(coarse.size)
        step, found = seen(late)[0]
        free = noise > 0.2 and offset > 0.0  # both hang together then
        assert step == pytest.approx(1.37, rel=2e-3 if free else 1e-3)
        assert found == pytest.approx(offset, abs=0.1 if free else 0.03)
    assert seen(record.x) == ()
    assert seen(np.round(record.x, 2)) == ()  # as written down, far below the noise
    first = Bench([Recording(record.time, record.u, x=coarse)])
    step, found = first.grid_of_x
    assert step == pytest.approx(1.37, rel=1e-6)
    assert found == pytest.approx(offset, abs=1e-4)
    noisy = coarse + 0.1 * np.random.default_rng(2).standard_normal(coarse.size)
    for other in (noisy, record.x, np.round(record.x, 1)):
        assert Bench([Recording(record.time, record.u, x=other)]).grid_of_x == (0.0, 0.0)


def test_a_stem_put_to_rest_displaces_the_air_it_would_have_moved():
    names = ('ratio', 'displacement', 'absolute_pressure')
    effects = {f'chamber_volume.{n}': v for n, v in zip(names, (1.5, 1.0, 150.0), strict=True)}
    record = recording(**effects)
    bench = Bench([record])
    start = {'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 0.0}
    friction = {'f_s': 200.0, 'f_d': 200.0}  # moves only where it is put
    stuck = complete({**VALUES, **start, **effects, **friction})
    (result,) = bench.run(stuck, ('chamber_volume',), ('x',))
    (free,) = bench.run({**stuck, 'chamber_volume.displacement': 0.0}, ('chamber_volume',), ('x',))
    dips = np.abs(result[1] - free[1])
    assert dips.max() > 5.0


def test_a_stem_is_put_to_rest_only_where_it_is_far_from_it():
    record = recording(noise=0.2)
    x = np.array(record.x)
    x[np.random.default_rng(3).random(x.size) < 0.02] = np.nan
    bench = Bench([Recording(record.time, record.u, record.p1, record.p2, x)])
    start = {'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 0.0}
    right, stiff = complete({**VALUES, **start}), complete({**VALUES, **start, 'f_s': 9.0})
    assert bench.score(right, (), 'x', (ON_TIME,)) == bench.score(right, (), 'x')
    assert bench.score(stiff, (), 'x', (ON_TIME,)) < 0.8 * bench.score(stiff, (), 'x')


def test_a_stem_that_is_caught_may_slip_a_little_late():
    slow, _, record = slow_valve(CREEPING, 0.2, T_g1=20.0, T_g2=25.0, f_s=7.0)
    bench = Bench([record])
    late = complete({**slow, 'f_s': 7.25, 'f_d/f_s': slow['f_d/f_s'] * 7.0 / 7.25})
    right = bench.score(complete(slow), (), 'x')
    assert bench.score(late, (), 'x', (ON_TIME,)) > right + 200.0
    assert bench.score(late, (), 'x', (CAUGHT,)) < right + 20.0


@pytest.mark.parametrize('drive', [(), (CAUGHT,), (RESTS,)])
def test_the_search_for_a_base_valve_comes_to_an_end(drive, monkeypatch):
    begun = []

    def counted(self, valve, *rest):
        begun.append(rest)
        assert len(begun) <= 100
        return valve

    monkeypatch.setattr(Fitter, 'evolve', counted)
    record = recording(noise=0.2, **{'vibration.amplitude': 3.0, 'vibration.frequency': 0.15})
    bench = Bench([record])
    found = find_base(Fitter(bench), groups(bench.signals)[-1], starting_valve(bench), drive)
    assert begun
    assert np.isfinite(found.cost)


def test_a_stem_is_where_it_was_seen_until_it_travels():
    bench = Bench([recording(noise=0.2)])
    (result,) = bench.run(complete({**VALUES, 'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 2.0}))
    assert result[2, 15] == pytest.approx(0.0, abs=0.3)


def test_a_play_nobody_saw_before_the_record_does_not_reach_p2():
    u = np.concatenate([np.full(200, 90.0), np.full(100, 60.0), commands()[20:]])
    slow = complete({**VALUES, 'T_g1': 20.0, 'T_g2': 20.0})
    values = {n: v for n, v in slow.items() if n not in ('phase', 'damping')}
    neutral = {f'hysteresis.{p.name}': p.neutral for p in CATALOGUE['hysteresis'].parameters}
    play = {**neutral, 'hysteresis.command_width': 5.0, 'hysteresis.reach': 1.0}
    parameters = {n: v for n, v in values.items() if '/' not in n}
    run = simulate(u, parameters={**parameters, 'effects': ['hysteresis'], **play})
    noise = 0.2 * np.random.default_rng(3).standard_normal((2, u.size))
    later = slice(250, None)
    p1, p2 = (run.p1 + noise[0])[later], (run.p2 + noise[1])[later]
    bench = Bench([Recording(run.t[: p1.size], u[later], p1, p2)])
    results = bench.run({**slow, **play}, ('hysteresis',))
    assert np.abs(results[0][0] - run.p1[later])[:50].max() > 3.0
    assert np.nanmax(np.abs(bench.residual(results, 'p2'))) < 5.0


@pytest.mark.parametrize('seed', [1, 2, 3, 4])
def test_a_stem_that_creeps_at_first_is_not_stopped_by_noise_of_p1(seed):
    levels = ((50, 50.0), (80, 62.4), (400, 67.0), (700, 20.0), (700, 70.0))
    slow, truth, record = slow_valve(
        levels, 0.2, T_g1=1.8, T_g2=60.0, f_s=11.0, **{'f_d/f_s': 0.44}
    )
    white = np.random.default_rng(seed).standard_normal(record.u.size)
    p1 = record.p1 + 0.3 * lfilter([0.83], [1.0, -0.55], white)
    bench = Bench([replace(record, p1=p1)])
    assert np.ptp(truth.x[:130]) < 8.0  # not so far that plays before the stem are forgotten
    assert np.nanmax(np.abs(bench.residual(bench.run(complete(slow)), 'x'))) < 6.0


@pytest.mark.parametrize('noise', [0.1, 0.3])
def test_a_stem_that_creeps_at_first_is_not_held_where_it_seems_to_rest(noise):
    levels = ((50, 70.0), (150, 20.0), (700, 90.0))
    slow, _, record = slow_valve(levels, noise, T_g1=12.0, T_g2=60.0, f_s=10.0)
    bench = Bench([record])
    assert np.nanmax(np.abs(bench.residual(bench.run(complete(slow)), 'x'))) < 6.0


def test_a_first_slip_that_was_seen_on_its_way_goes_on():
    levels = ((50, 20.0), (300, 31.0), (300, 20.0))
    slow, truth, record = slow_valve(levels, 0.2, T_g1=12.0, T_g2=60.0, f_s=10.0)
    slip = int(np.argmax(np.abs(np.diff(truth.x)) > 1.0)) + 1
    x = np.array(record.x)
    x[slip] = x[slip - 1] + 1.1  # the sample came while the stem had just left
    bench = Bench([Recording(record.time, record.u, record.p1, record.p2, x)])
    off = bench.residual(bench.run(complete(slow)), 'x')
    assert np.nanmax(np.abs(off[slip + 10 :])) < 6.0  # where p2 creeps, a slip may come late


@pytest.mark.parametrize('calibration', [(0.0, 1.0), (-1.0, 0.85)])
@pytest.mark.parametrize(('first', 'T_g2'), [(200, 60.0), (300, 60.0), (120, 30.0)])
def test_a_stem_that_moves_when_the_record_begins_moves_on(first, T_g2, calibration):
    levels = ((50, 70.0), (500, 20.0), (700, 90.0))
    slow, truth, record = slow_valve(levels, 0.2, T_g1=12.0, T_g2=T_g2, f_s=10.0)
    zero, span = calibration
    slow |= {'sensor_calibration.zero': zero, 'sensor_calibration.span': span}
    truth, record = (replace(each, x=zero + span * each.x) for each in (truth, record))
    bench = Bench([record.slice(0.2 * first, np.inf)])
    speed = (truth.x[first + 20] - truth.x[first]) / 4.0
    assert bench.stretches[0].speed == pytest.approx(speed, rel=0.15)
    start = {f'{name}_0': truth.output(name)[first] for name in ('p1', 'p2', 'x')}
    result = bench.run(complete({**slow, **start}), ['sensor_calibration'])
    assert np.nanmax(np.abs(bench.residual(result, 'x'))) < 6.0


@pytest.mark.parametrize('off', [-0.5, 0.0, 0.5])
def test_a_stem_that_moves_when_the_record_begins_does_not_stop_for_its_noise(off):
    levels = ((50, 70.0), (250, 20.0), (400, 60.0))
    slow, truth, record = slow_valve(levels, 0.2, T_g1=12.0, T_g2=60.0, f_s=10.0)
    bench = Bench([record.slice(0.2 * 260, np.inf)])
    start = {f'{name}_0': truth.output(name)[260] for name in ('p1', 'p2', 'x')}
    start['x_0'] += off  # as its first samples may have it
    assert bench.stretches[0].speed < 0.0
    result = bench.run(complete({**slow, **start}))
    assert np.nanmax(np.abs(bench.residual(result, 'x'))) < 6.0


def test_a_stem_that_slips_when_the_record_begins_is_put_where_it_comes_to_rest():
    levels = ((50, 20.0), (300, 30.7), (300, 27.0), (300, 60.0))
    slow, truth, record = slow_valve(levels, 0.2, T_g1=12.0, T_g2=60.0, f_s=10.0)
    slip = int(np.argmax(np.abs(np.diff(truth.x)) > 1.0))
    assert abs(truth.x[slip + 2] - truth.x[slip]) > 3.0
    bench = Bench([record.slice(0.2 * slip, np.inf)])
    start = {f'{name}_0': truth.output(name)[slip] for name in ('p1', 'p2', 'x')}
    result = bench.run(complete({**slow, **start, 'x_0': start['x_0'] + 3.0}))
    assert np.nanmax(np.abs(bench.residual(result, 'x'))) < 6.0


@pytest.mark.parametrize(('level', 'T_g2'), [(54.0, 20.0), (52.0, 15.0), (50.0, 30.0)])
def test_a_stem_that_slips_when_the_record_begins_and_then_creeps_is_not_held(level, T_g2):
    levels = ((50, 70.0), (600, level), (600, 80.0))
    slow, truth, record = slow_valve(levels, 0.3, T_g1=12.0, T_g2=T_g2, f_s=10.0)
    begin = int(np.argmax(np.abs(np.diff(truth.x)) > 1.0)) - 4
    bench = Bench([record.slice(0.2 * begin, np.inf)])
    start = {f'{name}_0': truth.output(name)[begin] for name in ('p1', 'p2', 'x')}
    result = bench.run(complete({**slow, **start}))
    assert np.nanmax(np.abs(bench.residual(result, 'x'))) < 6.0


def test_a_positioner_can_be_given_any_gain_of_the_catalogue():
    u = np.repeat([90.0, 5.0], 200)
    run = simulate(
        u,
        parameters={
            'effects': ['positioner_loop'],
            'positioner_loop.gain': 3.0,
            'positioner_loop.overdrive': 1000.0,
            'positioner_loop.underdrive': 1000.0,
        },
    )
    assert run.p1.min() < -150.0


def test_a_stem_that_moves_is_smoothed_along_lines_up_to_steps_of_the_command():
    slopes = (0.0, 0.5, -0.8, 0.1, -0.2)
    x = 50.0 + np.cumsum(np.repeat(slopes, 40))
    u = np.repeat(np.arange(5) * 20.0, 40)
    x[40:] += 8.0  # a slip
    noisy = x + 0.25 * np.random.default_rng(2).standard_normal(x.size)
    error = straightened(noisy, np.append(u[1:], u[-1]), 0.25) - x
    assert np.sqrt(np.mean(error**2)) < 0.45 * 0.25
    assert np.abs(error).max() < 3.0 * 0.25


def test_a_loop_is_seen_through_a_stem_held_where_it_was_measured():
    loop = {
        'positioner_loop.gain': 1.5,
        'positioner_loop.integral_gain': 0.03,
        'positioner_loop.initial_integral': 4.0,
        'positioner_loop.overdrive': 20.0,
        'positioner_loop.underdrive': 20.0,
        'positioner_loop.integral_limit': 1000.0,
    }
    bench = Bench([recording(noise=0.2, **loop)])
    wrong_stem = {**VALUES, 'f_s': 12.0, 'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 0.0}
    values = complete({**wrong_stem, **loop})

    def excess(values, drive):
        results = bench.run(values, ('positioner_loop',), drive)
        return leftover(np.nan_to_num(bench.residual(results, 'p1'))).excess

    held = excess(values, (HELD,))
    assert held < 0.1 * excess(values, ())
    assert held < 0.1 * excess({**values, 'positioner_loop.initial_integral': 0.0}, (HELD,))


ANY_DRIVE = {'positioner_loop.overdrive': 1000.0, 'positioner_loop.underdrive': 1000.0}


@pytest.mark.parametrize(
    ('effects', 'off'),
    [
        ({'ip_lag.time_constant': 1.0}, 2e-3),
        ({'air_leak.leak_rate': 0.02}, 2e-3),
        ({'positioner_loop.gain': 1.0, **ANY_DRIVE}, 0.15),
    ],
    ids=['lag', 'leak', 'loop'],
)
def test_what_pushes_a_stem_need_not_run_again_with_it(effects, off):
    record = recording(**effects)
    bench = Bench([record])
    bench.before = tuple(dict.fromkeys(name.split('.')[0] for name in effects))
    neutral = {f'{e}.{p.name}': p.neutral for e in bench.before for p in CATALOGUE[e].parameters}
    values = complete({**VALUES, **neutral, **effects, 'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 0.0})
    (result,) = bench.run(values, bench.before, (MODELLED,))
    # within a sample p2 goes another way, so that a slip may come a little sooner
    for row, name, most in ((1, 'p2', off), (2, 'x', max(off, 0.02))):
        assert np.sqrt(np.mean((result[row] - record.output(name)) ** 2)) < most, name
    # with other values it is pushed otherwise
    first = next(iter(effects))
    other = complete({**values, first: 0.5 * effects[first]})
    (moved,) = bench.run(other, bench.before, (MODELLED,))
    assert np.abs(moved[1] - result[1]).max() > 1.0


@pytest.mark.parametrize('phase', [0.0, 0.5, -0.5])
@pytest.mark.parametrize('ramp', [False, True])
def test_an_unknown_p1_drives_p2_where_it_was_not_measured_as_well(ramp, phase):
    sent = commands(600)
    if ramp:
        sent = np.interp(np.arange(sent.size), np.arange(0, sent.size, 50), sent[::50])
    fine = np.interp(np.arange(0.0, sent.size, 0.1), np.arange(sent.size), sent)
    came = fine if ramp else np.roll(np.repeat(sent, 10), -round(10 * phase))
    # the valve receives what no stage tells: another range
    valve = {name: VALUES[name] for name in ('f_d1', 'T_g1', 'T_g2')}
    truth = simulate(0.7 * came + 9.0, 0.02, valve)
    rng = np.random.default_rng(3)
    p1, p2 = (each[::10] + 0.1 * rng.standard_normal(sent.size) for each in (truth.p1, truth.p2))
    p1 = np.where(rng.random(p1.size) < 0.02, np.nan, p1)
    bench = Bench([Recording(truth.t[::10], sent, p1, p2)])
    values = complete({**VALUES, 'phase': phase})

    def excess():
        return leftover(bench.residual(bench.run(values, (), ('p1',)), 'p2')).excess

    wrong = excess()
    bench.stretches[0].stand_alone('p1')
    assert wrong > 1.0
    assert excess() < 0.3


def test_the_cheapest_are_right_where_costs_stop_counting_at_a_bound():
    costs = np.append(np.random.default_rng(3).permutation(200), 200.0)

    def counted(cost, bound):
        return min(cost, bound + 0.5)

    found = cheapest(counted, costs, 7)
    assert np.argsort(found)[:7].tolist() == np.argsort(costs)[:7].tolist()
    assert sorted(found)[:7] == list(range(7))
    assert found[-1] < costs[-1]  # counted last, it is known to be hopeless
    assert np.array_equal(cheapest(counted, costs[:5], 7), costs[:5])
    assert min(cheapest(counted, costs[costs > 50.0], 7, bound=20.0)) == 20.5


def test_single_steps_of_the_command_show_whether_arrivals_are_mixed():
    record = recording(noise=0.1)
    steps = np.flatnonzero(np.diff(record.u)) + 1
    some = np.array(record.p1)
    some[steps[::3]] = some[steps[::3] - 1]
    each = np.array(record.p1)
    each[steps] = each[steps - 1]
    for p1, mixed in ((record.p1, False), (some, True), (each, False)):
        bench = Bench([Recording(record.time, record.u, p1)])
        wrong = [np.tile(1.2 * record.u, (4, 1))]  # an effect spoils the base valve
        assert mixed_arrivals(bench, wrong) == mixed


def test_a_record_that_begins_in_motion_starts_at_its_first_sample():
    rng = np.random.default_rng(4)
    u = np.repeat(rng.uniform(10.0, 90.0, 30), rng.integers(30, 100, 30))
    run = simulate(u, parameters={'f_d1': 0.5, 'T_g1': 2.0, 'T_g2': 5.0, 'f_s': 4.0, 'f_d': 2.4})
    assert run.p2[1] > 5.0
    noisy = [each + 0.2 * rng.standard_normal(u.size) for each in (run.p1, run.p2)]
    bench = Bench([Recording(run.t, u, *noisy)])
    assert bench.stretches[0].first['p2'] == pytest.approx(0.0, abs=1.0)
    noisy[1][0] = 30.0  # an outlier
    bench = Bench([Recording(run.t, u, *noisy)])
    assert bench.stretches[0].first['p2'] < 10.0


@pytest.mark.parametrize('rms', [0.1, 0.6])  # moves of up to 13 or 2.2 times the noise
def test_a_command_that_always_moves_shows_it_too_and_no_lag_passes_for_chance(rms):
    rng = np.random.default_rng(8)
    u = 50.0 + 40.0 * np.sin(np.arange(3000) / 30.0)
    noise = rms * rng.standard_normal(3000)
    last = np.roll(u, 1)
    some = np.where(rng.random(3000) < 0.3, last, u)
    lagging = lfilter([0.5], [1.0, -0.5], u - u[0]) + u[0]
    for p1, mixed in ((u, False), (some, True), (last, False), (lagging, False)):
        bench = Bench([Recording(0.2 * np.arange(3000), u, p1 + noise)])
        assert mixed_arrivals(bench, [np.tile(u, (4, 1))]) == mixed


@pytest.mark.parametrize('signals', [('p1', 'p2'), ('p2',)])
def test_steps_that_came_before_the_sample_are_told_by_what_follows(signals):
    u = commands(3000)
    steps = np.flatnonzero(np.diff(u)) + 1
    early = steps[1::3]
    sent = u.copy()
    sent[early - 1] = u[early]
    values = {n: v for n, v in complete(VALUES).items() if n not in ('phase', 'damping')}
    run = simulate(sent, parameters={n: v for n, v in values.items() if '/' not in n})
    noise = 0.2 * np.random.default_rng(6).standard_normal((2, u.size))
    p1, p2 = run.p1.copy(), run.p2 + noise[1]
    p1[early - 1] = p1[early - 2]  # taken a little before the command
    measured = {'p1': p1 + noise[0], 'p2': p2}
    fitter = Fitter(Bench([Recording(run.t, u, **{name: measured[name] for name in signals})]))
    valve = starting_valve(fitter.bench)
    for group in groups(signals):
        valve = find_base(fitter, group, valve, ())
    assert np.abs(u - sent).max() > 50.0
    # only steps too small to tell may be left
    assert np.abs(fitter.bench.stretches[0].u - sent).max() < 10.0
    assert leftover(fitter.residuals(valve, 'p2')).excess < 0.05


def test_an_outlier_is_a_value_that_neighbours_who_agree_do_not_share():
    record = recording(noise=0.1)
    p1 = np.array(record.p1)
    step = np.flatnonzero(np.abs(np.diff(record.u)) > 20.0)[3]
    p1[step + 1] += 0.3 * (p1[step + 1] - p1[step])  # a peak of the loop
    p1[step + 20] += 5.0
    measured = Bench([Recording(record.time, record.u, p1)]).stretches[0].measured['p1']
    assert np.isfinite(measured[step + 1])
    assert np.isnan(measured[step + 20])


def test_a_search_for_growing_friction_starts_where_the_stem_holds_as_before():
    group = groups(('x',))[0]
    dwell = next(c for c in group.candidates() if c.effect == 'dwell_friction')
    start = {**dwell.neutral, 'dwell_friction.growth': 0.6}
    there, _ = dwell.balanced(VALUES['f_s'], VALUES, start)
    assert there['f_s'] * 1.6 == pytest.approx(VALUES['f_s'])
    assert there['f_s'] * there['f_d/f_s'] == pytest.approx(VALUES['f_s'] * VALUES['f_d/f_s'])


def test_data_show_where_a_signal_begins_and_what_holds_the_stem():
    record = recording(noise=0.3)
    bench = Bench([record])
    assert bench.stretches[0].first['x'] == pytest.approx(0.0, abs=0.2)
    results = bench.run(complete({**VALUES, 'p1_0': 0.0, 'p2_0': 0.0, 'x_0': 0.0}))
    friction, _ = friction_seen(bench, results)
    assert friction == pytest.approx(VALUES['f_s'], rel=0.25)
    off = Bench([Recording(record.time, record.u, record.p1, record.p2, 0.9 * record.x + 4.0)])
    (_, zero), (_, span) = calibration_seen(off, results).values()
    assert span == pytest.approx(0.9, abs=0.03)
    assert zero == pytest.approx(4.0, abs=1.5)
