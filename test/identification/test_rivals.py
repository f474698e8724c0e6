# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Rival models out of records that they made, and what the paper's step tells of them."""

import json

from click.testing import CliRunner
import numpy as np
import pytest

from valve_sim_ros import (
    IdentificationError,
    identify,
    InitialState,
    ModelError,
    read_parameters,
    Recording,
    simulate,
    write_recording,
)
from valve_sim_ros.cli import main
from valve_sim_ros.identification.candidates import Candidates
from valve_sim_ros.identification.rivals import _candidates, identify_rival
from valve_sim_ros.model.rivals import RIVALS

DATA_DRIVEN = [name for name, model in RIVALS.items() if model.data_driven]
PHYSICAL = [name for name, model in RIVALS.items() if not model.data_driven]
FAST = {'T_g1': 2.0, 'T_g2': 5.0}


def ramps(n=1500):
    """Return ramps between random levels, with rests, from where a closed valve rests."""
    rng = np.random.default_rng(4)
    corners = np.r_[0.0, np.cumsum(rng.integers(20, 60, 60))]
    levels = np.repeat(rng.uniform(0.0, 100.0, 31), 2)[:61]
    levels[:2] = 0.0
    return np.interp(np.arange(n), corners, levels)


def record(u, noise=0.05, **parameters):
    s = simulate(u, parameters=parameters)
    return Recording(s.t, s.u, x=s.x + noise * np.random.default_rng(0).standard_normal(u.size))


def step_record():
    u = np.r_[np.zeros(45), np.full(280, 50.0)]
    return record(u, 0.2)


@pytest.mark.parametrize('name', DATA_DRIVEN)
def test_data_driven_models_are_found_again(name):
    truth = RIVALS[name].from_friction(7.3, 3.1)
    result = identify_rival(name, (record(ramps(), model=name, **truth),), hold_out=True)
    assert result.eta > 99.9
    for key, value in truth.items():
        found = result.estimates[key]
        assert found.value == pytest.approx(value, abs=max(0.05, found.half_width)), key
        assert found.verdict == 'identified'
    # a jump more or less in the third that was not seen costs much
    assert result.eta_held_out['last third']['held_out']['x'] > 80.0


@pytest.mark.parametrize('name', ['classical', 'karnopp'])
def test_physical_models_find_the_base_valve(name):
    truth = {'f_s': 7.0, 'f_d': 4.0, **FAST}
    data = record(np.repeat(np.random.default_rng(5).uniform(5.0, 95.0, 24), 50), 0.1, **truth)
    result = identify(data, model=name, hold_out=False)
    assert result.eta > 99.9
    for key, value in truth.items():
        # Karnopp's stem stops at a higher speed, so it breaks away at another level
        if (name, key) != ('karnopp', 'f_s'):
            assert result.spec.values[key] == pytest.approx(value, rel=0.05), key
    assert 'held at its default' in result.estimates['a_1'].verdict


def test_a_step_cannot_tell_he_from_kano():
    step = step_record()
    he, kano = (identify(step, model=name, hold_out=False) for name in ('he', 'kano'))
    assert he.eta == pytest.approx(kano.eta, abs=1e-6)
    # the smallest f_s that fits as well: no jump, as the paper's own estimates
    assert kano.spec.values['J'] == 0.0
    assert he.spec.values['f_s'] == he.spec.values['f_d']
    assert kano.spec.values['S'] == pytest.approx(2.0 * he.spec.values['f_d'], abs=1e-6)
    assert 'fit as well' in he.estimates['f_s'].verdict


def test_not_worse_than_a_dense_grid():
    t = 0.2 * np.arange(3000)
    u = 50.0 + 50.0 * np.cos(2.0 * np.pi * t / 300.0)
    s = simulate(u)
    data = Recording(s.t, s.u, x=s.x)
    for name in ('he', 'kano'):
        candidates: Candidates = _candidates(RIVALS[name], (data,), None, 'u')
        axis = np.arange(0.0, 60.0, 1.0)
        grid = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        dense = candidates.costs(grid[grid[:, 1] <= grid[:, 0]], 1.0).min()
        error = identify_rival(name, (data,), hold_out=False).fitted[0]['x'] - s.x
        assert float(error @ error) <= dense * (1.0 + 1e-9)


def test_segments_start_afresh():
    s = simulate(ramps(), parameters={'model': 'he', 'f_s': 7.3, 'f_d': 3.1})
    time, x = s.t.copy(), s.x.copy()
    time[1000:] += 60.0  # where the force on the stem is that of a fresh start
    x[300:310] = np.nan
    result = identify_rival('he', (Recording(time, s.u, x=x),))
    assert len(result.recordings[0].segments) == 2
    assert result.spec.values['f_s'] == pytest.approx(7.3, abs=0.3)


@pytest.mark.parametrize('name', ['kano', 'classical'])
def test_files_load_into_the_plant(name, tmp_path):
    write_recording(record(ramps(600), f_s=6.0, f_d=4.0, **FAST), tmp_path / 'bag')
    arguments = [str(tmp_path / 'bag'), '--out', str(tmp_path), '--model', name]
    done = CliRunner().invoke(main, ['identify', *arguments, '--hold-out', 'none'])
    assert done.exit_code == 0, done.output
    content = json.loads((tmp_path / 'identify.json').read_text())
    assert content['model'] == name
    assert set(content['parameters']) == set(RIVALS[name].defaults)
    assert (tmp_path / 'fit.png').stat().st_size > 10_000
    spec = read_parameters(tmp_path / 'fitted.yaml')
    assert spec.model == name
    data = identify(tmp_path / 'bag', model=name, hold_out=False)
    first = data.recordings[0].x[0]
    again = simulate(data.recordings[0].u, parameters=spec, initial=InitialState(x=first))
    if name == 'kano':
        np.testing.assert_allclose(again.x, data.fitted[0]['x'], rtol=0, atol=1e-9)


def test_refusals():
    u = ramps(300)
    s = simulate(u)
    with pytest.raises(IdentificationError, match='x is not measured'):
        identify(Recording(s.t, s.u, p2=s.p2), model='kano')
    with pytest.raises(IdentificationError, match='u is constant'):
        identify(Recording(s.t, np.full(300, 5.0), x=s.x), model='kano')
    with pytest.raises(IdentificationError, match='x is constant'):
        identify(Recording(s.t, s.u, x=np.full(300, 5.0)), model='kano')
    with pytest.raises(ModelError, match='expected base or one of'):
        identify(Recording(s.t, s.u, x=s.x), model='kanu')
    with pytest.raises(IdentificationError, match='p2 is not measured'):
        identify_rival('he', (Recording(s.t, s.u, x=s.x),), channel='p2')
