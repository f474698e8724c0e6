# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One step of the ladder, and the evidence that it takes."""

from collections.abc import Sequence
from dataclasses import dataclass

from . import odds
from .adequacy import Leftover, leftover
from .fitting import Fitter, Valve
from .stages import Group


@dataclass(frozen=True)
class Rung:
    """One step of the ladder.

    Attributes
    ----------
    effect, stage : str
        What was added, and where it acts.
    gains : mapping of str to float
        Evidence for each effect that was tried: half log-likelihood of independent samples.
    before, after : Leftover
        What the valve left of the group's signal before and after.
    closed : float
        Part of the excess over the noise that it removed.
    probability : float
        See `odds.probability`.
    twins : tuple of str
        Effects that these data do not tell from it.
    valve : Valve
        With it.
    """

    effect: str
    stage: str
    gains: dict[str, float]
    before: Leftover
    after: Leftover
    closed: float
    probability: float
    twins: tuple[str, ...]
    valve: Valve

    @property
    def too_large(self) -> bool:
        """Whether it is far larger than it usually is."""
        return odds.too_large(self.valve, self.effect)

    @property
    def runner_up(self) -> str | None:
        """The effect that comes next."""
        others = {n: g for n, g in self.gains.items() if n != self.effect and g > 0.0}
        return max(others, key=lambda name: others[name]) if others else None


def judged(
    fitter: Fitter, group: Group, now: Valve, before: Leftover, runners: Sequence[Valve]
) -> Rung | None:
    """Return the step to the best runner if the evidence is enough."""
    runners = [runner for runner in runners if odds.size(runner) > odds.NEGLIGIBLE]
    if not runners:
        return None
    best_after = leftover(fitter.residuals(runners[0], group.signal))

    def evidence(runner: Valve) -> float:
        return odds.gain(now.cost, runner, best_after)

    # an effect's plainer law may cost a little more, and yet have more evidence
    tops = odds.best_per_effect(sorted(runners, key=evidence, reverse=True))
    gains = {each.candidates[-1].effect: evidence(each) for each in tops}
    best = odds.choice(tops, gains)
    candidate = best.candidates[-1]
    after = leftover(fitter.residuals(best, group.signal))
    change = before.mean_square - after.mean_square
    least = odds.LEAST_SHIFT if candidate.effect in odds.LASTING else odds.LEAST_CHANGE
    little = before.excess < odds.LEAST_EXCESS[group.signal]
    hidden = odds.imitates(now, candidate.effect)
    enough = odds.MORE_ENOUGH if little and not hidden else odds.ENOUGH
    least = 0.0 if hidden else least
    # where a few far errors were the only reason to look, they must be gone
    only_far = little and min(before.far, after.far) >= odds.LEAST_FAR
    # what has the colour of noise is misfit only where an effect takes it away
    still_coloured = (
        odds.coloured(group, before) and after.inflation > odds.WHITER * before.inflation
    )
    if gains[candidate.effect] < enough or change < least or only_far or still_coloured:
        return None
    closed = before.closed_by(after)
    return Rung(
        candidate.effect,
        candidate.stage,
        gains,
        before,
        after,
        closed,
        odds.probability(gains, candidate.effect, closed),
        tuple(odds.close_rivals(gains, candidate.effect)),
        best,
    )
