# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One pool for the runs of a search: compiled runs release the lock."""

from bisect import insort
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
import math
import os
from typing import TypeVar

Item = TypeVar('Item')
Result = TypeVar('Result')

RUNS = ThreadPoolExecutor(os.cpu_count())
"""For runs only: they wait for nothing in this pool."""


def at_once(run: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Return what each run makes of its item, in order."""
    return list(RUNS.map(run, items))


def cheapest(
    cost: Callable[[Item, float], float],
    items: Iterable[Item],
    count: int,
    bound: float = math.inf,
) -> list[float]:
    """Return the costs of items, right for the `count` least among those within `bound`.

    `cost` may stop counting at its second argument.
    """
    least: list[float] = []

    def counted(item: Item) -> float:
        found = cost(item, min(bound, least[count - 1]) if len(least) >= count else bound)
        insort(least, found)
        del least[count:]
        return found

    return at_once(counted, items)
