# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A valve behind a positioner, whose slips come back to the pressures within a sample."""

from dataclasses import replace

import numpy as np
import pytest

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import diagnose, odds
from valve_sim_ros.diagnosis.adequacy import leftover
from valve_sim_ros.diagnosis.base_valve import find_base, starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.fitting import Fitter
from valve_sim_ros.diagnosis.loop import closed_loop
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.diagnosis.stretch import MODELLED
from valve_sim_ros.diagnosis.unknowns import EARLY
from valve_sim_ros.recordings.recording import Recording

LOOP = 'positioner_loop'
ANY_DRIVE = {f'{LOOP}.overdrive': 1000.0, f'{LOOP}.underdrive': 1000.0}
PERIOD, FINE = 20, 0.01
LAGS = {'f_d1': 1.5, 'T_g1': 6.0, 'T_g2': 1.0}
VALVE = {**LAGS, 'f_s': 7.0, 'f_d': 4.0, 'a_1': 2700.0, 'a_2': 180.0}


def recorded(gain, valve=VALVE, **effects):
    """Return the record of a valve whose slips come back to p1 and p2 within a sample."""
    rng = np.random.default_rng(2)
    u = np.repeat(rng.uniform(20.0, 80.0, 25), 50 * PERIOD)
    used = [LOOP, *{name.split('.')[0] for name in effects}]
    given = {**ANY_DRIVE, f'{LOOP}.gain': gain, **effects}
    run = simulate(u, FINE, {**valve, 'effects': used, **given})
    u, p1, p2, x = (each[::PERIOD] for each in (u, run.p1, run.p2, run.x))
    noisy = (each + 0.2 * rng.standard_normal(u.size) for each in (p1, p2, x))
    return Recording(FINE * PERIOD * np.arange(u.size), u, *noisy)


def behind_a_positioner(gain, **effects):
    """Return a fitter, the groups, and a valve as one with a stem as measured is found."""
    bench = Bench([recorded(gain, **effects)])
    fitter = Fitter(bench, phase=EARLY, drive=('p1', MODELLED))
    parts = groups(bench.signals)
    bench.before = (LOOP,)
    added = next(each for each in parts[0].candidates() if each.effect == LOOP)
    found = {'f_d1': 1.4, 'T_g1': 6.0, 'T_g2': 0.9, f'{LOOP}.gain': gain}
    valve = starting_valve(bench)
    values = {**valve.values, **added.neutral, **found}
    return fitter, parts, replace(valve, values=values, effects=(LOOP,), candidates=(added,))


def excess(fitter, valve, signal):
    return leftover(fitter.residuals(valve, signal)).excess


@pytest.mark.slow
@pytest.mark.parametrize('gain', [0.5, 2.0])
def test_slips_within_a_sample_are_told_by_the_whole_loop(gain):
    fitter, parts, valve = behind_a_positioner(gain)
    held = find_base(fitter, parts[-1], valve, fitter.drive)
    assert odds.unfinished(leftover(fitter.residuals(held, 'x')), odds.CLEAN)
    found, left = closed_loop(fitter, parts, valve)
    assert fitter.drive == ()
    assert left.excess == excess(fitter, found, 'x')
    assert excess(fitter, found, 'p1') < 0.5 * excess(fitter, held, 'p1')
    for signal in ('p2', 'x'):
        assert excess(fitter, found, signal) < 0.5 * odds.CLEAN
    assert found.values['f_s'] == pytest.approx(VALVE['f_s'], abs=0.1)
    assert found.values['T_g2'] == pytest.approx(VALVE['T_g2'], abs=0.03)


@pytest.mark.slow
def test_the_loop_explains_no_effect_of_the_stem():
    fitter, parts, valve = behind_a_positioner(2.0, **{'friction_asymmetry.difference': 0.4})
    drive = fitter.drive
    assert closed_loop(fitter, parts, valve) is None
    assert fitter.drive == drive


@pytest.mark.slow
def test_behind_a_positioner_with_a_quick_chamber_x_is_not_unknown():
    found = diagnose(recorded(2.0, {**VALVE, 'T_g2': 0.5}))
    assert found.verdict == 'missing_effect'
    assert [each.rung.effect for each in found.effects] == [LOOP]
    assert found.augmented.values['f_s'] == pytest.approx(VALVE['f_s'], abs=0.1)
    assert min(gap.closed for gap in found.gaps.values()) > 0.9
