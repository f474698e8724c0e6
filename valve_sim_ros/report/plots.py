# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of an identification."""

import os
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
import numpy as np

from ..identification.result import Identification

LABELS = {
    'u': 'command u [%]',
    'p1': 'inlet pressure p1 [%]',
    'p2': 'chamber pressure p2 [%]',
    'x': 'stem position x [%]',
}
MEASURED, FITTED, COMMAND = '#7fb2dc', '#b3261e', '#1c2733'
WIDTH = 10.0
MOST_POINTS = 20_000
"""Longer records are thinned out for drawing."""


def draw_fit(result: Identification, path: str | os.PathLike[str]) -> None:
    """Write `overlay` of the first recording as PNG, aside first and then renamed."""
    save(overlay(result), path)


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as PNG, aside first and then renamed."""
    path = Path(path)
    aside = path.with_name(f'.{path.stem}.part.png')
    figure.savefig(aside, dpi=110)
    os.replace(aside, path)


def overlay(result: Identification, number: int = 0) -> Figure:
    """Draw u and, for p1, p2 and x, measured against fitted.

    Parameters
    ----------
    result : Identification
        What to draw.
    number : int
        Which of its recordings.
    """
    recording, fitted = result.recordings[number], result.fitted[number]
    thin = _thin(recording.time.size)
    time = recording.time[thin]
    # data-driven models know no pressures
    labels = {name: label for name, label in LABELS.items() if name in ('u', *fitted)}
    figure = Figure(figsize=(WIDTH, 2.1 * len(labels)), layout='constrained')
    rows = figure.subplots(len(labels), 1, sharex=True)
    for axes, (name, label) in zip(rows, labels.items(), strict=True):
        if name == 'u':
            axes.step(time, recording.u[thin], where='post', color=COMMAND, label='command')
        else:
            if name in recording.signals:
                values = recording.output(name)[thin]
                axes.plot(time, values, color=MEASURED, linewidth=2.6, label='measured')
            if name in result.signals:
                axes.set_title(f'η = {result.eta_by_signal[name]:.3f} %', loc='right', fontsize=9)
            axes.plot(time, fitted[name][thin], color=FITTED, linewidth=1, label='fitted')
        axes.set_ylabel(label, fontsize=9)
        _legend(axes)
    rows[-1].set_xlabel('time [s]')
    return figure


def residuals(result: Identification, number: int = 0) -> Figure:
    """Draw measured minus fitted over time, and how it is distributed, for each fitted signal."""
    recording, fitted = result.recordings[number], result.fitted[number]
    names = [name for name in result.signals if name in recording.signals]
    figure = Figure(figsize=(WIDTH, 0.6 + 1.9 * len(names)), layout='constrained')
    rows = figure.subplots(
        len(names), 2, squeeze=False, sharey='row', width_ratios=(5, 1), sharex='col'
    )
    thin = _thin(recording.time.size)
    for (axes, side), name in zip(rows, names, strict=True):
        error = recording.output(name) - fitted[name]
        axes.plot(recording.time[thin], error[thin], color=FITTED, linewidth=0.7)
        noise = result.noise.get(name)
        if noise:
            axes.axhspan(-2 * noise, 2 * noise, color=MEASURED, alpha=0.35, label='±2 noise')
            _legend(axes)
        axes.set_ylabel(f'{name} − fitted [%]', fontsize=9)
        side.hist(error[np.isfinite(error)], bins=50, orientation='horizontal', color=MEASURED)
        side.set_xticks([])
        axes.grid(alpha=0.3)
    rows[-1][0].set_xlabel('time [s]')
    return figure


def signature(result: Identification, number: int = 0) -> Figure:
    """Draw the signature: position (or the last fitted signal) against the command."""
    recording, fitted = result.recordings[number], result.fitted[number]
    name = result.signals[-1]
    figure = Figure(figsize=(6.2, 5.2), layout='constrained')
    axes = figure.subplots()
    thin = _thin(recording.time.size)
    if name in recording.signals:
        values = recording.output(name)[thin]
        axes.plot(recording.u[thin], values, '.', color=MEASURED, markersize=3, label='measured')
    axes.plot(recording.u[thin], fitted[name][thin], color=FITTED, linewidth=0.8, label='fitted')
    low, high = float(recording.u.min()), float(recording.u.max())
    axes.plot([low, high], [low, high], ':', color=COMMAND, linewidth=1, label=f'{name} = u')
    axes.set_xlabel(LABELS['u'])
    axes.set_ylabel(LABELS[name])
    _legend(axes)
    return figure


def intervals(result: Identification) -> Figure:
    """Draw every 95 % interval relative to its value, the doubtful ones in another colour."""
    names = [n for n, each in result.estimates.items() if np.isfinite(each.lower)]
    figure = Figure(figsize=(WIDTH, 0.9 + 0.34 * len(names)), layout='constrained')
    axes = figure.subplots()
    for row, name in enumerate(reversed(names)):
        each = result.estimates[name]
        scale = abs(each.value) or max(each.upper - each.lower, 1e-12)
        low, high = (100 * (end - each.value) / scale for end in (each.lower, each.upper))
        colour = '#1a7340' if each.identified else '#c77700'
        axes.plot([low, high], [row, row], color=colour, linewidth=4, solid_capstyle='butt')
        axes.plot([0], [row], 'o', color=colour, markersize=5)
    axes.set_yticks(range(len(names)), list(reversed(names)))
    axes.set_xscale('symlog', linthresh=1.0)
    axes.xaxis.set_major_formatter('{x:g}')
    axes.axvline(0, color=COMMAND, linewidth=0.7)
    axes.set_xlabel('95 % interval, relative to the value [%] (linear within ±1 %)')
    axes.grid(alpha=0.3, axis='x')
    return figure


def correlation(result: Identification) -> Figure:
    """Draw the correlation matrix of the fitted parameters, with its numbers."""
    assert result.assessment is not None
    names, matrix = result.assessment.names, result.assessment.correlation
    figure = Figure(
        figsize=(1.6 + 0.75 * len(names), 1.1 + 0.62 * len(names)), layout='constrained'
    )
    axes = figure.subplots()
    image = axes.imshow(matrix, vmin=-1, vmax=1, cmap='RdBu_r', aspect='auto')
    axes.set_xticks(range(len(names)), names, fontsize=9)
    axes.set_yticks(range(len(names)), names, fontsize=9)
    for row, column in np.ndindex(matrix.shape):
        value = matrix[row, column]
        ink = 'white' if abs(value) > 0.6 else COMMAND
        axes.text(column, row, f'{value:.2f}', ha='center', va='center', color=ink, fontsize=8)
    figure.colorbar(image, ax=axes, shrink=0.9)
    return figure


def profiles(result: Identification) -> Figure:
    """Draw the profile likelihoods; the line at 3.84 bounds the 95 % intervals."""
    columns = 3
    rows = -(-len(result.profiles) // columns)
    figure = Figure(figsize=(WIDTH, 2.4 * rows), layout='constrained')
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes, each in zip(grid, result.profiles, strict=False):
        axes.plot(each.values, each.rise, '.-', color=FITTED, linewidth=1)
        axes.axhline(3.84, color=COMMAND, linestyle=':', linewidth=1)
        axes.set_ylim(-0.3, 10.0)
        axes.xaxis.set_major_locator(MaxNLocator(4))
        axes.set_xlabel(f'{each.name} [{each.unit}]', fontsize=9)
        axes.grid(alpha=0.3)
    for axes in grid[len(result.profiles) :]:
        axes.set_visible(False)
    return figure


def _legend(axes: Axes) -> None:
    """Put the legend beside the axes, where it hides nothing."""
    axes.legend(loc='upper left', bbox_to_anchor=(1.0, 1.0), fontsize=8, frameon=False)
    axes.grid(alpha=0.3)


def _thin(size: int) -> slice:
    """Return which samples to draw."""
    return slice(None, None, max(1, size // MOST_POINTS))
