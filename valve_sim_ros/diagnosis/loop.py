# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Behind an effect through which the stem acts back, the whole valve fitted as it runs alone.

As measured nobody knows the stem between its samples. Where p1 follows a slip within one and p2
soon after, what a stem held as measured tells of both is as far off as the stem is.
"""

from collections.abc import Sequence
import math

from ..model.effects import CATALOGUE
from . import odds
from .adequacy import Leftover, leftover
from .base_valve import find_base
from .fitting import Fitter, Valve
from .stages import Group

TURNS, WORTH = 5, 0.8
"""Most times that all stages are fitted in turn; what one must leave at most of the excess to be
followed by another."""


def acts_back(valve: Valve) -> bool:
    """Tell whether the stem acts on the stages before it."""
    return any(CATALOGUE[effect].feedback for effect in valve.effects)


def closed_loop(
    fitter: Fitter, parts: Sequence[Group], valve: Valve
) -> tuple[Valve, Leftover] | None:
    """Return a valve fitted to each signal in turn while nothing is held, and what it leaves of x.

    Parameters
    ----------
    fitter : Fitter
        At the bench; afterwards nothing drives it as measured if that explains x.
    parts : sequence of Group
        All groups, the stem in the last one.
    valve : Valve
        Fitted with a stem as measured.

    Returns
    -------
    tuple of Valve and Leftover, or None
        None if this does not explain x either.
    """
    stem, drive = parts[-1], fitter.drive

    def left(there: Valve, group: Group) -> Leftover:
        return leftover(fitter.residuals(there, group.signal))

    found = None
    fitter.drive = ()
    try:
        valve, least = find_base(fitter, stem, valve, (), roughly=True), math.inf
        best = valve
        for _ in range(TURNS):
            for group in parts:
                search = fitter.refined if group is stem else fitter.fit
                valve = search(valve, fitter.problem(group, valve))
            most, before = max(left(valve, group).excess for group in parts), least
            if most < least:
                best, least = valve, most
            if most <= odds.SPOTLESS or most > WORTH * before:
                break
        rest = left(best, stem)
        found = None if odds.unfinished(rest, odds.CLEAN) else (best, rest)
    finally:
        if not found:
            fitter.drive = drive
    return found
