# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How strong evidence must be: numbers set on the tuning half of the blind records."""

from collections.abc import Collection, Mapping, Sequence
import math

from ..model.effects import CATALOGUE
from .adequacy import Leftover
from .fitting import Valve
from .stages import Group
from .unknowns import declared, PHASE, SLOWEST

ENOUGH = 25.0
"""Least gain in half log-likelihoods of independent samples for any name."""
MORE_ENOUGH, MORE_EXCESS, MORE_CLOSED = 60.0, 0.15, 0.6
"""What a further effect needs: gain (any effect, where the base valve leaves no least excess),
excess before it, and the part of it that it closes."""
NO_DROP, SLUGGISH = 0.93, 1.1
"""Kinetic over static friction beyond which a base valve is odd, as its friction hardly falls; and
how near to the slowest a stem is odd."""
MORE_SHARE, FAR_OFF = 0.02, 2.0
"""Least part of the whole gap that it closes, unless it leaves nothing but noise; the excess that
is far more than noise: it may close less of that, if both together explain the gap, and what is
left may count as noise more easily."""
ALIKE_SHARE = 0.05
"""Least part of the whole gap where it is declared to look like one named before."""
COLOURED, COLOUR, WHITER = 1.5, 2.0, 0.6
"""Mean square and samples per independent value beyond which noise seems coloured; and by how much
an effect must bring the latter down, if that was misfit."""
MORE_FAR = 10
"""So many errors beyond any noise are as good a reason to look for it as an excess."""
SPOTLESS = 0.1
"""Excess that is nothing but noise."""
NO_BASE, NO_BASE_ALONE = 10.0, 4.0
"""Excess of x, driven by p2 and measured alone, beyond which no longer search for a base valve
precedes the race. 100 clean records leave at most 4.5 of the former; of 102 of x alone 15 leave 4
to 12: effects led 12 of 13 of these to their base valve, see `race.rebased`."""
NEGLIGIBLE = 1.0 / 3.0
"""An effect of less than this part of its least usual size is another run of the base valve."""
LOOP, BLURRED = 'positioner_loop', 0.7
"""The effect that sees the stem, as measured while p1 is looked at, and the share of its noise
that is left then: hardly any where it rests, nearly all where it moves."""
COARSE = 'sensor_quantisation'
"""The effect that the values of x show."""
LASTING = (
    'ip_calibration',
    'ip_nonlinearity',
    'friction_asymmetry',
    'spring_preload',
    'spring_rate',
    'spring_nonlinearity',
    'fluid_force',
    'sensor_calibration',
    'sensor_drift',
)
"""Effects that shift a signal for long: small ones are nothing but the bias of a fit."""
LEAST_SHIFT, LEAST_CHANGE = 0.2, 0.015
"""Least mean square that such an effect, and any other, must remove [noise]."""
LEAST_EXCESS = {'p1': 0.0, 'p2': 0.1, 'x': 0.02}
LEAST_IF_MIXED, LEAST_IF_ALONE = {**LEAST_EXCESS, 'p1': 0.3}, 0.1
"""Least excess before a name is sought in a signal; where commands arrive just as samples are
taken: the start of each move then scatters by up to a sample, and lags fit that a little; and in x
if neither p1 nor p2 is measured."""
SLIGHT, SLIGHT_CLOSED = {'p1': 0.0, 'p2': 0.25, 'x': 0.0}, 0.8
"""Excess below which a name needs as much gain as a further one and must close this part of it:
jitter leaves as much of p2, and a quick exhaust fits that a little."""
LATEST = -0.99
"""Phase beyond which commands act a whole period late."""
LEAST_FAR = 3
"""So many errors of x beyond any noise do as well: a few slips come at another moment."""
ADEQUATE = 0.8
"""Excess over the noise that still counts as adequate (other solvers, jitter)."""
CLEAN = 0.25
"""Excess that counts as noise once an effect is added (coloured noise leaves up to that)."""
EXPLAINED, LEAST_CLOSED = {'p1': 0.95, 'p2': 0.9, 'x': 0.95}, 0.5
"""Least part of the excess that a name must close, else the effect is unknown (jitter leaves more
of a p2 that moves fast); and where nothing but noise is left."""
EXPLAINED_BY_STEPS = 0.9
"""The same for a coarse sensor: a stem that is a hundredth off may be a whole step off."""
EXPLAINED_BY_TWO, EXPLAINED_BUT_FAR, EXPLAINED_LASTING = 0.97, 0.99, 0.985
"""The same where two effects close it: two that are wrong imitate more than one; where what is
left is far more than noise; and where a large gap is closed by one that shifts a signal for long:
a wrong one straightens most of any line."""
MOSTLY = 0.85
"""Part of the excess beside which the rest may be the fault of a law that is not quite right."""
NEARLY_ALL = 0.02
"""What the best may leave of the excess, and no more than noise, where effects that take long and
do not look like it are not tried."""
TOO_LARGE = 1.2
"""An effect of more than this times its largest usual size stands for another. Of 154 right names
none had more than 0.97 times that, of 19 wrong ones six had 1.08 to 3.3 times."""
LEAST_FIRST, LEAST_AGAIN = 0.1, 0.35
"""A first effect that closes less than this part of the excess is not followed by a second; nor in
a second look, where slips do not hide what is missing, and where what the base valve leaves counts
as adequate."""
LEAST_LED = 0.7
"""What a name must close of an x whose stem is put to rest, to be tried on a free one."""
TWIN_GAIN, TWIN_SHARE, KNOWN_TWIN_SHARE = 12.0, 0.003, 0.02
"""Rivals whose gain is less than this, or this share of the gain, behind cannot be excluded; those
that are declared to look alike need not come as close."""


def late(base: Valve, group: Group) -> bool:
    """Tell whether p2 shows commands so late that more than the phase of its samples may be late.

    Where p1 is measured that tells.
    """
    return group.stages == ('u-p1', 'p1-p2') and base.values[PHASE.name] < LATEST


def suspicious(left: Leftover, group: Group, mixed: bool) -> bool:
    """Tell whether what the base valve leaves of a signal makes it worth to look for an effect."""
    least = (LEAST_IF_MIXED if mixed else LEAST_EXCESS)[group.signal]
    if group.has_stem:
        least = LEAST_IF_ALONE if x_alone(group) else least
        return left.excess >= least or left.far >= LEAST_FAR
    return left.excess >= least or coloured(group, left)


def no_base(left: Leftover, group: Group) -> bool:
    """Tell whether x is left so far off that effects are tried before a longer search."""
    if group.stages == ('p2-x',):
        return left.excess > NO_BASE
    return x_alone(group) and left.excess > NO_BASE_ALONE


def x_alone(group: Group) -> bool:
    """Tell whether neither p1 nor p2 is measured."""
    return group.has_stem and 'u-p1' in group.stages


def coloured(group: Group, left: Leftover) -> bool:
    """Tell whether what looks like coloured noise of a pressure may as well be misfit all over."""
    seems = left.mean_square > COLOURED and left.inflation > COLOUR and left.excess < SPOTLESS
    return seems and not (group.has_stem or left.noise)


def gain(before: float, after: Valve, left: Leftover) -> float:
    """Return what one more effect brings: likelihood of independent samples less BIC.

    A candidate that was looked for in many places pays for each of them. `left` is what the best
    valve leaves.
    """
    candidate = after.candidates[-1]
    independent = max(left.samples / left.inflation, 10.0)
    penalty = 0.5 * len(candidate.names) * math.log(independent) + math.log(candidate.places)
    return 0.5 * (before - after.cost) / left.worth - penalty


def choice(runners: Sequence[Valve], gains: Mapping[str, float]) -> Valve:
    """Return the best runner; of those the data do not tell apart, the most plausible.

    One that is far larger than usual stands for another, which may come as close as a twin.
    """
    likely = [each for each in runners if not too_large(each, each.candidates[-1].effect)]
    best = max(gains.values())
    if likely:
        best_likely = max(gains[each.candidates[-1].effect] for each in likely)
        if best - best_likely < twin_limit(best, KNOWN_TWIN_SHARE):
            runners, best = likely, best_likely
    limit = twin_limit(best)
    close = [each for each in runners if best - gains[each.candidates[-1].effect] < limit]
    return min(close, key=lambda each: (surprise(each), -gains[each.candidates[-1].effect]))


def twin_limit(gained: float, share: float = TWIN_SHARE) -> float:
    """Return by how much a gain must lead for the data to tell two effects apart."""
    return max(TWIN_GAIN, share * gained)


def surprise(valve: Valve) -> int:
    """Return how odd a fitted effect is: of wrong sign, too large, too small, or elsewhere."""
    candidate = valve.candidates[-1]
    odd = int(candidate.stage != CATALOGUE[candidate.effect].stage)
    for name in candidate.names:
        parameter = declared(candidate.effect, name)
        change = valve.values[f'{candidate.effect}.{name}'] - parameter.neutral
        odd += parameter.positive and change < 0.0
        odd += bool(parameter.usual) and abs(change) > parameter.usual[1]
    return odd + (size(valve) < 1.0)


def size(valve: Valve) -> float:
    """Return how large a fitted effect is, 1 being the least that is usual; 1 if none is told."""
    effect, sizes = valve.candidates[-1].effect, []
    for name in valve.candidates[-1].names:
        parameter = declared(effect, name)
        if parameter.usual:
            change = valve.values[f'{effect}.{name}'] - parameter.neutral
            sizes.append(abs(change) / parameter.usual[0])
    return max(sizes, default=1.0)


def too_large(valve: Valve, effect: str) -> bool:
    """Tell whether a fitted effect is far larger than is usual: it stands for another."""
    names = [name for each in valve.candidates if each.effect == effect for name in each.names]
    parameters = [declared(effect, name) for name in names]
    return any(
        abs(valve.values[f'{effect}.{each.name}'] - each.neutral) > TOO_LARGE * each.usual[1]
        for each in parameters
        if each.usual
    )


def adequate(signal: str, left: Leftover) -> bool:
    """Tell whether what is left of a signal may come of other solvers, of jitter and of chance.

    p1 has no slips that could come at another moment: there many far errors are no chance.
    """
    far = signal == 'p1' and left.far >= MORE_FAR
    return left.excess <= ADEQUATE and not far


def carried_on(left: Leftover, carried: float) -> bool:
    """Tell whether no more is left than the excess `carried` on from the signals before."""
    return carried > SPOTLESS and left.excess <= carried


def unfinished(left: Leftover, least: float) -> bool:
    """Tell whether what the effects found so far leave makes it worth to look for another."""
    return left.excess >= least or left.far >= MORE_FAR


def strong(
    signal: str, before: Leftover, gained: float, closed: float, *, first: bool, named: bool
) -> bool:
    """Tell whether the evidence is enough where there is less reason to look for an effect.

    Behind another one, in this group of stages or (`named`) in those before, or if the base valve
    leaves little.
    """
    slight = before.excess < SLIGHT[signal]
    if first and not named and not slight:
        return True
    least = 0.0 if not first else SLIGHT_CLOSED if slight else MORE_CLOSED
    return gained >= MORE_ENOUGH and closed >= least


def needed(
    base: Leftover, before: Leftover, closed: float, after: Leftover, names: Sequence[str]
) -> bool:
    """Tell whether a further effect closes enough of the gap, `after` being both together.

    One that looks like another of the `names` may only make up for a law that is not quite right,
    unless nothing but noise is left of far more than that.
    """
    share = base.closed_by(after) - base.closed_by(before)
    left = base.closed_by(before) < MOSTLY or before.excess > FAR_OFF
    explained = left and base.closed_by(after) >= MOSTLY
    *others, last = names
    if any(look_alike(last, other) for other in others):
        spotless = before.excess > FAR_OFF and after.excess <= SPOTLESS
        return (share >= ALIKE_SHARE or spotless) and (closed >= MORE_CLOSED or explained)
    spotless = after.excess <= (CLEAN if before.excess > FAR_OFF else SPOTLESS)
    matters = share >= MORE_SHARE or spotless
    return matters and (closed >= MORE_CLOSED or explained)


def explained(
    signal: str,
    before: Leftover,
    after: Leftover,
    names: Collection[str],
    blurred: float = 0.0,
) -> bool:
    """Tell whether the effects named explain the gap, so that none is unknown.

    `blurred` is the excess that comes of the noise of a measured x.
    """
    steps = {*names} == {COARSE}
    # p1 knows neither slips nor a chamber's laws: there the right one leaves little but noise
    if not steps and after.excess > (ADEQUATE + blurred if signal == 'p1' else FAR_OFF):
        least = EXPLAINED_BUT_FAR
    elif before.excess > FAR_OFF and not {*names}.isdisjoint(LASTING):
        least = EXPLAINED_LASTING
    elif after.excess <= CLEAN:
        least = LEAST_CLOSED
    elif steps:
        least = EXPLAINED_BY_STEPS
    else:
        least = EXPLAINED[signal] if len(names) == 1 else EXPLAINED_BY_TWO
    return before.closed_by(after) >= least


def nearly_all(before: Leftover, after: Leftover, last: str = '') -> bool:
    """Tell whether a gap is closed so far that effects that take long are not tried.

    `last` is the effect that was added last.
    """
    left = 1.0 - EXPLAINED_BY_STEPS if last == COARSE else NEARLY_ALL
    return after.excess <= min(CLEAN, left * before.excess)


def blurred(valve: Valve, noise: Mapping[str, float]) -> float:
    """Return the excess of p1 behind a loop that sees a noisy x; `noise`: of each signal [%]."""
    if LOOP not in valve.effects or not {'p1', 'x'} <= noise.keys():
        return 0.0
    return float(BLURRED * valve.values[f'{LOOP}.gain'] * noise['x'] / noise['p1']) ** 2


def imitates(base: Valve, effect: str) -> bool:
    """Tell whether a base valve of a kind that is rare passes for one with an effect."""
    odd = {
        'friction': base.values['f_d/f_s'] > NO_DROP,
        'stem': base.values['a_1/a_2'] < SLUGGISH * SLOWEST,
    }
    return odd.get(CATALOGUE[effect].imitated, False)


def look_alike(one: str, other: str) -> bool:
    """Tell whether either of two effects is declared to look like the other."""
    return other in CATALOGUE[one].twins or one in CATALOGUE[other].twins


def close_rivals(gains: Mapping[str, float], best: str) -> list[str]:
    """Return the effects that the data do not tell from the best, closest first."""

    def limit(name: str) -> float:
        return twin_limit(gains[best], KNOWN_TWIN_SHARE if look_alike(name, best) else TWIN_SHARE)

    near = [name for name in gains if name != best and gains[best] - gains[name] < limit(name)]
    return sorted(near, key=lambda name: -gains[name])


def probability(gains: Mapping[str, float], best: str, closed: float) -> float:
    """Return the probability that `best` is the effect, from its lead and the gap it closes.

    A logistic curve: the proportion of lead to gap was chosen by hand, the rest fitted to 314
    names given to blind records that earlier versions had used up.
    """
    others = [value for name, value in gains.items() if name != best]
    lead = gains[best] - max([0.0, *others])
    score = OFFSET + LEAD * math.log1p(max(lead, 0.0)) + CLOSED * max(closed, 0.0)
    return 1.0 / (1.0 + math.exp(-score))


OFFSET, LEAD, CLOSED = -1.7, 0.35, 2.7


def best_per_effect(runners: Sequence[Valve]) -> list[Valve]:
    """Return the best runner of each effect, in the order of the runners."""
    seen: dict[str, Valve] = {}
    for runner in runners:
        seen.setdefault(runner.candidates[-1].effect, runner)
    return list(seen.values())
