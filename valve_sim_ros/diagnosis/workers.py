# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Threads for runs and for searches: compiled runs release the lock."""

from bisect import insort
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
import math
import os
from typing import TypeVar

Item = TypeVar('Item')
Result = TypeVar('Result')

HELPERS = ThreadPoolExecutor(os.cpu_count())
"""Threads that help with runs: they wait for nothing in this pool."""


def at_once(run: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """Return what each run makes of its item, in order.

    The caller takes items as well, each thread the next one that is left: handing over one item
    at a time would cost as much as a short run.
    """
    each = list(items)
    found: dict[int, Result] = {}
    left = iter(range(len(each)))

    def work() -> None:
        for index in left:
            found[index] = run(each[index])

    helpers = [HELPERS.submit(work) for _ in range(min(len(each), os.cpu_count() or 1) - 1)]
    try:
        work()
    finally:
        for _ in left:
            pass  # nothing more is begun once a run has failed
        for helper in helpers:
            if not helper.cancel():
                helper.result()
    return [found[index] for index in range(len(each))]


def each_on_its_own(search: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Return what each search makes of its item, in order: searches wait for runs of their own."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        yield from pool.map(search, items)


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
