# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One blind record: a random valve, its hidden effects, its commands, its recorder, its key."""

from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from .effects import Changes, EFFECTS
from .excitations import commands
from .physics import Physics
from .plant import simulate, STEP, Trace
from .recorder import draw_recorder, measured, Recorder, sample_times, write_bag, write_csv
from .refit import left_over
from .seal import write_json
from .unknown import UNKNOWN
from .valves import base_valve
from .visibility import IMITATED, LEFT, ROUNDED_NOISE, STEPS, visible, WANTED

Rng = np.random.Generator
RUN_IN = 80.0
"""Time before the record, so that it begins in an unknown state [s]."""
CONTINUATION = 300.0
"""Length of the record that nobody has seen [s]."""
DRAWS = {**EFFECTS, **UNKNOWN}
TRIES = 200


@dataclass(frozen=True)
class Plan:
    """What is simulated: the valve with and without its effects, and the commands.

    Attributes
    ----------
    base : Physics
        The valve without any effect.
    changes : dict
        By effect id, what it changes in the valve.
    u : ndarray, shape (m,)
        Commands [%], one per period, from the run-in to the end of the continuation.
    length : float
        Length of the record [s].
    step : float
        Step of the integrator [s].
    """

    base: Physics
    changes: dict[str, Changes]
    u: np.ndarray
    length: float
    step: float

    def valve(self, without: str | None = None, all_effects: bool = True) -> Physics:
        """Return the valve with all effects, all but one, or none."""
        merged: Changes = {}
        for name, each in self.changes.items():
            if all_effects and name != without:
                merged |= each
        return self.base._replace(**merged)


@dataclass(frozen=True)
class Blind:
    """A record, what is hidden in it, and how it was taken."""

    plan: Plan
    recorder: Recorder
    times: np.ndarray
    trace: Trace
    visibility: dict[str, dict[str, float]]
    unexplained: dict[str, dict[str, float]]


def draw_plan(rng: Rng, effects: tuple[str, ...], recorder: Recorder, step: float) -> Plan:
    """Draw a valve, sizes of its effects and commands."""
    base = base_valve(rng)
    length = float(round(rng.triangular(600, 900, 1500)))
    low, high = (rng.uniform(2.0, 20.0), rng.uniform(75.0, 98.0))
    if rng.random() < 0.2:
        low, high = rng.uniform(10.0, 30.0), rng.uniform(55.0, 75.0)
    changes = {name: DRAWS[name](rng, base, length) for name in effects}
    count = round((RUN_IN + length + CONTINUATION) / recorder.period) * recorder.period
    u = commands(rng, count, recorder.period, (low, high), 2 * base.f_d1 + base.f_s + base.f_d)
    return Plan(base, changes, u, length, step)


def run(plan: Plan, physics: Physics, recorder: Recorder, times: np.ndarray) -> Trace:
    """Simulate the plan from the run-in to the last sample."""
    return simulate(*sent(plan, recorder), times, physics, step=plan.step, origin=RUN_IN)


def sent(plan: Plan, recorder: Recorder) -> tuple[np.ndarray, np.ndarray]:
    """Return the commands as they are sent [%], and when [s]."""
    u, count = plan.u, recorder.commands
    changes = np.append(np.diff(u), 0.0)
    moves = np.concatenate([[False], changes != 0.0, [False]])
    goes_on = moves[1:-1] & (moves[:-2] | moves[2:])
    ways = np.where(goes_on, changes, 0.0)[:, None] * np.arange(count) / count
    return (u[:, None] + ways).ravel(), recorder.period / count * np.arange(u.size * count)


def record_part(plan: Plan, recorder: Recorder) -> slice:
    """Return which samples make up the record."""
    first = round(RUN_IN / recorder.period)
    return slice(first, first + round(plan.length / recorder.period))


def plausible(trace: Trace, part: slice) -> bool:
    """Tell whether the stem stays within its stroke, and moves in this part, the record."""
    whole = np.isfinite(trace.x).all() and trace.stem.min() > -4.0 and trace.stem.max() < 104.0
    return bool(whole and np.ptp(trace.stem[part]) > 10.0)


def steps_show(plan: Plan, recorder: Recorder) -> bool:
    """Tell whether the steps of a coarse sensor are no finer than the noise allows to see."""
    step = plan.changes['sensor_quantisation']['sensor_step']
    least = ROUNDED_NOISE if recorder.resolution['x'] == step else STEPS
    return step > least * recorder.noise['x']


def _beyond_refit(
    plan: Plan, recorder: Recorder, recorded: list[Trace], signals: tuple[str, ...]
) -> dict[str, float]:
    """Return what a refit leaves of an effect in each signal [multiples of its noise]."""
    left = [
        left_over(
            trace,
            plan.u[record_part(plan, recorder)],
            plan.base,
            recorder.noise,
            signals,
            recorder.period,
            recorder.phase,
        )
        for trace in recorded
    ]
    return {name: max(left[0][name] ** 2 - left[1][name] ** 2, 0.0) ** 0.5 for name in signals}


def draw(
    rng: Rng,
    effects: tuple[str, ...],
    signals: tuple[str, ...],
    nuisances: float,
    steps: tuple[float, ...] = (STEP,),
) -> Blind:
    """Draw records until the stem stays within its stroke and every effect can be seen.

    Parameters
    ----------
    rng : Generator
        Source of all choices.
    effects : tuple of str
        Their ids; none for a clean record.
    signals : tuple of str
        What is measured.
    nuisances : float
        Probability of each nuisance of the recorder.
    steps : tuple of float
        Steps of the integrator to choose from [s].
    """
    for _ in range(TRIES):
        recorder = draw_recorder(rng, nuisances)
        plan = draw_plan(rng, effects, recorder, float(rng.choice(steps)))
        if 'sensor_quantisation' in effects and rng.random() < 0.5:
            # half of the sensors round the noise too
            recorder.resolution['x'] = plan.changes['sensor_quantisation']['sensor_step']
        part = record_part(plan, recorder)
        times = sample_times(recorder, part.stop, rng)
        trace = run(plan, plan.valve(), recorder, times)
        if not plausible(trace, part):
            continue
        seen: dict[str, dict[str, float]] = {}
        unexplained: dict[str, dict[str, float]] = {}
        for name in effects:
            other = run(plan, plan.valve(without=name), recorder, times)
            recorded = [Trace(*(row[part] for row in each)) for each in (trace, other)]
            seen[name] = visible(*recorded, recorder.noise, signals)
            if name == 'sensor_quantisation' and steps_show(plan, recorder):
                continue
            if max(seen[name].values()) < WANTED:
                break
            unexplained[name] = _beyond_refit(plan, recorder, recorded, signals)
            first = next(signal for signal in signals if seen[name][signal] >= LEFT)
            if max(unexplained[name].values()) < LEFT or unexplained[name][first] < IMITATED:
                break
        else:
            return Blind(plan, recorder, times, trace, seen, unexplained)
    raise ValueError(f'no visible record with {effects} on {signals} in {TRIES} tries')


def command_beside(blind: Blind) -> np.ndarray:
    """Return which of the commands sent is written beside each sample."""
    if blind.recorder.as_sent:
        return np.arange(blind.times.size)
    _, times = sent(blind.plan, blind.recorder)
    command_steps = np.rint(times / blind.plan.step)
    return np.searchsorted(command_steps, np.rint(blind.times / blind.plan.step), 'right') - 1


def write_continuation(blind: Blind, signals: tuple[str, ...], path: Path) -> None:
    """Write what followed the record as nobody measures it: at exact times, without noise."""
    plan, period = blind.plan, blind.recorder.period
    part = record_part(plan, blind.recorder)
    times = period * np.arange(plan.u.size)
    trace = run(plan, plan.valve(), replace(blind.recorder, commands=1), times)
    after = {'u': plan.u[part.stop :]}
    after |= {signal: getattr(trace, signal)[part.stop :] for signal in signals}
    write_csv(path, times[part.stop :] - part.start * period, after)


def write(blind: Blind, rng: Rng, name: str, signals: tuple[str, ...], folder: Path) -> None:
    """Write the record to records/, its key and its continuation to keys/."""
    recorder, plan = blind.recorder, blind.plan
    period = recorder.period
    part = record_part(plan, recorder)
    found = measured(blind.trace, recorder, signals, rng)
    commands = plan.u[part].copy()
    columns = {'u': sent(plan, recorder)[0][command_beside(blind)], **found}
    lost = rng.random(blind.times.size) < recorder.loss
    lost[: part.start + 1] = False  # nothing is known to hold before the first
    commands[lost[part]] = columns['u'][lost] = np.nan
    stamps = blind.times - part.start * period
    jitter = np.clip(rng.standard_normal(stamps.size), -3, 3) * recorder.stamp_jitter * period
    nominal = period * (np.arange(stamps.size) - part.start)
    stamps = np.round(stamps + jitter, 4) if rng.random() < 0.3 else nominal
    (folder / 'records').mkdir(parents=True, exist_ok=True)
    (folder / 'keys').mkdir(parents=True, exist_ok=True)
    if recorder.bag:
        write_bag(
            folder / 'records' / name,
            nominal[part] + 1e-4,
            commands,
            (blind.times - part.start * period + 2e-4 + np.abs(jitter))[part],
            {signal: values[part] for signal, values in found.items()},
        )
    else:
        in_part = {signal: values[part] for signal, values in columns.items()}
        write_csv(folder / 'records' / f'{name}.csv', stamps[part], in_part)
    write_continuation(blind, signals, folder / 'keys' / f'{name}.next.csv')
    key = {
        'effects': list(plan.changes),
        'parameters': plan.changes,
        'base': {k: v for k, v in plan.base._asdict().items() if k in Physics._fields[:8]},
        'signals': list(signals),
        'change_in_noise': blind.visibility,
        'unexplained_in_noise': blind.unexplained,
        'recorder': asdict(recorder),
        'step': plan.step,
        'length': plan.length,
    }
    write_json(folder / 'keys' / f'{name}.json', key)
