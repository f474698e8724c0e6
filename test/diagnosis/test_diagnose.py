# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Diagnoses from end to end, on blind records made by another simulator."""

import json

from click.testing import CliRunner
import numpy as np
import pytest
from valves import recording

from blind import sets
from valve_sim_ros import (
    diagnose,
    DiagnosisError,
    read_parameters,
    Recording,
    simulate,
    ValveSpec,
)
from valve_sim_ros.cli import main
from valve_sim_ros.diagnosis.base_valve import starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.diagnose import _known
from valve_sim_ros.diagnosis.unknowns import complete
from valve_sim_ros.identification.watch import Stop
from valve_sim_ros.report.diagnosis import report

SMALL_SET = (
    ('singles', ('p1', 'p2'), 0),
    ('singles', ('p1', 'p2'), 2),
    ('singles', ('p1', 'p2', 'x'), 5),
    ('clean', ('p1', 'p2', 'x'), 0),
)
"""Set, signals and number of the blind records that are diagnosed here."""


@pytest.fixture(scope='module')
def small_set(tmp_path_factory):
    """Make the records and their keys."""
    folder = tmp_path_factory.mktemp('blind')
    made = []
    for number, (name, signals, index) in enumerate(SMALL_SET):
        here = folder / str(number)
        record = sets.generate_one(name, 'tuning', signals, 7, here, index)
        (path,) = (here / 'records').glob(f'{record}*')
        made.append((path, json.loads((here / 'keys' / f'{record}.json').read_text())))
    return made


@pytest.mark.slow
@pytest.mark.parametrize('number', range(len(SMALL_SET)))
def test_the_hidden_effect_is_named(small_set, number):
    path, key = small_set[number]
    found = diagnose(path).as_json()
    named = [effect['id'] for effect in found['effects']]
    twins = [twin for effect in found['effects'] for twin in effect['indistinguishable_from']]
    assert named == key['effects'] or set(key['effects']) <= set(twins)
    assert found['verdict'] == ('missing_effect' if key['effects'] else 'adequate')


@pytest.mark.slow
def test_a_chamber_that_may_fill_and_empty_only_so_fast_is_named():
    limits = {'pressure_rate': 1000.0, 'filling_rate': 6.0, 'emptying_rate': 3.0}
    record = recording(0.2, **{f'rate_limit.{name}': rate for name, rate in limits.items()})
    found = diagnose(Recording(record.time, record.u, record.p1, record.p2))
    assert found.verdict == 'missing_effect'
    (named,) = found.as_json()['effects']
    assert named['id'] == 'rate_limit'
    rates = {name: each['value'] for name, each in named['parameters'].items()}
    assert rates['filling_rate'] == pytest.approx(6.0, rel=0.05)
    assert rates['emptying_rate'] == pytest.approx(3.0, rel=0.05)


def test_the_speed_of_stopping_in_a_parameter_file_counts():
    bench, spec = Bench([recording()]), ValveSpec().changed({'delta': 0.0984})
    printed, known = (_known(starting_valve(bench), each) for each in (None, spec))
    assert (printed.values['delta'], known.values['delta']) == (1e-5, 0.0984)
    same = complete({**known.values, 'delta': 1e-5})
    (early,), (late,) = bench.run(complete(known.values)), bench.run(same)
    assert np.abs(early[2] - late[2]).max() > 0.1


@pytest.mark.slow
def test_the_results_load_and_show_the_effect(small_set, tmp_path):
    path, _ = small_set[0]
    told = CliRunner().invoke(main, ['diagnose', str(path), '--out', str(tmp_path), '--seed', '1'])
    assert told.exit_code == 0, told.output
    assert 'missing: ' in told.output
    found = json.loads((tmp_path / 'diagnosis.json').read_text())
    assert set(found) >= {'schema_version', 'signals', 'verdict', 'effects', 'where', 'gap', 'eta'}
    base, augmented = (read_parameters(tmp_path / f'{n}.yaml') for n in ('base', 'augmented'))
    assert augmented.effects == tuple(effect['id'] for effect in found['effects'])
    u = np.repeat([20.0, 70.0, 40.0, 80.0], 200)
    shown = [simulate(u, parameters=spec).p2 for spec in (base, augmented)]
    assert np.abs(shown[0] - shown[1]).max() > 0.5
    page = (tmp_path / 'report.html').read_text()
    assert found['effects'][0]['id'] in page
    assert 'http' not in page.replace('http://www.w3.org', '')
    assert (tmp_path / 'decide_by.csv').exists()


@pytest.mark.slow
def test_the_effect_left_out_of_the_catalogue_is_not_named(small_set):
    path, key = small_set[0]
    found = diagnose(path, without=key['effects'])
    assert key['effects'][0] not in [named.rung.effect for named in found.effects]
    assert found.verdict == 'unknown_effect'


@pytest.mark.slow
def test_what_was_found_until_it_is_stopped_is_kept(small_set, tmp_path):
    path, _ = small_set[0]
    asked = []

    def stop_from_p2(share, text):
        asked.append(text)
        if 'looking at p2' in asked:  # from then on, until the end
            raise Stop

    found = diagnose(path, progress=stop_from_p2)
    assert found.partial
    assert [ladder.complete for ladder in found.ladders] == [True, False]
    assert [ladder.group.signal for ladder in found.ladders] == ['p1', 'p2']
    assert found.as_json()['partial']
    assert 'not all was tried' in '\n'.join(found.lines())
    paths = found.write(tmp_path)
    assert all(each.exists() for each in paths)
    assert asked[-1] == 'writing down'
    page = report(found)
    assert 'Partial: stopped' in page
    assert ('Stopped early' in page) == (not found.effects)
    with pytest.raises(DiagnosisError, match='stopped before the base valve'):
        diagnose(path, progress=stop_at_once)


@pytest.mark.slow
def test_without_patience_the_result_comes_early(small_set, tmp_path):
    path, _ = small_set[0]
    out = tmp_path / 'early'
    words = ['diagnose', str(path), '--out', str(out), '--patience', '0']
    done = CliRunner().invoke(main, words)
    assert done.exit_code == 0, done.output
    assert 'not all was tried' in done.output
    assert json.loads((out / 'diagnosis.json').read_text())['partial']


def stop_at_once(share, text):
    raise Stop


def test_useless_data_are_refused_with_a_sentence(tmp_path):
    time = 0.2 * np.arange(600)
    still = Recording(time, np.full(600, 50.0), x=np.full(600, 48.0))
    with pytest.raises(DiagnosisError, match='nothing moves'):
        diagnose(still)
    with pytest.raises(DiagnosisError, match='expected p1, p2 or x'):
        diagnose(Recording(time, np.linspace(0.0, 50.0, 600)))
    with pytest.raises(DiagnosisError, match='at least'):
        diagnose(Recording(time[:50], np.linspace(0.0, 50.0, 50), x=np.zeros(50)))
    told = CliRunner().invoke(
        main, ['diagnose', str(tmp_path / 'no_bag'), '--out', str(tmp_path / 'o')]
    )
    assert told.exit_code == 1
    assert not (tmp_path / 'o').exists()
