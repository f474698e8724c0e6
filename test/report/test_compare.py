# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The comparison on a short step: files, order, and models that give no answer."""

import inspect
import json

from click.testing import CliRunner
import numpy as np
import pytest

from valve_sim_ros import IdentificationError, Recording, simulate, write_recording
from valve_sim_ros.cli import main
from valve_sim_ros.identification.compare import compare
from valve_sim_ros.model.rivals import RIVALS
from valve_sim_ros.report.compare import signature

SOME = ('he', 'kano', 'choudhury')


@pytest.fixture(scope='module')
def step():
    s = simulate(np.r_[np.zeros(45), np.full(280, 50.0)], parameters={'T_g2': 20.0})
    x = s.x + 0.2 * np.random.default_rng(0).standard_normal(s.x.size)
    return Recording(s.t, s.u, x=x)


@pytest.fixture(scope='module')
def files(step, tmp_path_factory):
    folder = tmp_path_factory.mktemp('compare')
    write_recording(step, folder / 'bag')
    some = [word for name in SOME for word in ('--model', name)]
    arguments = ['compare', str(folder / 'bag'), '--out', str(folder / 'out'), *some]
    done = CliRunner().invoke(main, arguments)
    assert done.exit_code == 0, done.output
    return done.output, folder / 'out'


def test_models_are_compared(files):
    output, out = files
    models = json.loads((out / 'compare.json').read_text())['models']
    assert set(models) == {'base', *SOME}
    for name, entry in models.items():
        assert set(entry['eta']) == {'fitted', 'held_out'}
        assert entry['seconds'] > 0.0
        assert name in output
        if name != 'base':
            assert set(entry['parameters']) == set(RIVALS[name].defaults)
    assert models['base']['eta']['fitted'] > 99.9
    assert models['kano']['eta']['fitted'] == pytest.approx(models['he']['eta']['fitted'])
    assert 50.0 < models['he']['eta']['fitted'] < 65.0
    assert 'does not answer this input' in models['choudhury']['remark']
    assert (out / 'compare.txt').read_text().strip() in output


def test_page_and_pictures(files):
    _, out = files
    html = (out / 'compare.html').read_text()
    assert html.count('<img src="data:image/png') == 2
    assert 'does not answer this input' in html
    for name in ('overlay.png', 'signature.png'):
        assert (out / name).stat().st_size > 10_000
    assert not list(out.glob('.*'))


def test_signature_is_closed_and_has_the_width_of_the_friction(step):
    result = compare([step], models=['kano'])
    spec = result['kano'].result.spec
    u, x = signature(spec.changed({'S': 20.0, 'J': 4.0}))
    half = u.size // 2
    # over 100 % of travel, up and down are S - J apart once both move
    apart = np.interp(50.0, u[half:][::-1], x[half:][::-1]) - np.interp(50.0, u[:half], x[:half])
    assert apart == pytest.approx(16.0, abs=0.5)
    assert [entry.name for entry in result.entries] == ['base', 'kano']
    assert result.ranked[0].name == 'base'


def test_all_rivals_are_the_default():
    assert inspect.signature(compare).parameters['models'].default == tuple(RIVALS)


def test_refusal_without_x(step):
    with pytest.raises(IdentificationError, match='x is not measured'):
        compare([Recording(step.time, step.u, p2=step.x)])
