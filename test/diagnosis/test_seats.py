# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The ends of the stroke are part of a valve, and no effect."""

from dataclasses import replace

import numpy as np
import pytest

from valve_sim_ros import simulate
from valve_sim_ros.diagnosis.adequacy import leftover
from valve_sim_ros.diagnosis.base_valve import starting_valve
from valve_sim_ros.diagnosis.bench import Bench
from valve_sim_ros.diagnosis.diagnose import _spec
from valve_sim_ros.diagnosis.fitting import Fitter
from valve_sim_ros.diagnosis.outcome import but_seats, Ladder
from valve_sim_ros.diagnosis.rung import Rung
from valve_sim_ros.diagnosis.seats import ENDS, ends_of, seats_of, STOPS
from valve_sim_ros.diagnosis.stages import groups
from valve_sim_ros.recordings.recording import Recording

NOISE = 0.2
STAGES = {'f_d1': 0.6, 'T_g1': 2.0, 'T_g2': 4.0}
STEM = {'f_s': 4.0, 'a_1': 1339.5, 'a_2': 109.8}
FORCE = {'fluid_force.force': 14.0, 'fluid_force.reach': 25.0, 'fluid_force.shape': 0.0}


def pressed_into_its_seat():
    """Return a valve whose fluid force closes it at low commands, as measured."""
    u = np.repeat(np.random.default_rng(5).uniform(1.0, 90.0, 30), 75)
    stops = {f'{STOPS}.{name}': end for name, end in ENDS.items()}
    valve = {**STAGES, **STEM, 'f_d': 2.4, **FORCE, **stops}
    s = simulate(u, parameters={**valve, 'effects': ['fluid_force', STOPS]})
    noise = NOISE * np.random.default_rng(1).standard_normal((3, u.size))
    return Recording(s.t, u, *(np.array([s.p1, s.p2, s.x]) + noise))


def samples(*levels):
    noise = NOISE * np.random.default_rng(2).standard_normal(100 * len(levels))
    return np.repeat(np.array(levels), 100) + noise


@pytest.mark.parametrize(
    ('levels', 'ends'),
    [
        ((30.0, 0.0, 50.0), {'lower'}),
        ((30.0, 100.0, 50.0), {'upper'}),
        ((30.0, 0.0, 100.0, 50.0), {'lower', 'upper'}),
        ((0.0, 30.0, 50.0), set()),  # at rest before the command moves
        ((30.0, 0.0, -3.0, 50.0), set()),  # a sensor that is off
        ((30.0, 4.0, 50.0), set()),
    ],
)
def test_an_end_is_seen_where_x_is_pressed_against_it(levels, ends):
    found = seats_of(samples(*levels), NOISE)
    assert {name for name in ENDS if found.get(f'{STOPS}.{name}') == ENDS[name]} == ends
    assert bool(found) == bool(ends)


def test_no_end_is_seen_without_x():
    assert seats_of(np.empty(0), NOISE) == {}


def test_a_stem_with_an_effect_rests_in_its_seat_and_the_file_says_so():
    fitter = Fitter(Bench([pressed_into_its_seat()]), seed=0)
    group = groups(('p1', 'p2', 'x'))[-1]
    base = starting_valve(fitter.bench)
    own = {**STAGES, 'f_s': 4.0, 'f_d/f_s': 0.6, 'a_1/a_2': 12.2, 'damping': 1.5, **FORCE}
    valve = replace(base, values={**base.values, **own}, effects=('fluid_force',))
    assert leftover(fitter.residuals(valve, group.signal)).excess < 0.1
    written = _spec(fitter.bench, valve)
    assert written.effects == ('fluid_force', STOPS)
    assert written.values[f'{STOPS}.lower'] == 0.0
    assert ends_of(written.values) == [0.0]
    assert _spec(fitter.bench, base).effects == ()
    fitter.bench.seats = {}
    assert leftover(fitter.residuals(valve, group.signal)).excess > 1.0


@pytest.mark.parametrize(('lower', 'named'), [(0.3, False), (8.0, True)])
def test_the_seat_is_no_name_beside_another(lower, named):
    bench = Bench([pressed_into_its_seat()])
    group = groups(('p1', 'p2', 'x'))[-1]
    stops = next(c for c in group.candidates() if c.effect == STOPS and c.names == ('lower',))
    valve = starting_valve(bench)
    values = {**valve.values, **stops.neutral, f'{STOPS}.lower': lower}
    valve = replace(valve, values=values, candidates=(stops,))
    assert ends_of(values, stops.names) == ([] if named else [0.0])
    left = leftover(np.random.default_rng(3).standard_normal(2000))
    rungs = [
        Rung(name, 'p2-x', {name: 1e3}, left, left, 1.0, 0.9, (), valve)
        for name in ('fluid_force', STOPS)
    ]
    ladder = Ladder(group, 'missing_effect', valve, valve, left, left, tuple(rungs))
    (found,) = but_seats([ladder])
    assert [rung.effect for rung in found.rungs] == ['fluid_force'] + [STOPS] * named
    alone = replace(ladder, rungs=(rungs[1],))
    assert but_seats([alone]) == [alone]
    first = replace(ladder, rungs=(rungs[0],))
    assert but_seats([first, alone])[1].outcome == ('missing_effect' if named else 'adequate')
