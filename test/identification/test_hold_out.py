# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Fitted beside held out, by time and by bag; drift and too little data are said."""

import numpy as np
import pytest

from valve_sim_ros import IdentificationError, identify, Recording, simulate, ValveSpec
from valve_sim_ros.identification.holdout import HoldOut, remarks
from valve_sim_ros.identification.uncertainty import Estimate

TRUTH = {'f_d1': 2.5, 'T_g1': 5.0, 'T_g2': 20.0, 'f_s': 7.0, 'f_d': 3.0}


def record(seed, samples=1500, signals=('p2', 'x'), **changes):
    u = np.repeat(np.random.default_rng(seed).uniform(5.0, 95.0, samples // 50), 50)
    clean = simulate(u, parameters={**TRUTH, **changes})
    rng = np.random.default_rng(seed + 100)
    noise = {n: getattr(clean, n) + 0.1 * rng.standard_normal(u.size) for n in signals}
    return Recording(clean.t, clean.u, **noise)


def joined(first, second):
    """Return two recordings as one, the second a long gap after the first."""
    time = np.r_[first.time, second.time + first.time[-1] + 100.0]
    both = {n: np.r_[first.output(n), second.output(n)] for n in first.signals}
    return Recording(time, np.r_[first.u, second.u], **both)


def test_a_good_fit_holds_and_nothing_is_remarked():
    result = identify(record(1))
    assert set(result.eta_held_out) == {'first third', 'last third'}
    for etas in result.eta_held_out.values():
        assert etas['held_out']['x'] > 99.9
    assert result.remarks == ()


def test_several_bags_are_held_out_in_turn_and_start_on_their_own():
    result = identify([record(1), record(2), record(3, signals=('x',))])
    assert list(result.eta_held_out) == ['recording 1', 'recording 2', 'recording 3']
    assert result.eta > 99.9
    for name, true in TRUTH.items():
        assert result.spec.values[name] == pytest.approx(true, rel=0.01), name
    assert np.isnan(result.eta_held_out['recording 3']['held_out']['p2'])


def test_a_valve_that_changes_is_said_to_drift():
    result = identify(joined(record(1), record(2, f_s=10.0, T_g1=7.0)))
    text = '\n'.join(result.remarks)
    assert 'the valve drifts' in text
    assert 'f_s drifts' in text
    assert 'NOTE: ' in '\n'.join(result.lines())


def test_over_fitting_is_told_from_drift():
    eta = {'fitted': {'x': 99.9}, 'held_out': {'x': 80.0}}
    apart = [
        HoldOut('first third', ValveSpec({'f_s': 7.0}), eta, {'x': 9.0}),
        HoldOut('last third', ValveSpec({'f_s': 7.01}), eta, {'x': 1.0}),
    ]
    estimates = {'f_s': Estimate(7.0, 0.1, 'identified', 6.9, 7.1, 0.05, '%')}
    (line,) = remarks(apart, estimates, misfit=1.0)
    assert 'first third held out' in line
    assert 'over-fitted' in line
    assert 'lacks something' in remarks(apart, estimates, misfit=3.0)[0]
    apart[1] = HoldOut('last third', ValveSpec({'f_s': 8.0}), eta, {'x': 1.0})
    assert 'f_s drifts: 7 % without' in remarks(apart, estimates, misfit=1.0)[1]


@pytest.mark.parametrize(('way', 'words'), [('bags', 'two recordings'), ('often', 'expected one')])
def test_impossible_hold_outs_are_refused(way, words):
    with pytest.raises(IdentificationError, match=words):
        identify(record(1), hold_out=way)


def test_signals_can_be_chosen():
    data = record(1)
    assert identify(data, signals=['x'], hold_out=False).signals == ('x',)
    with pytest.raises(IdentificationError, match='p1 is not measured'):
        identify(data, signals=['p1'])
