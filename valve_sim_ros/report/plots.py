# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Measured against fitted signals, as a picture."""

import os
from pathlib import Path

from matplotlib.figure import Figure

from ..identification.result import Identification

LABELS = {
    'u': 'command u [%]',
    'p1': 'inlet pressure p1 [%]',
    'p2': 'chamber pressure p2 [%]',
    'x': 'stem position x [%]',
}


def draw_fit(result: Identification, path: str | os.PathLike[str]) -> None:
    """Draw u and, for p1, p2 and x, measured against fitted, for each recording.

    Parameters
    ----------
    result : Identification
        What to draw; its first recording.
    path : path-like
        PNG to write, aside first and then renamed.
    """
    path = Path(path)
    recording, fitted = result.recordings[0], result.fitted[0]
    figure = Figure(figsize=(10, 8), layout='constrained')
    for axes, (name, label) in zip(
        figure.subplots(4, 1, sharex=True), LABELS.items(), strict=True
    ):
        if name == 'u':
            axes.step(recording.time, recording.u, where='post', color='black', label='command')
        else:
            if name in result.signals:
                axes.plot(
                    recording.time,
                    recording.output(name),
                    color='tab:blue',
                    linewidth=2.5,
                    alpha=0.5,
                    label='measured',
                )
                axes.set_title(f'η = {result.eta_by_signal[name]:.3f} %', loc='right', fontsize=9)
            axes.plot(recording.time, fitted[name], color='tab:red', linewidth=1, label='fitted')
        axes.set_ylabel(label, fontsize=9)
        axes.legend(loc='upper right', fontsize=8)
        axes.grid(alpha=0.3)
    axes.set_xlabel('time [s]')
    aside = path.with_name(f'.{path.stem}.part.png')
    figure.savefig(aside, dpi=110)
    os.replace(aside, path)
