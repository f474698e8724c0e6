# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The models that the base valve is compared with: one file each, found by being here."""

from importlib import import_module
from pkgutil import iter_modules

from ..errors import ModelError
from .declaration import Rival

_MODULES = [import_module(f'{__name__}.{module.name}') for module in iter_modules(__path__)]
RIVALS: dict[str, Rival] = {
    module.MODEL.name: module.MODEL for module in _MODULES if hasattr(module, 'MODEL')
}
"""Every rival by its name, in alphabetical order: each module here with a constant MODEL."""


def rival(name: str) -> Rival:
    """Return the rival of that name.

    Raises
    ------
    ModelError
        If there is none.
    """
    if name not in RIVALS:
        raise ModelError(f'model = {name!r}: expected base or one of {", ".join(RIVALS)}')
    return RIVALS[name]
