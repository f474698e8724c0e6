# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The catalogue of effects: one file each, found by being here."""

from importlib import import_module
from pkgutil import iter_modules

from ..declarations import Effect

CATALOGUE: dict[str, Effect] = {
    module.name: import_module(f'{__name__}.{module.name}').EFFECT
    for module in iter_modules(__path__)
}
"""Every effect by its id."""
