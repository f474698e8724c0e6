# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An experiment on a simulated valve, offline."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ..model.pipeline import Array
from ..model.simulation import simulate, Simulation, Valve
from ..model.spec import ValveSpec
from .inputs import Experiment
from .pi_controller import PiController


class Loop(NamedTuple):
    """Commands and outputs of a closed loop [% of span], shape (n,) each."""

    u: Array
    p1: Array
    p2: Array
    x: Array


def perform(
    experiment: Experiment, spec: ValveSpec | None = None, noise: float = 0.0, seed: int = 0
) -> Simulation:
    """Return what a valve does in an experiment.

    Parameters
    ----------
    experiment : Experiment
        Which one.
    spec : ValveSpec, optional
        The valve; the paper's by default.
    noise : float
        Standard deviation of noise added to p1, p2 and x after the experiment [% of span].
    seed : int
        Seed of the noise.
    """
    spec = spec or ValveSpec()
    if experiment.closed_loop:
        loop = closed_loop(experiment.commands(), experiment.sample_time, spec)
        t: Array = np.arange(loop.u.size, dtype=np.float64) * experiment.sample_time
        result = Simulation(t, *loop, spec)
    else:
        result = simulate(experiment.commands(), experiment.sample_time, spec)
    if not noise:
        return result
    rng = np.random.default_rng(seed)
    noisy = {
        name: getattr(result, name) + noise * rng.standard_normal(result.t.size)
        for name in ('p1', 'p2', 'x')
    }
    return replace(result, **noisy)


def closed_loop(
    set_points: Array,
    sample_time: float,
    spec: ValveSpec,
    controller: PiController | None = None,
    x: float = 0.0,
) -> Loop:
    """Return the loop of a PI controller and a valve.

    Each command answers the position of the sample before, `x` [% of span] at first: what the
    nodes `pi_controller` and `valve_plant` do in lockstep.
    """
    law = controller or PiController(sample_time=sample_time)
    valve = Valve(spec, background=False)
    outputs = np.empty((4, set_points.size))
    for k, set_point in enumerate(set_points):
        u = law.step(float(set_point), x)
        p1, p2, x = valve.step(u, sample_time)
        outputs[:, k] = u, p1, p2, x
    return Loop(*outputs)
