# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Pictures of a diagnosis."""

from matplotlib.figure import Figure
import numpy as np

from ..diagnosis.adequacy import WINDOW
from ..diagnosis.result import Diagnosis
from ..diagnosis.rung import Rung
from ..diagnosis.unknowns import complete
from ..model.pipeline import Array
from ..recordings.recording import OUTPUTS
from .plots import COMMAND, FITTED, LABELS, MEASURED, WIDTH

BASE, AUGMENTED = '#c77700', FITTED
MOST_BARS = 10


def before_and_after(result: Diagnosis, number: int = 0) -> Figure:
    """Draw u, and each signal measured, with the base valve, and with the effects added."""
    stretch = result.bench.stretches[number]
    models = _models(result, number)
    names = ('u', *result.bench.signals)
    figure = Figure(figsize=(WIDTH, 0.6 + 2.1 * len(names)), layout='constrained')
    rows = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for axes, name in zip(rows, names, strict=True):
        if name == 'u':
            axes.step(stretch.time, stretch.u, where='post', color=COMMAND, label='command')
        else:
            row = OUTPUTS.index(name)
            axes.plot(
                stretch.time, stretch.measured[name], color=MEASURED, lw=2.6, label='measured'
            )
            for label, values in models.items():
                axes.plot(stretch.time, values[row], color=_colour(label), lw=1, label=label)
        for span in result.places[0].spans if result.places and name != 'u' else ():
            if name == result.places[0].signal:
                axes.axvspan(*span, color='#f4d35e', alpha=0.35, lw=0)
        axes.set_ylabel(LABELS[name], fontsize=9)
        axes.legend(loc='upper right', fontsize=8, ncols=4)
        axes.margins(y=0.18)
    rows[-1].set_xlabel('time [s]')
    return figure


def residuals(result: Diagnosis, number: int = 0) -> Figure:
    """Draw what is left of each signal before and after."""
    stretch = result.bench.stretches[number]
    models = _models(result, number)
    names = result.bench.signals
    figure = Figure(figsize=(WIDTH, 0.6 + 1.9 * len(names)), layout='constrained')
    rows = figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0]
    for axes, name in zip(rows, names, strict=True):
        row = OUTPUTS.index(name)
        for label, values in models.items():
            error = stretch.measured[name] - values[row]
            axes.plot(stretch.time, error, color=_colour(label), lw=0.8, label=label)
        noise = result.gaps[name].noise
        axes.axhspan(-2 * noise, 2 * noise, color=MEASURED, alpha=0.35, lw=0, label='±2 noise')
        axes.set_ylabel(f'{name} measured − model [%]', fontsize=9)
        axes.legend(loc='upper right', fontsize=8, ncols=3)
        axes.margins(y=0.25)
    rows[-1].set_xlabel('time [s]')
    return figure


def against_condition(result: Diagnosis) -> Figure:
    """Draw the residual before and after against the inputs of the stage that disagrees."""
    place = result.places[0]
    stretch = result.bench.stretches[0]
    models = _models(result, 0)
    first = next(iter(models.values()))
    speed = np.gradient(first[2], stretch.time)
    inputs = {
        'command u [%]': stretch.u,
        'p1 − p2 [%]': first[0] - first[1],
        'stem position x [%]': first[2],
        'stem speed [%/s]': np.clip(speed, *np.quantile(speed, (0.01, 0.99))),
        'time [s]': stretch.time,
    }
    figure = Figure(figsize=(WIDTH, 2.9), layout='constrained')
    row = OUTPUTS.index(place.signal)
    for axes, (label, values) in zip(
        figure.subplots(1, len(inputs), sharey=True), inputs.items(), strict=True
    ):
        for name, model in models.items():
            error = stretch.measured[place.signal] - model[row]
            axes.plot(*_binned(values, error), color=_colour(name), marker='.', lw=1, label=name)
        axes.axhline(0.0, color=COMMAND, lw=0.5)
        axes.set_xlabel(label, fontsize=9)
    figure.axes[0].set_ylabel(f'mean of {place.signal} measured − model [%]', fontsize=9)
    figure.axes[0].legend(fontsize=8)
    return figure


def ladder(rung: Rung) -> Figure:
    """Draw the evidence for each effect that was tried."""
    best = sorted(rung.gains.items(), key=lambda each: -each[1])[:MOST_BARS]
    names, gains = zip(*best, strict=True)
    figure = Figure(figsize=(WIDTH, 0.9 + 0.32 * len(names)), layout='constrained')
    axes = figure.subplots()
    colours = [
        AUGMENTED if name == rung.effect else BASE if name in rung.twins else MEASURED
        for name in names
    ]
    axes.barh(names, np.maximum(gains, 0.0), color=colours)
    axes.invert_yaxis()
    axes.set_xlabel('evidence against the valve without it (half log-likelihood)')
    return figure


def _models(result: Diagnosis, number: int) -> dict[str, Array]:
    """Return p1, p2, x of the base valve and, if it differs, of the augmented one."""
    found = {}
    for label, valve in (
        ('base valve', result.base_valve),
        ('with the effects', result.augmented_valve),
    ):
        if label == 'base valve' or result.effects:
            found[label] = result.bench.run(complete(valve.values), valve.effects)[number]
    return found


def _colour(label: str) -> str:
    return BASE if label == 'base valve' else AUGMENTED


def _binned(values: Array, error: Array) -> tuple[Array, Array]:
    """Return the means of an error in WINDOW groups of equal size, ordered by `values`."""
    known = np.isfinite(error)
    order = np.argsort(values[known], kind='stable')
    groups = np.array_split(order, WINDOW)
    return (
        np.array([values[known][group].mean() for group in groups]),
        np.array([error[known][group].mean() for group in groups]),
    )
