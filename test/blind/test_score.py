# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The score counts right: on made-up verdicts about made-up keys."""

import json
from pathlib import Path
import subprocess
import sys
from types import SimpleNamespace

from click.testing import CliRunner
import numpy as np
import pytest

from blind import results, runner, score, study, table
from blind.__main__ import main
from blind.continuation import gap_closed
from blind.outcomes import FAILED, MISSING, Outcome, read_all, UNKNOWN
from blind.seal import digest, write_json
from valve_sim_ros import simulate, ValveSpec, write_parameters

NONE = frozenset()


def named(truth, *ids, twins=None, probability=0.9, **more):
    """Return an outcome in which these effects were named."""
    return Outcome(
        more.pop('record', 'r'),
        truth,
        MISSING,
        ids,
        tuple(twins or [NONE] * len(ids)),
        (probability,) * len(ids),
        **more,
    )


def counts(kind, outcomes):
    return {each.name: each.count for each in score.rates(kind, outcomes)}


def test_that_exact_means_all_and_no_others():
    assert named(('a',), 'a').exact
    assert not named(('a',), 'a', 'b').exact
    assert not named(('a',), 'b').exact
    assert not Outcome('r', ('a',), UNKNOWN, ('a',), (NONE,), (0.9,)).exact
    assert named(('a', 'b'), 'b', 'a').exact


def test_that_a_twin_counts_only_if_it_is_stated():
    assert named(('a',), 'b', twins=[frozenset('a')]).within_twins
    assert not named(('a',), 'b', twins=[frozenset('c')]).within_twins
    # one name cannot stand for both
    assert not named(('a', 'b'), 'a', 'c', twins=[frozenset('b'), NONE]).within_twins
    assert named(('a', 'b'), 'a', 'c', twins=[NONE, frozenset('b')]).within_twins
    assert not named(('a',), 'a', 'b').within_twins


def test_that_singles_are_counted():
    outcomes = [
        named(('a',), 'a'),
        named(('a',), 'b', twins=[frozenset('a')]),
        named(('a',), 'b'),
        Outcome('r', ('a',), 'adequate'),
        Outcome('r', ('a',), UNKNOWN),
        Outcome('r', ('a',), FAILED),
    ]
    assert counts('singles', outcomes) == {
        'exactly': 1,
        'within stated twins': 2,
        'called adequate': 1,
        'called unknown': 1,
        'failed': 1,
    }
    (row,) = score.confusion(outcomes)
    assert (row.truth, row.exact.count, row.within.total) == ('a', 1, 6)
    assert row.said == {'b': 2, 'a': 1, 'adequate': 1, UNKNOWN: 1, FAILED: 1}


def test_that_an_unknown_effect_in_a_clean_record_is_a_false_alarm():
    outcomes = [Outcome('r', (), 'adequate')] * 3 + [named((), 'a'), Outcome('r', (), UNKNOWN)]
    assert counts('clean', outcomes)['false alarms'] == 2


def test_that_naming_an_unknown_effect_is_misnaming():
    outcomes = [
        named(('z',), 'a'),
        Outcome('r', ('z',), UNKNOWN),
        Outcome('r', ('z',), 'adequate'),
    ]
    found = counts('unknown', outcomes)
    assert (found['called unknown'], found['misnamed'], found['called adequate']) == (1, 1, 1)


def test_that_pairs_are_counted():
    pair = ('a', 'b')
    found = counts('pairs', [named(pair, *'ab'), named(pair, *'abc'), named(pair, 'b')])
    assert (found['exactly'], found['both, perhaps with others'], found['at least one']) == (
        1,
        2,
        3,
    )


def test_the_wilson_interval():
    # (k + z^2/2)/(n + z^2) -+ z/(n + z^2) sqrt(k (n - k)/n + z^2/4), here with k = 8, n = 10
    assert score.Rate('', 8, 10).interval == pytest.approx((0.4901625, 0.9433178), abs=1e-6)
    assert score.Rate('', 0, 0).interval == (0.0, 1.0)


def test_the_calibration_error():
    honest = [named(('a',), 'a' if k < 9 else 'b', probability=0.9) for k in range(10)]
    assert score.calibration(honest).error == pytest.approx(0.0, abs=1e-12)
    boastful = [named(('a',), 'a' if k < 6 else 'b', probability=0.95) for k in range(10)]
    found = score.calibration(boastful)
    assert (found.error, found.share_right) == (pytest.approx(0.35), pytest.approx(0.6))


@pytest.fixture
def one_record(tmp_path):
    """A set of one record, and a verdict that is right; other constants stand for the effect."""
    u = np.repeat([20.0, 70.0, 40.0, 80.0, 30.0, 60.0], 60)
    t = 0.2 * np.arange(u.size)
    base = ValveSpec().changed({'T_g1': 2.0, 'T_g2': 3.0})
    true = base.changed({'T_g2': 9.0, 'f_s': 12.0})
    found = simulate(u, parameters=true, time=t)
    half = u.size // 2
    for part in ('records', 'keys', 'verdicts/0001'):
        (tmp_path / part).mkdir(parents=True)
    table = np.column_stack((t, u, found.p2, found.x))
    for path, rows in (('records/0001.csv', table[:half]), ('keys/0001.next.csv', table[half:])):
        np.savetxt(tmp_path / path, rows, delimiter=',', header='t,u,p2,x', comments='')
    key = {
        'effects': ['air_leak'],
        'length': 36.0,
        'recorder': {'noise': {'p2': 0.2, 'x': 0.2}, 'period': 0.2},
    }
    write_json(tmp_path / 'keys/0001.json', key)
    about = {'set': 'singles', 'split': 'test', 'signals': ['p2', 'x'], 'count': 1}
    write_json(tmp_path / 'set.json', {**about, 'seal': digest(tmp_path / 'keys')})
    verdict = tmp_path / 'verdicts/0001'
    write_parameters(verdict / 'base.yaml', base)
    write_parameters(verdict / 'augmented.yaml', true)
    effect = {'id': 'air_leak', 'probability': 0.97, 'indistinguishable_from': ['ip_calibration']}
    write_json(verdict / 'diagnosis.json', {'verdict': MISSING, 'effects': [effect]})
    write_json(verdict / 'seconds.json', 4.0)
    return SimpleNamespace(folder=tmp_path, key=key, base=base, true=true, verdict=verdict)


def test_that_the_true_model_closes_the_gap_and_the_base_none_of_it(one_record):
    found = gap_closed(one_record.folder, one_record.verdict, '0001', one_record.key)
    assert found == pytest.approx(1.0, abs=0.01)
    write_parameters(one_record.verdict / 'augmented.yaml', one_record.base)
    assert gap_closed(one_record.folder, one_record.verdict, '0001', one_record.key) == 0.0
    write_parameters(one_record.verdict / 'base.yaml', one_record.true)
    assert gap_closed(one_record.folder, one_record.verdict, '0001', one_record.key) is None


def test_that_a_record_is_scored_from_its_files(one_record):
    (outcome,) = read_all(one_record.folder, one_record.folder / 'verdicts')
    assert outcome.exact
    assert outcome.twins == (frozenset({'ip_calibration'}),)
    assert outcome.seconds == pytest.approx(4.0 * 4500 / 180)
    said = CliRunner().invoke(main, ['score', '--records', str(one_record.folder)])
    assert said.exit_code == 0
    assert 'ok 0001 air_leak' in said.output
    assert 'air_leak 97 % (or ip_calibration)  closed 100.0 %' in said.output
    assert 'exactly' in said.output
    assert '100.0 % [20.7, 100.0] (1 of 1)' in said.output


def test_that_a_touched_key_is_refused(one_record):
    write_json(one_record.folder / 'keys/0001.json', {**one_record.key, 'effects': ['ip_lag']})
    with pytest.raises(ValueError, match='not the sealed keys'):
        read_all(one_record.folder, one_record.folder / 'verdicts')
    said = CliRunner().invoke(main, ['score', str(one_record.folder)])
    assert said.exit_code == 1


def test_the_table_of_all_sets(one_record):
    outcomes = read_all(one_record.folder, one_record.folder / 'verdicts')
    sets = [
        table.Scored('singles', 'p2,x', outcomes),
        table.Scored('clean', 'x', [named((), 'a')]),
    ]
    text = table.as_markdown(sets, 'test', 'abc1234', 'make blind')
    assert 'version abc1234, test half' in text
    assert '    make blind' in text
    assert '| air_leak | 1/1 | 1/1 |  |' in text
    assert '| false alarms | 100.0 % [20.7, 100.0] (1 of 1) |' in text
    assert 'stated 93.5 % ' not in text
    assert '93.5 % stated, 50.0 % right' in text


ABOUT = {'set': 'singles', 'signals': 'p2,x', 'split': 'test', 'seed': 0, 'version': 'abc1234'}


def test_that_a_study_that_is_interrupted_scores_what_was_done(one_record, monkeypatch):
    home = one_record.folder / 'study'
    home.mkdir()
    (home / 'singles_test0_p2x').symlink_to(one_record.folder)
    one_record.verdict.parent.rename(one_record.folder / 'verdicts-abc1234')
    about = json.loads((one_record.folder / 'set.json').read_text())
    write_json(one_record.folder / 'set.json', {**about, 'count': 3})
    monkeypatch.setattr(study, 'SETS', (('singles', 'p2,x', 3), ('clean', 'x', 1)))
    asked = []

    def interrupted(folder, out, limit, known, progress):
        asked.append((folder.name, limit, known))
        (out / '0002').mkdir(exist_ok=True)
        raise KeyboardInterrupt

    monkeypatch.setattr(runner, 'run', interrupted)
    kept = one_record.folder / 'kept.jsonl'
    for share in (1.0, 1.0):
        (found,) = study.study(
            'test', share, 0, home, lambda title, total: lambda done: None, 'abc1234', kept
        )
        assert found.size == '1 of 3 records'
        text = table.as_markdown([found], 'test', '', '')
        assert '## singles — u, p2, x: 1 of 3 records' in text
    # what was kept of the first is neither asked nor kept again
    assert asked == [('singles_test0_p2x', 3, set()), ('singles_test0_p2x', 3, {'0001'})]
    assert len(kept.read_text().splitlines()) == 1


def test_that_a_study_whose_outcomes_are_kept_needs_no_record(tmp_path, monkeypatch):
    kept = tmp_path / 'kept.jsonl'
    results.add(kept, ABOUT, [named(('a',), 'b', twins=[frozenset('a')], record='0001')])
    monkeypatch.setattr(study, 'SETS', (('singles', 'p2,x', 1),))
    for share in (0.0, 1.0):
        (found,) = study.study('test', share, 0, tmp_path / 'none', None, 'abc1234', kept)
        assert found.size == '1 records'
        assert counts('singles', found.outcomes)['within stated twins'] == 1


def test_that_what_another_version_said_can_be_scored(tmp_path):
    kept = tmp_path / 'kept.jsonl'
    about = {'set': 'singles', 'signals': 'p2,x', 'split': 'test', 'seed': 5, 'version': 'old1234'}
    results.add(kept, about, [named(('a',), 'a', record='0001')])
    words = ['study', '--seed', '5', '--out', str(tmp_path), '--keep', str(kept), '--of']
    said = CliRunner().invoke(main, [*words, 'old1234'])
    assert said.exit_code == 0
    assert '1 of 150 records' in said.output
    refused = CliRunner().invoke(main, [*words, 'new1234'])
    assert refused.exit_code == 1
    assert 'version new1234, seed 5: expected one that --keep names' in refused.output


def test_that_no_outcomes_leave_the_table_alone(tmp_path):
    doc = tmp_path / 'blind.md'
    doc.write_text('as it was')
    words = ['study', '--share', '0', '--out', str(tmp_path), '--doc', str(doc)]
    said = CliRunner().invoke(main, words)
    assert said.exit_code == 1
    assert 'give a larger --share' in said.output
    assert doc.read_text() == 'as it was'


def test_that_outcomes_are_kept_whole_and_by_version(tmp_path):
    kept = tmp_path / 'kept.jsonl'
    said = [
        named(('a', 'b'), 'a', 'c', twins=[NONE, frozenset('bd')], seconds=4.5, closed=0.25),
        Outcome('0003', (), 'adequate', seconds=2.0),
        Outcome('0002', ('a',), FAILED),
    ]
    results.add(kept, ABOUT, said[:1])
    results.add(kept, {**ABOUT, 'version': 'other'}, said[:1])
    results.add(kept, ABOUT, said[1:])
    assert results.read(kept, ABOUT) == [said[2], said[1], said[0]]
    assert results.read(kept, {**ABOUT, 'seed': 1}) == []
    assert results.read(None, ABOUT) == results.read(tmp_path / 'none', ABOUT) == []


def test_the_version_is_that_of_the_package(tmp_path):
    def git(*words):
        identity = ('-c', 'user.name=n', '-c', 'user.email=e')
        done = subprocess.run(('git', *identity, *words), cwd=tmp_path, check=True, stdout=-1)
        return done.stdout.decode().strip()

    git('init', '-q')
    assert results.version(tmp_path) == 'unknown'
    (tmp_path / 'valve_sim_ros').mkdir()
    code = tmp_path / 'valve_sim_ros/model.py'
    code.write_text('a = 1\n')
    git('add', '.')
    git('commit', '-qm', 'package')
    commit = git('rev-parse', '--short', 'HEAD')
    (tmp_path / 'doc.md').write_text('of no matter\n')
    git('add', '.')
    git('commit', '-qm', 'doc')
    assert results.version(tmp_path) == commit
    code.write_text('a = 2\n')
    assert results.version(tmp_path) == f'{commit}-dirty'


def stub(monkeypatch, diagnose):
    monkeypatch.setitem(
        sys.modules, 'valve_sim_ros.diagnosis', SimpleNamespace(diagnose=diagnose, PATIENCE=300.0)
    )


def test_that_the_left_out_effect_is_passed_on_and_only_there(one_record, monkeypatch):
    asked = []

    def diagnose(paths, seed, without, patience):
        asked.append((paths[0].name, seed, without))
        return SimpleNamespace(
            write=lambda out, report: write_json(out / 'diagnosis.json', {'verdict': 'adequate'})
        )

    stub(monkeypatch, diagnose)
    record = one_record.folder / 'records/0001.csv'
    runner.one(one_record.folder, one_record.verdict.parent, 7, record)
    about = json.loads((one_record.folder / 'set.json').read_text())
    write_json(one_record.folder / 'set.json', {**about, 'set': 'left_out'})
    runner.one(one_record.folder, one_record.verdict.parent, 7, record)
    assert asked == [('0001.csv', 7, ()), ('0001.csv', 7, ('air_leak',))]


def test_that_a_diagnosis_that_breaks_counts_as_failed(one_record, monkeypatch):
    def diagnose(paths, seed, without, patience):
        raise ValueError('no')

    stub(monkeypatch, diagnose)
    runner.verdict(Path('nowhere.csv'), one_record.verdict, 0, ())
    assert 'ValueError: no' in (one_record.verdict / 'error.txt').read_text()
    (outcome,) = read_all(one_record.folder, one_record.folder / 'verdicts')
    assert outcome.verdict == FAILED


def test_that_records_with_a_verdict_are_not_done_again(one_record):
    done = []
    failed = runner.run(one_record.folder, one_record.folder / 'verdicts', progress=done.append)
    assert (failed, done) == (0, [1])
