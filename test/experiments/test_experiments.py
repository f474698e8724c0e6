# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The paper's experiments: what it prints of them, and what they show of its valve."""

from click.testing import CliRunner
import numpy as np
import pytest

from valve_sim_ros import ModelError, read_recording, ValveSpec
from valve_sim_ros.cli import main
from valve_sim_ros.experiments.inputs import experiment, EXPERIMENTS
from valve_sim_ros.experiments.perform import closed_loop, perform
from valve_sim_ros.experiments.pi_controller import PiController


def test_six_experiments_name_their_assumptions():
    assert set(EXPERIMENTS) == {
        'multi-step',
        'step',
        'impulse',
        'cosine',
        'closed-loop',
        'signature',
    }
    for each in EXPERIMENTS.values():
        assert each.assumptions
        assert each.commands().min() >= 0.0
        assert each.commands().max() <= 100.0
    with pytest.raises(ModelError, match='expected one of'):
        experiment('stairs')


def test_inputs_are_those_printed():
    assert np.ptp(EXPERIMENTS['step'].commands()) == 50.0
    u = EXPERIMENTS['impulse'].commands()
    assert np.count_nonzero(u == u.max()) == 2
    assert u.max() - u[-1] == 30.0
    assert EXPERIMENTS['closed-loop'].sample_time == 0.02
    law = PiController()
    assert (law.gain, law.integral_time) == (0.2083, 15.0)


def test_frequency_of_the_cosine_falls():
    u = EXPERIMENTS['cosine'].commands() - 50.0
    crossings = np.flatnonzero(np.diff(np.sign(u)) != 0)
    assert (np.diff(crossings) > 0).all()
    assert (np.diff(np.diff(crossings)) > 0).all()


def test_step_golden():
    s = perform(EXPERIMENTS['step'])
    assert s.x[[53, 60, 200, 324]] == pytest.approx(
        [0.0, 8.275686, 41.513836, 42.886722], abs=1e-5
    )


def test_static_loop_has_the_width_of_the_backlash():
    s = perform(EXPERIMENTS['multi-step'])
    ends = np.arange(2999, s.t.size, 3000)
    u, p2 = s.u[ends], s.p2[ends]
    up, down = (u == 50.0).nonzero()[0]
    assert p2[down] - p2[up] == pytest.approx(2.0 * 1.7647, abs=0.2)


def test_stem_moves_after_the_impulse():
    s = perform(EXPERIMENTS['impulse'])
    assert np.ptp(s.x[349:]) > 1.0


def test_slow_signature_is_that_of_kano():
    s = perform(EXPERIMENTS['signature'])
    half = s.t.size // 2
    u, x = s.u[half:], s.x[half:]
    rising = (np.diff(u, prepend=u[0]) > 0) & (np.abs(u - 50.0) < 1.0)
    falling = (np.diff(u, prepend=u[0]) < 0) & (np.abs(u - 50.0) < 1.0)
    apart = np.mean(x[falling] - u[falling]) - np.mean(x[rising] - u[rising])
    lag = (8.84 + 150.74) * 2.0 * np.pi * 50.0 / 40_000.0
    assert apart == pytest.approx(2.0 * (1.7647 + 5.2602) + lag, abs=0.1)


def test_closed_loop_answers_the_position_before():
    loop = closed_loop(np.full(200, 40.0), 0.02, ValveSpec())
    law = PiController(sample_time=0.02)
    again = [law.step(40.0, x) for x in np.r_[0.0, loop.x[:-1]]]
    np.testing.assert_array_equal(loop.u, again)


def test_noise_is_the_seeds():
    first, again, other = (
        perform(EXPERIMENTS['step'], noise=0.2, seed=seed).x for seed in (1, 1, 2)
    )
    assert (first == again).all()
    assert (first != other).any()
    assert np.std(first - perform(EXPERIMENTS['step']).x) == pytest.approx(0.2, rel=0.2)


def test_command_line_writes_a_bag(tmp_path):
    arguments = ['experiment', 'impulse', '--out', str(tmp_path / 'bag'), '--noise', '0.1']
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    assert 'assumed: on a base of 50 %' in done.output
    recording = read_recording(tmp_path / 'bag')
    np.testing.assert_allclose(recording.u, EXPERIMENTS['impulse'].commands())
    assert recording.signals == ('p1', 'p2', 'x')
