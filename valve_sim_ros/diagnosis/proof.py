# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The proof: both valves fitted to the first part of the data and held against the rest."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ..identification.fitness import fitness
from ..model.pipeline import Array
from ..model.scoring import BESIDE
from ..recordings.recording import OUTPUTS
from .conditions import Mask
from .fitting import Fitter, Valve
from .stages import Group
from .stretch import Stretch
from .unknowns import complete

HELD_OUT = 0.3
"""The last share of the samples is held out."""
REFIT = 6
"""Steps of the refits to the first part; they start at the optimum for the whole."""


@dataclass(frozen=True)
class Halves:
    """A number for the fitted and for the held-out part."""

    fitted: float
    held_out: float


@dataclass(frozen=True)
class Gap:
    """What one signal shows before and after: all root mean squares in % of span."""

    noise: float
    before: Halves
    after: Halves
    eta_before: Halves
    eta_after: Halves

    @property
    def closed(self) -> float | None:
        """Explainable gap closed on held-out data, G of the docs; None if there is no gap."""
        return closed(self.before.held_out, self.after.held_out, self.noise)


def closed(before: float, after: float, noise: float) -> float | None:
    """Return 1 - (SSE_after - SSE_noise) / (SSE_before - SSE_noise); None without a gap."""
    gap = before**2 - noise**2
    if gap <= 0.1 * noise**2:
        return None
    return min(1.0 - (after**2 - noise**2) / gap, 1.0)


def prove(
    fitter: Fitter,
    groups: Sequence[Group],
    base: Valve,
    augmented: Valve,
    floors: Mapping[str, float],
    drive: tuple[str, ...] = (),
) -> dict[str, Gap]:
    """Fit both valves to the first part, and measure them on both parts.

    Parameters
    ----------
    fitter : Fitter
        At the bench; what counts is restored.
    groups : sequence of Group
        In the order of the flow.
    base, augmented : Valve
        Fitted to all data.
    floors : mapping of str to float
        Mean square of the noise by signal, over that seen from sample to sample.
    drive : tuple of str
        What puts the stem where it was measured: x is then what is held beside the measured one.

    Returns
    -------
    dict of str to Gap
        By signal.
    """
    bench = fitter.bench
    counts = [dict(stretch.counts) for stretch in bench.stretches]
    parts = _parts(bench.stretches, bench.size)
    for stretch, held in zip(bench.stretches, parts, strict=True):
        stretch.recount({n: np.where(held, np.nan, v) for n, v in stretch.counts.items()})
    refits = []
    for valve in (base, augmented):
        for group in groups:
            unknowns, signal, _ = fitter.problem(group, valve)
            valve = fitter.fit(valve, (unknowns, signal, drive), REFIT)
        refits.append(valve)
    for stretch, every in zip(bench.stretches, counts, strict=True):
        stretch.recount(every)
    held_out = np.concatenate(parts)
    gaps = {}
    results = [bench.run(complete(each.values), each.effects, drive) for each in refits]
    for name in bench.signals:
        measured = np.concatenate([stretch.counts[name] for stretch in bench.stretches])
        row = BESIDE if drive and name == 'x' else OUTPUTS.index(name)
        models = [np.concatenate([each[row] for each in result]) for result in results]
        noise = bench.noise[name] * np.sqrt(floors[name])
        gaps[name] = Gap(
            float(noise),
            *(_halves(measured - model, held_out) for model in models),
            *(_etas(measured, model, held_out) for model in models),
        )
    return gaps


def _parts(stretches: Sequence[Stretch], total: int) -> list[Mask]:
    """Return which samples of each stretch are held out."""
    first, parts = 0, []
    for stretch in stretches:
        n = stretch.u.size
        parts.append((first + np.arange(n)) >= (1.0 - HELD_OUT) * total)
        first += n
    return parts


def _halves(error: Array, held_out: Mask) -> Halves:
    """Return the root mean squares of an error on both parts."""
    values = []
    for part in (error[~held_out], error[held_out]):
        known = part[np.isfinite(part)]
        values.append(float(np.sqrt(np.mean(known**2))) if known.size else float('nan'))
    return Halves(*values)


def _etas(measured: Array, model: Array, held_out: Mask) -> Halves:
    return Halves(
        fitness(measured[~held_out], model[~held_out]),
        fitness(measured[held_out], model[held_out]),
    )
