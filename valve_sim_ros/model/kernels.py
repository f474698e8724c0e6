# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The makes of the step function: run over a record, single step, interpreted step.

Machine code is kept between processes. numba looks only at the file of the function it stores,
so the name under which it is stored carries a digest of all sources of the model.
"""

from collections.abc import Callable, Mapping
from dis import get_instructions
from functools import cache, lru_cache
import hashlib
from pathlib import Path
from types import FunctionType
from typing import Any, NamedTuple

from numba import njit
from numba.core.dispatcher import Dispatcher

from . import pipeline
from .composition import slot_function
from .scoring import run_scored

SLOTS = tuple(name for name in vars(pipeline) if name.endswith('_slot'))
"""Names of the places in the pipeline where an effect plugs in."""


class Make(NamedTuple):
    """The two compiled functions of one kind of valve, and the step as plain Python.

    run : `pipeline.run`; step, interpreted : `pipeline.step`.
    """

    run: Any
    step: Any
    interpreted: Any


@lru_cache(maxsize=1)
def source_digest() -> str:
    """Return a digest of all source files of the model."""
    digest = hashlib.sha256()
    for path in sorted(Path(__file__).parent.rglob('*.py')):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def remake(function: Any, make: Callable[..., Any], slots: Mapping[str, Any]) -> Any:
    """Copy a jitted function and all it calls, with other slots, through `make`.

    Parameters
    ----------
    function : numba dispatcher
        What to copy.
    make : callable
        Turns each Python function into what shall be called: `njit`, or the identity.
    slots : mapping
        Jitted functions to put in the place of those of the same name.
    """
    source = function.py_func
    options = {'forceinline': True} if function.targetoptions.get('forceinline') else {}
    space = dict(source.__globals__)
    for name in {i.argval for i in get_instructions(source) if i.opname == 'LOAD_GLOBAL'}:
        called = slots.get(name, space.get(name))
        if isinstance(called, Dispatcher):
            space[name] = remake(called, make, slots)
    copy = FunctionType(source.__code__, space, source.__name__, source.__defaults__)
    return make(copy, **options)


def kept(function: Any, slots: Mapping[str, Any], label: str) -> Any:
    """Return `function` compiled with these slots, its machine code kept between processes.

    `label` must differ between sets of slots: machine code is found again by it.
    """
    python = remake(function, njit, slots).py_func
    python.__qualname__ = f'{python.__name__}_{label}_{source_digest()}'
    return njit(cache=True, nogil=True)(python)


def interpreted(function: Any, slots: Mapping[str, Any]) -> Any:
    """Return `function` as plain Python, for the time until machine code is there."""
    return remake(function, lambda python, **_: python, slots)


def filled(effects: bool) -> tuple[dict[str, Any], str]:
    """Return the slots with the whole catalogue of effects, or with none, and their label."""
    return ({name: slot_function(name) for name in SLOTS}, 'effects') if effects else ({}, 'base')


@cache
def make(effects: bool = False) -> Make:
    """Return the makes of the base valve, or of that with the whole catalogue of effects.

    Nothing is compiled before the first call of `run` or `step`.
    """
    slots, label = filled(effects)
    return Make(
        kept(pipeline.run, slots, label),
        kept(pipeline.step, slots, label),
        interpreted(pipeline.step, slots),
    )


@cache
def scored(effects: bool) -> Any:
    """Return `scoring.run_scored` of the base valve, or with the whole catalogue of effects."""
    return kept(run_scored, *filled(effects))
