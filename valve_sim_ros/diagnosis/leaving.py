# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What holds the stem when it leaves its rests, and the effects that this tells."""

from collections.abc import Iterable, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..model.drift import drifted
from ..model.effects import CATALOGUE
from ..model.effects.dwell_friction import SHAPES
from ..model.pipeline import Array
from .bench import Bench
from .starts import Starts
from .stretch import Stretch
from .unknowns import declared

LEAST_LEFT, LEAVES = 6, 4.0
"""Rests that tell a law, and how far a stem is away that has left one [noise]."""
SCATTER, AS_WELL = 0.2, 1.3
"""How far what holds the stem scatters [%], and up to how many times what the best of like laws
leaves another may leave."""
TOLD_BETTER, FORETOLD = 0.5, 0.6
"""The part of what scatters about one level that a law leaves at most that is no chance, and one
that a race begins with."""
DWELL, DWELLS = 'dwell_friction', tuple(np.geomspace(0.5, 200.0, 16).tolist())
"""The effect, and time constants that are tried [s]."""
DRIFT, WANDER = 'friction_drift', 'sensor_drift'
SETTLINGS = tuple(np.geomspace(2.0, 40.0, 8).tolist())
"""The effects, and rates at which they settle that are tried [1/h]."""
PLACES, TELLS = 'position_dependent_friction', 0.85
"""The effect, and the part of what scatters about one level that such a law leaves at most."""
CENTRES, WIDTHS = 24, (3.0, 6.0, 12.0)
"""How many places of a bump are tried, and which widths [% of span]."""

Form = list[tuple[dict[str, float], Array]]
"""Values of an effect that are tried, and how what holds the stem varies with them, shape (n,)."""


class Told(NamedTuple):
    """What rests tell of an effect: where searches start.

    And what scatters about its best law, as a part of what scatters about one level.
    """

    starts: Starts
    left: float


class Rests(NamedTuple):
    """Rests of the stem that it left while p2 pushed it, each shape (n,).

    How long they lasted [s], what held the stem last [% of span, positive if it was pushed open],
    when [s since the first sample], which way it left (1 opens, -1 closes), and from where [%].
    """

    lasted: Array
    force: Array
    time: Array
    way: Array
    level: Array

    def laid_to(self, *others: Array) -> tuple[Array, float]:
        """Return static friction, an offset and the part of other forces in what holds, robustly.

        Also returned is what scatters about that.
        """
        forces = np.column_stack((self.way, np.ones(self.way.size), *others))
        start = np.zeros(forces.shape[1])
        start[0] = np.median(self.way * self.force)
        fit = least_squares(
            lambda parts: forces @ parts - self.force, start, loss='cauchy', f_scale=SCATTER
        )
        return fit.x, float(fit.cost)


def left(bench: Bench, stretch: Stretch) -> list[tuple[int, int, float]]:
    """Return each rest's first sample, 0 if unknown, the one that has left it, and its level."""
    x, near = stretch.measured['x'], LEAVES * bench.noise['x']
    known = np.isfinite(stretch.rests).astype(int)
    edges = np.flatnonzero(np.diff(known, prepend=0, append=0))
    found: dict[int, tuple[int, int, float]] = {}
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        level = float(np.median(stretch.rests[begin:end]))
        away = np.flatnonzero(np.abs(x - level) > near)  # where lost, x is not away
        before, after = away[away < begin], away[away >= end]
        if after.size:
            first = int(before[-1]) + 1 if before.size else 0
            found[first] = first, int(after[0]), level
    return list(found.values())


def rests_left(bench: Bench, pairs: Iterable[tuple[Stretch, Array]]) -> Rests:
    """Return the rests in stretches that tell what holds the stem, none if they are few.

    With each stretch come p1, p2, x of a valve, shape (4, n).
    """
    near = LEAVES * bench.noise['x']
    found = []
    for stretch, result in pairs:
        time = stretch.time
        for first, gone, level in left(bench, stretch) if stretch.rests.size else []:
            last = float(result[1, gone - 1 : gone + 1].mean())
            # nobody knows how long the first rest lasts; and a stem may creep with p2
            if first and abs(last - result[1, first]) > 2.0 * near:
                way = np.sign(stretch.measured['x'][gone] - level)
                lasted, since = time[gone] - time[first], time[gone] - time[0]
                found.append((lasted, last - level, since, way, level))
    return Rests(*np.array(found if len(found) >= LEAST_LEFT else []).reshape(-1, 5).T)


def dwell_seen(bench: Bench, results: Sequence[Array]) -> Told:
    """Return what rests tell of a friction that grows with their time, by each form of its law.

    `results` as for `seen.friction_seen`.
    """
    rests = rests_left(bench, zip(bench.stretches, results, strict=True))
    forms = []
    for shape in SHAPES:
        form: Form = []
        for time_constant in DWELLS:
            part = rests.lasted / time_constant
            kept = (1.0 + shape * part) ** (-1.0 / shape) if shape else np.exp(-part)
            form.append(({'time_constant': time_constant, 'shape': shape}, 1.0 - kept))
        forms.append(form)
    return _told(rests, DWELL, 'growth', forms)


def drift_seen(bench: Bench, results: Sequence[Array], effect: str = DRIFT) -> Told:
    """Return what rests tell of a friction or a sensor that drifts, on and on or until it settles.

    Few rests hardly tell how soon it settles. `results` as for `seen.friction_seen`.
    """
    # each stretch begins anew
    rests = rests_left(bench, [(bench.stretches[0], results[0])])

    def form(settlings: Iterable[float]) -> Form:
        each = [(k, np.array([drifted(time, k) for time in rests.time])) for k in settlings]
        return [({'settling': k}, grown) for k, grown in each]

    return _told(rests, effect, 'rate', [form([0.0]), form(SETTLINGS)], as_well=AS_WELL)


def places_seen(bench: Bench, results: Sequence[Array]) -> Told:
    """Return what rests tell of a friction that varies along the stroke, or at one place.

    `results` as for `seen.friction_seen`.
    """
    rests = rests_left(bench, zip(bench.stretches, results, strict=True))
    if not rests.way.size:
        return Told([], 1.0)
    centres = np.linspace(rests.level.min(), rests.level.max(), CENTRES).tolist()
    bumps: Form = [
        ({'centre': at, 'width': width}, np.exp(-0.5 * ((rests.level - at) / width) ** 2))
        for at, width in product(centres, WIDTHS)
    ]
    slope = _told(rests, PLACES, 'slope', [[({}, (rests.level - 50.0) / 50.0)]], most=TELLS)
    bump = _told(rests, PLACES, 'height', [bumps], most=TELLS)
    return Told([*slope.starts, *bump.starts], min(slope.left, bump.left))


def _told(
    rests: Rests,
    effect: str,
    amount: str,
    forms: Sequence[Form],
    *,
    as_well: float = 1.0,
    most: float = 1.0,
) -> Told:
    """Return what rests tell of an effect: at least one start of each form of its law.

    What holds the stem is straight in static friction and in the `amount` of the effect: friction
    holds it against its way, a sensor shows more or less either way. None that leaves more than
    `most` of what scatters; of like laws those that leave up to `as_well` times the least,
    best first.
    """
    parameter, sensed = declared(effect, amount), CATALOGUE[effect].stage == 'sensor'
    found, least = [], 1.0
    even = rests.laid_to()[1] if rests.way.size else 0.0
    for form in forms if even > 0.0 else ():
        laws = []
        for values, shape in form:
            (f_s, _, more), scatters = rests.laid_to(-shape if sensed else rests.way * shape)
            size = more if sensed else more / f_s
            if f_s > 0.0 and parameter.lower <= size <= parameter.upper:
                each = {amount: size, **values}
                start = {'f_s': f_s, **{f'{effect}.{name}': v for name, v in each.items()}}
                laws.append((scatters / even, start))
        laws.sort(key=lambda law: law[0])
        best = laws[0][0] if laws else 1.0
        if best < most:
            found += [start for part, start in laws if part <= as_well * best]
            least = min(least, best)
    return Told(found, least)
