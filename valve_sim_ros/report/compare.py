# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Models side by side: measured against fitted, signatures, and the page of both."""

from collections.abc import Sequence
import math
import os
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
import numpy as np

from ..identification.comparison import Comparison, Entry, percent
from ..model.files import write_text
from ..model.pipeline import Array
from ..model.simulation import simulate
from ..model.spec import ValveSpec
from .page import embed, number, render
from .plots import FITTED, MEASURED, save

COLUMNS = 3
LEG = 800
"""Samples from one end of the span to the other, for a signature."""
SLOW = 50.0
"""Length of such a leg in time constants of the chamber,"""
LONGEST_LAG = 300.0
"""of which longer ones count as this [s]."""
MOST_POINTS = 3000


def write_comparison(comparison: Comparison, directory: str | os.PathLike[str]) -> list[str]:
    """Write the pictures and the page of a comparison; return the names of the files."""
    folder = Path(directory)
    pictures = {'overlay.png': overlay(comparison), 'signature.png': signatures(comparison)}
    for name, figure in pictures.items():
        save(figure, folder / name)
    write_text(folder / 'compare.html', page(comparison, *pictures.values()))
    return [*pictures, 'compare.html']


def overlay(comparison: Comparison) -> Figure:
    """Draw x measured and fitted by each model, from the best to the worst; first recording."""
    recording = comparison.recordings[0]
    thin = slice(None, None, max(1, recording.time.size // MOST_POINTS))
    time = recording.time[thin]
    figure, panels = _grid(comparison.ranked, sharey=True)
    for axes, entry in zip(panels, comparison.ranked, strict=False):
        axes.step(time, recording.u[thin], where='post', color='0.8', linewidth=0.8, label='u')
        measured = recording.output('x')[thin]
        axes.plot(time, measured, color=MEASURED, linewidth=2.4, label='x measured')
        fitted = entry.result.fitted[0]['x'][thin]
        axes.plot(time, fitted, color=FITTED, linewidth=1.0, label='x fitted')
        axes.set_title(f'{entry.name}   η = {percent(entry.eta)} %', fontsize=9, loc='left')
    panels[0].legend(fontsize=7, loc='best')
    figure.supxlabel('time [s]', fontsize=9)
    figure.supylabel('% of span', fontsize=9)
    return figure


def signatures(comparison: Comparison) -> Figure:
    """Draw x against u for a command so slow that all valves follow it."""
    figure, panels = _grid(comparison.ranked, sharey=True)
    for axes, entry in zip(panels, comparison.ranked, strict=False):
        u, x = signature(entry.result.spec)
        axes.plot((0.0, 100.0), (0.0, 100.0), color='0.8', linewidth=0.8)
        axes.plot(u, x, color=FITTED, linewidth=1.1)
        axes.set_title(entry.name, fontsize=9, loc='left')
    figure.supxlabel('command u [%]', fontsize=9)
    figure.supylabel('position x [%]', fontsize=9)
    return figure


def signature(spec: ValveSpec) -> tuple[Array, Array]:
    """Return u and x of a closed loop from 0 to 100 % and back, slow against the chamber."""
    lag = max(spec.values.get('T_g1', 1.0), spec.values.get('T_g2', 1.0))
    sample_time = max(SLOW * min(lag, LONGEST_LAG) / LEG, 1e-3)
    up = np.linspace(0.0, 100.0, LEG)
    u = np.concatenate([up, up[::-1], up, up[::-1]])
    x = simulate(u, sample_time, spec).x
    return u[2 * LEG :], x[2 * LEG :]


def page(comparison: Comparison, overlay: Figure, signatures: Figure) -> str:
    """Return the comparison as a page that stands alone."""
    least = min(entry.information for entry in comparison.entries)
    rows = [
        (
            entry.name,
            entry.title,
            percent(entry.eta),
            percent(entry.eta_held_out),
            entry.free,
            f'{entry.information - least:.0f}',
            f'{entry.seconds:.1f}',
        )
        for entry in comparison.ranked
    ]
    return render(
        'compare.html',
        rows=rows,
        parameters=[(entry.name, _values(entry)) for entry in comparison.ranked],
        remarks=[f'{e.name}: {e.remark}' for e in comparison.entries if e.remark],
        sources=[_source(path) for r in comparison.recordings for path in r.provenance.paths],
        samples=sum(len(recording) for recording in comparison.recordings),
        channel=comparison.channel,
        overlay=embed(overlay),
        signatures=embed(signatures),
        version=comparison.entries[0].result.version,
    )


def _values(entry: Entry) -> str:
    """Return the fitted values as text; those that were held are left out."""
    return ', '.join(
        f'{name} = {number(entry.parameters[name])} {estimate.unit}'.rstrip(' -')
        for name, estimate in entry.result.estimates.items()
        if name in entry.parameters and math.isfinite(estimate.half_width)
    )


def _source(path: str) -> str:
    """Return the name of a file without its folders."""
    return Path(path).name


def _grid(entries: Sequence[Entry], **shared: Any) -> tuple[Figure, list[Any]]:
    """Return a figure with one panel per model."""
    rows = math.ceil(len(entries) / COLUMNS)
    figure = Figure(figsize=(10.5, 2.1 * rows + 0.4), layout='constrained')
    panels = figure.subplots(rows, COLUMNS, sharex=True, squeeze=False, **shared).ravel()
    for axes in panels:
        axes.grid(alpha=0.25)
        axes.tick_params(labelsize=8)
    for axes in panels[len(entries) :]:
        axes.set_visible(False)
    for axes in panels[max(len(entries) - COLUMNS, 0) : len(entries)]:
        axes.tick_params(labelbottom=True)
    return figure, list(panels)
