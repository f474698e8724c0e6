# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The model against the golden numbers, itself and an independent way of solving it."""

import math
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
import numpy as np
import pytest

from valve_sim_ros import InitialState, ModelError, read_parameters, simulate, Valve, ValveSpec
from valve_sim_ros.model import kernels, pipeline
from valve_sim_ros.model.electro_pneumatic import backlash
from valve_sim_ros.model.slip import first_stop, forced_gain, free_motion, Slip, stem_poles
from valve_sim_ros.model.stem import Friction, Stem, stem_step
from valve_sim_ros.model.tables import parameter_table, sample_file

LEVEL = st.floats(0.0, 100.0)
AT_REST = Stem(0.0, 0.0, 0.0, False)


def stem_after(duration, target, excess, rate, a_1, a_2, f_s, f_d, delta=1e-5, stem=AT_REST):
    poles = stem_poles(a_1, a_2)
    return stem_step(
        stem,
        target,
        excess,
        duration,
        Friction(f_s, f_s, f_d, f_d, 1.0),
        delta,
        forced_gain(rate, a_1, a_2, 1.0),
        poles,
        math.exp(-rate * duration),
        *free_motion(duration, poles),
    )


def test_step_response_of_the_whole_chain():
    u = np.zeros(325)
    u[45:] = 50.0
    s = simulate(u)
    k = [45, 46, 50, 53, 54, 55, 56, 60, 100, 200, 324]
    p2 = [0, 1.079044, 5.159173, 7.985878, 8.886275, 9.766529, 10.627091, 13.881089, 34.337268]
    x = [0, 0, 0, 0, 0.554679, 3.886092, 4.968668, 8.275686, 28.937416, 41.513836, 42.886722]
    assert s.p1[45:] == pytest.approx(48.2353)
    np.testing.assert_allclose(s.p2[k], [*p2, 46.788573, 48.147801], atol=6e-7)
    np.testing.assert_allclose(s.x[k], x, atol=6e-7)


@pytest.mark.parametrize(
    ('time', 'x'),
    [
        (0.01, 0.87420403),
        (0.05, 6.0907485),
        (0.1, 10.04269288),
        (0.2, 13.3545717),
        (0.5, 14.7042701),
    ],
)
def test_slip_under_held_pressure(time, x):
    stem = stem_after(time, 20.0, 0.0, 1.0 / 8.84, 2000.0, 176.0, 8.7978, 5.2602)
    assert stem.x == pytest.approx(x, abs=1e-7)


def test_poles_of_the_paper():
    poles = stem_poles(2000.0, 176.0)
    assert (poles.first, poles.second) == pytest.approx((-12.2108, -163.7892), abs=1e-4)


def test_nominal_valve_of_table_1_overshoots_and_stays():
    stem = stem_after(1.0, 40.0, 0.0, 1.0 / 8.84, 38602.941, 1.169118, 32.021, 26.6779)
    assert stem.direction == 0.0
    assert stem.x == pytest.approx(26.5202288, abs=1e-4)  # f_d is given to four digits


def test_breakaway_inside_an_interval():
    stem = stem_after(2.0, 48.2353, -48.2353, 1.0 / 8.84, 2000.0, 176.0, 8.7978, 5.2602)
    assert stem.x == pytest.approx(3.88609189, abs=1e-7)
    assert stem.v == pytest.approx(7.248945, abs=1e-5)


def test_end_points_of_the_signature():
    fast = {'T_g1': 1.0, 'T_g2': 1.0}
    up, down = (
        simulate([100.0] * 200, parameters=fast),
        simulate([0.0] * 200, parameters=fast, initial=InitialState(100.0, 100.0, 94.0)),
    )
    assert up.x[-1] == pytest.approx(92.975, abs=1e-3)
    assert down.x[-1] == pytest.approx(7.0249, abs=1e-3)


def random_record(n=600):
    rng = np.random.default_rng(3)
    return np.repeat(rng.uniform(0.0, 100.0, n // 20), 20)


def test_record_and_single_steps_are_equal_to_the_bit():
    u = random_record()
    s, valve = simulate(u), Valve(background=False)
    steps = np.array([valve.step(value, 0.2) for value in u]).T
    np.testing.assert_array_equal(steps, [s.p1, s.p2, s.x])


def test_interpreted_steps_agree():
    u = random_record()
    s = simulate(u)
    step = kernels.make().interpreted
    state, theta = InitialState().array(ValveSpec()).tolist(), ValveSpec().theta.tolist()
    x = [step(v, 0.2 if k else 0.0, state, theta, math.inf, (), ()) for k, v in enumerate(u)]
    np.testing.assert_allclose(x, s.x, rtol=0, atol=1e-12)


def test_valve_hands_over_to_machine_code_without_a_trace():
    u = random_record()
    valve, s = Valve(), simulate(u)
    steps = np.array([valve.step(value, 0.2) for value in u]).T
    np.testing.assert_allclose(steps, [s.p1, s.p2, s.x], rtol=0, atol=1e-12)


def test_a_finer_grid_changes_nothing():
    u = random_record(200)
    coarse = simulate(u)
    # halving a step needs the held p1 of eq. (5), which the model keeps per sample: compare stems
    time = np.arange(u.size) * 0.2
    np.testing.assert_allclose(simulate(u, time=time).x, coarse.x, rtol=0, atol=1e-9)


def test_printed_branch_differs_only_a_little():
    u = random_record(3000)
    difference = simulate(u).p2 - simulate(u, parameters={'branch': 'printed'}).p2
    assert 0.0 < np.abs(difference).max() < 5.0


def test_a_slot_takes_an_effect():
    @njit
    def twice(value, state, effects, memory, dt):
        return 2.0 * value

    for make in (kernels.interpreted, lambda *how: kernels.kept(*how, 'test')):
        state = InitialState().array(ValveSpec())
        make(pipeline.step, {'command_slot': twice})(
            30.0, 0.0, state, ValveSpec().theta, math.inf, (), ()
        )
        assert state[0] == pytest.approx(60.0 - 1.7647)
    assert set(kernels.SLOTS) == {
        'command_slot',
        'inlet_slot',
        'tubing_slot',
        'flow_slot',
        'force_slot',
        'reach_slot',
        'stride_slot',
        'motion_slot',
        'sensor_slot',
    }


@given(LEVEL, LEVEL, st.floats(0.0, 30.0))
def test_backlash_is_a_play(p1, u, width):
    after = backlash(p1, u, width)
    assert abs(u - after) <= width + 1e-12
    assert after == p1 or abs(abs(u - after) - width) < 1e-12


@settings(max_examples=30)
@given(st.lists(LEVEL, min_size=2, max_size=6), st.floats(0.5, 50.0), st.floats(0.5, 50.0))
def test_pressure_moves_towards_the_inlet_and_never_past_it(levels, fill, empty):
    s = simulate(np.repeat(levels, 20), parameters={'T_g1': fill, 'T_g2': empty})
    before, held = s.p2[:-1], s.p1[:-1]
    low, high = np.minimum(before, held), np.maximum(before, held)
    assert ((s.p2[1:] >= low - 1e-9) & (s.p2[1:] <= high + 1e-9)).all()


@given(st.floats(0.0, 8.79), st.floats(0.0, 1.0))
def test_a_stuck_stem_does_not_creep(level, delta):
    s = simulate([level] * 500, parameters={'f_d1': 0.0, 'delta': delta})
    assert (s.x == 0.0).all()


def substepped(p1, theta, n):
    """Stage 3 by Karnopp's logic and small semi-implicit steps, p2 exact: an independent check."""
    t_fill, t_empty, f_s, f_d, a_1, a_2, delta = theta[1:8]
    h, p2, x, v, s, armed, out = 0.2 / n, 0.0, 0.0, 0.0, 0, False, [0.0]
    for held in p1[:-1]:
        decay = math.exp(-h / (t_fill if held > p2 else t_empty))
        for _ in range(n):
            p2 = held + (p2 - held) * decay
            if s == 0 and abs(p2 - x) > f_s:
                s, armed = (1 if p2 > x else -1), False
            if s:
                v = (v + h * a_1 * (p2 - x - s * f_d)) / (1 + h * a_2 + h * h * a_1)
                if (armed and s * v <= delta) or s * v < 0:
                    v, s = 0.0, 0
                else:
                    x, armed = x + h * v, armed or s * v > delta
        out.append(x)
    return np.array(out)


def test_exact_step_agrees_with_small_steps():
    u = random_record(200)
    s = simulate(u, parameters={'T_g2': 20.0})
    assert np.abs(substepped(s.p1, s.spec.theta, 320) - s.x).max() < 0.05


def test_a_step_in_one_and_in_many_parts_agree():
    """Swings, creeps and reversals: no stop is passed over, however short the halt."""
    chance, parts = np.random.default_rng(1), 32
    for _ in range(3000):
        ratio, damping = np.exp(chance.uniform(np.log([2.0, 0.1]), np.log([80.0, 5.0])))
        a_1 = (2.0 * damping * ratio) ** 2
        rate, duration = np.exp(chance.uniform(-4.0, 4.0)), chance.choice([0.05, 0.2, 1.0])
        f_s, target, excess = chance.uniform([0.1, -20.0, -20.0], [6.0, 20.0, 20.0])
        valve = rate, a_1, a_1 / ratio, f_s, f_s * chance.uniform()
        speed = chance.normal() * 10.0 ** chance.uniform(-2.0, 1.5)
        moving = Stem(0.0, speed, np.sign(speed), True)
        begun = moving if chance.uniform() < 0.7 else AT_REST
        after, left = begun, excess
        for _ in range(parts):
            after = stem_after(duration / parts, target, left, *valve, stem=after)
            left *= math.exp(-rate * duration / parts)
        at_once = stem_after(duration, target, excess, *valve, stem=begun)
        assert at_once.x == pytest.approx(after.x, abs=1e-6), (damping, duration, begun, valve)


def test_rounding_does_not_end_a_slip_that_only_begins():
    """Each slip at the edge of friction would end at once, hundreds of times a step."""
    poles = stem_poles(3999999.9999999953, 19999.999999999985)
    slip = Slip(
        base=23.7978461438425,
        forced=0.0032255500664604853,
        rate=0.9581572658909195,
        c1=-1.5453782729241474e-05,
        c2=1.6018787532419602e-09,
        d1=0.0031222981625074657,
        d2=-3.1713929833413526e-05,
    )
    stop, armed = first_stop(slip, -1.0, False, 1e-5, 0.0179, poles)
    assert stop == -1.0
    assert armed


@pytest.mark.parametrize(
    ('parameters', 'words'),
    [
        ({'f_s': 2.0}, 'exceeds'),
        ({'f_s': math.nan}, 'finite'),
        ({'T_g1': -1.0}, 'between'),
        ({'T_g1': 'slow'}, 'expected a number'),
        ({'fs': 3.0}, 'did you mean'),
        ({'branch': 'euler'}, 'expected one of'),
    ],
)
def test_bad_parameters_are_refused_with_a_sentence(parameters, words):
    with pytest.raises(ModelError, match=words):
        simulate([0.0, 1.0], parameters=parameters)


@pytest.mark.parametrize('u', [[0.0, math.nan], [[0.0]], ['a']])
def test_bad_commands_are_refused(u):
    with pytest.raises(ModelError):
        simulate(u)


def test_sample_file_and_readme_follow_the_declarations():
    root = Path(__file__).parents[2]
    assert (root / 'config/valve_plant.yaml').read_text() == sample_file()
    assert parameter_table() in (root / 'README.md').read_text()
    assert read_parameters(root / 'config/valve_plant.yaml') == ValveSpec()
