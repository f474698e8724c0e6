# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One battery for every rival model; a new file is tested the moment it exists."""

import numpy as np
import pytest

from valve_sim_ros import (
    InitialState,
    ModelError,
    read_parameters,
    simulate,
    Valve,
    ValveSpec,
    write_parameters,
)
from valve_sim_ros.model.rivals import rival, RIVALS

NAMES = """
stenman choudhury kano he chen xch he_semi_physical classical karnopp seven_parameter lugre
"""
FAST = {'T_g1': 1.0, 'T_g2': 3.0}
every_rival = pytest.mark.parametrize('name', RIVALS)


def spec(name, **values):
    declared = {parameter.name for parameter in RIVALS[name].parameters}
    fast = {key: value for key, value in FAST.items() if key in declared}
    return ValveSpec({**fast, **values}, model=name)


def ramps(n=240):
    """Return slow triangles, which every model answers."""
    return 50.0 + 45.0 * np.abs((np.arange(n) / 30.0) % 4.0 - 2.0) - 45.0


def test_all_eleven_are_here():
    assert set(RIVALS) == set(NAMES.split())
    assert all(model.name == name for name, model in RIVALS.items())
    with pytest.raises(ModelError, match='expected base or one of'):
        rival('kanu')


@every_rival
def test_declaration_says_what_it_rests_on(name):
    model = RIVALS[name]
    assert model.title
    assert model.confirmed or model.reconstructed
    assert set(model.held) < set(model.defaults)
    assert set(model.from_friction(8.0, 4.0)) <= set(model.free)
    for preset in model.presets:
        ValveSpec(model.preset(preset), model=name)


@every_rival
def test_simulates_as_a_plant(name):
    result = simulate(ramps(), parameters={'model': name})
    assert result.spec.model == name
    assert np.isfinite([result.p1, result.p2, result.x]).all()
    assert np.ptp(simulate(ramps(), parameters=spec(name)).x) > 20.0


@every_rival
def test_record_and_single_steps_are_equal_to_the_bit(name):
    u, valve = ramps(), Valve(spec(name), background=False)
    s = simulate(u, parameters=spec(name))
    steps = np.array([valve.step(value, 0.2) for value in u]).T
    assert steps.tobytes() == np.array([s.p1, s.p2, s.x]).tobytes()


@every_rival
def test_interpreted_steps_agree_with_machine_code(name):
    u = ramps()[:120:2]
    s, valve = simulate(u, parameters=spec(name)), Valve(spec(name), background=False)
    valve._compiled = None  # stay with plain Python
    steps = np.array([valve.step(value, 0.2) for value in u]).T
    np.testing.assert_allclose(steps, [s.p1, s.p2, s.x], rtol=0, atol=1e-9)


@every_rival
def test_parameter_file_round_trip(name, tmp_path):
    first = RIVALS[name].parameters[0]
    changed = spec(name, **{first.name: 0.5 * (first.default + first.upper)})
    write_parameters(tmp_path / 'valve.yaml', changed)
    assert read_parameters(tmp_path / 'valve.yaml') == changed


@every_rival
def test_refuses_what_is_not_its_own(name):
    with pytest.raises(ModelError, match='unknown parameter'):
        ValveSpec({'branches': 1.0}, model=name)
    with pytest.raises(ModelError, match='takes none'):
        ValveSpec(model=name, effects=('air_leak',))
    last = RIVALS[name].parameters[-1]
    with pytest.raises(ModelError, match=last.name):
        ValveSpec({last.name: last.upper + 1.0}, model=name)


@every_rival
def test_a_plant_changes_its_model_where_it_stands(name):
    valve = Valve(ValveSpec(FAST), InitialState(40.0, 40.0, 40.0), background=False)
    valve.step(40.0, 0.2)
    valve.spec = valve.spec.changed({'model': name})
    assert valve.step(40.0, 0.2)[2] == pytest.approx(40.0, abs=0.1)


@every_rival
def test_does_not_move_at_rest(name):
    start = InitialState(30.0, 30.0, 30.0)
    result = simulate(np.full(50, 30.0), parameters=spec(name), initial=start)
    np.testing.assert_allclose(result.x, 30.0, rtol=0, atol=1e-9)


@every_rival
def test_finite_at_the_ends_of_the_ranges(name):
    for parameter in RIVALS[name].parameters:
        for value in (parameter.lower, parameter.upper):
            values = {parameter.name: value}
            if parameter.name == 'f_s' and 'f_d' in RIVALS[name].defaults:
                values['f_d'] = min(value, RIVALS[name].defaults['f_d'])
            if parameter.name == 'f_d':
                values['f_s'] = max(value, RIVALS[name].defaults['f_s'])
            result = simulate(ramps(90), parameters=spec(name, **values))
            assert np.isfinite(result.x).all(), values
