# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A problem seen sharply or through a blur, which hides the small kinks of its cost."""

from collections.abc import Iterable, Sequence
from heapq import nsmallest
from typing import Protocol

import numpy as np

from ..model.pipeline import Array
from .descent import descend, End
from .watch import Watch


class Task(Protocol):
    """What can be minimised: a `Problem`, or one with an unknown held."""

    blocks: list[tuple[str, slice]]

    def residuals(self, point: Array) -> Array:
        """Return the residuals at a point."""

    def jacobian(self, point: Array, base: Array | None, step: float) -> Array:
        """Return their derivatives."""


class View:
    """Residuals summed over `width` neighbours; a width of 1 is the problem itself."""

    def __init__(self, problem: Task, watch: Watch, width: int = 1) -> None:
        """Look at a problem; `watch` is told of every simulation."""
        self.problem, self.watch, self.width = problem, watch, width
        self._edges = np.concatenate(
            [np.arange(part.start, part.stop, width) for _, part in problem.blocks]
        )

    def scored(self, point: Array) -> End:
        """Return a point with its residuals and their squares."""
        residuals = self._evaluate(point)
        return End(point, residuals, float(residuals @ residuals))

    def descend(self, point: Array, steps: int, step: float) -> End:
        """Go down from `point`; see `descent.descend`."""
        return descend(self._evaluate, self.jacobian, point, most_steps=steps, step=step)

    def jacobian(self, point: Array, base: Array | None, step: float) -> Array:
        """Return the derivatives of the residuals by the shares, shape (m, size)."""
        self.watch.tick()
        if self.width > 1:
            return self._blurred(self.problem.jacobian(point, None, step))
        return self.problem.jacobian(point, base, step)

    def _evaluate(self, point: Array) -> Array:
        """Return the residuals."""
        self.watch.tick()
        residuals = self.problem.residuals(point)
        if self.width > 1:
            return self._blurred(residuals)
        self.watch.offer(End(point, residuals, float(residuals @ residuals)))
        return residuals

    def _blurred(self, rows: Array) -> Array:
        """Sum neighbouring rows so that independent noise keeps its size."""
        return np.add.reduceat(rows, self._edges, axis=0) / np.sqrt(self.width)


def best_of(ends: Iterable[End], count: int) -> list[End]:
    """Return the `count` ends of least cost, the best first; of a generator, only those stay."""
    return nsmallest(count, ends, key=lambda end: end.cost)


def distinct(ends: Sequence[End], count: int, apart: float = 1e-2) -> list[End]:
    """Return the best ends of which no two are the same place."""
    chosen: list[End] = []
    for end in best_of(ends, len(ends)):
        if all(np.abs(end.point - other.point).max() > apart for other in chosen):
            chosen.append(end)
    return chosen[:count]
