# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Effects and models as ROS parameters: at the start, from files, and while the node runs."""

from conftest import overrides
import pytest
import rclpy

from valve_sim_ros import ModelError, simulate, Valve, ValveSpec, write_parameters
from valve_sim_ros.model.effects import CATALOGUE
from valve_sim_ros.nodes.valve_plant import ValvePlant

pytestmark = pytest.mark.ros

LEAK = {'effects': ['air_leak'], 'air_leak.leak_rate': 0.05}
COMMANDS = [60.0] * 30 + [20.0] * 30


def given(**values):
    """Return values by name; f__g stands for f.g."""
    return {name.replace('__', '.'): value for name, value in values.items()}


def test_effect_from_the_start_equals_the_offline_valve(lockstep_valve):
    valve = lockstep_valve(LEAK)
    heard = [valve.step(u) for u in COMMANDS]
    expected = simulate(COMMANDS, parameters=LEAK)
    assert [sample.p2 for sample in heard] == expected.p2.tolist()
    assert expected.p2.tolist() != simulate(COMMANDS).p2.tolist()


def test_effect_comes_and_goes_between_two_samples(lockstep_valve):
    valve = lockstep_valve({'f_s': 6.0})
    offline = Valve(ValveSpec({'f_s': 6.0}), background=False)
    # one change brings the effect, its value and another value; the next takes the effect away
    changes = {20: {**LEAK, 'f_s': 7.0}, 40: {'air_leak.leak_rate': 0.5}, 50: {'effects': ['']}}
    for k, u in enumerate(COMMANDS):
        if k in changes:
            result = valve.plant.set_parameters_atomically(overrides(**changes[k]))
            assert result.successful, result.reason
            offline.spec = offline.spec.changed(changes[k])
        assert valve.step(u)[2:] == offline.step(u, 0.2)
    assert valve.plant.spec == ValveSpec({'f_s': 7.0})


def test_value_of_an_effect_survives_its_absence(bench):
    plant = bench.plant(effects=['air_leak'], air_leak__leak_rate=0.5)
    for effects in ([''], ['sensor_lag', 'air_leak']):
        assert plant.set_parameters_atomically(overrides(effects=effects)).successful
    assert plant.spec.values['air_leak.leak_rate'] == 0.5
    assert plant.get_parameter('air_leak.leak_rate').value == 0.5


def test_every_parameter_of_every_effect_is_described(bench):
    plant = bench.plant()
    for parameter in (p for effect in CATALOGUE.values() for p in effect.qualified):
        shown = plant.describe_parameter(parameter.name)
        (limits,) = shown.floating_point_range
        assert (limits.from_value, limits.to_value) == (parameter.lower, parameter.upper)
        assert shown.description == f'{parameter.description} [{parameter.unit}]'


@pytest.mark.parametrize(
    ('values', 'words'),
    [
        (given(effects=['air_leek']), 'did you mean air_leak'),
        (given(effects='air_leak'), 'expected a list'),
        (given(effects=[1]), 'expected names'),
        (given(air_leak__leak_rate=0.1), 'add effects: [air_leak]'),
        (given(effects=['air_leak'], air_leak__leak_rate=-0.1), 'air_leak.leak_rate'),
        (given(effects=['air_leak'], air_leak__leak_rate='much'), 'expected a number'),
        (given(effects=['air_leak'], f_s=1.0), 'exceeds'),
    ],
)
def test_refusals_say_why_and_change_nothing(bench, values, words):
    with pytest.raises((ModelError, rclpy.exceptions.InvalidParameterValueException)) as refused:
        bench.plant(**values)
    assert words in str(refused.value)
    plant = bench.plant()
    result = plant.set_parameters_atomically(overrides(**values))
    assert not result.successful
    assert words in result.reason
    assert plant.spec == ValveSpec()


def test_model_is_fixed_and_must_exist(bench):
    with pytest.raises(ModelError, match='expected one of base'):
        bench.plant(model='none_such')
    (result,) = bench.plant().set_parameters(overrides(model='base'))
    assert not result.successful


NESTED = """
/**:
  ros__parameters:
    f_s: 6
    effects: [air_leak, sensor_lag]
    air_leak:
      leak_rate: 1
"""


@pytest.mark.parametrize('form', ['nested', 'written'])
def test_parameter_file_for_all_nodes(tmp_path, form):
    effects = ('air_leak', 'sensor_lag')
    spec = ValveSpec({'f_s': 6.0, 'air_leak.leak_rate': 1.0}, effects=effects)
    file = tmp_path / 'valve.yaml'
    if form == 'written':
        write_parameters(file, spec)
    else:
        file.write_text(NESTED)
    rclpy.init(args=['--ros-args', '--params-file', str(file)])
    plant = ValvePlant(namespace='/unit_2')
    try:
        assert plant.spec == spec
    finally:
        plant.destroy_node()
        rclpy.try_shutdown()
