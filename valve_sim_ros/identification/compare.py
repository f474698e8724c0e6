# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The base valve and its rivals fitted to the same data, side by side."""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
import threading
import time

import numpy as np

from ..model.rivals import RIVALS
from ..model.rivals.declaration import Channel
from ..model.spec import BASE_MODEL
from ..recordings.recording import Recording
from .comparison import Comparison, Entry
from .errors import IdentificationError
from .identify import identify
from .result import Identification
from .rivals import identify_rival
from .uncertainty import WEAK
from .watch import Progress

WORKERS = 2
ANSWER = 0.01
"""A model that moves by less than this share of what the stem did gives no answer."""


def compare(
    recordings: Sequence[Recording],
    *,
    models: Sequence[str] = tuple(RIVALS),
    seed: int = 0,
    channel: Channel = 'u',
    hold_out: bool = True,
    progress: Progress | None = None,
) -> Comparison:
    """Fit the base valve and rivals to x of the same recordings.

    Parameters
    ----------
    recordings : sequence of Recording
        The data; x must be measured. The base valve uses p1 and p2 too where they are.
    models : sequence of str
        The rivals; all by default.
    seed : int
        Seed of the base valve's search.
    channel : {'u', 'p2'}
        What drives the rivals: the command, or the measured p2 in the place of the force.
    hold_out : bool
        Also fit without the outer thirds; takes three times as long.
    progress : callable, optional
        Called with the share done, 0 to 1, and what is being done; from several threads.

    Returns
    -------
    Comparison
        The base valve first, then the rivals in the order given.

    Raises
    ------
    IdentificationError
        If x is not measured or nothing can be identified.
    """
    for number, recording in enumerate(recordings):
        if 'x' not in recording.signals:
            raise IdentificationError(
                f'x is not measured in recording {number + 1}: the models are compared by x; '
                'record it, or name its topic'
            )
    share = _shares([BASE_MODEL, *models], progress)
    base_fit = partial(
        identify,
        recordings,
        seed=seed,
        hold_out='time' if hold_out else 'none',
        progress=share(BASE_MODEL),
    )
    with ThreadPoolExecutor(WORKERS) as pool:
        base = pool.submit(_timed, base_fit)

        def fit(name: str) -> Entry:
            needed = None if RIVALS[name].data_driven else base.result()[0]
            result, seconds = _timed(
                partial(
                    identify_rival,
                    name,
                    recordings,
                    base=needed,
                    channel=channel,
                    hold_out=hold_out,
                    progress=share(name),
                )
            )
            return _entry(name, result, seconds)

        # those that wait for the base fit come last
        waiting = sorted(models, key=lambda name: not RIVALS[name].data_driven)
        futures: dict[str, Future[Entry]] = {name: pool.submit(fit, name) for name in waiting}
        try:
            entries = [_entry(BASE_MODEL, *base.result())]
            entries += [futures[name].result() for name in models]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return Comparison(tuple(entries), tuple(recordings), channel)


def _timed(fit: Callable[[], Identification]) -> tuple[Identification, float]:
    """Return a fit and how long it took [s]."""
    start = time.perf_counter()
    return fit(), time.perf_counter() - start


def _shares(
    names: Sequence[str], progress: Progress | None
) -> Callable[[str], Callable[[float, str], None]]:
    """Return what each model's progress is told to: the mean over all goes on."""
    done, lock = dict.fromkeys(names, 0.0), threading.Lock()

    def told(name: str, share: float, text: str) -> None:
        with lock:
            done[name] = max(done[name], share)
            if progress is not None:
                progress(sum(done.values()) / len(names), text if name != BASE_MODEL else 'base')

    return lambda name: partial(told, name)


def _entry(name: str, result: Identification, seconds: float) -> Entry:
    """Return one line of the comparison."""
    measured = np.concatenate([recording.output('x') for recording in result.recordings])
    errors = np.concatenate([fitted['x'] for fitted in result.fitted]) - measured
    errors = errors[np.isfinite(errors)]
    free = _free(name, result)
    noise = max(float(np.mean(errors**2)), 1e-12)
    return Entry(
        name=name,
        title='semi-physical, three stages' if name == BASE_MODEL else RIVALS[name].title,
        result=result,
        seconds=seconds,
        free=free,
        eta=result.eta_by_signal['x'],
        eta_held_out=_held_out(result),
        information=errors.size * float(np.log(noise)) + free * float(np.log(errors.size)),
        remark=_remark(name, result),
    )


def _free(name: str, result: Identification) -> int:
    """Return how many parameters were fitted."""
    if name != BASE_MODEL:
        return len(RIVALS[name].free)
    a_1 = result.estimates['a_1']
    return 7 if a_1.half_width <= WEAK * a_1.value else 6


def _held_out(result: Identification) -> float:
    """Return eta over all samples that were held out of the fit that predicts them.

    The errors come from eta of each part: of that of both parts together, the parts' own spread
    is the scale there.
    """
    x = np.concatenate([recording.output('x') for recording in result.recordings])
    place = np.arange(x.size) / x.size
    thirds = {'first third': place < 1.0 / 3.0, 'last third': place >= 2.0 / 3.0}
    squares, seen = 0.0, []
    for name, etas in result.eta_held_out.items():
        values = x[thirds[name] & np.isfinite(x)]
        spread = float(np.sum((values - values.mean()) ** 2)) if values.size else 0.0
        eta = etas['held_out']['x']
        if np.isfinite(eta):
            squares += (1.0 - eta / 100.0) * spread
            seen.append(values)
    if not seen:
        return float('nan')
    together = np.concatenate(seen)
    spread = float(np.sum((together - together.mean()) ** 2))
    return 100.0 * (1.0 - squares / spread) if spread > 0.0 else float('nan')


def _remark(name: str, result: Identification) -> str:
    """Say that a model does not answer this input, and why."""
    moved = max(
        np.nanmax(recording.output('x')) - np.nanmin(recording.output('x'))
        for recording in result.recordings
    )
    answer = max(np.nanmax(fitted['x']) - np.nanmin(fitted['x']) for fitted in result.fitted)
    if answer > ANSWER * moved:
        return ''
    why = '' if name == BASE_MODEL else RIVALS[name].remark
    return 'does not answer this input' + (f': {why}' if why else '')
