# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of a diagnosis."""

from dataclasses import replace

import numpy as np

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis import diagnose
from valve_sim_ros.model.spec import ValveSpec
from valve_sim_ros.recordings.recording import Recording
from valve_sim_ros.report.diagnosis import report


def test_a_name_beside_an_unknown_effect_is_said_first():
    u = np.repeat(np.random.default_rng(5).uniform(10.0, 90.0, 30), 50)
    delay = {'effects': ['ip_dead_time'], 'ip_dead_time.dead_time': 0.7}
    s = simulate(u, parameters={'f_s': 4.0, 'f_d': 2.4, **delay})
    noise = 0.2 * np.random.default_rng(1).standard_normal((3, u.size))
    rows = np.array([s.p1, s.p2, s.x]) + noise
    found = diagnose(Recording(s.t, u, *rows))
    assert 'With ip_dead_time added it does' in report(found)
    assert 'end of its stroke' not in report(found)
    pressed = ValveSpec(effects=('ip_dead_time', 'travel_stops'))
    pressed = replace(found, augmented=pressed.changed({'travel_stops.lower': 0.0}))
    told = 'the stem is pressed against the end of its stroke at 0 %: '
    assert f'Besides, {told}' in report(pressed)
    assert any(line.startswith(told) for line in pressed.lines())
    *others, last = found.ladders
    guess = next(rung for ladder in found.ladders for rung in ladder.rungs)
    unknown = replace(last, outcome='unknown_effect', best_guess=guess)
    found = replace(found, ladders=(*others, unknown))
    page = report(found)
    assert 'no effect of the catalogue explains it' in page
    nearest = 'the least bad, ip_dead_time, leaves too much of the gap open'
    assert f'In x, {nearest}.' in page
    assert f'    {nearest}' in found.lines()
    assert 'In other stages it can be named: ip_dead_time' in page
