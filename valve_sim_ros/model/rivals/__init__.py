# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The models that the base valve is compared with: one file each, found by being here."""

from importlib import import_module
from pkgutil import iter_modules
from typing import Any

RIVALS: dict[str, Any] = {
    module.name: import_module(f'{__name__}.{module.name}').MODEL
    for module in iter_modules(__path__)
    if module.name != 'declaration'
}
"""Every rival by its name.

Each has `parameters`, `make()` giving a `kernels.Make`, and `start(p1, p2, x, theta)` giving the
state array; state[0:3] is p1, p2, x.
"""
