# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Three makes of the one step function: run over a record, single step, interpreted step.

Machine code is kept between processes. numba looks only at the file of the function it stores,
so the name under which it is stored carries a digest of all sources of the model.
"""

from collections.abc import Callable
from functools import lru_cache
import hashlib
from pathlib import Path
from types import FunctionType
from typing import Any

from numba import njit
from numba.core.dispatcher import Dispatcher

from . import pipeline

SLOTS = tuple(name for name in vars(pipeline) if name.endswith('_slot'))
"""Names of the places in the pipeline where an effect plugs in."""


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Return a digest of all source files of the model."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob('*.py')):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def remake(function: Any, make: Callable[..., Any], slots: dict[str, Any]) -> Any:
    """Copy a jitted function and all it calls, with other slots, through `make`.

    Parameters
    ----------
    function : numba dispatcher
        What to copy.
    make : callable
        Turns each Python function into what shall be called: `njit`, or the identity.
    slots : dict
        Plain functions to put in the place of those of the same name.
    """
    source = function.py_func
    space = dict(source.__globals__)
    for name in source.__code__.co_names:
        if name in slots:
            space[name] = make(slots[name])
        elif isinstance(space.get(name), Dispatcher):
            space[name] = remake(space[name], make, slots)
    return make(FunctionType(source.__code__, space, source.__name__, source.__defaults__))


def kept(function: Any, slots: dict[str, Any] | None = None, label: str = 'base') -> Any:
    """Return `function` compiled with these slots, its machine code kept between processes.

    `label` must differ between sets of slots: machine code is found again by it.
    """

    def keep(python: Any) -> Any:
        python.__qualname__ = f'{python.__name__}_{label}_{source_digest()}'
        return njit(cache=True)(python)

    outer = remake(function, njit, slots or {}).py_func
    return keep(outer)


def interpreted(function: Any, slots: dict[str, Any] | None = None) -> Any:
    """Return `function` as plain Python, for the time until machine code is there."""
    return remake(function, lambda python: python, slots or {})


run = kept(pipeline.run)
advance = kept(pipeline.advance)
