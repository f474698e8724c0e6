# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The twin beside a running valve: agrees with its equal, and names the stage that differs."""

import json
import threading

from conftest import overrides
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
import numpy as np
import pytest
from std_msgs.msg import Float64MultiArray, String
from std_srvs.srv import Trigger

from valve_sim_ros import ModelError, simulate, ValveSpec
from valve_sim_ros.nodes.assembly import Assembly
from valve_sim_ros.nodes.comparison import Comparison
from valve_sim_ros.nodes.messages import LATCHED
from valve_sim_ros.nodes.valve_twin import ValveTwin

VALVE = {'T_g1': 1.0, 'T_g2': 4.0}
LEVELS = np.repeat(np.random.default_rng(5).uniform(10.0, 90.0, 20), 40)


def compared(model, valve, noise=0.0, lost=()):
    """Return a comparison that has seen a simulated valve."""
    run = simulate(LEVELS, parameters=valve)
    measured = np.array([run.p1, run.p2, run.x])
    measured += noise * np.random.default_rng(1).standard_normal(measured.shape)
    measured[list(lost)] = np.nan
    comparison = Comparison(ValveSpec().changed(model), 0.2, 1000.0)
    for u, values in zip(LEVELS, measured.T.tolist(), strict=True):
        comparison.take(u, tuple(values))
    return comparison


def test_equal_model_agrees_to_the_last_digits():
    comparison = compared(VALVE, VALVE)
    assert max(comparison.residual(160.0)) < 1e-9
    assert min(comparison.eta()) > 99.999


@pytest.mark.parametrize(
    ('change', 'stage'), [({'f_d1': 8.0}, 0), ({'T_g1': 4.0}, 1), ({'f_s': 20.0, 'f_d': 15.0}, 2)]
)
def test_residual_names_the_stage(change, stage):
    residual = compared(VALVE, {**VALVE, **change}).residual(160.0)
    assert residual[stage] > 0.5
    assert max(found for k, found in enumerate(residual) if k != stage) < 0.05


def test_noise_is_estimated_and_signals_may_be_missing():
    comparison = compared(VALVE, VALVE, noise=0.3, lost=(0, 1))
    assert comparison.noise()[2] == pytest.approx(0.3, rel=0.15)
    assert comparison.residual(100.0)[2] == pytest.approx(0.3, rel=0.3)
    recording = comparison.recording()
    assert recording.signals == ('x',)
    assert len(recording) == LEVELS.size


def test_record_rolls_and_shows_interruptions():
    comparison = Comparison(ValveSpec(), 1.0, 50.0)
    for k in range(120):
        if k == 100:
            comparison.interrupt()
        comparison.take(float(k % 100), (1.0, 2.0, float(k)))
    recording = comparison.recording()
    assert recording.x.tolist() == list(range(70, 120))
    assert [part.stop - part.start for part in recording.segments] == [30, 20]


def test_samples_are_assembled_from_single_topics():
    taken, breaks = [], []
    assembly = Assembly(0.1, lambda *row: taken.append(row), lambda: breaks.append(len(taken)))
    assembly.command = 50.0
    for k in range(40):
        now = 0.1 * k + (30.0 if k >= 30 else 0.0)
        for name in ('p1', 'p2', 'x') if k % 2 else ('p1', 'x', 'p2'):
            if (k, name) != (20, 'p2'):
                assembly.hear(name, float(k), now)
    expected = [(float(k), float(k), float(k)) for k in range(40)]
    expected[20] = (20.0, pytest.approx(np.nan, nan_ok=True), 20.0)
    assert [row[1] for row in taken] == expected
    assert breaks == [30]


@pytest.fixture
def pair(bench):
    """Return what makes a lockstep plant, its peer and its twin, connected."""

    def make(plant_values, twin_values):
        plant = bench.plant(pacing='lockstep', publish_sample=True, **plant_values)
        cli = ['--ros-args', '-r', 'sample:=/valve_plant/sample']
        given = overrides(**{'diagnostics_period': 0.05, 'alarm_time': 60.0, **twin_values})
        twin = bench.add(ValveTwin(parameter_overrides=given, cli_args=cli))
        peer = bench.peer(plant)
        bench.until(plant.outputs['sample'].get_subscription_count)
        bench.until(lambda: peer.u.get_subscription_count() == 2)
        return plant, peer, twin

    return make


def send(bench, peer, twin, levels):
    for u in levels:
        goal = len(peer.heard['x']) + 1
        peer.send(u)
        bench.until(lambda goal=goal: all(len(heard) == goal for heard in peer.heard.values()))
    bench.until(lambda: twin.samples >= len(levels) - 1)


@pytest.mark.ros
def test_twin_of_an_equal_valve_is_content(bench, pair):
    _, peer, twin = pair(VALVE, VALVE)
    reports = []
    peer.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 10)
    send(bench, peer, twin, LEVELS[:200])
    assert max(twin.comparison.residual(1000.0)) < 1e-9
    assert min(twin.comparison.eta()) > 99.999
    bench.until(lambda: reports)
    assert not [r for r in reports if 'off by' in r.status[0].message]


@pytest.mark.ros
def test_twin_hears_the_single_topics_of_a_valve_on_the_wall(bench):
    plant = bench.plant(sample_time=0.02, publish_sample=True, **VALVE)
    twin = bench.add(ValveTwin(parameter_overrides=overrides(sample_time=0.02, **VALVE)))
    peer = bench.peer(plant)
    rows = set()
    peer.create_subscription(
        Float64MultiArray, '/valve_plant/sample', lambda m: rows.add(tuple(m.data[1:])), 1000
    )
    bench.until(plant.outputs['sample'].get_subscription_count)
    bench.until(lambda: peer.u.get_subscription_count() == 2)
    for u in (30.0, 80.0, 40.0):
        goal = twin.samples + 30
        peer.send(u)
        bench.until(lambda goal=goal: twin.samples >= goal)
    record = twin.recording()
    assembled = list(zip(record.u, record.p1, record.p2, record.x, strict=True))
    # a busy machine may disorder single samples
    assert np.mean([row in rows for row in assembled]) > 0.8
    assert np.nanmax(record.p1) - np.nanmin(record.p1) > 30.0


@pytest.mark.ros
def test_twin_warns_of_the_stage_that_differs(bench, pair):
    _, peer, twin = pair(VALVE, {**VALVE, 'f_s': 25.0, 'f_d': 20.0})
    reports = []
    peer.create_subscription(DiagnosticArray, '/diagnostics', reports.append, 10)
    send(bench, peer, twin, LEVELS)
    bench.until(lambda: any('x: the model is off' in r.status[0].message for r in reports))
    worst = reports[-1].status[0]
    assert worst.level == DiagnosticStatus.WARN
    assert 'p1: the model' not in worst.message
    # the right values, live: the comparison is content again
    assert twin.set_parameters_atomically(overrides(f_s=8.7978, f_d=5.2602)).successful
    twin.comparison.interrupt()
    send(bench, peer, twin, LEVELS)
    assert twin.comparison.residual(60.0)[2] < 1.0


class Diagnosis:
    """What `diagnose` returns, for a test that needs no true one."""

    def __init__(self, recording, spec):
        self.recording, self.spec = recording, spec

    def write(self, folder):
        (folder / 'diagnosis.txt').write_text('written')

    def lines(self):
        return [f'{len(self.recording)} samples', 'friction']

    def as_json(self):
        return {'samples': len(self.recording)}


@pytest.mark.ros
def test_diagnose_stops_nothing(bench, pair, monkeypatch):
    go, asked = threading.Event(), []

    def diagnose(recording, *, spec, progress, patience):
        progress(0.1, 'waiting')
        asked.append(recording)
        assert go.wait(20.0)
        return Diagnosis(recording, spec)

    monkeypatch.setattr('valve_sim_ros.diagnosis.diagnose', diagnose)
    _, peer, twin = pair(VALVE, VALVE)
    refused = bench.call(Trigger, '/valve_twin/diagnose')
    assert not refused.success
    assert 'no samples' in refused.message
    send(bench, peer, twin, LEVELS[:30])
    latched = []
    peer.create_subscription(
        String, '/valve_twin/diagnosis', lambda m: latched.append(json.loads(m.data)), LATCHED
    )
    client = peer.create_client(Trigger, '/valve_twin/diagnose')
    bench.until(client.service_is_ready)
    answer = client.call_async(Trigger.Request())
    bench.until(lambda: asked)
    send(bench, peer, twin, LEVELS[:50])  # while the diagnosis is at work
    assert not answer.done()
    second = bench.call(Trigger, '/valve_twin/diagnose')
    assert not second.success
    assert 'at work' in second.message
    go.set()
    bench.until(answer.done)
    samples = len(asked[0])
    assert 29 <= samples <= 30
    assert answer.result().success
    assert answer.result().message == f'{samples} samples\nfriction'
    bench.until(lambda: latched)
    assert latched == [{'samples': samples}]


@pytest.mark.ros
def test_unknown_parameters_are_refused(bench):
    with pytest.raises(ModelError, match='did you mean window'):
        ValveTwin(parameter_overrides=overrides(windows=3.0))
