# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How sure the fitted values are, and which of them the data cannot see, in words."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import combinations
import math

from ..model.parameters import PAPER_SEVEN
from ..model.pipeline import Array
from .covariance import Covariance
from .unknowns import DECLARED, RATIO, RATIO_BOUNDS

Quantity = Callable[[dict[str, float]], float]

IDENTIFIED, WEAK = 0.05, 0.30
"""Relative half-widths of the 95 % interval up to which a value counts as (weakly) identified."""
SMALL = 0.1
"""A friction or backlash known to so many per cent of span is identified, however small."""
SIZES = ('f_d1', 'f_s', 'f_d')
"""The parameters that may be as small as 0."""
AT_BOUND = 1e-4
"""An unknown within this share of its range from an end is at its bound."""
NORMAL_95 = 1.959964
ADVICE = {
    'f_d1': 'let u reverse, and measure p1 or p2',
    'T_g1': 'let u step up and hold it for some T_g1',
    'T_g2': 'let u step down and hold it for some T_g2',
    'f_s': 'let the stem stop, reverse and break away several times',
    'f_d': 'let u reverse while the stem moves, and measure p2',
    RATIO: 'sample several times within a slip',
}
"""What would show a parameter that the data do not show."""


@dataclass(frozen=True)
class Estimate:
    """A fitted value with its uncertainty.

    Attributes
    ----------
    value : float
        In `unit`.
    half_width : float
        Half the width of the 95 % interval.
    verdict : str
        How well it is known, in words.
    lower, upper : float
        Ends of the 95 % interval, inside the legal range; NaN if not worked out.
    standard_error : float
        Standard deviation of the value; NaN if not worked out.
    unit : str
        Of the value.
    """

    value: float
    half_width: float
    verdict: str
    lower: float = math.nan
    upper: float = math.nan
    standard_error: float = math.nan
    unit: str = ''

    @property
    def identified(self) -> bool:
        """Whether the value can be relied on."""
        return self.verdict.startswith('identified')


@dataclass(frozen=True)
class Assessment:
    """The uncertainty of all parameters.

    Attributes
    ----------
    estimates : mapping of str to Estimate
        By parameter, and of a_1/a_2.
    combinations : mapping of str to Estimate
        Sums, differences and ratios that the data show although not their parts.
    names : tuple of str
        Rows and columns of `correlation`.
    correlation : ndarray, shape (n, n)
        Of the parameters that were fitted.
    """

    estimates: Mapping[str, Estimate]
    combinations: Mapping[str, Estimate]
    names: tuple[str, ...]
    correlation: Array


def parameter(name: str) -> Quantity:
    """Return the function that picks a parameter, or a_1/a_2."""
    if name == RATIO:
        return lambda values: values['a_1'] / values['a_2']
    return lambda values: values[name]


def assess(covariance: Covariance, a_1_held: bool) -> Assessment:
    """Judge every parameter, the ratio a_1/a_2, and the combinations of what is not seen.

    Parameters
    ----------
    covariance : Covariance
        Of the problem in which a_1 is free.
    a_1_held : bool
        Whether the data cannot tell a_1 from a_2, so that a_1 kept its usual value.
    """
    unknowns = covariance.problem.unknowns
    estimates = {}
    for name in (*unknowns.names, 'a_2'):
        low, high, unit = _range(covariance, name)
        interval = _interval(covariance, name, low, high)
        estimates[name] = _estimate(interval, _verdict(covariance, name, interval), unit)
    if not estimates['f_s'].identified:
        estimates['f_d'] = _no_better(estimates['f_d'], estimates['f_s'])
    ratio = estimates[RATIO]
    for name in ('a_1', 'a_2') if a_1_held else ():
        words = (
            f'not separately identified by this data, only a_1/a_2 = {ratio.value:.3g} 1/s is '
            f'fitted; a_1 is held at {estimates["a_1"].value:g}'
        )
        estimates[name] = replace(estimates[name], verdict=words)
    names = tuple(n for n in unknowns.names if n != 'a_1' or not a_1_held)
    order = (*(p.name for p in PAPER_SEVEN), *(n for n in estimates if n not in DECLARED))
    return Assessment(
        {name: estimates[name] for name in order},
        _visible(covariance, estimates),
        names,
        covariance.correlation([parameter(name) for name in names]),
    )


def _range(covariance: Covariance, name: str) -> tuple[float, float, str]:
    """Return the legal range and the unit of a parameter."""
    if name in DECLARED:
        return DECLARED[name].lower, DECLARED[name].upper, DECLARED[name].unit
    if name == RATIO:
        return *RATIO_BOUNDS, '1/s'
    unknown = covariance.problem.unknowns.each[covariance.problem.unknowns.index(name)]
    return unknown.lower, unknown.upper, unknown.unit


def _interval(
    covariance: Covariance, name: str, low: float, high: float
) -> tuple[float, float, float, float]:
    """Return value, standard error and the ends of the 95 % interval.

    What is positive by nature scatters by factors, so its interval is one of factors.
    """
    quantity = parameter(name)
    value, error = covariance.of(quantity)
    if low > 0.0:
        spread = covariance.of(lambda values: math.log(quantity(values)))[1]
        factor = math.exp(min(NORMAL_95 * spread, 700.0))
        lower, upper = value / factor, value * factor
    else:
        lower, upper = value - NORMAL_95 * error, value + NORMAL_95 * error
    names = covariance.problem.unknowns.names
    if name in names and covariance.unseen[names.index(name)]:
        lower, upper = low, high
    return value, error, min(max(lower, low), value), max(min(upper, high), value)


def _estimate(interval: tuple[float, float, float, float], verdict: str, unit: str) -> Estimate:
    """Return an estimate from value, standard error and the ends of the interval."""
    value, error, lower, upper = interval
    return Estimate(value, 0.5 * (upper - lower), verdict, lower, upper, error, unit)


def _no_better(f_d: Estimate, f_s: Estimate) -> Estimate:
    """Return f_d, which is searched as a share of f_s, where f_s is not known well."""
    upper = max(f_d.upper, f_s.upper)
    verdict = 'weakly identified' if f_d.identified else f_d.verdict
    return replace(f_d, upper=upper, half_width=0.5 * (upper - f_d.lower), verdict=verdict)


def _known(name: str, value: float, half: float) -> str:
    """Say how well a value is known by the width of its interval alone."""
    relative = half / abs(value) if value else math.inf
    if relative <= IDENTIFIED or (name in SIZES and half <= SMALL):
        return 'identified'
    return 'weakly identified' if relative <= WEAK else 'not identified by this data'


def _verdict(
    covariance: Covariance, name: str, interval: tuple[float, float, float, float]
) -> str:
    """Say in words how well one value is known, and what would show it."""
    value, _, lower, upper = interval
    advice = f'; {ADVICE[name]}' if name in ADVICE else ''
    unknowns = covariance.problem.unknowns
    if name in unknowns.names:
        index = unknowns.index(name)
        share = float(covariance.point[index])
        if covariance.unseen[index]:
            usual = math.isclose(value, DECLARED[name].default) if name in DECLARED else False
            start = ', left at its start' if usual else ''
            return f'not identified by this data{start}: nothing depends on it{advice}'
        if share > 1.0 - AT_BOUND and name != 'f_d':
            return f'not identified by this data: at the upper bound {value:.4g} of its range'
        if share < AT_BOUND and name not in SIZES:
            return f'not identified by this data: at the lower bound {value:.4g} of its range'
    words = _known(name, value, 0.5 * (upper - lower))
    if name in SIZES and value < AT_BOUND:
        words += ': at its bound 0, none is seen'
    return words if words.startswith('identified') else words + advice


def _visible(covariance: Covariance, estimates: Mapping[str, Estimate]) -> dict[str, Estimate]:
    """Return combinations that are known although their parts are not."""
    found = {}
    hidden = [name for name in SIZES if not estimates[name].identified]
    for one, other in combinations(hidden, 2):
        for sign, symbol in ((1.0, '+'), (-1.0, '-')):
            first, second = (other, one) if sign < 0.0 else (one, other)
            if (first, second) == ('f_d', 'f_s'):
                first, second = second, first
            quantity = _sum(first, second, sign)
            value, error = covariance.of(quantity)
            half = NORMAL_95 * error
            if _known('f_s', value, half) == 'identified':
                found[f'{first} {symbol} {second}'] = _estimate(
                    (value, error, value - half, value + half), 'identified', '%'
                )
    ratio = estimates[RATIO]
    apart = estimates['a_1'].identified and estimates['a_2'].identified
    if not apart and not ratio.verdict.startswith('not'):
        found[RATIO] = ratio
    return found


def _sum(first: str, second: str, sign: float) -> Quantity:
    """Return the sum or difference of two parameters."""
    return lambda values: values[first] + sign * values[second]
