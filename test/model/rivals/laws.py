# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Data-driven laws as plain Python, sample by sample."""

import numpy as np

from valve_sim_ros.model import kernels
from valve_sim_ros.model.rivals import rival

FS_FD = {'f_s': 4.5, 'f_d': 2.0}
S_J = {'S': 6.5, 'J': 2.5}
UP_DOWN = [*range(13), *range(11, -13, -1)]


def positions(name, u, x0=0.0, u0=None, **values):
    """Return x of a data-driven model for the commands `u`, starting at rest."""
    model = rival(name)
    theta = [{**model.defaults, **values}[p.name] for p in model.parameters]
    advance = kernels.interpreted(model.advance, {})
    first = u[0] if u0 is None else u0
    state = model.start(first, first, x0, theta).tolist()
    return np.array([advance(float(v), 0.2, state, theta) for v in u])


def inputs(seed=0, n=1500):
    """Return named inputs: walks, stairs, quantised walks with pauses, noisy sines, triangles."""
    rng = np.random.default_rng(seed)
    k = np.arange(n)
    walk = 50.0 + np.cumsum(rng.uniform(-3.0, 3.0, n))
    return {
        'walk': walk,
        'stairs': np.repeat(rng.uniform(0.0, 100.0, n // 10), 10),
        'pauses': np.round(50.0 + np.cumsum(rng.uniform(-1.5, 1.5, n))),
        'noisy sine': 50.0 + 40.0 * np.sin(k / 40.0) + rng.normal(0.0, 0.7, n),
        'triangle': 0.37 * np.abs((k + 130) % 260 - 130.0),
    }
