# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Known valves out of synthetic records, and refusals."""

import json

from click.testing import CliRunner
import numpy as np
import pytest

from valve_sim_ros import (
    IdentificationError,
    identify,
    ModelError,
    read_parameters,
    Recording,
    simulate,
    write_recording,
)
from valve_sim_ros.cli import main
from valve_sim_ros.identification.fitness import fitness
from valve_sim_ros.identification.problem import Problem

TRUTH = {'f_d1': 2.5, 'T_g1': 5.0, 'T_g2': 20.0, 'f_s': 7.0, 'f_d': 3.0}


def record(noise, signals=('p1', 'p2', 'x'), u=None):
    if u is None:
        u = np.repeat(np.random.default_rng(5).uniform(5.0, 95.0, 40), 50)
    s = simulate(u, parameters=TRUTH)
    rng = np.random.default_rng(0)
    return Recording(
        s.t, s.u, **{n: getattr(s, n) + noise * rng.standard_normal(u.size) for n in signals}
    )


@pytest.mark.parametrize(('noise', 'eta'), [(0.1, 99.5), (0.0, 99.99)])
@pytest.mark.parametrize('signals', [('p1', 'p2', 'x'), ('p2', 'x'), ('x',)])
def test_finds_the_truth(noise, eta, signals):
    result = identify(record(noise, signals))
    assert result.eta >= eta
    for name, true in TRUTH.items():
        assert result.spec.values[name] == pytest.approx(true, rel=0.02), name
    estimate = result.estimates['a_1']
    assert estimate.identified == (noise == 0.0)
    assert ('not separately' in estimate.verdict) == (noise > 0.0)


def test_same_seed_same_result():
    data = record(0.1, ('x',))
    assert (
        identify(data, seed=3, hold_out=False).spec == identify(data, seed=3, hold_out=False).spec
    )


def test_one_up_step_cannot_show_emptying():
    u = np.r_[np.zeros(40), np.full(400, 60.0)]
    result = identify(record(0.1, ('x',), u), hold_out=False)
    assert result.estimates['T_g2'].verdict != 'identified'
    assert result.estimates['f_d1'].verdict != 'identified'


def test_constant_signals_are_refused():
    with pytest.raises(IdentificationError, match='u is constant'):
        identify(record(0.1, ('x',), np.full(100, 50.0)))
    data = record(0.0)
    with pytest.raises(IdentificationError, match='x is constant'):
        identify(Recording(data.time, data.u, x=np.zeros(len(data))))


def test_fitness_is_eq_11():
    assert fitness(np.array([0.0, 2.0]), np.array([0.0, 1.0])) == pytest.approx(50.0)


def test_command_line_round_trip(tmp_path):
    write_recording(record(0.1), tmp_path / 'bag')
    run = CliRunner().invoke
    done = run(main, ['identify', str(tmp_path / 'bag'), '--out', str(tmp_path / 'out')])
    assert done.exit_code == 0, done.output
    content = json.loads((tmp_path / 'out/identify.json').read_text())
    assert set(content['parameters']) == {'f_d1', 'T_g1', 'T_g2', 'f_s', 'f_d', 'a_1', 'a_2'}
    assert content['eta'] > 99.5
    assert (tmp_path / 'out/fit.png').stat().st_size > 10_000
    fitted = read_parameters(tmp_path / 'out/fitted.yaml')
    assert fitted.values['f_s'] == content['parameters']['f_s']['value']
    arguments = ['--input', str(tmp_path / 'bag'), '--params', str(tmp_path / 'out/fitted.yaml')]
    done = run(main, ['simulate', *arguments, '--out', str(tmp_path / 'again.csv')])
    assert done.exit_code == 0, done.output
    assert (tmp_path / 'again.csv').read_text().startswith('t,u,p1,p2,x')


def test_command_line_refusals_leave_nothing(tmp_path):
    run = CliRunner().invoke
    out = tmp_path / 'out'
    write_recording(record(0.1, u=np.full(50, 20.0) + 0.0), tmp_path / 'flat.csv')
    for source, words in ((tmp_path / 'none', 'no such'), (tmp_path / 'flat.csv', 'constant')):
        done = run(main, ['identify', str(source), '--out', str(out)])
        assert done.exit_code == 1
        assert words in done.output
        assert 'Traceback' not in done.output
        assert not out.exists()


@pytest.mark.parametrize(
    ('text', 'words'),
    [
        ('[', 'not a YAML'),
        ('', 'expected one node'),
        ('/**: {ros__parameters: {fs: 3.0}}', 'unknown parameter'),
        ('/**: {ros__parameters: {f_s: wide}}', 'expected a number'),
        ('/**: {ros__parameters: {f_s: 1.0, f_d: 2.0}}', 'exceeds'),
    ],
)
def test_bad_parameter_files(tmp_path, text, words):
    (tmp_path / 'p.yaml').write_text(text)
    with pytest.raises(ModelError, match=words):
        read_parameters(tmp_path / 'p.yaml')


def test_long_data_are_searched_in_part_and_fitted_whole(monkeypatch):
    monkeypatch.setattr('valve_sim_ros.identification.identify.MOST_SEARCHED', 700)
    data = record(0.1)
    problem = Problem([data])
    part = problem.shortened(700)
    assert [stretch.u.size for stretch in part.stretches] == [700]
    assert problem.shortened(10**6) is problem
    result = identify(data, hold_out=False)
    assert result.fitted[0]['x'].size == len(data)
    for name, true in TRUTH.items():
        assert result.spec.values[name] == pytest.approx(true, rel=0.02), name
