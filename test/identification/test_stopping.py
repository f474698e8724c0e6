# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A search that is stopped leaves its best as a valid result that says it is partial."""

import json

from click.testing import CliRunner
import numpy as np
import pytest

from valve_sim_ros import IdentificationError, identify, read_parameters, Recording, simulate
from valve_sim_ros.cli import main
from valve_sim_ros.identification.watch import Stop


@pytest.fixture
def data():
    u = np.repeat(np.random.default_rng(5).uniform(5.0, 95.0, 20), 50)
    clean = simulate(u)
    return Recording(
        clean.t, u, x=clean.x + 0.1 * np.random.default_rng(0).standard_normal(u.size)
    )


def stop_at(share, error=Stop):
    def progress(done, text):
        if done >= share:
            raise error

    return progress


@pytest.mark.parametrize('share', [0.05, 0.71, 0.8])
def test_the_best_so_far_is_kept(data, share):
    result = identify(data, progress=stop_at(share))
    assert result.partial
    assert result.lines()[0].startswith('PARTIAL')
    assert np.isfinite(result.eta)
    assert json.loads(json.dumps(result.as_json(), allow_nan=False))['partial']
    if share > 0.7:
        assert result.eta > 99.0


def test_a_search_of_part_of_long_data_keeps_its_best_for_the_whole(data, monkeypatch):
    monkeypatch.setattr('valve_sim_ros.identification.identify.MOST_SEARCHED', 500)
    time = data.time + np.repeat([0.0, 100.0], len(data) // 2)
    gap = Recording(time, data.u, x=data.x)
    assert len(gap.segments) == 2
    result = identify(gap, progress=stop_at(0.05))
    assert result.partial
    assert result.fitted[0]['x'].size == len(gap)


def test_interrupt_counts_only_if_asked_for(data):
    with pytest.raises(KeyboardInterrupt):
        identify(data, progress=stop_at(0.1, KeyboardInterrupt))
    assert identify(data, progress=stop_at(0.1, KeyboardInterrupt), interruptible=True).partial


def test_nothing_found_yet_is_an_error(data):
    with pytest.raises(IdentificationError, match='before anything'):
        identify(data, progress=stop_at(0.0))


def test_progress_rises_to_the_end(data):
    told = []
    identify(data, progress=lambda share, text: told.append(share))
    assert told == sorted(told)
    assert told[-1] == 1.0


def test_command_line_writes_a_partial_result(data, tmp_path, monkeypatch):
    from valve_sim_ros import write_recording
    from valve_sim_ros.cli import identify as verb

    class Bar:
        def __enter__(self):
            return stop_at(0.1, KeyboardInterrupt)

        def __exit__(self, *_):
            return None

    monkeypatch.setattr(verb, 'progress_bar', Bar)
    write_recording(data, tmp_path / 'a.csv')
    out = tmp_path / 'out'
    done = CliRunner().invoke(main, ['identify', str(tmp_path / 'a.csv'), '--out', str(out)])
    assert done.exit_code == verb.INTERRUPTED, done.output
    assert 'PARTIAL' in done.output
    assert json.loads((out / 'identify.json').read_text())['partial']
    assert 'PARTIAL' in (out / 'fitted.yaml').read_text()
    read_parameters(out / 'fitted.yaml')
    assert 'Partial' in (out / 'report.html').read_text()
