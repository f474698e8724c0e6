# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Figures of the study of the paper that no other page needs."""

from matplotlib.figure import Figure
import numpy as np


def karnopp_figure(simulation, runs):
    """Draw the paper's Fig. 7: u, p2, x, and Karnopp's stem driven by p2."""
    figure = Figure(figsize=(9, 4), layout='constrained')
    axes = figure.subplots()
    axes.step(simulation.t, simulation.u, where='post', color='0.7', label='u')
    axes.plot(simulation.t, simulation.p2, color='0.4', linestyle='--', label='p2')
    axes.plot(simulation.t, simulation.x, color='#7fb2dc', linewidth=2.4, label='x')
    labels = {'table_1': 'Karnopp, Table 1', 'corrected': 'Karnopp, F_v = 612.9 N s/m'}
    for (name, x), colour in zip(runs.items(), ('#b3261e', '#1a7340'), strict=True):
        axes.plot(simulation.t, x, color=colour, linewidth=1.2, label=labels[name])
    return _labelled(figure, axes, 'time [s]', '% of span')


def loop_figure(simulation):
    """Draw the paper's Fig. 10: p2 at the end of each level against u."""
    ends = np.arange(2999, simulation.t.size, 3000)
    figure = Figure(figsize=(5, 4.2), layout='constrained')
    axes = figure.subplots()
    axes.plot((0.0, 100.0), (0.0, 100.0), color='0.8')
    axes.plot(simulation.u[ends], simulation.p2[ends], 'o-', color='#1f5f99', label='p2')
    return _labelled(figure, axes, 'command u [%]', 'steady p2 [%]')


def measured_figure(simulation):
    """Draw x against u over the second period of a slow sine."""
    half = simulation.t.size // 2
    figure = Figure(figsize=(5, 4.2), layout='constrained')
    axes = figure.subplots()
    axes.plot((0.0, 100.0), (0.0, 100.0), color='0.8')
    axes.plot(simulation.u[half:], simulation.x[half:], color='#1f5f99', label='x')
    return _labelled(figure, axes, 'command u [%]', 'position x [%]')


def _labelled(figure, axes, across, up):
    axes.set_xlabel(across)
    axes.set_ylabel(up)
    axes.grid(alpha=0.25)
    axes.legend(fontsize=8)
    return figure
