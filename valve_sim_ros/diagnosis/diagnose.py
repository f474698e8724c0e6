# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From recordings to a verdict: find, name, add, show."""

from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
import math
import os
import time

from ..identification.watch import Progress, Stop
from ..model.spec import ValveSpec
from ..recordings import read_recording
from ..recordings.recording import OUTPUTS, Recording
from . import dead_time
from .base_valve import find_base, starting_valve
from .bench import Bench
from .climbing import climb_all
from .conditions import Place, places
from .errors import DiagnosisError
from .fitting import Fitter, go_on, Valve
from .intervals import intervals
from .odds import COARSE
from .outcome import concluded, Ladder
from .proof import closed, Gap, prove
from .result import Diagnosis, Named
from .seats import seated
from .stages import Group, groups
from .stretch import CAUGHT
from .unknowns import complete

Data = Recording | str | os.PathLike[str]


def diagnose(
    data: Data | Sequence[Data],
    *,
    topics: Mapping[str, str] | None = None,
    seed: int = 0,
    spec: ValveSpec | None = None,
    progress: Progress | None = None,
    without: Collection[str] = (),
    interruptible: bool = False,
    patience: float = math.inf,
) -> Diagnosis:
    """Find where the base valve and a recording disagree, and name the effect that is missing.

    Parameters
    ----------
    data : Recording, path-like, or a sequence of them
        Bags, CSV files or recordings of one valve, with u and any of p1, p2, x.
    topics : mapping of str to str, optional
        Topic or column of signals.
    seed : int
        Of the searches.
    spec : ValveSpec, optional
        What is known of the valve: where the search starts; its effects stay in force.
    progress : callable, optional
        Called with the share done and what is being done; may raise `Stop`, and what was found
        so far is the result, marked partial.
    without : collection of str
        Effects to leave out of the catalogue.
    interruptible : bool
        Let Ctrl-C do the same as `Stop`.
    patience : float
        Wall time after which it does as if it were stopped [s], once the base valve is fitted;
        the time to compile the model does not count.
        With a limit the result may depend on the machine.

    Returns
    -------
    Diagnosis
        With verdict, effects, places, gaps, and both valves.

    Raises
    ------
    DiagnosisError
        If nothing can be learnt from the data, or it was stopped before the base valve was fitted.
    RecordingError
        If the data cannot be read.
    """
    tell = progress or _silent
    stops = (Stop, KeyboardInterrupt) if interruptible else (Stop,)
    try:
        tell(0.0, 'reading')
        recordings = _read(data, topics)
        bench = Bench(recordings)
        _refuse_useless(bench)
        fitter = Fitter(bench, seed=seed)
        parts = groups(bench.signals)
        valve = _known(starting_valve(bench), spec)
        tell(0.01, 'making ready')
        _compiled(fitter, parts[-1], valve)
        end = time.monotonic() + patience
        for group in parts:
            tell(0.05, f'fitting the base valve to {group.signal}')
            later = group is not parts[0]
            valve = find_base(fitter, group, valve, group.drive, roughly=later)
    except stops:
        raise DiagnosisError(
            'stopped before the base valve was fitted; let it run a little longer'
        ) from None
    fitter.alive = _until(end)
    ladders, base = climb_all(fitter, parts, valve, without, tell, stops)
    fitter.alive = go_on
    ladders, late = dead_time.settled(fitter, ladders)
    tell = _heedless(tell)
    augmented = ladders[-1].valve
    tell(0.92, 'holding out')
    floors = {ladder.group.signal: ladder.after.floor for ladder in ladders}
    gaps = prove(fitter, parts, base, augmented, floors)
    empty = [each for each in ladders if each.rungs and _closes_nothing(gaps, each)]
    if any(each.group.has_stem for each in empty):
        # slips at other moments hide what a right law of friction closes of a free stem
        caught = prove(fitter, parts, base, augmented, floors, (CAUGHT,))
        empty = [each for each in empty if _closes_nothing(caught, each)]
    if empty:
        augmented = _without(augmented, base, empty)
        ladders = [
            concluded(replace(each, rungs=())) if each in empty else each for each in ladders
        ]
        gaps = prove(fitter, parts, base, augmented, floors)
    tell(0.97, 'writing down')
    return Diagnosis(
        recordings=tuple(recordings),
        bench=bench,
        ladders=tuple(ladders),
        effects=_named(fitter, ladders, late),
        places=_places(fitter, ladders),
        gaps=gaps,
        base=_spec(bench, base),
        augmented=_spec(bench, augmented),
        base_valve=base,
        augmented_valve=augmented,
        seed=seed,
    )


def _compiled(fitter: Fitter, group: Group, valve: Valve) -> None:
    """Have the model with effects compiled: once for all times, and nobody's patience."""
    candidate = group.candidates()[0]
    values = {**valve.values, **candidate.neutral}
    fitter.score(replace(valve, values=values, effects=(candidate.effect,)), group.signal)


def _silent(share: float, text: str) -> None:
    """Tell nobody."""


def _until(end: float) -> Callable[[], None]:
    """Return what to call before each search, which stops it after a time [s]."""

    def alive() -> None:
        if time.monotonic() > end:
            raise Stop

    return alive


def _heedless(tell: Progress) -> Progress:
    """Return how to tell the last steps, the least that makes a result: they are not stopped."""

    def told(share: float, text: str) -> None:
        with suppress(Stop):
            tell(share, text)

    return told


def _read(data: Data | Sequence[Data], topics: Mapping[str, str] | None) -> list[Recording]:
    """Return all recordings."""
    each = [data] if isinstance(data, Recording | str | os.PathLike) else list(data)
    if not each:
        raise DiagnosisError('no data given: expected at least one bag or CSV file')
    recordings = [
        item if isinstance(item, Recording) else read_recording(item, topics=topics)
        for item in each
    ]
    thin = math.ceil(sum(map(len, recordings)) / MOST_SAMPLES)
    return recordings if thin <= 1 else [_thinned(recording, thin) for recording in recordings]


def _thinned(recording: Recording, thin: int) -> Recording:
    """Return every so many samples: a valve is slow, and searches take their time per sample."""
    p1, p2, x = (
        recording.output(name)[::thin] if name in recording.signals else None for name in OUTPUTS
    )
    return Recording(recording.time[::thin], recording.u[::thin], p1, p2, x, recording.provenance)


def _refuse_useless(bench: Bench) -> None:
    """Refuse data that cannot tell anything."""
    if bench.size < LEAST_SAMPLES:
        raise DiagnosisError(
            f'{bench.size} samples in stretches without gaps: expected at least {LEAST_SAMPLES}; '
            'record the valve for some minutes while the command moves'
        )
    low = min(stretch.u.min() for stretch in bench.stretches)
    high = max(stretch.u.max() for stretch in bench.stretches)
    if high - low < 1.0:
        raise DiagnosisError(
            f'u stays between {low:.4g} and {high:.4g} %: nothing moves, nothing can be told; '
            'record the valve while the command steps up and down'
        )


LEAST_SAMPLES, MOST_SAMPLES = 200, 20_000
PATIENCE = 300.0
"""How long a user waits for the last searches: an x that nothing explains takes minutes [s]."""
LEAST_HELD = 0.3
"""A name that closes less of the gap, on fitted data and on those held out, is withdrawn."""


def _known(valve: Valve, spec: ValveSpec | None) -> Valve:
    """Return the valve to start from with what is known of it."""
    if spec is None:
        return valve
    if spec.model != 'base':
        raise DiagnosisError(
            f'parameters of model {spec.model}: the diagnosis looks for what model base lacks'
        )
    values = dict(spec.values)
    values['f_d/f_s'] = values['f_d'] / max(values['f_s'], 1e-9)
    values['a_1/a_2'] = values['a_1'] / values['a_2']
    values['damping'] = values['a_2'] / (2.0 * math.sqrt(values['a_1']))
    return replace(valve, values={**valve.values, **values}, effects=spec.effects)


def _named(
    fitter: Fitter, ladders: Sequence[Ladder], known: Mapping[str, tuple[float, float]]
) -> tuple[Named, ...]:
    """Return the effects that were added, with parameters and intervals, some of them known."""
    named = []
    for ladder in ladders:
        if ladder.outcome != 'missing_effect':
            continue
        found = intervals(fitter, ladder.group, ladder.valve, ladder.after.inflation)
        spans = {**found, **{name: known[name] for name in known if name in found}}
        for rung in ladder.rungs:
            own = {n: s for n, s in spans.items() if n.startswith(f'{rung.effect}.')}
            named.append(Named(rung, {n: ladder.valve.values[n] for n in own}, own))
    return tuple(named)


def _closes_nothing(gaps: Mapping[str, Gap], ladder: Ladder) -> bool:
    """Tell whether a name closes next to nothing of its signal, neither where fitted nor beyond.

    One slip at another moment may spoil the part held out. A coarse sensor is told by the values
    of x: it need not close anything.
    """
    if COARSE in {rung.effect for rung in ladder.rungs}:
        return False
    gap = gaps[ladder.group.signal]
    fitted = closed(gap.before.fitted, gap.after.fitted, gap.noise)
    known = [each for each in (fitted, gap.closed) if each is not None]
    return bool(known) and max(known) < LEAST_HELD


def _without(valve: Valve, base: Valve, ladders: Sequence[Ladder]) -> Valve:
    """Return a valve without what some ladders had added, there as the base valve."""
    gone = {rung.effect for ladder in ladders for rung in ladder.rungs}
    own = [unknown.name for ladder in ladders for unknown in ladder.group.unknowns(1)]
    return replace(
        valve,
        values={**valve.values, **{name: base.values[name] for name in own}},
        effects=tuple(name for name in valve.effects if name not in gone),
        candidates=tuple(each for each in valve.candidates if each.effect not in gone),
    )


def _places(fitter: Fitter, ladders: Sequence[Ladder]) -> tuple[Place, ...]:
    """Return where each group that disagrees does so."""
    found: list[Place] = []
    for ladder in ladders:
        if ladder.outcome == 'adequate':
            continue
        residual = fitter.residuals(ladder.base, ladder.group.signal)
        results = fitter.bench.run(complete(ladder.base.values), ladder.base.effects)
        stage = ladder.rungs[0].stage if ladder.rungs else ladder.group.stages[-1]
        found += places(fitter.bench, stage, ladder.group.signal, residual, results)
    return tuple(found)


def _spec(bench: Bench, valve: Valve) -> ValveSpec:
    """Return a fitted valve as the plant loads it."""
    values, effects = seated(complete(valve.values), valve.effects, bench.seats)
    spec = ValveSpec(effects=tuple(effects))
    kept = {}
    for parameter in spec.parameters:
        if parameter.name in values:
            kept[parameter.name] = min(
                max(values[parameter.name], parameter.lower), parameter.upper
            )
    return spec.changed(kept)
