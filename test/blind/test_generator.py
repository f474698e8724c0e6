# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Blind records: repeatable, readable, their keys kept apart, their effects where they belong."""

import ast
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from blind import records, sets, visibility
from blind.effects import EFFECTS
from blind.physics import Physics
from blind.plant import simulate
from blind.recorder import Recorder, write_bag
from blind.seal import digest, read_json
from blind.unknown import UNKNOWN
from valve_sim_ros import read_recording
from valve_sim_ros.model.effects import CATALOGUE

PERIOD = 0.2
U = np.repeat([20.0, 60.0, 35.0, 80.0, 30.0], 100)


def run(**changes):
    t = PERIOD * np.arange(U.size)
    return simulate(U, t, t, Physics(**changes))


@pytest.fixture(scope='module')
def made(tmp_path_factory):
    """Three records of singles."""
    folder = tmp_path_factory.mktemp('set')
    sets.generate('singles', 'tuning', ('p2', 'x'), 3, 5, folder)
    return folder


def test_that_the_same_record_is_made_again(made, tmp_path):
    sets.generate_one('singles', 'tuning', ('p2', 'x'), 5, tmp_path, 1)
    for part in ('records/0002.csv', 'keys/0002.json', 'keys/0002.next.csv'):
        assert (tmp_path / part).read_bytes() == (made / part).read_bytes()


def test_that_no_effect_is_drawn_that_another_valve_imitates(tmp_path):
    # the first draw of this one was a row of plays that a wider play of the valve equals
    sets.generate_one('singles', 'test', ('p1', 'p2', 'x'), 67, tmp_path, 18)
    key = read_json(tmp_path / 'keys' / '0019.json')
    assert key['effects'] == ['hysteresis']
    assert key['unexplained_in_noise']['hysteresis']['p1'] >= visibility.IMITATED


def test_that_a_set_may_grow_over_bags_and_what_an_interruption_left(tmp_path):
    (tmp_path / '.0008.part').mkdir()
    t = PERIOD * np.arange(U.size)
    for x in (U, U + 1.0):
        write_bag(tmp_path / '0008', t, U, t + 1e-4, {'x': x})
    assert [each.name for each in tmp_path.iterdir()] == ['0008']
    np.testing.assert_array_equal(read_recording(tmp_path / '0008').x, U + 1.0)


def test_that_the_halves_differ(made, tmp_path):
    sets.generate_one('singles', 'test', ('p2', 'x'), 5, tmp_path, 0)
    other = read_json(tmp_path / 'keys/0001.json')
    assert other['base'] != read_json(made / 'keys/0001.json')['base']


def test_that_records_are_read_and_say_nothing_of_the_key(made):
    for path in (made / 'records').iterdir():
        recording = read_recording(path)
        key = read_json(made / 'keys' / f'{path.stem}.json')
        assert recording.signals == ('p2', 'x')
        assert recording.time[-1] == pytest.approx(key['length'], abs=1.0)
        assert recording.provenance.comments == ()
        assert recording.quality.period == pytest.approx(key['recorder']['period'], rel=0.02)


def test_that_the_set_is_sealed(made, tmp_path):
    about = read_json(made / 'set.json')
    assert about['seal'] == digest(made / 'keys')
    for path in (made / 'keys').iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    assert about['seal'] == digest(tmp_path)
    (tmp_path / '0001.json').write_text('{}')
    assert about['seal'] != digest(tmp_path)


def test_that_every_effect_of_the_catalogue_is_in_and_the_unknown_ones_are_not():
    assert set(EFFECTS) == set(CATALOGUE)
    assert not set(UNKNOWN) & set(CATALOGUE)
    assert len(UNKNOWN) >= 5


def test_that_a_block_of_singles_has_each_effect_once():
    block = len(EFFECTS)
    names = [
        sets.SETS['singles'][0](k, np.random.default_rng(3), np.random.default_rng(k))[0]
        for k in range(block)
    ]
    assert sorted(names) == sorted(EFFECTS)


@pytest.mark.parametrize('name', [*EFFECTS, *UNKNOWN])
def test_that_a_drawn_effect_changes_constants_that_exist(name):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        changes = records.DRAWS[name](rng, Physics(), 600.0)
        assert changes
        assert Physics()._replace(**changes) != Physics()


def test_that_the_generator_imports_nothing_of_the_package():
    of_the_score = {'runner.py', 'continuation.py'}
    for path in Path(records.__file__).parent.glob('*.py'):
        tree = ast.parse(path.read_text(encoding='utf-8'))
        modules = [n.module or '' for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
        modules += [a.name for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names]
        imported = any(module.startswith('valve_sim_ros') for module in modules)
        assert imported == (path.name in of_the_score), path.name


def test_that_smaller_steps_change_little():
    t = PERIOD * np.arange(U.size)
    coarse, fine = (simulate(U, t, t, Physics(), step=step) for step in (1e-3, 2.5e-4))
    for name in ('p1', 'p2', 'x'):
        assert getattr(coarse, name) == pytest.approx(getattr(fine, name), abs=0.1)


@pytest.mark.parametrize(
    ('changes', 'first', 'untouched'),
    [
        ({'supply': 60.0}, 'p1', ()),
        ({'leak': 0.02}, 'p2', ('p1',)),
        ({'spring_rate': 1.3}, 'x', ('p1', 'p2')),
        ({'sensor_zero': 2.0, 'sensor_span': 0.9}, 'x', ('p1', 'p2', 'stem')),
    ],
)
def test_that_an_effect_acts_from_its_stage_on(changes, first, untouched):
    plain, changed = run(), run(**changes)
    assert np.abs(getattr(plain, first) - getattr(changed, first)).max() > 1.0
    for name in untouched:
        assert np.array_equal(getattr(plain, name), getattr(changed, name))


def test_that_limits_hold():
    assert run(supply=60.0).p1.max() == 60.0
    assert run(stop_high=55.0).x.max() == 55.0
    assert np.ptp(run(sensor_step=2.0).x % 2.0) == 0.0


def test_that_a_delay_shifts():
    plain, late = run(), run(ip_delay=0.6)
    assert np.array_equal(plain.p1[:-3], late.p1[3:])


def test_that_an_effect_nobody_could_see_is_not_visible():
    noise = dict.fromkeys(('p1', 'p2', 'x'), 0.2)
    signals = ('p1', 'p2', 'x')
    never = visibility.visible(run(supply=95.0), run(), noise, signals)
    assert max(never.values()) == 0.0
    seen = visibility.visible(run(supply=60.0), run(), noise, signals)
    assert max(seen.values()) > visibility.WANTED


def test_that_the_steps_of_a_coarse_sensor_show_against_its_noise():
    changes = {'sensor_quantisation': {'sensor_step': 0.5}}
    plan = records.Plan(Physics(), changes, U, 100.0, 1e-3)
    on_top = Recorder(noise={'x': 0.2}, resolution={'x': 0.0})
    assert not records.steps_show(plan, on_top)
    assert records.steps_show(plan, replace(on_top, resolution={'x': 0.5}))


def test_that_ramps_go_on_between_samples_and_steps_do_not():
    u = np.array([20.0, 20.0, 21.0, 22.0, 22.0, 60.0, 60.0])
    plan = records.Plan(Physics(), {}, u, 1.4, 1e-3)
    recorder = Recorder(period=PERIOD, commands=4)
    commands, times = records.sent(plan, recorder)
    assert times == pytest.approx(0.05 * np.arange(28))
    assert commands[::4] == pytest.approx(u)
    assert commands[4:12] == pytest.approx([20.0, 20.25, 20.5, 20.75, 21.0, 21.25, 21.5, 21.75])
    assert (commands[[3, 12, 19, 20]] == [20.0, 22.0, 22.0, 60.0]).all()
