# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Diagnoses from end to end, on blind records made by another simulator."""

import json

import pytest

from blind import sets
from valve_sim_ros.diagnosis import diagnose

SMALL_SET = (
    ('singles', ('p1', 'p2'), 2),
    ('singles', ('p1', 'p2'), 8),
    ('singles', ('p1', 'p2', 'x'), 10),
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


@pytest.mark.parametrize('number', range(len(SMALL_SET)))
def test_the_hidden_effect_is_named(small_set, number):
    path, key = small_set[number]
    found = diagnose(path).as_json()
    named = [effect['id'] for effect in found['effects']]
    twins = [twin for effect in found['effects'] for twin in effect['indistinguishable_from']]
    assert named == key['effects'] or set(key['effects']) <= set(twins)
    assert found['verdict'] == ('missing_effect' if key['effects'] else 'adequate')
