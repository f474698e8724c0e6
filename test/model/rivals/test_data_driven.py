# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Golden sequences and identities of the models that map commands to positions."""

import math

from laws import FS_FD, inputs, positions, S_J, UP_DOWN
import numpy as np
import pytest

from valve_sim_ros.model.rivals import rival

PAUSE = [*range(11), 10, 10, 10, 11, 12, 13, 14]
SIGNATURES = [(6.5, 2.5), (6.0, 0.0), (6.0, 6.0), (4.0, 8.0)]
"""S, J with undershoot, no jump, no offset, overshoot."""
NAMES = list(inputs())


def f_s_f_d(s, j):
    return {'f_s': (s + j) / 2, 'f_d': (s - j) / 2}


def test_stenman_jumps_to_the_command():
    u = [*range(13), *range(11, -1, -1)]
    x = positions('stenman', u, d=3.5)
    where = np.flatnonzero(np.diff(x)) + 1
    assert [(u[k], x[k]) for k in where] == [(4, 4), (8, 8), (12, 12), (8, 8), (4, 4), (0, 0)]


def test_he_makes_stairs():
    x = positions('he', UP_DOWN, **FS_FD)
    assert x[:13].tolist() == [0, 0, 0, 0, 0, 3, 3, 3, 6, 6, 6, 9, 9]
    down = dict(zip(UP_DOWN[13:], x[13:], strict=True))
    assert [down[u] for u in range(11, 4, -1)] == [9] * 7
    assert (down[4], down[1], down[-2]) == (6, 3, 0)


def test_he_semi_physical_has_the_signature_of_he():
    x = positions('he_semi_physical', UP_DOWN, K_1=1.99, he_f_s1=4.5, he_f_d1=3.2437186)
    np.testing.assert_allclose(x, positions('he', UP_DOWN, **FS_FD), atol=1e-6)


def test_he_semi_physical_with_k_1_of_one_is_he():
    for u in inputs().values():
        semi = positions('he_semi_physical', u, K_1=1.0, he_f_s1=4.5, he_f_d1=2.0)
        np.testing.assert_allclose(semi, positions('he', u, **FS_FD), atol=1e-9)


def test_the_force_form_overshoots_and_rings():
    step = [0.0, 50.0, 50.0, 50.0]
    x = positions('he_semi_physical', step, he_f_s1=14.592, he_f_d1=14.592, force=1.0)
    assert x[1:3] == pytest.approx([70.46, 58.78], abs=0.01)
    x = positions('he_semi_physical', step, he_f_s1=4.5, he_f_d1=3.2437186, force=1.0)
    assert x[1:] == pytest.approx([93.0, 13.8, 79.3], abs=0.1)


def test_peak_factor_of_the_paper():
    zeta = 1.169118 / (2.0 * math.sqrt(38602.94))
    k_1 = 1.0 + math.exp(-math.pi * zeta / math.sqrt(1.0 - zeta**2))
    assert k_1 == pytest.approx(1.9907, abs=1e-4)
    assert rival('he_semi_physical').defaults['K_1'] == pytest.approx(k_1, abs=1e-3)


@pytest.mark.parametrize('name', ['kano', 'xch'])
def test_up_and_down_of_kano(name):
    x = positions(name, UP_DOWN, **S_J)
    assert x[:13].tolist() == [0, 0, 0, 0, 0, 3, 4, 5, 6, 7, 8, 9, 10]
    assert x[13:].tolist() == [10] * 6 + list(range(7, -11, -1))


@pytest.mark.parametrize('name', ['kano', 'xch'])
def test_a_pause_needs_the_jump_only(name):
    assert positions(name, PAUSE, **S_J)[-8:].tolist() == [8, 8, 8, 8, 8, 8, 11, 12]


@pytest.mark.parametrize('name', ['kano', 'xch'])
@pytest.mark.parametrize(
    ('s', 'j', 'first', 'top', 'turn'),
    [
        (6.0, 2.0, (4.0, 2.0), 18.0, (14.0, 16.0)),
        (6.0, 0.0, (3.0, 0.0), 17.0, (14.0, 17.0)),
        (6.0, 6.0, (6.0, 6.0), 20.0, (14.0, 14.0)),
        (4.0, 8.0, (6.0, 8.0), 22.0, (16.0, 14.0)),
        (0.0, 0.0, (0.0, 0.0), 20.0, (20.0, 20.0)),
    ],
)
def test_turning_points(name, s, j, first, top, turn):
    step = 1e-3
    way = 20.0 * np.concatenate([np.linspace(0, 1, 20001), np.linspace(1, -1, 40001)[1:]])
    x = positions(name, way, S=s, J=j)
    moved = np.flatnonzero(np.diff(x)) + 1
    back = moved[moved > 20000][0]
    assert (way[moved[0]], x[moved[0]]) == pytest.approx(first, abs=3 * step)
    assert (way[back], x[back]) == pytest.approx(turn, abs=3 * step)
    assert (x.max(), x.min()) == pytest.approx((top, -top), abs=3 * step)


def test_neutral_start_is_symmetric():
    for name in ('kano', 'xch'):
        for way in (1, -1):
            x = positions(name, [way * u for u in range(13)], **S_J)
            assert np.flatnonzero(x)[0] == 5


@pytest.mark.parametrize('which', NAMES)
def test_he_is_stenman_without_dynamic_friction(which):
    u = inputs()[which]
    np.testing.assert_array_equal(
        positions('he', u, f_s=3.0, f_d=0.0), positions('stenman', u, d=3.0)
    )


@pytest.mark.parametrize('which', ['walk', 'stairs', 'noisy sine', 'triangle'])
def test_he_and_kano_without_a_jump_are_a_play(which):
    u = inputs()[which]
    he = positions('he', u, x0=u[0], f_s=3.01, f_d=3.01)
    play = [u[0]]
    for value in u[1:]:
        play.append(min(max(play[-1], value - 3.01), value + 3.01))
    np.testing.assert_allclose(he, play, atol=1e-9)
    np.testing.assert_allclose(positions('kano', u, x0=u[0], S=6.02, J=0.0), he, atol=1e-9)


@pytest.mark.parametrize('which', NAMES)
@pytest.mark.parametrize(('s', 'j'), SIGNATURES)
def test_xch_and_the_revised_chen_are_kano(which, s, j):
    u = inputs()[which] * 1.0001234  # floating ties apart
    kano = positions('kano', u, x0=u[0], S=s, J=j)
    np.testing.assert_allclose(positions('xch', u, x0=u[0], S=s, J=j), kano, atol=1e-9)
    np.testing.assert_allclose(positions('chen', u, x0=u[0], **f_s_f_d(s, j)), kano, atol=1e-9)


def test_the_original_chen_is_late_at_a_reversal():
    u = [*range(11), 0, 0, 0]
    assert positions('chen', u, **FS_FD, revised=0.0)[-4:].tolist() == [8, 8, 2, 2]
    assert positions('chen', u, **FS_FD)[-4:].tolist() == [8, 2, 2, 2]
    assert positions('kano', u, **S_J)[-4:].tolist() == [8, 2, 2, 2]
    assert positions('he', u, **FS_FD)[-4:].tolist() == [6, 2, 2, 2]


def test_choudhury_never_answers_a_step():
    step = [0.0] * 5 + [50.0] * 50 + [90.0] * 50
    assert (positions('choudhury', step, **S_J) == 0.0).all()
    assert (positions('kano', step, **S_J)[-1:] > 0.0).all()


def test_choudhury_dies_of_noise():
    u = [0.25 * k + k % 2 for k in range(200)]
    assert u[-1] == pytest.approx(50.75)
    assert (positions('choudhury', u, **S_J) == 0.0).all()
    assert positions('kano', u, **S_J)[-1] == pytest.approx(47.75, abs=1.1)
    assert positions('he', u, **FS_FD)[-1] == pytest.approx(47.75, abs=1.1)


def test_choudhury_needs_s_at_first_then_equals_kano():
    u = [*range(60), *range(58, 10, -1), *range(12, 80)]
    x, kano = positions('choudhury', u, **S_J), positions('kano', u, **S_J)
    first = np.flatnonzero(x)[0]
    assert u[first] == 7
    np.testing.assert_array_equal(x[first:], kano[first:])


def test_choudhury_after_a_pause_in_the_same_direction_equals_kano():
    u = np.array([*np.linspace(0, 30, 61), *[30.0] * 4, *np.linspace(30.25, 60, 120)])
    x, kano = positions('choudhury', u, **S_J), positions('kano', u, **S_J)
    np.testing.assert_allclose(x[20:], kano[20:])


def test_the_port_of_choudhury_freezes_between_j_and_s_after_a_pause():
    u = np.array([*np.linspace(0, 30, 61), *[30.0] * 4, *np.linspace(30.5, 60, 60)])
    port = positions('choudhury', u, **S_J, latched=0.0)
    moved = 65 + np.flatnonzero(np.diff(port[64:]))
    assert u[moved[0]] - 30.0 == pytest.approx(3.0)  # above J = 2.5
    assert u[moved[1]] - 30.0 == pytest.approx(7.0)  # frozen until above S = 6.5


def test_choudhury_saturates():
    x = positions('choudhury', [0.0, 50.0, 80.0, 105.0, 120.0, 95.0, 90.0], **S_J)
    assert x[3:5].tolist() == [100.0, 100.0]


SQUARE = [('stenman', 50.0), ('he', 50.0 - 2.0), ('kano', 48.0), ('xch', 48.0), ('chen', 48.0)]


@pytest.mark.parametrize(('name', 'end'), SQUARE)
def test_one_large_step_from_rest(name, end):
    values = {'stenman': {'d': 4.5}, 'he': FS_FD, 'chen': FS_FD}.get(name, S_J)
    x = positions(name, [0.0, 0.0, 50.0, 50.0, 50.0], **values)
    assert x.tolist() == [0.0, 0.0, end, end, end]


@pytest.mark.parametrize('name', ['stenman', 'he', 'kano', 'xch', 'chen', 'he_semi_physical'])
def test_isa_stairs_and_steps(name):
    """Steps of 1 % stay inside a band of 4.5 %, 5 and 10 to 50 % leave it at the step's sample."""
    values = {'stenman': {'d': 4.5}, 'he': FS_FD, 'chen': FS_FD}.get(name, S_J)
    if name == 'he_semi_physical':
        values = {'he_f_s1': 4.5, 'he_f_d1': 3.2437186}
    small = np.repeat([50.0, 51.0, 52.0, 53.0, 52.0, 51.0, 50.0], 10)
    assert (positions(name, small, x0=50.0, **values) == 50.0).all()
    for size in (10.0, 20.0, 50.0, -10.0, -50.0):
        u = np.repeat([50.0, 50.0 + size], 10)
        x = positions(name, u, x0=50.0, **values)
        assert x[9] == 50.0
        assert abs(x[10] - u[10]) < 4.5
        assert (x[10:] == x[10]).all()
