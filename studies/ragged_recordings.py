# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whether the truth stays inside the 95 % intervals when samples are lost and stamps jitter.

`make ragged` prints how often.

Random valves are recorded twice, once cleanly and once by a recorder that loses messages and
stamps them late or early; both recordings go the way of a bag, from receive stamps to samples, and
are identified blindly.
"""

from dataclasses import dataclass
import math

import click
import numpy as np
from tqdm import tqdm

from valve_sim_ros import identify, simulate
from valve_sim_ros.recordings.align import align, Arrivals
from valve_sim_ros.recordings.recording import OUTPUTS, Provenance

SAMPLE_TIME, SAMPLES, HOLD, NOISE = 0.2, 3000, 12.0, 0.1
NAMES = ('f_d1', 'T_g1', 'T_g2', 'f_s', 'f_d', 'a_1/a_2')


@dataclass(frozen=True)
class Recorder:
    """Share of the messages lost, jitter as a share of the sample time, lag of all stamps [s]."""

    loss: float = 0.0
    jitter: float = 0.0
    lag: float = 0.0


def valve(rng):
    """Draw a valve: 0.5 to 2 times the paper's values."""
    values = {'f_d1': 1.7647, 'T_g1': 8.84, 'T_g2': 150.74, 'f_s': 8.7978, 'f_d': 5.2602}
    drawn = {name: value * 2.0 ** rng.uniform(-1.0, 1.0) for name, value in values.items()}
    drawn['f_d'] = min(drawn['f_d'], 0.9 * drawn['f_s'])
    return {**drawn, 'a_1': 2000.0, 'a_2': 176.0 * 2.0 ** rng.uniform(-1.0, 1.0)}


def true_run(rng, parameters):
    """Return times and levels of the commands, the samples' times, and p1, p2, x with noise."""
    count = int(SAMPLES * SAMPLE_TIME / HOLD)
    times = np.append(-0.1, np.cumsum(rng.uniform(0.4, 1.6, count)) * HOLD)
    levels = rng.uniform(5.0, 95.0, times.size)
    ticks = SAMPLE_TIME * np.arange(SAMPLES)
    u = levels[np.searchsorted(times, ticks + 1e-9, side='right') - 1]
    s = simulate(u, SAMPLE_TIME, parameters)
    noisy = {name: getattr(s, name) + NOISE * rng.standard_normal(SAMPLES) for name in OUTPUTS}
    return times, levels, ticks, noisy


def recorded(rng, run, recorder):
    """Return what such a recorder makes of a run."""
    times, levels, ticks, outputs = run

    def stamps(seconds, lag):
        late = seconds + lag + recorder.jitter * SAMPLE_TIME * rng.standard_normal(seconds.size)
        return np.maximum.accumulate(np.round(late * 1e9).astype(np.int64)) + 10**18

    def received(seconds, values, lag):
        kept = rng.random(values.size) >= recorder.loss
        return Arrivals(stamps(seconds, lag)[kept], values[kept])

    # a lost command would be another experiment, so only outputs get lost
    arrivals = {'u': Arrivals(stamps(times, 0.0), levels)}
    for name, values in outputs.items():
        arrivals[name] = received(ticks, values, recorder.lag)
    return align(arrivals, Provenance())


def inside(recording, parameters):
    """Return, by parameter, whether the truth lies inside the interval, and its half-width."""
    truth = {**parameters, 'a_1/a_2': parameters['a_1'] / parameters['a_2']}
    estimates = identify(recording, hold_out=False).estimates
    return {
        name: (
            estimates[name].lower <= truth[name] <= estimates[name].upper,
            estimates[name].half_width / truth[name],
        )
        for name in NAMES
    }


@click.command()
@click.option('--runs', default=100, show_default=True, help='Random valves.')
@click.option('--loss', default=5.0, show_default=True, help='Messages lost [%].')
@click.option('--jitter', default=10.0, show_default=True, help='Of the stamps [% of a sample].')
@click.option('--lag', default=0.0, show_default=True, help='Of the outputs [% of a sample].')
def main(runs, loss, jitter, lag):
    """Print how often the truth is inside the intervals, clean and ragged."""
    recorders = {
        'clean': Recorder(),
        'ragged': Recorder(loss / 100.0, jitter / 100.0, lag / 100.0 * SAMPLE_TIME),
    }
    hits: dict[str, list[dict[str, tuple[bool, float]]]] = {kind: [] for kind in recorders}
    try:
        for seed in tqdm(range(runs), disable=None):
            rng = np.random.default_rng(seed)
            parameters = valve(rng)
            run = true_run(rng, parameters)
            found = [inside(recorded(rng, run, each), parameters) for each in recorders.values()]
            for kind, result in zip(recorders, found, strict=True):
                hits[kind].append(result)
    except KeyboardInterrupt:  # what there is counts
        runs = len(hits['clean'])
    if not runs:
        raise click.ClickException('no run was completed')
    error = 1.96 * math.sqrt(0.95 * 0.05 / runs)
    click.echo(
        f'{runs} valves, {SAMPLES} samples each; ragged: {loss:g} % lost, jitter {jitter:g} % and '
        f'lag {lag:g} % of a sample; exact 95 % intervals hold {95 - 100 * error:.0f} to '
        f'{min(95 + 100 * error, 100):.0f} % of so many'
    )
    click.echo('| parameter | clean: inside | ± (median) | ragged: inside | ± (median) |')
    click.echo('|---|---|---|---|---|')
    for name in NAMES:
        cells = [
            f'{sum(each[name][0] for each in hits[kind])} of {runs} | '
            f'{100 * np.median([each[name][1] for each in hits[kind]]):.2g} %'
            for kind in recorders
        ]
        click.echo(f'| {name} | {" | ".join(cells)} |')


if __name__ == '__main__':
    main()
