# Copyright 2026 The valve_sim_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Arrays without reference counts inside compiled loops, where counting costs most of the time."""

from typing import Any

from numba.core import cgutils, types
from numba.extending import intrinsic, overload


def borrowed(array: Any) -> Any:
    """Return an array as it is; compiled code gets a view that nobody counts.

    The caller keeps the array alive for as long as the view is used. Tuples pass unchanged.
    """
    return array


# numba calls these two with types and builders that have no annotations of their own
@intrinsic
def _view(typing_context, array):  # type: ignore[no-untyped-def]
    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        view = context.make_array(array)(context, builder, arguments[0])
        view.meminfo = cgutils.get_null_value(view.meminfo.type)
        view.parent = cgutils.get_null_value(view.parent.type)
        return view._getvalue()

    return array(array), generate


@overload(borrowed)
def _borrowed(array):  # type: ignore[no-untyped-def]
    if isinstance(array, types.Array):
        return lambda array: _view(array)
    return lambda array: array
