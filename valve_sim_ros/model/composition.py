# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The slots of the pipeline filled with the whole catalogue of effects.

All effects are compiled into one set of slots; which of them act is told by a flag each, so that
any combination runs without compiling again.
"""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from numba import njit
import numpy as np

from .declarations import Effect
from .effects import CATALOGUE
from .pipeline import Array
from .state import BASE_STEP


class Place(NamedTuple):
    """Where the flag and parameters, and the memory, of one effect begin."""

    flag: int
    memory: int


STRIDE = 0
"""Where the longest step of a moving stem is kept, before all flags."""
USED = sorted({slot for effect in CATALOGUE.values() for slot in effect.slots})
FILLED = {slot: place for place, slot in enumerate(USED, STRIDE + 1)}
"""Where it is told, slot by slot, whether any effect is at work there: asked in every step."""


def _places() -> tuple[dict[str, Place], int, int]:
    """Lay all effects out one after the other."""
    places, flag, memory = {}, STRIDE + 1 + len(FILLED), 0
    for effect in CATALOGUE.values():
        places[effect.id] = Place(flag, memory)
        flag += 1 + len(effect.parameters)
        memory += effect.memory
    return places, flag, memory


PLACES, EFFECTS_SIZE, MEMORY_SIZE = _places()


class Composition(NamedTuple):
    """What the compiled pipeline needs of the effects of one valve; they remember nothing yet."""

    effects: Array
    memory: Array
    finest: float


def compose(active: Iterable[str], values: Mapping[str, float]) -> Composition:
    """Return the effects in force with their parameters by full name."""
    effects, memory = np.zeros(EFFECTS_SIZE), np.empty(MEMORY_SIZE)
    finest = stride = BASE_STEP
    for name in active:
        effect, flag = CATALOGUE[name], PLACES[name].flag
        effects[flag] = 1.0
        memory[memory_of(name)] = np.nan  # the rest is never read
        for offset, parameter in enumerate(effect.parameters, 1):
            effects[flag + offset] = values[f'{name}.{parameter.name}']
        for slot in effect.slots:
            effects[FILLED[slot]] = 1.0
        finest = min(finest, effect.longest_step)
        stride = min(stride, effect.stride)
    effects[STRIDE] = stride
    return Composition(effects, memory, finest)


def memory_of(name: str) -> slice:
    """Return the part of the memory that belongs to one effect."""
    return slice(PLACES[name].memory, PLACES[name].memory + CATALOGUE[name].memory)


def slot_function(slot: str) -> Any:
    """Return one slot with all effects that fill it, in the order of the signal path."""
    filling = sorted(
        (effect for effect in CATALOGUE.values() if slot in effect.slots),
        key=lambda effect: (effect.order, effect.id),
    )
    lines = [f'def {slot}(value, state, effects, memory, dt):']
    if slot == 'stride_slot':
        lines.append(f'    value = min(value, effects[{STRIDE}])')
    if filling:
        lines.append(f'    if effects[{FILLED[slot]}] == 0.0:')
        lines.append('        return value')
    space: dict[str, Any] = {}
    for effect in filling:
        space[effect.id] = effect.slots[slot]
        lines.append(f'    if effects[{PLACES[effect.id].flag}] != 0.0:')
        lines.append(f'        value = {effect.id}({_arguments(effect)})')
    exec('\n'.join([*lines, '    return value']), space)
    return njit(space[slot])


def _arguments(effect: Effect) -> str:
    """Return the call of one effect: its parameters as a tuple, its part of the memory."""
    flag, part = PLACES[effect.id].flag, memory_of(effect.id)
    own = ''.join(f'effects[{flag + 1 + index}], ' for index in range(len(effect.parameters)))
    memory = f'memory[{part.start}:{part.stop}]' if effect.memory else '()'
    return f'value, state, ({own}), {memory}, dt'
